"""Steps of many runs, in flight and on the ground: in lanes as singly; what is wrong is named."""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.library import NOT_POSITIVE_DEFINITE, STEP_TOO_LONG
from serpentail.model.stepping.makers import SingleSteps
from tests.support import zoo
from tests.support.models import folder_of

from ...c.batches.tails import TOUCHING, on_ground
from ...support.rows import row

H = 2e-4  # s
RUNS = 19  # two groups of lanes, and some left over
AIR, GROUND = "m2_n2", "ground_m2_n2"
APART = (*["none"] * 8, *["all"] * 8, *TOUCHING)  # in the lanes of a group all or none
OWN = {"tail_mass": (0.008, 0.02), "gravity": (0, 9), "mu": (0.1, 1.5)}


def runs_of(model, count=RUNS, seed=5, touching=TOUCHING):
    """Arguments of steps by name, all runs different; on the ground legs move at 2 rad/s or so."""
    if model.contacts:
        values = on_ground(model, (list(touching) * count)[:count], seed)
        values.pop("angles")
        values["legs"][:, 4:] *= 20
        if "feet" not in model.contacts:
            values.pop("legs")
    else:
        rng, nt = np.random.default_rng(seed), model.layout.nt
        q, v = 0.1 * rng.normal(size=(count, 7 + nt)), rng.normal(size=(count, 6 + nt))
        q[:, 3] += 1
        values = {"q": q, "v": v, "tau": 1e-4 * rng.normal(size=(count, nt))}
    values["q"][:, 3:7] /= np.linalg.norm(values["q"][:, 3:7], axis=1, keepdims=True)
    return {name: array.astype(model.parameter_vector.dtype) for name, array in values.items()}


def moving(values):
    return [values[name] for name in ("q", "v", "bristles") if name in values]


def stepped(model, values, h=H, **settings):
    arguments = dict(values)
    state = [arguments.pop(name) for name in ("q", "v", "tau")]
    return np.hstack(model.step(*state, h, **arguments, **settings))


def alone(model, values, **settings):
    """The same by a call for each run."""
    rows = [slice(k, k + 1) for k in range(len(values["q"]))]
    each = [{name: array[k] for name, array in values.items()} for k in rows]
    return np.vstack([stepped(model, one, **settings) for one in each])


def assert_alike(model, found, expected):
    """Within rounding, which ill-conditioned contacts enlarge."""
    digits = np.finfo(model.parameter_vector.dtype).eps
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    assert (np.abs(found - expected) <= 1e6 * digits * scale).all()


@pytest.fixture(params=[AIR, GROUND])
def model(request):
    return zoo.model(request.param)


def test_steps_of_one_call_are_those_of_many(model):
    many = runs_of(model)
    for values in (many, {name: array[4] for name, array in many.items()}):
        expected, own = stepped(model, values, steps=3), dict(values)
        for _ in range(3):
            into = [np.zeros_like(array) for array in moving(own)]
            stepped(model, own, out=into)
            own |= zip(("q", "v", "bristles"), into, strict=False)
            if "legs" in own:
                angles, rates = np.split(own["legs"], 2, axis=-1)
                own["legs"] = np.concatenate([angles + H * rates, rates], axis=-1)
        np.testing.assert_allclose(np.hstack(into), expected, rtol=1e-8, atol=1e-11)
        held = {name: array.copy() for name, array in values.items()}
        found = stepped(model, held, steps=3, out=moving(held))
        assert np.array_equal(found, expected) and np.array_equal(np.hstack(moving(held)), found)
    values = runs_of(model, 780 if not model.contacts else 80)
    one, three = (stepped(model, values, steps=4, threads=n) for n in (1, 3))
    assert np.array_equal(one, three)
    values = runs_of(model)  # single rows are repeated
    one = {name: array[2] for name, array in values.items() if name not in ("v", "bristles")}
    tiled = {name: np.tile(array, (RUNS, 1)) for name, array in one.items()}
    assert np.array_equal(stepped(model, values | one), stepped(model, values | tiled))


def test_runs_have_parameters_of_their_own(model):
    for count in (3, RUNS):
        values = runs_of(model, count)
        changes = {name: np.linspace(*ends, count) for name, ends in OWN.items()}
        if not model.contacts:
            del changes["mu"]
        for each in (changes, model.parameters_of_runs(changes, count)):
            found = stepped(model, values, parameters=each)
            for k in range(count):
                own = model.with_parameters(**{name: x[k] for name, x in changes.items()})
                with row(count, type(each), k):
                    one = {name: array[k] for name, array in values.items()}
                    assert_alike(model, found[k], stepped(own, one))


def test_a_run_that_fails_leaves_its_neighbours(model):
    for count in (4, RUNS):
        values, statuses = runs_of(model, count), np.full(count, -1, np.intc)
        expected = alone(model, values)
        if model.contacts:
            values["v"][2, 3:6] = 3 / H  # rad/s: farther than the search for contacts allows
        else:
            values["v"][2, 6:] = 1e200
        with pytest.raises(st.SimulationError, match=r"step of run 2: [^(]*too long[^(]*$"):
            stepped(model, values)
        values["v"][1] = values["v"][2]
        with pytest.raises(st.SimulationError, match=rf"run 1: .*\(2 of {count} runs failed\)"):
            stepped(model, values)
        values["tau"][1] = np.nan  # a status where statuses are asked for
        found = stepped(model, values, statuses=statuses)
        assert list(statuses.nonzero()[0]) == [1, 2]
        assert_alike(model, np.delete(found, [1, 2], 0), np.delete(expected, [1, 2], 0))
        if model.contacts:
            assert statuses[2] == STEP_TOO_LONG != NOT_POSITIVE_DEFINITE
            kept = np.hstack([values["q"], values["v"]])[2]
            np.testing.assert_allclose(found[2, : kept.size], kept, rtol=1e-12, atol=1e-15)


def test_floats_and_baked_parameters_serve():
    for name, like, most in (("single", AIR, 2e-4), ("baked", "m1_n3", 1e-12)):
        model, other = zoo.model(name), zoo.model(like)
        values, dtype = runs_of(other), model.parameter_vector.dtype
        found = stepped(model, {key: array.astype(dtype) for key, array in values.items()})
        expected = stepped(other, values)
        assert found.dtype == dtype == (np.float32 if name == "single" else np.float64)
        assert (np.abs(found - expected) < most * (1 + np.abs(expected))).all()


@pytest.fixture
def in_lanes(monkeypatch):
    """Fails if a call of several runs makes some of them singly."""
    make = SingleSteps.make

    def made(self, held, first, last):
        assert held.runs == 1, "made singly"
        make(self, held, first, last)

    monkeypatch.setattr(SingleSteps, "make", made)


OTHERS = ("ground_arcs", "ground", "single_ground", "paper", "elastic_ground")


@pytest.mark.parametrize("names", [(AIR, GROUND), pytest.param(OTHERS, marks=pytest.mark.slow)])
def test_mixed_contacts_give_what_each_run_gives_alone(in_lanes, names):
    functions = ["contact_points", "contact_dynamics", "rollout", "implicit"]
    options = {"contacts": ["tail", "torso"], "functions": functions, "baked": True}
    scenes = [zoo.scene("m1_n1", **options)] if names is OTHERS else []  # as the zoo has none
    for model in (*map(zoo.model, names), *(st.load(folder_of(scene)) for scene in scenes)):
        for steps, touching in ((1, APART), (4, TOUCHING)):
            values = runs_of(model, touching=touching)
            with row(model.name, steps):
                found = stepped(model, values, steps=steps)
                assert_alike(model, found, alone(model, values, steps=steps))


def test_friction_that_jams_in_some_lanes_is_held_there(in_lanes):
    """The matrix of a run whose friction jams is not positive definite with a bound that moves."""
    model, h, jams = zoo.model(GROUND), 1e-3, []
    values = runs_of(model, 24, 3, ("all", "some", "none", "all"))
    values["v"][:, :2] *= 10
    names = ("q", "v", "bristles", "legs")
    for q, v, bristles, legs in zip(*map(values.get, names), strict=True):
        factor = model.kernel("implicit_factor")
        try:
            factor(q, v, np.zeros(4), np.zeros(2), np.array([h, 1.0]), bristles, legs)
        except st.StateError:
            jams.append(q)
    assert 0 < len(jams) < 18
    together, single = (step(model, values, h=h) for step in (stepped, alone))
    for one, other in zip(together, single, strict=True):
        assert_alike(model, one[None], other[None])


def test_arcs_bent_out_of_range_fail_where_they_do_alone():
    model, count = zoo.model("ground_arcs"), 9
    values, limit = runs_of(model, count), model.manifest["scene"]["bend_range"]
    values["q"][4, 7:9], values["v"][4, 6:8] = [0.999 * limit, 0], [0.01 * limit / H, 0]
    lanes, single = np.zeros(count, np.intc), np.zeros(1, np.intc)
    stepped(model, values, statuses=lanes)
    stepped(model, {name: array[4:5] for name, array in values.items()}, statuses=single)
    assert single[0] != 0 and lanes[4] == single[0] and not np.delete(lanes, 4).any()


UPRIGHT = np.eye(11)[3]
SOUND = {"q": np.tile(UPRIGHT, (9, 1)), "v": np.zeros((9, 10)), "tau": np.zeros((9, 4)), "h": 1e-3}
ERRORS = dict.fromkeys(("h", "steps", "threads", "method", "stepz"), st.SimulationError)
ERRORS |= {"parameters": st.ModelError}  # all others: StateError
REFUSED = [
    *(("h", value, f"h: value {value}") for value in (0.0, -1e-3, np.nan, np.inf)),
    ("h", "1 m", "h: value '1 m': a length where a time"),
    *(("steps", value, f"steps: value {value}") for value in (0, 2.0, True, 10_001)),
    ("threads", 0, "threads: value 0"),
    ("method", "rk5", "method: value 'rk5': did you mean 'rk4'?"),
    ("stepz", 2, "'stepz': did you mean 'steps'?"),
    ("q", np.zeros(10), "q has shape (10,), not (11,) or (k, 11)"),
    ("q", np.zeros((0, 11)), "q has shape (0, 11)"),
    ("q", np.outer(np.arange(9) < 5, UPRIGHT), "q[3:7] of run 5 is the zero"),
    ("v", np.zeros((9, 2, 10)), "v has shape (9, 2, 10)"),
    ("tau", 0.0, "tau has shape ()"),
    ("tau", ["a"] * 4, "tau: value ['a', 'a', 'a', 'a']: needs real numbers, not texts"),
    ("v", np.zeros((8, 10)), "numbers of runs differ (q 9, v 8, tau 9)"),
    ("v", np.where(np.arange(90).reshape(9, 10) == 32, np.nan, 0), "v[3, 2]: value nan"),
    ("tau", [0, np.inf, 0, 0], "tau[1]: value inf"),
    ("bristles", np.zeros(4), "bristles: this model has none"),
    ("legs", np.zeros(8), "legs: this model has none"),
    ("parameters", {"tail_mass": [1.0]}, "tail_mass: value [1.0]"),
    ("parameters", 3, "parameters: value 3"),
    ("out", np.zeros((2, 9, 11)), "out: needs 2 arrays, for q, v"),
    ("out", [np.zeros((9, 11))], "out: needs 2 arrays"),
    ("statuses", np.zeros(9), "statuses: value"),
    ("statuses", np.zeros(3, np.intc), "of shape (9,)"),
]
UNSOUND = {
    "of another type": lambda a: a.astype(np.float32),
    "short": lambda a: a[:4],
    "Fortran order": lambda a: a.T.copy().T,
    "no array": lambda a: a.tolist(),
    "not writeable": lambda a: np.broadcast_to(a[0], a.shape),
}


def test_what_is_wrong_is_named():
    tail = zoo.model(AIR)
    for name, value, words in REFUSED:
        given = SOUND | {name: value}
        arguments = [given.pop(each) for each in ("q", "v", "tau", "h")]
        with row(name, value):
            with pytest.raises(ERRORS.get(name, st.StateError)) as raised:
                tail.step(*arguments, **given)
            assert words in str(raised.value) and "\n" not in str(raised.value)
    for name, spoil in UNSOUND.items():
        out = [SOUND["q"].copy(), spoil(SOUND["v"])]
        with row(name), pytest.raises(st.StateError, match=r"step: out: v: value .*writeable C"):
            tail.step(**SOUND, out=out)
    made, bare = tail.parameters_of_runs({"tail_mass": np.full(3, 0.01)}, 3), zoo.model("bare")
    state = [0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2), H
    feet, points = zoo.model("feet_tail"), 2 * sum(zoo.model("feet_tail").contacts.values())
    calls = (
        (lambda: tail.step(**SOUND, parameters=made), "parameters of 3 runs, not of 9"),
        (lambda: feet.step(*state, legs=np.zeros(8)), rf"bristles: none: .*\(k, {points}\)"),
        (lambda: feet.step(*state, bristles=np.zeros(points)), "legs: none: "),
        (lambda: bare.step(*state), r"without 'rollout'.*`functions`"),
        (lambda: bare.step(*state, method="implicit_euler"), "without 'rollout', 'implicit'"),
        (lambda: zoo.model("fixed").step(*np.zeros((3, 4)), 1e-3), "step: fixed has a fixed base"),
        (lambda: st.load(zoo.folder(AIR), compiled=False).step(**SOUND), "compiled=False"),
        (lambda: tail.batch_library.rollouts.function("tail_hops"), "function tail_hops"),
    )
    for k, (call, words) in enumerate(calls):
        with row(words), pytest.raises(st.StateError if k < 3 else st.ModelError, match=words):
            call()
