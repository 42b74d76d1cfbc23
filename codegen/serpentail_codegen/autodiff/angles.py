"""Sines and cosines: a step goes in; whether its outputs are those of its inputs comes out.

The derivative of a cosine is minus its sine, which stands beside it.  So what reads sines and
cosines can be differentiated with respect to the angles: half the rows, and d(R x) = R dx + dalpha
(e x R x) instead of four products.
"""

from dataclasses import dataclass, replace

from ..ir.dataflow import names, reads, writes
from ..ir.program import Apply, Index, Program, Ref, statements
from ..ir.step import Step


@dataclass(frozen=True)
class SinesAndCosines:
    """Vectors of sines and cosines: for each scalar its angle, and the sign and place of its
    derivative.
    """

    angles: int
    scalars: tuple[tuple[int, int, int], ...]


def sines_and_cosines_of(step: Step) -> SinesAndCosines | None:
    """Return how the outputs of a step follow from angles; None if they are not their sines and
    cosines.
    """
    if len(step.inputs) != 1 or len(step.outputs) != 1:
        return None
    kinds = [step.nodes[r] for r in step.results]
    scalars = []
    for op, *args in kinds:
        partner = ({"sin": "cos", "cos": "sin"}.get(op), *args)
        if partner not in kinds:
            return None
        scalars.append((step.nodes[args[0]][1], 1 if op == "sin" else -1, kinds.index(partner)))
    return SinesAndCosines(step.inputs[0][1], tuple(scalars))


@dataclass(frozen=True)
class SinesAndCosinesArray:
    """An array of sines and cosines, and where it is written from which angles."""

    kind: SinesAndCosines
    target: Ref
    source: Ref

    def angles(self, ref: Ref) -> Ref:
        """Return the angles of what a reference reads: the writer's, in the iteration that
        wrote it.
        """
        (variable, step), *_ = self.target.offset.terms or (("", 0),)
        distance = ref.offset + self.target.offset.offset * -1
        iteration = Index(
            tuple((name, factor // step) for name, factor in distance.terms),
            distance.offset // step,
        )
        factor = dict(self.source.offset.terms)[variable]
        return replace(self.source, offset=iteration * factor + self.source.offset.offset)


def sines_and_cosines_arrays(program: Program) -> dict[str, SinesAndCosinesArray]:
    """Return the arrays of sines and cosines that are written once and read by steps, vector by
    vector.
    """
    out = {}
    for statement, _ in statements(program.body):
        kind = sines_and_cosines_of(statement.step) if isinstance(statement, Apply) else None
        if kind and not any(statement.adds):
            (source,), (target,) = statement.reads, statement.writes
            out[target.array.name] = SinesAndCosinesArray(kind, target, source)
    return {name: found for name, found in out.items() if _plain(program, found)}


def _plain(program: Program, found: SinesAndCosinesArray) -> bool:
    """Tell if an array is local, written by one step in one loop, and read as it was written."""
    name, terms = found.target.array.name, found.target.offset.terms
    writers = sum(name in names(writes(s)) for s, _ in statements(program.body))
    if (
        found.target.array.role != "local"
        or writers != 1
        or len(terms) > 1
        or len(found.source.offset.terms) > 1
    ):
        return False
    step = dict(terms).get(terms[0][0] if terms else "", 0)
    for statement, _ in statements(program.body):
        for ref in reads(statement):
            if ref.array.name == name and not (
                isinstance(statement, Apply)
                and ref.size == found.target.size
                and _multiple(ref, found.target, step)
            ):
                return False
    return bool(terms) and dict(found.source.offset.terms).keys() == dict(terms).keys()


def _multiple(ref: Ref, target: Ref, step: int) -> bool:
    distance = [factor for _, factor in ref.offset.terms] + [
        ref.offset.offset - target.offset.offset
    ]
    return (
        step != 0 and ref.stride == target.stride and all(number % step == 0 for number in distance)
    )
