"""Whatever they are given, functions and makers answer with finite numbers, or refuse."""

import inspect

import numpy as np
import pytest
from hypothesis import strategies as some

import serpentail as st
from tests.motion.conftest import fields, motion
from tests.support import zoo
from tests.support.forms import SOUND
from tests.support.posed import posed
from tests.support.rows import row

from .conftest import answer, plain, strange

MODELS = some.sampled_from(["ground_m1_n1", "arcs1", "single"])


@some.composite
def calls(draw):
    """Return a method of a model that evaluates, with moderate arguments."""
    model = zoo.model(draw(MODELS))
    functions = model.manifest["functions"]
    name = draw(some.sampled_from(sorted(name for name in functions if hasattr(model, name))))
    ports = {port["name"]: tuple(port["shape"]) for port in functions[name]["inputs"]}
    words = inspect.signature(getattr(model, name)).parameters
    return getattr(model, name), {word: draw(plain(ports[word])) for word in words if word in ports}


def test_a_call_is_answered_or_refused(search):
    """One argument or all may be strange."""

    def law(call, wrong, every, data):
        method, arguments = call
        for k, (word, x) in enumerate(arguments.items()):
            if every or k == wrong % len(arguments):
                arguments = arguments | {word: data.draw(strange(x.shape))}
        answer(method, **arguments)

    search(law, call=calls(), wrong=some.integers(0, 5), every=some.booleans(), data=some.data())


def test_a_step_is_made_or_refused(search):
    """One argument or all may be strange; one run, or nine."""

    def law(name, many, wrong, every, steps, data):
        model = zoo.model(name)
        sizes = {"q": model.nq, "v": model.nv, "tau": model.nv - 6}
        if model.contacts:
            sizes |= {"bristles": 2 * sum(model.contacts.values()), "legs": 8}
        given = {"h": 1e-4, "steps": steps}
        for k, (word, size) in enumerate(sizes.items()):
            shape = (9, size) if many else (size,)
            given[word] = data.draw(strange(shape) if every or k == wrong else plain(shape))
        if wrong == len(sizes):
            given["h"] = data.draw(strange())
        answer(model.step, **given)

    names, steps = some.sampled_from(["ground_m1_n1", "m1_n1"]), some.sampled_from([1, 3])
    how = {"wrong": some.integers(0, 5), "every": some.booleans(), "data": some.data()}
    search(law, name=names, many=some.booleans(), steps=steps, **how)


def test_parameters_are_taken_or_refused(search):
    """What is taken gives a model that evaluates, and leaves this one as it was."""

    def law(of, which, value):
        model = zoo.model(of)
        name = [*model.parameters, "mass"][which % (len(model.parameters) + 1)]
        state = {"q": np.full(model.nq, 0.3), "v": np.full(model.nv, 0.1)}
        state["tau"] = np.zeros(model.nv - 6)
        before = model.forward_dynamics(**state)
        other = answer(model.with_parameters, **{name: value})
        if other is not None:
            answer(other.forward_dynamics, **state)
            assert np.isfinite(other.parameter_vector).all()
        answer(st.load, model.folder, {name: value}, compiled=False)
        np.testing.assert_array_equal(model.forward_dynamics(**state), before)

    search(law, of=MODELS, which=some.integers(0, 99), value=strange((3,)))


def test_models_and_loads_at_points_are_made_or_refused(search):
    def law(name, which, value):
        model = zoo.model(name)
        given = {"folder": model.folder, "parameters": {}, "profile": None, "compiled": False}
        if which in given:
            answer(st.load, **given | {which: value})
        else:
            answer(model.external_force, **{which: value})

    words = ["folder", "parameters", "profile", "compiled", "force", "moment", "tail"]
    value = strange() | strange((3,))
    search(law, name=MODELS, which=some.sampled_from(words), value=value)


# Trajectories.

FLIGHT = motion(np.linspace(0, 0.4, 21), segments=1)
REFUSED = (ValueError, st.SerpentailError)
INSIDE = some.lists(some.floats(0, 0.4), min_size=1, max_size=5, unique=True).map(sorted)


def test_fields_are_taken_or_refused(search):
    own = fields(FLIGHT)

    def law(name, value):
        answer(st.Trajectory, refusals=REFUSED, **own | {name: value})

    names, value = some.sampled_from([*own, "contact"]), strange((21,)) | strange((21, 9))
    search(law, name=names, value=value)


def test_the_same_numbers_make_the_same_motion():
    given = {name: x for name, x in fields(FLIGHT).items() if name != "info"}
    given = {name: x.astype(np.float32).astype(float) for name, x in given.items()}
    for form, formed in (SOUND | {"single": np.float32}).items():
        found = st.Trajectory(**{name: formed(x) for name, x in given.items()})
        for name, expected in given.items():
            array = getattr(found, name)
            with row(form, name):
                np.testing.assert_array_equal(array, expected)
                assert type(array) is np.ndarray and array.flags.c_contiguous


def test_new_samples_are_one_by_one_what_they_are_together(search):
    def law(times, odd):
        answer(FLIGHT.resample, odd, refusals=REFUSED)
        together = answer(FLIGHT.resample, times)
        for k, t in enumerate(times):
            alone = answer(FLIGHT.resample, [t])
            for name in ("q", "v", "tau", "kinetic"):
                one, same = getattr(alone, name)[0], getattr(together, name)[k]
                np.testing.assert_allclose(one, same, rtol=0, atol=1e-13)

    search(law, times=INSIDE, odd=strange((3,)) | some.lists(some.floats(-0.1, 0.5), max_size=5))


def test_names_of_files_are_taken_or_refused(search, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = some.text(some.characters(codec="utf-8", exclude_characters="/"), max_size=300)

    def law(method, name):
        found = answer(getattr(FLIGHT, method), name, refusals=(*REFUSED, TypeError))
        assert found is None or found.stat().st_size > 100
        if found is not None and method == "save":
            np.testing.assert_array_equal(st.Trajectory.load(found).q, FLIGHT.q)
        assert {p.resolve().parent for p in tmp_path.iterdir()} <= {tmp_path.resolve()}

    methods = some.sampled_from(["save", "to_csv", "to_netcdf"])
    search(law, method=methods, name=names | some.none() | some.integers())


# Simulations, and what acts in them.

CUT = ("tsit5", "ros34pw2", "switching", "dop853", "lsoda")  # methods that take most_steps
METHODS = some.sampled_from([*CUT, "rk4", "implicit_euler", "auto"])
SPAN = 0.002  # s
# numbers of a setting: steps of less than this and more than nothing would take for ever
SHORT = 1e-5
NOT_ENDLESS = strange((3,)).filter(lambda x: not (isinstance(x, float) and 0 < abs(x) < SHORT))
TIMES = NOT_ENDLESS.filter(lambda x: not (isinstance(x, int | float) and x > SPAN))


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


def test_starts_durations_settings_goals_and_bounds_of_plans_are_taken_or_refused(search):
    def law(timed, pair, name, field, value):
        answer(asked, **{timed: pair})
        answer(asked, **{name: value})
        word, kind, part = field
        answer(lambda: asked(**{word: kind(**{part: value})}))
        answer(asked, **{word: value})

    vectors = strange((11,))
    pair = some.tuples(vectors, strange((10,))) | some.lists(vectors, max_size=3) | strange()
    settings = sorted({*inspect.signature(st.plan).parameters} - {"model", "start", "watch"})
    kinds = {"goal": st.Goal, "bounds": st.Bounds}
    fields = [(word, kind, part) for word, kind in kinds.items() for part in kind.__annotations__]
    how = {"timed": some.sampled_from(["start", "duration"]), "pair": pair}
    how |= {"name": some.sampled_from(settings), "field": some.sampled_from(fields)}
    search(law, value=strange((4,)) | strange((3,)), **how)
