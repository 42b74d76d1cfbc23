"""Any value at any key of a scene is taken, or refused by the errors that say so."""

import copy
import datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

import serpentail as st
from serpentail.planning.nlp.rules import collocation_rule
from serpentail.scenes import plan, plan_keys, simulate_keys
from serpentail.scenes.simulate import scenario_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.scene import KEYS, NAMES
from tests.support import zoo
from tests.support.posed import posed

Q = [0, 0, 0.3, 1, 0, 0, 0, 0.1, 0.1]
SIMULATE = {
    "duration": 0.005,
    "output_step": 0.001,
    "start": {"height": 0.1, "bends": [0.1], "velocity": [0, 0, 1]},
    "legs": {"gamma": 3.67, "delta": -0.26, "moves": [{"at": 0.001, "delta": -1.0, "rate": 70.0}]},
    "reference": {"times": [0.0, 0.01], "bends": [[0.1], [0.2]]},
    "controller": {"kind": "damping", "damping": 1e-3},
}
PLAN = {
    "start": {"q": Q, "v": [0, 0, 1, 5, 0, 0, 0, 0]},
    "goal": {"attitude": "upright", "tail": [0.0, "free"], "turns": [0, 0]},
    "duration": 0.3,
    "bounds": {"angle": 3.0, "torque": 0.02},
}
GENERATE = {
    "name": "x",
    "kind": "articulated",
    "segments": 2,
    "links": 3,
    "functions": ["mass_matrix"],
    "parameters": {"tail_mass": 0.1, "hip": [0, 0, 0.0]},
    "contacts": ["feet"],
}
WORDS = ("", "free", "auto", "rk4", "pfl", "torques", "²", "\0", "a\nb", "x" * 1000)
HUGE = (10**18, 10**300, 10**400, -(10**400), 1e-320, 1e300)
VALUES = some.recursive(
    some.one_of(
        some.booleans(),
        some.integers(-3, 3),
        some.sampled_from(HUGE),
        some.floats(),
        some.sampled_from(WORDS),
        some.just(datetime.date(2000, 1, 1)),
    ),
    lambda inner: some.lists(inner, max_size=3) | some.dictionaries(some.just("a"), inner),
    max_leaves=6,
)


def places(table, keys):
    """Every path to a value of a table, and to keys that it may have."""
    found = [(key,) for key in keys]
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        found.append((key,))
        if isinstance(value, dict | list):
            found += [(key, *path) for path in places(value, ())]
    return found


def changed(table, path, value):
    """A copy of a table with a value at a path; missing tables are made."""
    part = table = copy.deepcopy(table)
    for key in path[:-1]:
        part = part.setdefault(key, {}) if isinstance(part, dict) else part[key]
    part[path[-1]] = value
    return table


def anything(table, keys):
    """A table with any value at one place."""
    return some.builds(changed, some.just(table), some.sampled_from(places(table, keys)), VALUES)


many = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
unusual = pytest.mark.filterwarnings(
    "ignore::RuntimeWarning", "ignore::serpentail.errors.UnusualSize"
)


@unusual
@many
@given(
    anything(GENERATE, (*KEYS, *NAMES)),
    anything(SIMULATE, simulate_keys.SIMULATE.keys),
    anything(PLAN, plan_keys.PLAN.keys),
)
def test_any_table_is_taken_or_refused(scene, motion, task):
    if isinstance(motion.get("start"), dict):
        motion["start"].pop("settle", None)  # which takes as long as it takes

    def planned():
        settings = posed(zoo.model("feet_tail"), **plan.plan_arguments(task))[1]
        collocation_rule(settings.rule, settings.degree)

    works = [
        (SceneError, lambda: parse_scene(scene, "x")),
        (st.SerpentailError, lambda: scenario_of(zoo.model("feet_tail"), motion, Path())),
        (st.PlanningError, planned),
    ]
    for refusal, work in works:
        try:
            work()
        except refusal as error:
            lines = str(error).splitlines()
            assert lines and all(lines) and max(map(len, lines)) < 900
