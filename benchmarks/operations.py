"""Additions, multiplications and divisions a state of a batch, executed and needed.

Executed: by its C. Needed: those of a line without loops, from which all zeros are gone.
"""

from pathlib import Path
from types import SimpleNamespace

from benchmarks.models import DFD, FD, HESSIAN, label
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import Function, assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import CountingRun
from serpentail_codegen.ir.interpret import unroll
from serpentail_codegen.ir.program import Program
from serpentail_codegen.ir.tape import operation_count
from serpentail_codegen.passes.narrow_directions import directions_in_turn, has_directions
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.targets.c.batch import batches

SIZES = ((1, 3), (3, 4))


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail and function."""
    return [counts(name, size) for size in SIZES for name in (FD, DFD, HESSIAN)]


def counts(name: str, size: tuple[int, int]) -> dict:
    """Return the row of one function of one tail."""
    tail, scene = Tail(*size), scene_for("articulated", *size, functions=[name])
    function = CATALOGUE[name].of(tail)
    (batch,) = batches(scene, tail, [SimpleNamespace(function=function)])
    done, least = executed(batch.program) / batch.states, needed(function, tail)
    row = {"function": name, "model": label(*size), "executed": done, "needed": least}
    return row | {"ratio": done / least}


def executed(program: Program) -> int:
    """Return the operations of one run, each lane counted; inputs are as wide as declared."""
    given = (*program.of_role("parameters"), *program.of_role("input"))
    return CountingRun(program, {a.name: [a.lanes] * a.length for a in given}).counter.count


def needed(function: Function, tail: Tail) -> int:
    """Return the operations that a function's outputs and guards need."""
    program = assemble(function, tail)
    if has_directions(program):  # a wide operation would count as one
        program = directions_in_turn(program)
    tape, results, guards = unroll(program)
    ends = [node for nodes in results.values() for node in nodes] + [node for _, node in guards]
    return operation_count(tape.nodes, ends)
