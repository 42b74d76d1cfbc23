"""Steps on the ground in lanes are those of each run alone, whichever points touch in each run."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as drawn

import serpentail as st
from serpentail.model.library import NOT_POSITIVE_DEFINITE, STEP_TOO_LONG
from serpentail.model.stepping.singly import SingleSteps

from ...c.batches.ground import CONTACTS, TOUCHING, states
from ...support.models import model_folder

H = 2e-4  # s
WANTED = ["contact_points", "contact_dynamics", "rollout", "implicit"]
PASSIVE = {"tail_stiffness": 2e-3, "tail_damping": 1e-5}
MODELS = {
    "links": (2, 2, {}),
    "arcs": (2, None, {}),
    "no_feet": (1, 2, {"contacts": ["tail", "torso"]}),
    "float": (1, 2, {"real": "float"}),
    "baked": (1, 2, {"baked": True}),
    "paper": (1, 2, {"friction": "paper"}),
    "elastic": (1, 2, {"parameters": PASSIVE}),
}
QUICK = ("links", "no_feet")
every_model = pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in MODELS]
)


@cache
def model(name="links"):
    """A model whose runs are stepped."""
    segments, links, options = MODELS[name]
    options = {"contacts": CONTACTS, "functions": WANTED} | options
    return st.load(model_folder(segments, links, name=f"{name}_steps", **options))


def runs_of(model, touching, seed=0):
    """Arguments of steps by name, one row for each run; legs move at 2 rad/s or so."""
    values = states(model, touching, seed)
    values.pop("angles")
    values["legs"][:, 4:] *= 20
    if "feet" not in model.contacts:
        values.pop("legs")
    return {name: array.astype(model.parameter_vector.dtype) for name, array in values.items()}


def stepped(model, values, **settings):
    """All numbers of the runs after some steps."""
    arguments = dict(values)
    state = [arguments.pop(name) for name in ("q", "v", "tau")]
    return np.hstack(model.step(*state, H, **arguments, **settings))


def alone(model, values, parameters=None, **settings):
    """The same by a call for each run."""
    rows = []
    for k in range(len(values["q"])):
        one = {name: array[k : k + 1] for name, array in values.items()}
        own = {name: value[k : k + 1] for name, value in (parameters or {}).items()}
        rows.append(stepped(model, one, parameters=own, **settings)[0])
    return np.array(rows)


def assert_alike(model, found, expected):
    """Within rounding, which ill-conditioned contacts enlarge."""
    digits = np.finfo(model.parameter_vector.dtype).eps
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    assert (np.abs(found - expected) <= 1e6 * digits * scale).all()


@pytest.fixture
def in_lanes(monkeypatch):
    """Fails if a call of several runs makes some of them singly."""
    make = SingleSteps.make

    def made(self, held, first, last):
        assert held.runs == 1, "made singly"
        make(self, held, first, last)

    monkeypatch.setattr(SingleSteps, "make", made)


@every_model
def test_mixed_contacts_give_what_each_run_gives_alone(name, in_lanes):
    found = model(name)
    values = runs_of(found, (TOUCHING * 7)[:19])
    for steps in (1, 4):
        together = stepped(found, values, steps=steps)
        assert_alike(found, together, alone(found, values, steps=steps))


@settings(deadline=None, max_examples=40)
@given(
    touching=drawn.lists(drawn.sampled_from(TOUCHING), min_size=8, max_size=17),
    seed=drawn.integers(0, 2**32 - 1),
    friction=drawn.floats(0.1, 1.5),
)
def test_any_mixture_of_contacts_and_parameters(touching, seed, friction):
    found, values = model(), runs_of(model(), touching, seed)
    count = len(touching)
    parameters = {
        "mu": np.linspace(0.1, friction, count),
        "torso_mass": np.linspace(0.09, 0.12, count),
    }
    together = stepped(found, values, parameters=parameters, steps=2)
    assert_alike(found, together, alone(found, values, parameters, steps=2))


def test_one_torque_and_one_stance_serve_all_runs(in_lanes):
    values = runs_of(model(), TOUCHING * 4)
    tiled = dict(values)
    for name in ("tau", "legs"):
        tiled[name] = np.tile(values[name][0], (12, 1))
        values[name] = values[name][0]
    assert np.array_equal(stepped(model(), values, steps=2), stepped(model(), tiled, steps=2))


def test_friction_that_jams_in_some_lanes_is_held_there(in_lanes):
    """The matrix of a run whose friction jams is not positive definite with a bound that moves."""
    found, h = model(), 1e-3
    values = runs_of(found, ("all", "some", "none", "all") * 6, seed=3)
    values["v"][:, :2] *= 10
    factor, jams = found.kernel("implicit_factor"), []
    for k in range(24):
        state = [values[name][k] for name in ("q", "v")]
        rest = [values["bristles"][k], values["legs"][k]]
        try:
            factor(*state, np.zeros(4), np.zeros(2), np.array([h, 1.0]), *rest)
        except st.StateError:
            jams.append(k)
    assert 0 < len(jams) < 18
    arguments = {name: values[name] for name in ("bristles", "legs")}
    state = [values[name] for name in ("q", "v", "tau")]
    together = np.hstack(found.step(*state, h, **arguments))
    for k in range(24):
        own = {name: array[k : k + 1] for name, array in arguments.items()}
        one = np.hstack(found.step(*(array[k : k + 1] for array in state), h, **own))
        assert_alike(found, together[k : k + 1], one)


def test_a_run_that_fails_leaves_its_neighbours():
    values, statuses = runs_of(model(), TOUCHING * 3), np.full(9, -1, np.intc)
    expected = alone(model(), values)
    values["v"][2, 3:6] = 3 / H  # rad/s: farther in a step than the search for contacts allows
    values["bristles"][5, 1] = np.nan
    found = stepped(model(), values, statuses=statuses)
    assert statuses[2] == STEP_TOO_LONG and statuses[5] != 0
    assert not np.delete(statuses, [2, 5]).any() and statuses[2] != NOT_POSITIVE_DEFINITE
    assert_alike(model(), np.delete(found, [2, 5], 0), np.delete(expected, [2, 5], 0))
    kept = np.hstack([values["q"], values["v"]])[2]
    kept[3:7] /= np.linalg.norm(kept[3:7])
    np.testing.assert_allclose(found[2, : kept.size], kept, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_arcs_bent_out_of_range_fail_where_they_do_alone():
    found = model("arcs")
    values = runs_of(found, TOUCHING * 3)
    limit = found.manifest["scene"]["bend_range"]
    values["q"][4, 7:9], values["v"][4, 6:8] = [0.999 * limit, 0], [0.01 * limit / H, 0]
    lanes, single = (np.zeros(count, np.intc) for count in (9, 1))
    stepped(found, values, statuses=lanes)
    stepped(found, {name: array[4:5] for name, array in values.items()}, statuses=single)
    assert single[0] != 0 and lanes[4] == single[0] and not np.delete(lanes, 4).any()
