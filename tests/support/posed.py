"""Planning problems that are checked, but not solved."""

from unittest.mock import patch

import serpentail as st
from serpentail.planning import planner


def posed(model, **arguments):
    """The problem and the settings of a plan."""
    with patch.object(planner, "best_plan", lambda model, problem, settings: (problem, settings)):
        return st.plan(model, **arguments)
