"""States side by side give what each of them gives alone, in any number, pressing on the ground or
not.
"""

import ctypes
from functools import cache

import mpmath
import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import settings
from hypothesis import strategies as st

import serpentail
from serpentail.model.compiler import compile_library
from serpentail.model.kernel import ArgumentRecord
from serpentail.model.library import NOT_FINITE
from serpentail_codegen.targets.c.batch import STATES
from tests.support import zoo
from tests.support.rows import row

from . import ground
from .tails import GROUND, alone, batched, evaluated, given, in_lanes, states

FREE = ("m2_n2", "arcs1", "fixed")
FREE_SLOW = ("straight", "loops", "segments", "single", "arcs2_loops", "arcs2", "mixed", "baked")
TOUCHING = ("ground_m2_n2", "box", "smooth", "paper", "small")
TOUCHING_SLOW = ("ground_arcs", "single_ground", "ground_mixed", "feet", "feet_tail")


# largest differences by rounding, in units of the last digit of each output's largest value
LIMITS = {"mixed": 2e4}  # H has a condition number of 2e7, because a segment weighs 0.2 g


def slow(*names):
    """Cases of slow tests."""
    return [pytest.param(name, marks=pytest.mark.slow) for name in names]


def values_of(model, count):
    """States of a model, a third of them with all points on the ground, some, or none."""
    values = states(model, count)
    if not model.contacts:
        return values
    touching = ground.states(model, (ground.TOUCHING * count)[:count])
    presses = [ground.pressing(model, touching, k) for k in range(6)]
    assert presses[2] == presses[5] == 0 and presses[0] > 0
    # what the others move with is at random, their poses are above the ground
    return values | touching


@pytest.mark.parametrize("name", [*FREE, *slow(*FREE_SLOW), *TOUCHING, *slow(*TOUCHING_SLOW)])
def test_any_number_of_states_gives_what_each_gives_alone(name, monkeypatch):
    model = serpentail.load(zoo.folder(name))  # its own: later calls would be in lanes
    values, lanes = values_of(model, 37), STATES[model.manifest["real"]]
    own = GROUND if model.contacts else batched(model)
    for function in [name for name in batched(model) if name in own]:
        expected = alone(model, function, values)
        scale, digits = np.abs(expected).max(axis=0), np.finfo(expected.dtype).eps
        for count in (1, 7, lanes, lanes + 5, len(expected)):
            arrays = given(model, values, function, slice(count))
            with row(function, count), monkeypatch.context() as patch:
                if count >= lanes:
                    in_lanes(patch)
                out = evaluated(model, function, arrays)
                assert out.dtype == expected.dtype and np.isfinite(out).all()
                assert (
                    np.abs(out - expected[:count]) <= LIMITS.get(name, 3e3) * digits * scale
                ).all()


def test_states_whose_lanes_fail_are_evaluated_again_one_by_one(monkeypatch):
    """As if the lanes of the second group of states failed, and none of them alone."""
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)
    model, failures = serpentail.load(zoo.folder("m1_n1")), []
    q, lanes = states(model, 37)["q"], model.batch_library.states
    function = model.batch_library.entry("mass_matrix", 37)

    def failing(address):
        record = ArgumentRecord.from_address(address)
        if failures:
            return function(address)
        record.count, record.failed = lanes, lanes
        failures.append(function(address))
        return NOT_FINITE

    monkeypatch.setattr(model.batch_library, "entry", lambda name, count: failing)
    monkeypatch.setattr(model.batch_library, "threads", 1)
    expected = [model.mass_matrix(one) for one in q]
    np.testing.assert_allclose(model.mass_matrix(q), expected, rtol=1e-12, atol=1e-18)
    assert failures == [0]


@pytest.mark.parametrize("name", ["ground_m1_n1", *slow("arcs1", "loops", "ground_arcs")])
def test_the_reproducible_profile_gives_the_same_bits(name, monkeypatch):
    model = serpentail.load(zoo.folder(name), profile="reproducible")
    values = values_of(model, 11)
    in_lanes(monkeypatch)
    for function in batched(model):
        with row(function):
            together = evaluated(model, function, given(model, values, function))
            np.testing.assert_array_equal(together, alone(model, function, values))


@cache
def on_the_ground():
    """A model that only this file has."""
    return serpentail.load(zoo.folder("ground_m2_n2"))


@settings(deadline=None, max_examples=40)
@drawn(
    touching=st.lists(st.sampled_from(ground.TOUCHING), min_size=8, max_size=17),
    seed=st.integers(0, 2**32 - 1),
)
def test_forces_are_those_of_the_law_in_any_mixture(touching, seed):
    """Eq. 36 and Coulomb's cone, from the places and velocities of the points alone."""
    model = on_the_ground()
    values, p = ground.states(model, touching, seed), model.parameters
    with pytest.MonkeyPatch.context() as patch:
        in_lanes(patch)
        places, moves = model.contact_points(*given(model, values, "contact_points"))
        _, rates, forces = model.contact_dynamics(*given(model, values, "contact_dynamics"))
    depth = np.maximum(-places[..., 2], 0)
    normal = p["K_n"] * np.sqrt(depth) * np.maximum(depth - p["D_n"] * moves[..., 2], 0)
    np.testing.assert_allclose(forces[..., 2], normal, rtol=1e-9, atol=1e-12)
    bristles = values["bristles"].reshape(*depth.shape, 2)
    trial = -p["K_f"] * (bristles + p["D_f"] * moves[..., :2])
    size, bound = np.linalg.norm(trial, axis=-1), p["mu"] * normal
    friction = trial * np.where(size > bound, bound / size, 1)[..., None]
    np.testing.assert_allclose(forces[..., :2], friction, rtol=1e-7, atol=1e-12)
    relaxing = -(friction + p["K_f"] * bristles) / (p["D_f"] * p["K_f"])
    found_rates = rates.reshape(*depth.shape, 2)
    np.testing.assert_allclose(found_rates, relaxing, rtol=1e-7, atol=1e-12)


ROWS = """
int row_lanes(void);
int row_lanes(void) { return LANES; }
void row(const real *x, real *sine, real *cosine);
void row(const real *x, real *sine, real *cosine) {
  lanes a;
  for (int k = 0; k < LANES; ++k) ((real *)&a)[k] = x[k];
  @_sincos_row(a, (lanes *)sine, (lanes *)cosine);
}
"""


@mpmath.workdps(60)
@pytest.mark.parametrize("name", ["bare", "single"])
def test_sine_and_cosine_of_rows_are_good_to_the_last_digit(tmp_path, name):
    folder, file = zoo.folder(name), tmp_path / "rows.c"
    source = (folder / "src" / f"{name}_batch.c").read_text()
    for word in ("lanes", "LANES", "real"):
        source = source.replace(f"#undef {word}", "")
    file.write_text(source + ROWS.replace("@", name))
    library = ctypes.CDLL(str(compile_library([file], folder / "include")))
    number = np.float32 if name == "single" else np.float64
    width, rng = library.row_lanes(), np.random.default_rng(3)
    far, least = (number(1e4), -40) if name == "single" else (number(1e5), -300)
    angles = [*rng.uniform(-4, 4, 320), *rng.uniform(-far, far, 320)]
    angles += [*10.0 ** rng.uniform(least, 8, 96), *(k * np.pi / 4 for k in range(-40, 40))]
    angles += [k * np.pi / 2 for k in rng.integers(0, int(far / 2), 160)]
    beyond = np.nextafter(far, 2 * far)
    angles += [0.0, far, -far, beyond, -beyond, np.inf, -np.inf]
    angles = np.array(angles + [np.nan] * (-len(angles) % width)).astype(number).reshape(-1, width)
    pointer = [np.zeros(width, number) for _ in range(3)]
    for some in angles:
        pointer[0][:] = some
        library.row(*(ctypes.c_void_p(a.ctypes.data) for a in pointer))
        for x, *found in zip(some, *pointer[1:], strict=True):
            if not np.isfinite(x):
                assert np.isnan(found).all()
                continue
            exact = mpmath.cos_sin(mpmath.mpf(float(x)))[::-1]
            for y, value in zip(found, exact, strict=True):
                most = 1.5 * float(np.spacing(number(abs(value))))
                assert abs(mpmath.mpf(float(y)) - value) <= most, x
