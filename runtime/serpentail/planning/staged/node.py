"""A model's compiled functions of a node, which the stages call."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...model.model import Model

FUNCTIONS = {  # of a model, by the names of Task in native/stage.h
    "rates": "airborne_rates",
    "slopes": "airborne_rates_derivatives",
    "curvature": "airborne_rates_hessian",
}


@dataclass(frozen=True, eq=False)
class NodeCode:
    """C functions by the names of Task, their workspace in doubles, and the model's parameters."""

    functions: dict[str, Any]
    work: int
    parameters: np.ndarray


def node_code(model: Model) -> NodeCode:
    """Return the C functions of a model; ``lacking`` has checked that it has all of them."""
    functions = {
        name: getattr(model.library, f"{model.name}_{function}")
        for name, function in FUNCTIONS.items()
    }
    work = max(model.manifest["work"][function] for function in FUNCTIONS.values())
    return NodeCode(functions, work, model.parameter_vector)


def lacking(model: Model) -> str | None:
    """Return what a model lacks for stages, and the remedy; None if it has all."""
    missing = [name for name in FUNCTIONS.values() if name not in model.generated]
    if missing:
        return f"the model lacks {', '.join(missing)}: add them to the scene's functions"
    if model.manifest["real"] != "double":
        return f"the model computes with {model.manifest['real']}: it needs double"
    if model.library is None:
        return "the model was loaded with compiled=False: load it again to use its C"
    return None
