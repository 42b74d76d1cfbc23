"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

import ctypes
import json
import threading
from functools import cache

import mpmath
import numpy as np
import pytest

import serpentail as st
from serpentail.model.compiler import compile_library
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.passes.batch import batched as widened
from serpentail_codegen.passes.batch import unrolled_step
from serpentail_codegen.targets.c.batch import BATCHED, STATES
from tests.support.models import model_folder

TAILS = {"articulated": Tail(2, 2), "continuum": Tail(2, 4, "continuum")}
FORMS = [
    pytest.param(
        tail,
        emission,
        real,
        marks=() if real == "double" and emission == usual else pytest.mark.slow,
    )
    for tail, usual in ((("articulated", 2, 2), "straight"), (("continuum", 2, None), "loops"))
    for emission in ("straight", "loops")
    for real in ("double", "float")
]
every_form = pytest.mark.parametrize(("tail", "emission", "real"), FORMS)
ARGUMENTS = {
    "mass_matrix": ("q",),
    "bias_force": ("q", "v"),
    "inverse_dynamics": ("q", "v", "v_dot"),
    "forward_dynamics": ("q", "v", "tau"),
}


@cache
def model(kind="articulated", segments=2, links=2, profile="fast", **options):
    """A model with all functions that have batches."""
    folder = model_folder(segments, links, name=f"{kind}_batch", functions=list(BATCHED), **options)
    return st.load(folder, profile=profile)


@pytest.fixture(autouse=True)
def any_batch_is_large(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)


def states(model, count, seed=0):
    """Random states, one argument a name."""
    rng = np.random.default_rng(seed)
    sizes = {"q": model.nq, "v": model.nv, "v_dot": model.nv, "tau": model.nv - 6}
    return {name: rng.normal(size=(count, size)) for name, size in sizes.items()}


def given(arguments, name):
    """The arguments of one function."""
    return [arguments[a] for a in ARGUMENTS[name]]


def alone(model, name, arguments):
    """Every state by a call of its own."""
    return np.array(
        [getattr(model, name)(*state) for state in zip(*given(arguments, name), strict=True)]
    )


# Programs.


def numbers(program, rng):
    """Random arguments of a program, its parameters positive."""
    parameters = {
        a.name: rng.uniform(0.1, 1, a.length).tolist() for a in program.of_role("parameters")
    }
    return parameters | {
        a.name: rng.normal(size=a.length).tolist() for a in program.of_role("input")
    }


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("name", BATCHED)
def test_a_program_of_many_states_means_each_of_them(tail, name):
    single, rng = assemble(FUNCTIONS[name], TAILS[tail]), np.random.default_rng(1)
    states = [numbers(single, rng) for _ in range(3)]
    for state in states[1:]:
        state.update({a.name: states[0][a.name] for a in single.of_role("parameters")})
    many = dict(states[0])
    for a in single.of_role("input"):
        many[a.name] = list(np.array([state[a.name] for state in states]).T)
    found = Run(widened(single, 3), Numbers(np), many).values
    for k, state in enumerate(states):
        alone = Run(single, Numbers(np), state).values
        for a in single.of_role("output"):
            assert [np.broadcast_to(x, 3)[k] for x in found[a.name]] == alone[a.name]


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("name", BATCHED)
def test_a_program_written_out_means_the_same_and_guards_the_same(tail, name):
    single = assemble(FUNCTIONS[name], TAILS[tail])
    values = numbers(single, np.random.default_rng(2))
    expected, found = (Run(p, Numbers(np), values) for p in (single, unrolled_step(single)))
    for a in single.of_role("output"):
        np.testing.assert_allclose(
            np.float64(found.values[a.name]), np.float64(expected.values[a.name]), rtol=1e-12
        )
    pairs = [sorted((status, float(x)) for status, x in run.guards) for run in (found, expected)]
    assert len(pairs[0]) == len(pairs[1])
    for (status, x), (other, y) in zip(*pairs, strict=True):
        assert status == other and x == pytest.approx(y, rel=1e-9)


def test_what_depends_on_parameters_alone_stays_narrow():
    arrays = {
        a.name: a.lanes
        for a in widened(assemble(FUNCTIONS["inverse_dynamics"], Tail(2, 2)), 8).arrays
    }
    assert arrays["q"] == arrays["force"] == 8
    assert arrays["link"] == arrays["tail_mass"] == 0


@pytest.mark.parametrize(("segments", "links", "straight"), [(3, 4, True), (8, 16, False)])
def test_batches_stay_straight_for_longer_tails_than_single_states(segments, links, straight):
    folder = model_folder(segments, links, functions=["forward_dynamics"])
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["functions"]["forward_dynamics"]["emission"] in ("lanes", "segments")
    assert ("written_out" in (folder / "src" / f"{folder.name}_batch.c").read_text()) == straight


# The compiled batches.


@every_form
@pytest.mark.parametrize("name", BATCHED)
def test_any_number_of_states_gives_what_each_gives_alone(tail, emission, real, name):
    found = model(*tail, emission=emission, real=real)
    arguments = states(found, 37)
    expected = alone(found, name, arguments)
    scale, digits = np.abs(expected).max(axis=0), np.finfo(expected.dtype).eps
    for count in (1, 7, *range(STATES[real], len(expected), STATES[real] - 3), len(expected)):
        out = getattr(found, name)(*(a[:count] for a in given(arguments, name)))
        assert out.dtype == expected.dtype
        assert (np.abs(out - expected[:count]) <= 3e3 * digits * scale).all()


@pytest.mark.parametrize("tail", [("articulated", 2, 2), ("continuum", 2, None)])
@pytest.mark.parametrize("emission", ["loops", pytest.param("straight", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", BATCHED)
def test_the_reproducible_profile_gives_the_same_bits(tail, emission, name):
    found = model(*tail, profile="reproducible", emission=emission)
    arguments = states(found, 11)
    assert np.array_equal(
        getattr(found, name)(*given(arguments, name)), alone(found, name, arguments)
    )


@mpmath.workdps(60)
@pytest.mark.parametrize("real", ["double", "float"])
def test_sine_and_cosine_of_rows_are_good_to_the_last_digit(tmp_path, real):
    found = model(real=real)
    source = (found.folder / "src" / f"{found.name}_batch.c").read_text()
    source = (
        source.replace("#undef lanes", "").replace("#undef LANES", "").replace("#undef real", "")
    )
    name, number = found.name, np.float32 if real == "float" else np.float64
    source += f"""
int row_lanes(void);
int row_lanes(void) {{ return LANES; }}
void row(const real *x, real *sine, real *cosine);
void row(const real *x, real *sine, real *cosine) {{
  lanes a;
  for (int k = 0; k < LANES; ++k) ((real *)&a)[k] = x[k];
  {name}_sincos_row(a, (lanes *)sine, (lanes *)cosine);
}}
"""
    file = tmp_path / "rows.c"
    file.write_text(source)
    library = ctypes.CDLL(str(compile_library([file], found.folder / "include")))
    width, rng = library.row_lanes(), np.random.default_rng(3)
    far, least = (number(1e4), -40) if real == "float" else (number(1e5), -300)
    angles = [
        *rng.uniform(-4, 4, 320),
        *rng.uniform(-far, far, 320),
        *10.0 ** rng.uniform(least, 8, 96),
    ]
    angles += [k * np.pi / 4 for k in range(-40, 40)] + [
        k * np.pi / 2 for k in rng.integers(0, int(far / 2), 160)
    ]
    angles += [
        0.0,
        far,
        -far,
        np.nextafter(far, 2 * far),
        -np.nextafter(far, 2 * far),
        np.inf,
        -np.inf,
    ]
    angles = np.array(angles + [np.nan] * (-len(angles) % width)).astype(number).reshape(-1, width)
    pointer = [np.zeros(width, number) for _ in range(3)]
    for row in angles:
        pointer[0][:] = row
        library.row(*(ctypes.c_void_p(a.ctypes.data) for a in pointer))
        for x, sine, cosine in zip(row, *pointer[1:], strict=True):
            if not np.isfinite(x):
                assert np.isnan(sine) and np.isnan(cosine)
                continue
            exact = mpmath.cos_sin(mpmath.mpf(float(x)))[::-1]
            for y, value in zip((sine, cosine), exact, strict=True):
                assert abs(mpmath.mpf(float(y)) - value) <= 1.5 * float(
                    np.spacing(number(abs(value)))
                ), x


# The face.


def test_a_few_states_compile_nothing_and_many_do_once(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1000)
    built = []
    monkeypatch.setattr(
        "serpentail.model.batch.compile_library", lambda *a: built.append(a) or compile_library(*a)
    )
    found = st.load(model().folder)
    found.mass_matrix(states(found, 999)["q"])
    assert not built
    found.mass_matrix(states(found, 1000)["q"])
    found.with_parameters(torso_mass=1.0).mass_matrix(states(found, 20)["q"])
    assert len(built) == 1


def test_parameters_count_in_batches():
    heavy = model().with_parameters(torso_mass=1.0, link_radius=0.01)
    arguments = states(heavy, 9)
    expected = alone(heavy, "forward_dynamics", arguments)
    np.testing.assert_allclose(
        heavy.forward_dynamics(*given(arguments, "forward_dynamics")), expected, rtol=1e-9
    )


WRONG = {
    "a number that is none": (
        lambda q, v: v.__setitem__((13, 4), np.nan),
        r"v\[4\] of state 13: value nan",
    ),
    "an infinite position": (
        lambda q, v: q.__setitem__((13, 0), np.inf),
        r"q\[0\] of state 13: value inf",
    ),
    "no attitude": (
        lambda q, v: q.__setitem__((13, slice(3, 7)), 0),
        r"quaternion q\[3:7\] of state 13 is zero",
    ),
    "what overflows": (
        lambda q, v: v.__setitem__((13, slice(None)), 1e200),
        "result of state 13 is not finite",
    ),
}


@pytest.mark.parametrize("what", WRONG)
@pytest.mark.parametrize("count", [20, 1500])
def test_the_state_that_is_wrong_is_named(what, count):
    change, message = WRONG[what]
    found, arguments = model(), states(model(), count)
    change(arguments["q"], arguments["v"])
    with pytest.raises(st.StateError, match=message):
        found.bias_force(arguments["q"], arguments["v"])


def test_a_bend_beyond_the_range_is_named():
    found = model("continuum", 2, None)
    q = states(found, 20)["q"]
    q[17, 9] = 7.0
    with pytest.raises(st.StateError, match="segment 2 of state 17 is bent by 7"):
        found.mass_matrix(q)


def test_threads_share_a_model():
    found = model()
    batches = [states(found, 600, seed) for seed in range(6)]
    expected = [found.forward_dynamics(*given(a, "forward_dynamics")) for a in batches]
    results = [None] * 6

    def work(k):
        results[k] = [
            found.forward_dynamics(*given(batches[k], "forward_dynamics")) for _ in range(20)
        ]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, expected[k]) for k, many in enumerate(results) for one in many)


def test_a_single_state_is_repeated_over_a_batch():
    found, arguments = model(), states(model(), 30)
    force = found.bias_force(arguments["q"][0], arguments["v"])
    expected = [found.bias_force(arguments["q"][0], v) for v in arguments["v"]]
    np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-14)
