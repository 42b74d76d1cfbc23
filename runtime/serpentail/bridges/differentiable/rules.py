"""Which functions have derivatives in other tools, and which functions of a model these are."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """Jacobians of a function by its arguments in order: functions, and how many arguments each
    takes of the first; that by q is by its tangent.
    """

    jacobians: tuple[tuple[str, int], ...]


RULES = {
    "forward_dynamics": Rule((("forward_dynamics_derivatives", 3),)),
    "inverse_dynamics": Rule((("inverse_dynamics_derivatives", 3), ("mass_matrix", 1))),
}
