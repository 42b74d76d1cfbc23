"""Whatever a step cannot take is refused in one line that names it."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo

from ...support.rows import row

H, RUNS = 1e-3, 9


@pytest.fixture
def tail():
    return zoo.model("m2_n2")


@pytest.fixture
def sound():
    q = np.zeros((RUNS, 11))
    q[:, 3] = 1
    return {"q": q, "v": np.zeros((RUNS, 10)), "tau": np.zeros((RUNS, 4)), "h": H}


def replaced(shape, index, value):
    array = np.zeros(shape)
    array[index] = value
    return array


ERRORS = dict.fromkeys(("h", "steps", "threads", "method", "stepz"), st.SimulationError)
ERRORS |= {"parameters": st.ModelError}  # all others: StateError
REFUSED = [
    *(("h", value, f"h: value {value}") for value in (0.0, -1e-3, np.nan, np.inf)),
    ("h", "1 ms", "h: value '1 ms'"),
    ("h", [1e-3] * RUNS, "h: value [0.001, "),
    *(("steps", value, f"steps: value {value}") for value in (0, 2.0, True, 10_001)),
    ("threads", 0, "threads: value 0"),
    ("method", "rk5", "method: value 'rk5': did you mean 'rk4'?"),
    ("stepz", 2, "'stepz': did you mean 'steps'?"),
    ("q", np.zeros(10), "q has shape (10,), not (11,) or (k, 11)"),
    ("q", np.zeros((0, 11)), "q has shape (0, 11)"),
    ("q", replaced((RUNS, 11), (slice(5), 3), 1), "q[3:7] of run 5 is the zero"),
    ("v", np.zeros((RUNS, 2, 10)), "v has shape (9, 2, 10)"),
    ("tau", 0.0, "tau has shape ()"),
    ("tau", ["a"] * 4, "tau: type <U1"),
    ("v", np.zeros((8, 10)), "numbers of runs differ (q 9, v 8, tau 9)"),
    ("v", replaced((RUNS, 10), (3, 2), np.nan), "v[3, 2]: value nan"),
    ("tau", replaced(4, 1, np.inf), "tau[1]: value inf"),
    ("bristles", np.zeros(4), "bristles: this model has none"),
    ("legs", np.zeros(8), "legs: this model has none"),
    ("parameters", {"tail_mass": [1.0]}, "tail_mass: value [1.0]"),
    ("parameters", {"tail_mas": [1.0]}, "tail_mas: no such parameter"),
    ("parameters", 3, "parameters: value 3"),
    ("out", np.zeros((2, RUNS, 11)), "out: needs 2 arrays, for q, v"),
    ("out", [np.zeros((RUNS, 11))], "out: needs 2 arrays"),
    ("statuses", np.zeros(RUNS), "statuses: value"),
    ("statuses", np.zeros(3, np.intc), "of shape (9,)"),
]
UNSOUND = {
    "of another type": lambda a: a.astype(np.float32),
    "short": lambda a: a[:4],
    "Fortran order": lambda a: a.T.copy().T,
    "no array": lambda a: a.tolist(),
    "not writeable": lambda a: np.broadcast_to(a[0], a.shape),
}


def test_what_is_wrong_is_named(tail, sound):
    for name, value, words in REFUSED:
        given = sound | {name: value}
        arguments = [given.pop(each) for each in ("q", "v", "tau", "h")]
        with row(name, value):
            with pytest.raises(ERRORS.get(name, st.StateError)) as raised:
                tail.step(*arguments, **given)
            assert words in str(raised.value) and "\n" not in str(raised.value)
    for name, spoil in UNSOUND.items():
        out = [sound["q"].copy(), spoil(sound["v"])]
        with row(name), pytest.raises(st.StateError, match=r"step: out: v: value .*writeable C"):
            tail.step(**sound, out=out)
    made = tail.parameters_of_runs({"tail_mass": np.full(3, 0.01)}, 3)
    with pytest.raises(st.StateError, match="parameters of 3 runs, not of 9"):
        tail.step(**sound, parameters=made)


def test_the_ground_needs_bristles_and_legs():
    model = zoo.model("feet_tail")
    q, v, points = [0, 0, 1, 1, 0, 0, 0, 0, 0], np.zeros(8), 2 * sum(model.contacts.values())
    with pytest.raises(st.StateError, match=rf"bristles: none: .*\(k, {points}\)"):
        model.step(q, v, np.zeros(2), H, legs=np.zeros(8))
    with pytest.raises(st.StateError, match="legs: none: "):
        model.step(q, v, np.zeros(2), H, bristles=np.zeros(points))


def test_a_model_without_what_it_needs_says_which(tail, sound):
    bare = zoo.model("bare")
    state = [0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2), H
    with pytest.raises(st.ModelError, match=r"without 'rollout'.*`functions`"):
        bare.step(*state)
    with pytest.raises(st.ModelError, match="without 'rollout', 'implicit'"):
        bare.step(*state, method="implicit_euler")
    with pytest.raises(st.ModelError, match="step: fixed has a fixed base"):
        zoo.model("fixed").step(np.zeros(4), np.zeros(4), np.zeros(4), H)
    with pytest.raises(st.ModelError, match="was loaded with compiled=False"):
        st.load(zoo.folder("m2_n2"), compiled=False).step(**sound)
    with pytest.raises(st.ModelError, match="no C function tail_hops, an older"):
        tail.batch_library.rollouts.function("tail_hops")
