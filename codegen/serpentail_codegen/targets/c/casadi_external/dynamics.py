"""The C functions for derivatives of the dynamics, and the zeros of these derivatives."""

from collections.abc import Collection
from dataclasses import dataclass

from serpentail_scene.signatures.table import SIGNATURES

# first number with an effect: neither the position of B nor its velocity
# matters
MOVING = {"q": 3, "v": 3}


def moves(name: str, k: int) -> bool:
    """Tell if some output depends on number k of an input."""
    return k >= MOVING.get(name, 0)


@dataclass(frozen=True)
class DynamicsDerivatives:
    """Inverse or forward dynamics, and the C functions that compute its derivatives."""

    name: str
    last: str
    gives: str
    jacobian: tuple[str, ...]
    adjoint: tuple[str, ...]
    hessian: tuple[str, ...]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs with derivatives."""
        return ("q", "v", self.last)

    def has(self, works: Collection[str], kind: str) -> bool:
        """Tell if the scene has the functions that a derivative needs."""
        parts = {
            "jac_": self.jacobian,
            "adj1_": self.adjoint,
            "jac_adj1_": self.adjoint + self.jacobian + self.hessian,
        }
        return {self.name, *parts[kind]} <= set(works)

    def by_parameters(self, works: Collection[str]) -> bool:
        """Tell if there are derivatives with respect to the parameters."""
        return f"{self.name}_parameter_derivatives" in works

    def depends(self, on: str, row: int, column: int) -> bool:
        """Tell if output ``row`` depends on input ``column``."""
        if on == "v_dot":  # H: the mass in its first corner
            return row == column or max(row, column) >= 3
        if on == "q" and self.name == "forward_dynamics" and column < 7:
            return row < 3 <= column  # the acceleration of B turns with the torso
        return moves(on, column)

    def curved(self, a: str, b: str, row: int, column: int) -> bool:
        """Tell if the weighted outputs have a second derivative by a[row] and b[column]."""
        if b == f"adj_{self.gives}":
            return self.depends(a, column, row)
        return moves(a, row) and moves(b, column)


DYNAMICS = (
    DynamicsDerivatives(
        "inverse_dynamics", "v_dot", "force", *SIGNATURES["inverse_dynamics"].exact
    ),
    DynamicsDerivatives("forward_dynamics", "tau", "v_dot", *SIGNATURES["forward_dynamics"].exact),
)
