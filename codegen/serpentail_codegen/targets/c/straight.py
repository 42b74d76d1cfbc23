"""Prints a program as one straight line of C, with loops only over lanes."""

from collections.abc import Iterable

from ...ir.interpret import unroll
from ...ir.program import Array, Program, padded
from ...ir.tape import BINARY
from ..expressions import EARLY, LATE, Scalars, called
from .routine import CFunction, dialect, each_lane, scalar


def straight_line(program: Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program without loops except those over lanes."""
    tape, outputs, guards = unroll(program, fixed)
    results = [node for a in program.of_role("output") for node in outputs[a.name]]
    needed = [*results, *(node for _, node in guards)]
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    scalars = Scalars(tape.nodes, needed, scalar_names(arrays), dialect(real, prefix))

    # narrow scalars, then wide ones, then what needs a lane of these
    lines = scalars.lines(EARLY)
    wide, work = wide_lines(scalars)
    lines += wide + scalars.lines(LATE)

    targets = scalar_names(program.of_role("output"))
    lines += [
        f"{target} = {scalars.text[node]};" for target, node in zip(targets, results, strict=True)
    ]
    zero = dialect(real).literal(0)
    for status in dict.fromkeys(status for status, _ in guards):
        tests = [f"{scalars.text[node]} > {zero}" for name, node in guards if name == status]
        lines += [f"if (!({' && '.join(tests)})) {{", f"  return STATUS_{status};", "}"]

    operations = sum((tape.lanes[n] or 1) for n in scalars.live if tape.nodes[n][0] in BINARY)
    helpers = called(tape.nodes) | ({"lanes"} if wide else set())
    return CFunction(tuple(lines), work, (), frozenset(helpers), operations)


def scalar_names(arrays: Iterable[Array]) -> list[str]:
    """Return how C writes every scalar of some arrays."""
    return [scalar(a.part(0, a.length), k) for a in arrays for k in range(a.length)]


def wide_lines(scalars: Scalars) -> tuple[list[str], int]:
    """Print wide scalars, those of equal lanes in one loop; return the workspace that they take,
    too.
    """
    lines: list[str] = []
    work = 0
    needed = sorted({scalars.nodes[n][1] for n in scalars.live if scalars.nodes[n][0] == "lane"})
    for lanes in sorted({scalars.lanes[n] for n in scalars.live} - {0}):
        pitch, inner = padded(lanes), scalars.lines(lanes)
        for node in needed:
            if scalars.lanes[node] == lanes:
                inner.append(f"STORE(&work[{work}] + c, {scalars.text[node]});")
                scalars.stored[node] = work
                work += pitch

        # a unit row is a window on an array with a single one
        loop = each_lane(str(lanes), inner)
        if any("&one[" in line for line in inner):
            ones = ", ".join("1" if k == lanes - 1 else "0" for k in range(lanes + pitch))
            array = f"static const real one[{lanes + pitch}] = {{{ones}}};"
            loop = ["{", f"  {array}", *("  " + line for line in loop), "}"]
        lines += loop
    return lines, work
