"""Arrays of sines and cosines: they are differentiated with respect to their angles.

The derivative of a cosine is minus the sine that stands beside it.  A step that reads both can
therefore take the tangents of the angles in place of those of the sines and cosines: half as many,
and d(R x) = R dx + dalpha (e x R x) in place of four products.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..ir.dataflow import names, reads, writes
from ..ir.program import Apply, Index, Program, Ref, statements
from ..ir.step import Step

PARTNERS = {"sin": "cos", "cos": "sin"}


@dataclass(frozen=True)
class SinesAndCosines:
    """How the scalars of a vector follow from angles.

    angles: the number of angles.
    scalars: of each scalar its angle, and the sign and the position of its derivative.
    """

    angles: int
    scalars: tuple[tuple[int, int, int], ...]


AngleInputs = frozenset[tuple[str, SinesAndCosines]]  # the inputs of a step that are such


def sines_and_cosines_of(step: Step) -> SinesAndCosines | None:
    """Return how a step's output follows from angles; None if it is not their sines and cosines."""
    if len(step.inputs) != 1 or len(step.outputs) != 1:
        return None
    operations = [step.nodes[r] for r in step.results]
    scalars = []
    for op, *args in operations:
        partner = (PARTNERS.get(op), *args)
        if partner not in operations:
            return None
        angle = step.nodes[args[0]][1]
        scalars.append((angle, 1 if op == "sin" else -1, operations.index(partner)))
    return SinesAndCosines(step.inputs[0][1], tuple(scalars))


@dataclass(frozen=True)
class SinesAndCosinesArray:
    """An array of sines and cosines that one statement writes, in a loop or alone.

    kind: how they follow from angles.
    target: where the statement writes them.
    source: where it reads the angles.
    """

    kind: SinesAndCosines
    target: Ref
    source: Ref

    def angles(self, ref: Ref) -> Ref:
        """Return the angles that belong to the sines and cosines which a reference reads."""
        # the iteration of the writing loop in which these were written
        (variable, step), *_ = self.target.offset.terms
        distance = ref.offset + self.target.offset.offset * -1
        terms = tuple((name, factor // step) for name, factor in distance.terms)
        iteration = Index(terms, distance.offset // step)

        # what that iteration read
        factor = dict(self.source.offset.terms)[variable]
        return replace(self.source, offset=iteration * factor + self.source.offset.offset)


def sines_and_cosines_arrays(program: Program) -> dict[str, SinesAndCosinesArray]:
    """Return the arrays that hold nothing but the sines and cosines of one loop, by name."""
    candidates = {}
    for statement, _ in statements(program.body):
        if isinstance(statement, Apply) and not any(statement.adds):
            kind = sines_and_cosines_of(statement.step)
            if kind:
                (source,), (target,) = statement.reads, statement.writes
                candidates[target.array.name] = SinesAndCosinesArray(kind, target, source)
    return {
        name: array
        for name, array in candidates.items()
        if _written_once(program, array) and _read_as_written(program, array)
    }


def angle_inputs(
    by_angles: Mapping[str, SinesAndCosinesArray], inputs: Mapping[str, Ref]
) -> dict[str, SinesAndCosinesArray]:
    """Return the arrays that a step reads sines and cosines of, by the names of its inputs."""
    arrays = {name: by_angles.get(ref.array.name) for name, ref in inputs.items()}
    return {name: array for name, array in arrays.items() if array}


def kinds(arrays: Mapping[str, SinesAndCosinesArray]) -> AngleInputs:
    """Return how the inputs of a step follow from angles, for its derivatives."""
    return frozenset((name, array.kind) for name, array in arrays.items())


def _written_once(program: Program, array: SinesAndCosinesArray) -> bool:
    """Tell if an array is local, and written by one statement in one loop over the angles."""
    name = array.target.array.name
    if array.target.array.role != "local":
        return False
    writers = sum(name in names(writes(s)) for s, _ in statements(program.body))
    if writers != 1:
        return False
    variables = [variable for variable, _ in array.target.offset.terms]
    return len(variables) == 1 and variables == [v for v, _ in array.source.offset.terms]


def _read_as_written(program: Program, array: SinesAndCosinesArray) -> bool:
    """Tell if all that reads an array are steps, which take the vectors that were written."""
    for statement, _ in statements(program.body):
        for ref in reads(statement):
            if ref.array.name != array.target.array.name:
                continue
            if not isinstance(statement, Apply) or not _is_a_written_vector(ref, array.target):
                return False
    return True


def _is_a_written_vector(ref: Ref, target: Ref) -> bool:
    """Tell if a reference always means what one iteration writes to the target."""
    if ref.size != target.size or ref.stride != target.stride:
        return False
    ((_, step),) = target.offset.terms
    distances = [factor for _, factor in ref.offset.terms]
    distances.append(ref.offset.offset - target.offset.offset)
    return step != 0 and all(distance % step == 0 for distance in distances)
