"""The equations of motion that the nodes of a program evaluate."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...basics.errors import ModelError, PlanningError
from ...model.model import Model
from ..design import Design
from .body import function_of_design

if TYPE_CHECKING:
    import casadi as ca


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of motion as CasADi functions, and their source: "compiled" or "symbolic"."""

    forward: "ca.Function"
    inverse: "ca.Function"
    parameters: tuple  # further inputs after the usual ones
    source: str


def equations_of_motion(
    model: Model, source: str = "auto", design: Design | None = None
) -> Equations:
    """Return compiled functions if the scene has their second derivatives, else SX ones.

    With a design they are SX functions, whose last input is its numbers.
    """
    names = ("forward_dynamics", "inverse_dynamics")
    if design is not None and design.size:
        if source == "compiled":
            raise PlanningError(
                "dynamics: value 'compiled': compiled C takes the parameters of a design as known "
                "numbers: needs 'symbolic' or 'auto'"
            )
        forward, inverse = (function_of_design(model, design, name) for name in names)
        return Equations(forward, inverse, (), "symbolic")
    if source != "symbolic":
        try:
            forward, inverse = (model.casadi.external(name, derivatives=2) for name in names)
            return Equations(forward, inverse, (model.casadi.parameter_vector,), "compiled")
        except ModelError:
            if source == "compiled":
                raise
    forward, inverse = (getattr(model.casadi, name) for name in names)
    return Equations(forward, inverse, (), "symbolic")
