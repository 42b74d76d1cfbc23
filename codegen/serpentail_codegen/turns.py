"""Sines and cosines: a step goes in; whether its outputs are those of its inputs comes out.

The derivative of a cosine is minus its sine, which stands beside it.  So what reads sines and cosines can be
differentiated with respect to the angles: half the rows, and d(R x) = R dx + dalpha (e x R x) instead of four products.
"""

from dataclasses import dataclass

from .ir.step import Step


@dataclass(frozen=True)
class Turned:
    """Vectors of sines and cosines: for each scalar its angle, and the sign and place of its derivative."""

    angles: int
    scalars: tuple[tuple[int, int, int], ...]


def turned_by(step: Step) -> Turned | None:
    """Return how the outputs of a step follow from angles; None if they are not their sines and cosines."""
    if len(step.inputs) != 1 or len(step.outputs) != 1:
        return None
    kinds = [step.nodes[r] for r in step.results]
    scalars = []
    for op, *args in kinds:
        partner = ({"sin": "cos", "cos": "sin"}.get(op), *args)
        if partner not in kinds:
            return None
        scalars.append((step.nodes[args[0]][1], 1 if op == "sin" else -1, kinds.index(partner)))
    return Turned(step.inputs[0][1], tuple(scalars))
