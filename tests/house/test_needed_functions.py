"""The table of docs/models.md of functions that a scene needs is what the runtime asks for."""

import re
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.differentiable.rules import RULES
from serpentail.exporting.fmu import FLYING, TOUCHING
from serpentail.identification import identify
from serpentail.planning import best
from serpentail.planning.condensed import node
from serpentail.planning.predictive import settings
from serpentail_codegen.scene.signatures.table import ALL, EXACT_DERIVATIVES
from tests.support import zoo
from tests.support.rows import row

PAGE = Path(__file__).parents[2] / "docs" / "models.md"
FIRST, SECOND = EXACT_DERIVATIVES["forward_dynamics"]
ALL_DERIVATIVES = {part for orders in EXACT_DERIVATIVES.values() for o in orders for part in o}
OF_RULES = {name for rule in RULES.values() for name, _ in rule.jacobians}
EXPECTED = {
    "`st.plan`": set(best.NEEDED),
    "`st.plan`, up to seven times as fast": ALL_DERIVATIVES - set(best.NEEDED),
    '`st.plan(..., solver="fatrop")`': set(node.FUNCTIONS.values()),
    "`st.Mpc`": set(settings.NEEDED.values()),
    "`st.identify`": {*identify.FUNCTIONS, "forward_dynamics_parameter_derivatives"},
    '`casadi.external("x_dot", derivatives=1)`': {"forward_dynamics", *FIRST},
    '`casadi.external("x_dot", derivatives=2)`': set(SECOND) - set(FIRST),
    "`st.jax_functions`, `st.torch_functions`": {*RULES, *OF_RULES},
    "[an FMU](export.md)": {*FLYING, *TOUCHING},
}


def rows() -> dict[str, set[str]]:
    """The functions of each row, by its purpose."""
    section = PAGE.read_text(encoding="utf-8").partition("## Which functions")[2]
    section = section.partition("\n## ")[0]
    table = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("| ")]
    return {
        purpose.strip(): {name for name in re.findall(r"`(\w+)`", names) if name in ALL}
        for purpose, names in table[1:]
    }


def test_rows_of_simulations_are_what_their_errors_name():
    """A model with next to nothing is told all that it lacks."""
    model = zoo.model("bare")
    q, v = np.eye(model.nq)[3], np.zeros(model.nv)
    reference = ([0.0, 1.0], np.zeros((2, 2)))
    calls = {
        "`st.simulate`": (lambda: st.simulate(model, q, v), {"implicit"}),
        "`model.step`, `st.environment`": (lambda: model.step(q, v, [0, 0], 1e-3), {"implicit"}),
        "`st.Pfl`": (lambda: st.Pfl(model, reference), {"pfl"}),
    }
    for purpose, (call, at_times) in calls.items():
        with row(purpose), pytest.raises(st.ModelError) as caught:
            call()
        named = re.findall(r"'(\w+)'", str(caught.value).partition("(it has")[0])
        assert rows()[purpose] - {*model.generated} == set(named) | at_times, purpose
    assert rows().keys() == EXPECTED.keys() | calls.keys()


def test_other_rows_are_what_the_runtime_needs():
    for purpose, names in EXPECTED.items():
        with row(purpose):
            assert rows()[purpose] == names
