"""C function bodies: programs go in, the lines of their C functions come out, straight or as loops
over steps.
"""

from ...ir.interpret import unroll
from ...ir.program import Program, padded
from ...ir.tape import BINARY
from ..expressions import EARLY, LATE, Scalars, called
from .routine import CFunction, dialect, each_lane, scalar


def straight_line(program: Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program without loops but those over lanes."""
    tape, outputs, guards = unroll(program, fixed)
    results = [node for a in program.of_role("output") for node in outputs[a.name]]
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    names = [scalar(a.part(0, a.length), k) for a in arrays for k in range(a.length)]
    scalars = Scalars(
        tape.nodes, [*results, *(node for _, node in guards)], names, dialect(real, prefix)
    )
    lines = scalars.lines(EARLY)
    rows, work = wide_lines(scalars)
    lines += rows + scalars.lines(LATE)
    targets = [
        scalar(a.part(0, a.length), k) for a in program.of_role("output") for k in range(a.length)
    ]
    lines += [
        f"{target} = {scalars.text[node]};" for target, node in zip(targets, results, strict=True)
    ]
    zero = dialect(real).literal(0)
    for status in dict.fromkeys(status for status, _ in guards):
        tests = " && ".join(
            f"{scalars.text[node]} > {zero}" for name, node in guards if name == status
        )
        lines += [f"if (!({tests})) {{", f"  return STATUS_{status};", "}"]
    lines.append("return STATUS_OK;")
    operations = sum((tape.lanes[n] or 1) for n in scalars.live if tape.nodes[n][0] in BINARY)
    helpers = called(tape.nodes) | ({"lanes"} if rows else set())
    return CFunction(tuple(lines), work, (), frozenset(helpers), operations)


def wide_lines(scalars: Scalars) -> tuple[list[str], int]:
    """Print the rows, those of equal length in one loop; rows of which a lane is needed go to the
    workspace.
    """
    lines, work = [], 0
    needed = sorted({scalars.nodes[n][1] for n in scalars.live if scalars.nodes[n][0] == "lane"})
    for lanes in sorted({scalars.lanes[n] for n in scalars.live} - {0}):
        row, inner = padded(lanes), scalars.lines(lanes)
        for node in needed:
            if scalars.lanes[node] == lanes:
                inner.append(f"STORE(&work[{work}] + c, {scalars.text[node]});")
                scalars.stored[node] = work
                work += row
        if any("&one[" in line for line in inner):
            ones = ", ".join("1" if k == lanes - 1 else "0" for k in range(lanes + row))
            lines += ["{", f"  static const real one[{lanes + row}] = {{{ones}}};"]
            lines += ["  " + line for line in each_lane(str(lanes), inner)] + ["}"]
        else:
            lines += each_lane(str(lanes), inner)
    return lines, work
