"""Whatever an environment cannot be made of, or cannot take, is refused in one line."""

import sys

import numpy as np
import pytest

import serpentail as st

from ..support.models import model_folder

REFUSED = [
    ({"task": "cooking"}, st.SimulationError, "task: value 'cooking': needs 'righting' or"),
    ({"task": "rihgting"}, st.SimulationError, "did you mean 'righting'?"),
    ({"task": "landing"}, st.ModelError, "has contacts none: needs 'feet'"),
    ({"count": 0}, st.SimulationError, "count: value 0: needs a whole number from 1"),
    ({"count": 2.5}, st.SimulationError, "count: value 2.5"),
    ({"torque": 0}, st.SimulationError, "torque: value 0: needs a number above 0"),
    ({"torque": np.nan}, st.SimulationError, "torque: value nan"),
    ({"step": -1e-3}, st.SimulationError, "step: value -0.001"),
    ({"duration": np.inf}, st.SimulationError, "duration: value inf"),
    ({"tilt": 4}, st.SimulationError, "tilt: value 4: needs a number from 0 to 3.14"),
    ({"tilt": 90}, st.SimulationError, 'to 3.14159 rad, or "90 deg"'),
    ({"torque": "2 g"}, st.SimulationError, "torque: value '2 g': a mass where a torque"),
    ({"spin": "fast"}, st.SimulationError, "spin: value 'fast'"),
    ({"substeps": 0}, st.SimulationError, "substeps: value 0"),
    ({"spins": 1.0}, st.SimulationError, "righting has no setting 'spins'; it has"),
    ({"model": 3}, st.ModelError, "model: value 3: needs a model"),
]


@pytest.mark.parametrize("changed, error, line", REFUSED)
def test_what_is_wrong_is_named(flyer, changed, error, line):
    given = {"model": flyer, "task": "righting", "count": 3} | changed
    with pytest.raises(error) as raised:
        st.environments(**given)
    assert line in str(raised.value) and "\n" not in str(raised.value)


def test_a_flight_is_of_a_model_without_contacts(walker):
    with pytest.raises(st.ModelError, match=r"righting: .* needs none.*contacts=\[\]"):
        st.environment(walker, "righting")


@pytest.mark.parametrize("lacking", ["rollout", "implicit"])
def test_a_model_without_what_it_needs_says_which(lacking):
    names = ["forward_dynamics", "contact_points"]
    names += [name for name in ("rollout", "implicit") if name != lacking]
    task, contacts = "landing", {"contacts": ["feet"]}
    if lacking == "rollout":
        names, task, contacts = names[:1], "righting", {}
    model = st.load(model_folder(1, 1, functions=names, **contacts))
    with pytest.raises(st.ModelError, match=f"without '{lacking}'"):
        st.environment(model, task)


@pytest.mark.parametrize(
    "action, line",
    [
        (np.zeros((3, 3)), "action has shape (3, 3), not (3, 2)"),
        (np.full((3, 2), np.nan), "action[0, 0]: value nan"),
        ("left", "action: type <U4: needs real numbers"),
    ],
)
def test_actions_are_checked(flyer, action, line):
    worlds = st.environments(flyer, "righting", 3)
    worlds.reset(seed=0)
    with pytest.raises(st.StateError) as raised:
        worlds.step(action)
    assert line in str(raised.value)


def test_seeds_options_and_order_are_checked(flyer):
    worlds = st.environments(flyer, "righting", 3)
    with pytest.raises(st.SimulationError, match=r"call reset\(\) first"):
        worlds.step(np.zeros((3, 2)))
    for seed in (-1, 1.5, [1, 2]):
        with pytest.raises(st.SimulationError, match="seed: value"):
            worlds.reset(seed=seed)
    for made in (worlds, st.environment(flyer, "righting")):
        with pytest.raises(st.SimulationError, match="options: value"):
            made.reset(options={"height": 3})


def test_without_gymnasium_the_extra_is_named(flyer, monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(st.ExtraMissing, match=r'pip install "serpentail\[gym\]"'):
        st.environment(flyer, "righting")
