"""Steps on the ground: implicit, with bristles, legs and torques of each run; in lanes they are
those of each run alone, whichever points touch in each run.
"""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as drawn
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail.model.library import NOT_POSITIVE_DEFINITE, STEP_TOO_LONG
from serpentail.model.stepping.singly import SingleSteps
from tests.support import zoo
from tests.support.models import folder_of

from ...c.batches.ground import TOUCHING, states
from ...support.rows import row

H = 2e-4  # s
FINE = 5e-5  # s
MODELS = ("ground_m2_n2", "ground_arcs", "ground", "single_ground", "paper", "elastic_ground")


@pytest.fixture
def model():
    return zoo.model("ground_m2_n2")


def runs_of(model, touching, seed=0):
    """Arguments of steps by name, one row for each run; legs move at 2 rad/s or so."""
    values = states(model, touching, seed)
    values.pop("angles")
    values["legs"][:, 4:] *= 20
    if "feet" not in model.contacts:
        values.pop("legs")
    return {name: array.astype(model.parameter_vector.dtype) for name, array in values.items()}


def stepped(model, values, h=H, **settings):
    """All numbers of the runs after some steps."""
    arguments = dict(values)
    state = [arguments.pop(name) for name in ("q", "v", "tau")]
    return np.hstack(model.step(*state, h, **arguments, **settings))


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


# Against the motion


def pressing(runs, seed=0):
    """Runs of the zoo's "ground" whose feet press on the ground."""
    model, rng = zoo.model("ground"), np.random.default_rng(seed)
    q, v = np.zeros((runs, model.nq)), 0.05 * rng.normal(size=(runs, model.nv))
    q[:, 3], q[:, 7:] = 1, 0.2 * rng.normal(size=(runs, 2))
    legs = np.tile([3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0], (runs, 1))
    legs[:, [1, 3]] -= rng.uniform(0, 0.3, (runs, 1))
    q[:, 2] = -model.contact_points(q, v, legs)[0][:, :6, 2].min(axis=1) - 2e-4
    bristles = np.zeros((runs, 2 * sum(model.contacts.values())))
    tau = 1e-5 * rng.normal(size=(runs, 2))
    return {"q": q, "v": v, "tau": tau, "bristles": bristles, "legs": legs}


def true(model, y, tau, legs, duration):
    """Where LSODA of SciPy comes to, by the model's forces on the ground."""
    nq, nv = model.nq, model.nv

    def rate(t, y):
        q, v, bristles = y[:nq], y[nq : nq + nv], y[nq + nv :]
        w, x, omega = q[3], q[4:7], v[3:6]
        turn = 0.5 * np.concatenate([[-x @ omega], w * omega + np.cross(x, omega)])
        now = np.concatenate([legs[:4] + t * legs[4:], legs[4:]])
        v_dot, stretching = model.kernel("contact_rates")(q, v, tau, bristles, now)[:2]
        return np.concatenate([v[:3], turn, v[6:], v_dot, stretching])

    found = solve_ivp(rate, (0, duration), y, "LSODA", rtol=1e-9, atol=1e-11, max_step=2e-4)
    return found.y[:, -1]


def test_steps_come_to_where_the_motion_does():
    """By half the step, half as far from it: the method is of order 1, singly and in lanes."""
    model, two = zoo.model("ground"), pressing(2)
    two["legs"][:, 4:] = [[2.0, -3.0, 2.0, -3.0], [0.0, -10.0, 0.0, 0.0]]
    nine = {name: array[np.arange(9) % 2] for name, array in two.items()}
    for k in range(2):
        start = np.concatenate([two[name][k] for name in ("q", "v", "bristles")])
        expected = true(model, start, two["tau"][k], two["legs"][k], 60 * FINE)
        moved = np.abs(expected - start)[: model.nq].max()
        for runs in (two, nine):
            with row(k, len(runs["q"])):
                errors = []
                for part in (1, 2, 4):
                    found = stepped(model, runs, FINE / part, steps=60 * part)
                    errors.append(np.abs(found[k] - expected)[: model.nq].max())
                assert errors[0] < 0.02 * moved
                assert errors[1] < 0.7 * errors[0] and errors[2] < 0.7 * errors[1]


def test_a_run_is_what_simulate_makes_of_it():
    model, values, end = zoo.model("ground"), pressing(11), 40 * FINE
    values["legs"] = legs = values["legs"][4]
    arguments = dict(values)
    state = [arguments.pop(name) for name in ("q", "v", "tau")]
    found = model.step(*state, FINE, steps=40, **arguments)
    for k in (0, 10):
        tau = np.tile(values["tau"][k], (2, 1))
        held = {
            "controller": st.TorqueTable([0.0, end], tau, 0.0),
            "legs": st.Legs.fixed(*legs[:2]),
        }
        keys = {"t_span": end, "output_step": end, "method": "implicit_euler", "step": FINE}
        motion = st.simulate(model, values["q"][k], values["v"][k], **held, **keys)
        stretch = motion.contact.bristles[-1].ravel()
        for array, expected in zip(found, (motion.q[-1], motion.v[-1], stretch), strict=True):
            np.testing.assert_allclose(array[k], expected, rtol=1e-8, atol=1e-12)


def test_in_place_in_threads_and_one_by_one():
    model, values = zoo.model("ground"), pressing(80)
    expected = stepped(model, values, steps=3, threads=1)
    own = {name: array.copy() for name, array in values.items()}
    out = [own[name] for name in ("q", "v", "bristles")]
    assert np.array_equal(stepped(model, own, steps=3, out=out, threads=3), expected)
    assert np.array_equal(np.hstack(out), expected)
    one = {name: array[70] for name, array in values.items()}
    np.testing.assert_allclose(stepped(model, one, steps=3), expected[70], rtol=1e-9, atol=1e-13)


def test_a_flight_by_implicit_steps_is_near_the_explicit():
    values = pressing(2)
    values["q"][:, 2] += 1.0
    step = partial(stepped, zoo.model("ground"), values, FINE, steps=20)
    implicit, explicit = step(), step(method="rk4")
    np.testing.assert_allclose(implicit[:, :9], explicit[:, :9], atol=1e-6)
    assert not np.array_equal(implicit, explicit)


# In lanes


@pytest.fixture
def in_lanes(monkeypatch):
    """Fails if a call of several runs makes some of them singly."""
    make = SingleSteps.make

    def made(self, held, first, last):
        assert held.runs == 1, "made singly"
        make(self, held, first, last)

    monkeypatch.setattr(SingleSteps, "make", made)


def test_mixed_contacts_give_what_each_run_gives_alone(in_lanes):
    names = ["contact_points", "contact_dynamics", "rollout", "implicit"]
    options = {"contacts": ["tail", "torso"], "functions": names, "baked": True}
    footless = st.load(folder_of(zoo.scene("m1_n1", **options)))  # the zoo has none
    for model in (*map(zoo.model, MODELS), footless):
        values = runs_of(model, (TOUCHING * 7)[:19])
        for steps in (1, 4):
            with row(model.name, steps):
                found = stepped(model, values, steps=steps)
                assert_alike(model, found, alone(model, values, steps=steps))


@settings(deadline=None, max_examples=20)
@given(
    touching=drawn.lists(drawn.sampled_from(TOUCHING), min_size=8, max_size=17),
    seed=drawn.integers(0, 2**32 - 1),
    friction=drawn.floats(0.1, 1.5),
)
def test_any_mixture_of_contacts_and_parameters(touching, seed, friction):
    model, count = zoo.model("ground_m2_n2"), len(touching)
    values, mass = runs_of(model, touching, seed), np.linspace(0.09, 0.12, count)
    parameters = {"mu": np.linspace(0.1, friction, count), "torso_mass": mass}
    together = stepped(model, values, parameters=parameters, steps=2)
    assert_alike(model, together, alone(model, values, parameters, steps=2))
    without = stepped(model, values, steps=2)
    assert not np.array_equal(together, without)


def test_one_torque_and_one_stance_serve_all_runs(model, in_lanes):
    values = runs_of(model, TOUCHING * 4)
    one = {name: values[name][0] for name in ("tau", "legs")}
    tiled = {name: np.tile(row, (12, 1)) for name, row in one.items()}
    found, expected = (stepped(model, values | each, steps=2) for each in (one, tiled))
    assert np.array_equal(found, expected)


def test_friction_that_jams_in_some_lanes_is_held_there(model, in_lanes):
    """The matrix of a run whose friction jams is not positive definite with a bound that moves."""
    values, h, jams = runs_of(model, ("all", "some", "none", "all") * 6, seed=3), 1e-3, []
    values["v"][:, :2] *= 10
    for k in range(24):
        q, v, bristles, legs = (values[name][k] for name in ("q", "v", "bristles", "legs"))
        factor = model.kernel("implicit_factor")
        try:
            factor(q, v, np.zeros(4), np.zeros(2), np.array([h, 1.0]), bristles, legs)
        except st.StateError:
            jams.append(k)
    assert 0 < len(jams) < 18
    together, single = (step(model, values, h=h) for step in (stepped, alone))
    for k in range(24):
        assert_alike(model, together[k : k + 1], single[k : k + 1])


def test_a_run_that_fails_leaves_its_neighbours(model):
    for count in (4, 9):
        values, statuses = runs_of(model, (TOUCHING * 3)[:count]), np.full(count, -1, np.intc)
        expected = alone(model, values)
        values["v"][2, 3:6] = 3 / H  # rad/s: farther in a step than the search for contacts allows
        with pytest.raises(st.SimulationError, match="step of run 2: "):
            stepped(model, values)
        values["bristles"][3, 1] = np.nan
        found = stepped(model, values, statuses=statuses)
        assert statuses[2] == STEP_TOO_LONG and statuses[3] != 0
        assert not np.delete(statuses, [2, 3]).any() and statuses[2] != NOT_POSITIVE_DEFINITE
        assert_alike(model, np.delete(found, [2, 3], 0), np.delete(expected, [2, 3], 0))
        kept = np.hstack([values["q"], values["v"]])[2]
        kept[3:7] /= np.linalg.norm(kept[3:7])
        np.testing.assert_allclose(found[2, : kept.size], kept, rtol=1e-12, atol=1e-15)


def test_arcs_bent_out_of_range_fail_where_they_do_alone():
    model = zoo.model("ground_arcs")
    values = runs_of(model, TOUCHING * 3)
    limit = model.manifest["scene"]["bend_range"]
    values["q"][4, 7:9], values["v"][4, 6:8] = [0.999 * limit, 0], [0.01 * limit / H, 0]
    lanes, single = (np.zeros(count, np.intc) for count in (9, 1))
    stepped(model, values, statuses=lanes)
    stepped(model, {name: array[4:5] for name, array in values.items()}, statuses=single)
    assert single[0] != 0 and lanes[4] == single[0] and not np.delete(lanes, 4).any()
