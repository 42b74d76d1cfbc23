"""Planning problems that are checked, but not solved."""

from unittest.mock import patch

from serpentail.planning import planner
from tests.support.tumbling import keyed


def posed(model, ask=keyed, **arguments):
    """The problem and the settings of a plan; ask: st.plan for its own arguments alone."""
    with patch.object(planner, "best_plan", lambda model, problem, settings: (problem, settings)):
        return ask(model, **arguments)
