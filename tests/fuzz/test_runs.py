"""Simulations, what acts in them, and plans before anything is derived: taken or refused, whatever
they are given.
"""

import numpy as np
import pytest
from hypothesis import strategies as some

import serpentail as st
from tests.support import zoo
from tests.support.posed import posed

from .conftest import answer, strange

CUT = ("tsit5", "ros34pw2")  # methods that take most_steps
METHODS = some.sampled_from([*CUT, "rk4", "implicit_euler", "dop853", "lsoda", "auto"])
SPAN = 0.002  # s
# numbers of a setting: steps of less than this and more than nothing would take for ever
SHORT = 1e-5
NOT_ENDLESS = strange((3,)).filter(lambda x: not (isinstance(x, float) and 0 < abs(x) < SHORT))
TIMES = NOT_ENDLESS.filter(lambda x: not (isinstance(x, int | float) and x > SPAN))
FIELDS = {
    st.Goal: ("goal", ("attitude", "torso_rate", "tail", "tail_rate", "turns")),
    st.Bounds: ("bounds", ("angle", "rate", "torque", "torque_rate")),
}
SETTINGS = (
    *("objective", "smoothing", "damping", "path", "formulation", "attitude"),
    *("rule", "degree", "intervals", "most_intervals", "tolerance", "rounds", "solver", "options"),
    *("guess", "guess_damping", "multi_start", "retries", "seed", "dynamics", "time_limit"),
    *("track", "unknown"),
)


@pytest.fixture(scope="module")
def model():
    return zoo.model("feet_tail")


def start(model):
    """A motion above the ground that ends at once."""
    q, v = np.zeros(model.nq), np.full(model.nv, 0.1)
    q[2:4] = 0.3, 1.0
    common = {"q0": q, "v0": v, "controller": st.Damping(1e-5), "t_span": SPAN}
    return common | {"output_step": SPAN / 2, "legs": st.Legs.fixed(3.6, -0.3)}


def test_states_and_settings_of_a_run_are_taken_or_refused(model, search):
    names = ("rtol", "atol", "step", "first_step", "least_step", "most_step", "most_steps", "bad")

    def law(state, x, setting, value, method):
        most = {"most_steps": 10_000} if method in CUT else {}
        usual = start(model) | {"method": method}
        answer(st.simulate, model, **usual | {state: x} | most)
        given = most | {setting: value} if method in CUT or setting != "most_steps" else {}
        answer(st.simulate, model, **usual | given)

    x = strange((model.nq,)) | strange((model.nv,))
    states, settings = some.sampled_from(["q0", "v0"]), some.sampled_from(names)
    search(law, state=states, x=x, setting=settings, value=NOT_ENDLESS, method=METHODS)


def test_what_a_run_is_told_is_taken_or_refused(model, search):
    names = ("controller", "legs", "bristles0", "stop_at", "method", "parameters", "output_step")

    def law(name, value, time):
        if not (name == "controller" and callable(value)):  # a user's function raises what it likes
            answer(st.simulate, model, **start(model) | {name: value})
        if name == "output_step":
            answer(st.simulate, model, **start(model) | {"t_span": time})

    search(law, name=some.sampled_from(names), value=NOT_ENDLESS, time=TIMES)


def test_many_runs_are_made_or_refused(model, search):
    """Parameters, starts and bristles of many runs."""

    def law(name, value):
        given = start(model)
        many = given | {"q0": np.stack([given["q0"]] * 3), "method": "rk4"}
        if name == "parameters":
            answer(st.simulate, model, **many | {"parameters": value})
            value = {"tail_mass": value}
        answer(st.simulate, model, **many | {name: value})

    names = some.sampled_from(["parameters", "v0", "bristles0"])
    search(law, name=names, value=strange((3,)) | strange((3, 8)))


PFL = {"reference": ([0.0, 1.0], np.zeros((2, 2))), "kp": 1.0, "kd": 2.0}
ACTING = {
    "Damping": st.Damping,
    "TorqueTable times": lambda x: st.TorqueTable(x, np.zeros((2, 2))),
    "TorqueTable torques": lambda x: st.TorqueTable([0.0, 1.0], x),
    "TorqueTable damping": lambda x: st.TorqueTable([0.0, 1.0], np.zeros((2, 2)), x),
    "TorqueCurve": st.TorqueCurve,
    "Phases": st.Phases,
    "Phases time": lambda x: st.Phases([(0.0, None), (x, None)]),
    "Phases controller": lambda x: st.Phases([(0.0, x)]),
    "a function": lambda x: lambda t, q, v: x,
    **{f"Pfl {k}": lambda x, k=k: st.Pfl(zoo.model("feet_tail"), **PFL | {k: x}) for k in PFL},
}
MADE = {
    st.Legs: {"times": [0.0, 1.0], "gamma": 3.6, "delta": [0.0, 1.0]},
    st.Legs.fixed: {"gamma": 3.6, "delta": -0.3},
    st.Legs.ramp: {"gamma": 3.6, "delta": (-0.3, -1.0), "at": 0.4, "rate": -70.0},
    st.Reference: {"times": [0.0, 1.0], "angles": np.zeros((2, 2)), "blend": "quintic"},
    st.polar_to_bend: dict.fromkeys(("phi", "theta", "phi_dot", "theta_dot"), 0.3),
    st.bend_to_polar: dict.fromkeys(("a", "b", "a_dot", "b_dot"), 0.3),
    st.rotation_matrix: {"quaternion": np.array([0.5, 0.5, -0.5, 0.5])},
    st.pitch_roll_yaw: {"q": np.full(9, 0.5)},
}


def test_what_acts_is_taken_or_refused(model, search):
    """A user's function of the time raises what it likes."""

    def law(name, value, made):
        function, word = made
        answer(function, **MADE[function] | {word: value})
        controller = None
        if not (name == "Phases controller" and callable(value)):
            controller = answer(ACTING[name], value)
        if controller is not None:
            acting = {"controller": controller, "most_steps": 2000}
            answer(st.simulate, model, **start(model) | acting)

    made = some.sampled_from([(function, word) for function in MADE for word in MADE[function]])
    value = strange((2,)) | strange((2, 2))
    search(law, name=some.sampled_from(sorted(ACTING)), value=value, made=made)


# Plans.


def asked(**given):
    """What `st.plan` checks first."""
    model = zoo.model("m2_n2")
    q = np.zeros(model.nq)
    q[3] = 1.0
    usual = {"start": (q, np.zeros(model.nv)), "goal": None, "duration": 0.5, "bounds": None}
    return posed(model, **usual | given)


def test_starts_durations_and_settings_of_plans_are_taken_or_refused(taken_or_refused):
    vectors = strange((11,))
    pairs = some.tuples(vectors, strange((10,))) | some.lists(vectors, max_size=3)
    taken_or_refused(asked, ["start", "duration"], pairs | strange())
    taken_or_refused(asked, SETTINGS, strange((4,)))


def test_goals_and_bounds_are_taken_or_refused(search):
    def law(kind, which, value):
        word, names = FIELDS[kind]
        answer(lambda: asked(**{word: kind(**{names[which % len(names)]: value})}))
        answer(lambda: asked(**{word: value}))

    kinds, which = some.sampled_from([st.Goal, st.Bounds]), some.integers(0, 19)
    search(law, kind=kinds, which=which, value=strange((4,)) | strange((3,)))
