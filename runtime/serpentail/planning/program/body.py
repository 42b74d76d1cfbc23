"""The model as a node sees it: parameters that the planner chooses are symbols of CasADi."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...model.model import Model
from ...model.parameters import TOTALS, ellipsoid_moments, merged
from ..design import Design

if TYPE_CHECKING:
    import casadi as ca


class BodyFunctions:
    """Parameters of a model by name, and its functions of SX operations with them.

    values (size,): symbols of the design's numbers, SI; None without a design.
    """

    def __init__(self, model: Model, design: Design, values: "ca.SX | None"):
        self.model = model
        self.parameters: Mapping[str, Any] = model.parameters
        self.vector: ca.SX | None = None
        if design.size:
            self.parameters = _completed(model, design.split(values))
            self.vector = _vector(model, self.parameters)

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what a function of the model gives for arguments."""
        if self.vector is None:
            return getattr(self.model.casadi, name)(*arguments)
        return self.model.casadi.symbolic(name)(*arguments, self.vector)

    def gravity(self) -> Any:
        """Gravitational acceleration (3,), world, its opposite: upward on level ground."""
        import casadi as ca

        if "gravity_vector" in self.parameters:
            return -_column(self.parameters["gravity_vector"])
        return ca.vertcat(0, 0, self.parameters["gravity"])


def _completed(model: Model, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return all parameters, those that follow from others too, as ``model.parameters``."""
    import casadi as ca

    values = merged(model.parameters, changes)
    for name, parts in TOTALS.items():
        own = [part for part in parts if part in values]
        if changes.keys() & set(own):
            values[name] = sum(ca.sum1(_column(values[part])) for part in own)
    if "link_radius" in values:
        links = model.manifest["dimensions"]["total"]
        values["link_inertia"] = ca.vertcat(*ellipsoid_moments(values, links))
    return values


def _vector(model: Model, values: Mapping[str, Any]) -> "ca.SX":
    """Return the parameters in the order in which functions take them."""
    import casadi as ca

    names = [p["name"] for p in model.manifest["parameters"] if p["in_struct"]]
    return ca.vertcat(*(_column(values[name]) for name in names))


def _column(value: Any) -> "ca.SX":
    import casadi as ca

    return ca.SX(ca.DM(value)) if isinstance(value, tuple) else ca.SX(value)
