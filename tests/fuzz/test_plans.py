"""What a plan is asked for is taken or refused before anything is derived."""

import numpy as np
import pytest
from hypothesis import strategies as some

import serpentail as st
from tests.support.models import model_folder
from tests.support.posed import posed

from .searching import answer
from .strange import strange

FIELDS = {st.Goal: ("attitude", "torso_rate", "tail", "tail_rate", "turns")}
FIELDS[st.Bounds] = ("angle", "rate", "torque", "torque_rate")
SETTINGS = (
    *("objective", "smoothing", "damping", "path", "formulation", "attitude"),
    *("rule", "degree", "intervals", "most_intervals", "tolerance", "rounds", "solver", "options"),
    *("guess", "guess_damping", "multi_start", "retries", "seed", "dynamics", "time_limit"),
    *("track", "unknown"),
)


@pytest.fixture(scope="module")
def model():
    functions = ["mass_matrix", "inverse_dynamics", "forward_dynamics", "rollout"]
    return st.load(model_folder(2, 1, functions=functions), compiled=False)


def asked(model, start=None, goal=None, duration=0.5, bounds=None, **settings):
    """What `st.plan` checks first."""
    q = np.zeros(model.nq)
    q[3] = 1.0
    upright = (q, np.zeros(model.nv)) if start is None else start
    given = {"start": upright, "goal": goal, "duration": duration, "bounds": bounds}
    return posed(model, **given | settings)


def test_starts_and_durations_are_taken_or_refused(model, search):
    def law(which, value):
        answer(lambda: asked(model, **{which: value}))

    vectors = strange((model.nq,))
    pairs = some.tuples(vectors, strange((model.nv,))) | some.lists(vectors, max_size=3)
    search(law, which=some.sampled_from(["start", "duration"]), value=pairs | strange())


@pytest.mark.parametrize("kind", FIELDS, ids=lambda kind: kind.__name__)
def test_goals_and_bounds_are_taken_or_refused(model, search, kind):
    def law(name, value):
        which = {st.Goal: "goal", st.Bounds: "bounds"}[kind]
        answer(lambda: asked(model, **{which: kind(**{name: value})}))
        answer(lambda: asked(model, **{which: value}))

    search(law, name=some.sampled_from(FIELDS[kind]), value=strange((4,)) | strange((3,)))


def test_settings_are_taken_or_refused(model, search):
    def law(name, value):
        answer(lambda: asked(model, **{name: value}))

    search(law, name=some.sampled_from(SETTINGS), value=strange((4,)))
