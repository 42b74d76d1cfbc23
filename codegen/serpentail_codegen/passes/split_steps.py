"""Splits steps in two: the part that all directions of differentiation share, and the part of each
direction.
"""

from dataclasses import dataclass, replace
from functools import cache

from ..ir.step import Step, compacted, specialised
from ..ir.tape import live_nodes, operands

SLOPES = "slopes"  # the vector that the first part hands to the second


@dataclass(frozen=True)
class Parted:
    """A step in two parts: the one that all directions share, and the one of each direction.

    slopes: how many numbers the first part hands to the second.
    """

    shared: Step
    each: Step
    slopes: int


@cache
def parted(step: Step, wide: frozenset[str], overwritten: frozenset[str]) -> Parted:
    """Split a step by its wide vectors.

    Of the narrow inputs the second part reads those that are not ``overwritten`` by the first.
    """
    vector = [name for name, size in step.inputs for _ in range(size)]
    handed = {n: k for k, n in enumerate(_handed(step, wide, overwritten))}
    narrow, each = _results(step, wide)
    slopes = ((SLOPES, len(handed)),) if handed else ()
    shared = replace(
        step,
        name=f"{step.name}_shared",
        outputs=(*(output for output in step.outputs if output[0] not in wide), *slopes),
        results=(*narrow, *handed),
    )

    # the handed vector is an input of the second part
    nodes = [
        ("input", len(vector) + handed[n]) if n in handed else node
        for n, node in enumerate(step.nodes)
    ]
    turn = Step(
        f"{step.name}_each",
        step.doc,
        (*step.inputs, *slopes),
        tuple(output for output in step.outputs if output[0] in wide),
        tuple(nodes),
        each,
    )
    return Parted(compacted(shared), compacted(turn), len(handed))


def _results(step: Step, wide: frozenset[str]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the results of narrow vectors, and those of wide ones."""
    of_vector = [name for name, size in step.outputs for _ in range(size)]
    pairs = list(zip(of_vector, step.results, strict=True))
    narrow = tuple(node for name, node in pairs if name not in wide)
    return narrow, tuple(node for name, node in pairs if name in wide)


def _handed(step: Step, wide: frozenset[str], overwritten: frozenset[str]) -> list[int]:
    """Return the narrow nodes that wide ones read and cannot find elsewhere; signs are not kept."""
    vector = [name for name, size in step.inputs for _ in range(size)]
    is_wide: list[bool] = []
    for op, *args in step.nodes:
        own = op == "input" and vector[args[0]] in wide
        is_wide.append(own or any(is_wide[a] for a in operands((op, *args))))

    _, results = _results(step, wide)
    read = list(results)
    for n in live_nodes(step.nodes, results):
        read += operands(step.nodes[n]) if is_wide[n] else ()
    handed: dict[int, None] = {}
    for reader in read:
        signed = step.nodes[reader][0] == "neg" and not is_wide[reader]
        n = step.nodes[reader][1] if signed else reader
        op, *args = step.nodes[n]
        at_hand = op == "const" or (op == "input" and vector[args[0]] not in overwritten)
        if not is_wide[n] and not at_hand:
            handed[n] = None
    return list(handed)


def without(step: Step, still: frozenset[str]) -> Step:
    """Return a step some of whose inputs are zero."""
    zeros = {name: (0,) * size for name, size in step.inputs if name in still}
    if not zeros:
        return step
    return specialised(step, f"{step.name}_without_{'_'.join(sorted(zeros))}", **zeros)


def is_zero(step: Step) -> bool:
    """Tell if a step gives nothing but zeros."""
    return all(step.nodes[r] == ("const", 0) for r in step.results)
