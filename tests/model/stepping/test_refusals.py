"""Whatever a step cannot take is refused in one line that names it."""

import numpy as np
import pytest

import serpentail as st

from ...simulation.rollouts.many import WANTED, rat, starts, tail
from ...support.models import model_folder

H = 1e-3
RUNS = 9


@pytest.fixture
def sound():
    q, v = starts(tail(), RUNS)
    return {"q": q, "v": v, "tau": np.zeros((RUNS, 4)), "h": H}


def replaced(array, index, value):
    array = array.copy()
    array[index] = value
    return array


REFUSED = [
    ({"h": 0.0}, st.SimulationError, "step: h: value 0.0: needs a number above 0"),
    ({"h": -1e-3}, st.SimulationError, "step: h: value -0.001"),
    ({"h": np.nan}, st.SimulationError, "step: h: value nan"),
    ({"h": np.inf}, st.SimulationError, "step: h: value inf"),
    ({"h": "1 ms"}, st.SimulationError, "step: h: value '1 ms'"),
    ({"h": [1e-3] * RUNS}, st.SimulationError, "step: h: value"),
    ({"steps": 0}, st.SimulationError, "step: steps: value 0: needs a whole number from 1"),
    ({"steps": 2.0}, st.SimulationError, "step: steps: value 2.0"),
    ({"steps": True}, st.SimulationError, "step: steps: value True"),
    ({"steps": 10**9}, st.SimulationError, "step: steps"),
    ({"threads": 0}, st.SimulationError, "step: threads: value 0"),
    ({"method": "rk5"}, st.SimulationError, "step: method: value 'rk5': did you mean 'rk4'?"),
    ({"stepz": 2}, st.SimulationError, "step: setting: value 'stepz': did you mean 'steps'?"),
    ({"q": np.zeros(10)}, st.StateError, "step: q has shape (10,), not (11,) or (k, 11)"),
    ({"q": np.zeros((0, 11))}, st.StateError, "step: q has shape (0, 11)"),
    ({"v": np.zeros((RUNS, 2, 10))}, st.StateError, "step: v has shape (9, 2, 10)"),
    ({"tau": 0.0}, st.StateError, "step: tau has shape ()"),
    ({"tau": ["a"] * 4}, st.StateError, "step: tau: type <U1: needs real numbers"),
    ({"v": np.zeros((8, 10))}, st.StateError, "numbers of runs differ (q 9, v 8, tau 9)"),
    ({"v": replaced(np.zeros((RUNS, 10)), (3, 2), np.nan)}, st.StateError, "step: v[3, 2]: value"),
    ({"tau": replaced(np.zeros(4), 1, np.inf)}, st.StateError, "step: tau[1]: value inf"),
    ({"bristles": np.zeros(4)}, st.StateError, "step: bristles: this model has none"),
    ({"legs": np.zeros(8)}, st.StateError, "step: legs: this model has none"),
    ({"parameters": {"tail_mass": [1.0]}}, st.ModelError, "tail_mass: value [1.0]"),
    ({"parameters": {"tail_mas": [1.0]}}, st.ModelError, "tail_mas: no such parameter"),
    ({"parameters": 3}, st.ModelError, "parameters: value 3: needs a mapping"),
    ({"out": np.zeros((2, RUNS, 11))}, st.StateError, "step: out: needs 2 arrays, for q, v"),
    ({"statuses": np.zeros(RUNS)}, st.StateError, "step: statuses: value"),
    ({"statuses": np.zeros(3, np.intc)}, st.StateError, "of shape (9,)"),
]


@pytest.mark.parametrize("changed, error, line", REFUSED)
def test_what_is_wrong_is_named(sound, changed, error, line):
    given = sound | changed
    arguments = [given.pop(name) for name in ("q", "v", "tau", "h")]
    with pytest.raises(error) as raised:
        tail().step(*arguments, **given)
    assert line in str(raised.value) and "\n" not in str(raised.value)


def test_a_quaternion_without_direction_is_none(sound):
    sound["q"][5, 3:7] = 0
    with pytest.raises(st.StateError, match=r"q\[3:7\] of run 5 is the zero quaternion"):
        tail().step(**sound)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda a: a.astype(np.float32),
        lambda a: a[:4],
        lambda a: a.T.copy().T,
        lambda a: a.tolist(),
        lambda a: np.broadcast_to(a[0], a.shape),
    ],
)
def test_results_go_into_sound_arrays_only(sound, spoil):
    out = [sound["q"].copy(), spoil(sound["v"])]
    with pytest.raises(st.StateError, match=r"step: out: v: value .*needs a writeable C array"):
        tail().step(**sound, out=out)


def test_the_ground_needs_bristles_and_legs():
    q, v = starts(rat(), 2)
    points = 2 * sum(rat().contacts.values())
    with pytest.raises(st.StateError, match=rf"bristles: none: .* give \(k, {points}\) in m"):
        rat().step(q, v, np.zeros(2), H, legs=np.zeros(8))
    with pytest.raises(st.StateError, match=r"legs: none: .* give 4 angles, 4 rates"):
        rat().step(q, v, np.zeros(2), H, bristles=np.zeros(points))


@pytest.mark.parametrize("lacking", ["rollout", "implicit"])
def test_a_model_without_what_it_needs_says_which(lacking):
    names = ["forward_dynamics"] + [n for n in ("rollout", "implicit") if n != lacking]
    names = names if lacking == "rollout" else [n for n in WANTED if n != "implicit"]
    options = {"contacts": ["feet", "tail"]} if lacking == "implicit" else {}
    folder = model_folder(1, 3 if lacking == "implicit" else 1, functions=names, **options)
    model = st.load(folder)
    with pytest.raises(st.ModelError, match=f"without '{lacking}'.* add it to `functions`"):
        model.step(np.zeros(model.nq), np.zeros(model.nv), np.zeros(2), H)


def test_a_model_that_is_not_compiled_says_so(sound):
    model = st.load(tail().folder, compiled=False)
    with pytest.raises(st.ModelError, match="was loaded with compiled=False"):
        model.step(**sound)


def test_parameters_made_before_are_of_as_many_runs(sound):
    made = tail().parameters_of_runs({"tail_mass": np.full(3, 0.01)}, 3)
    with pytest.raises(st.StateError, match="parameters of 3 runs, not of 9"):
        tail().step(**sound, parameters=made)


def test_a_folder_of_an_older_generator_is_to_be_made_again():
    with pytest.raises(st.ModelError, match=r"has no C function tail_hops, an older .*generate"):
        tail().batch_library.rollouts.function("tail_hops")
