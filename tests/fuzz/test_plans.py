"""What a plan is asked for is taken or refused before anything is derived."""

import numpy as np
from hypothesis import strategies as some

import serpentail as st
from tests.support import zoo
from tests.support.posed import posed

from .searching import answer
from .strange import strange

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


def asked(**given):
    """What `st.plan` checks first."""
    model = zoo.model("m2_n2")
    q = np.zeros(model.nq)
    q[3] = 1.0
    usual = {"start": (q, np.zeros(model.nv)), "goal": None, "duration": 0.5, "bounds": None}
    return posed(model, **usual | given)


def test_starts_and_durations_are_taken_or_refused(search):
    def law(which, value):
        answer(lambda: asked(**{which: value}))

    vectors = strange((11,))
    pairs = some.tuples(vectors, strange((10,))) | some.lists(vectors, max_size=3)
    search(law, which=some.sampled_from(["start", "duration"]), value=pairs | strange())


def test_goals_and_bounds_are_taken_or_refused(search):
    def law(kind, which, value):
        word, names = FIELDS[kind]
        answer(lambda: asked(**{word: kind(**{names[which % len(names)]: value})}))
        answer(lambda: asked(**{word: value}))

    kinds, which = some.sampled_from([st.Goal, st.Bounds]), some.integers(0, 19)
    search(law, kind=kinds, which=which, value=strange((4,)) | strange((3,)))


def test_settings_are_taken_or_refused(search):
    def law(name, value):
        answer(lambda: asked(**{name: value}))

    search(law, name=some.sampled_from(SETTINGS), value=strange((4,)))
