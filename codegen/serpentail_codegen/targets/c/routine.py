"""C function bodies: programs go in, the lines of their C functions come out, straight or as loops
over steps.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from ...ir.program import Array, Index, Program, Ref
from ...ir.step import Step
from ..expressions import Dialect, Scalars, index_text


@dataclass(frozen=True)
class Routine:
    """A step as one C function: its rows and how far apart, the outputs that are added, inputs that
    lie apart.
    """

    step: Step
    rows: frozenset[str] = frozenset()
    row: int = 1
    adds: frozenset[str] = frozenset()
    apart: tuple[tuple[str, int], ...] = ()

    @property
    def name(self) -> str:
        """Name that tells routines of one step apart."""
        names = {n for n, _ in (*self.step.inputs, *self.step.outputs)}
        usual = {n for n in names if n.startswith("d_")} or names
        odd = sorted(self.rows ^ usual) if self.rows else []
        lanes = [f"rows_of_{self.row}", *odd] if self.rows else []
        adds = ["add", *sorted(self.adds)] if self.adds else []
        apart = [f"{name}_apart_{stride}" for name, stride in self.apart]
        return "_".join([self.step.name, *lanes, *adds, *apart])


@dataclass(frozen=True)
class CFunction:
    """One C function body: its lines, the scalars of workspace, the routines and helpers it calls,
    what it costs.

    ``operations`` are executed, each lane counted; ``callees`` are the programs that it calls, with
    their C functions.
    """

    lines: tuple[str, ...]
    work: int
    routines: tuple[Routine, ...]
    helpers: frozenset[str]
    operations: int
    callees: "tuple[tuple[Program, CFunction], ...]" = ()


def dialect(real: str, prefix: str = "") -> Dialect:
    """Return how C writes scalars of a real type."""
    suffix = "f" if real == "float" else ""
    sincos = f"real {{sine}}, {{cosine}}; {prefix}_sincos({{argument}}, &{{sine}}, &{{cosine}});"
    functions = {"sqrt": "sqrt" + suffix}
    sincos_row = (
        f"lanes {{sine}}, {{cosine}}; {prefix}_sincos_row({{argument}}, &{{sine}}, &{{cosine}});"
    )
    row, load = "const lanes {name} = {text};", "LOAD({address} + c)"
    return Dialect(
        "const real {name} = {text};",
        functions,
        real,
        sincos=sincos,
        sincos_row=sincos_row,
        row=row,
        load=load,
    )


def begin(ref: Ref) -> Index:
    """Return where a reference begins, in numbers."""
    return ref.offset * ref.array.row + (ref.lane or 0)


def pointer(ref: Ref) -> str:
    """Print the address of a reference's first scalar."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters":
        return name if ref.array.length > 1 else f"&{name}"
    offset = index_text(begin(ref))
    return name if offset == "0" else f"{name} + {offset}"


def scalar(ref: Ref, k: int) -> str:
    """Print scalar number k of a reference."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters" and ref.array.length == 1:
        return name
    return f"{name}[{index_text(begin(ref) + k * ref.stride)}]"


def argument_name(array: Array) -> str:
    """Print what a C function calls an array."""
    return f"parameters->{array.name}" if array.role == "parameters" else array.name


def each_lane(columns: str, lines: Iterable[str]) -> list[str]:
    """Print a loop over lanes, as many in turn as a vector holds."""
    return [f"for (int c = 0; c < {columns}; c += LANES) {{", *("  " + line for line in lines), "}"]


def routine_arguments(routine: Routine) -> str:
    """Print the arguments of a step."""
    inputs = [f"const real *{name}" for name, _ in routine.step.inputs]
    outputs = [f"real *{name}_out" for name, _ in routine.step.outputs]
    return ", ".join([*inputs, *outputs, *(["int count"] if routine.rows else [])])


def routine_lines(routine: Routine, real: str, prefix: str) -> list[str]:
    """Print the body of a step: inputs by their names, outputs as ``<name>_out``; rows in a loop
    over lanes.
    """
    step, row = routine.step, routine.row
    names, rows = [], {}
    for name, size in step.inputs:
        if name in routine.rows:
            rows |= {len(names) + k: row for k in range(size)}
            names += [f"&{name}[{k * row}]" for k in range(size)]
        else:
            names += [f"{name}[{k * dict(routine.apart).get(name, 1)}]" for k in range(size)]
    scalars = Scalars(step.nodes, step.results, names, dialect(real, prefix), rows)
    lines = scalars.lines()
    wide, narrow, results = scalars.lines(row) if routine.rows else [], [], iter(step.results)
    stores = []
    for name, size in step.outputs:
        for k in range(size):
            node = next(results)
            if name in routine.rows:
                text = scalars.text[node] if scalars.lanes[node] else f"WIDE({scalars.text[node]})"
                address = f"&{name}_out[{k * row}] + c"
                stores.append(
                    f"STORE({address}, "
                    f"{f'LOAD({address}) + {text}' if name in routine.adds else text});"
                )
            else:
                narrow.append((name, k, scalars.text[node]))
    # every input is read before an output is written: outputs may overwrite inputs
    late = {text: f"r{k}" for k, (_, _, text) in enumerate(narrow) if "[" in text}
    lines += [f"const real {name} = {text};" for text, name in late.items()]
    lines += each_lane("count", wide + stores) if stores else []
    for name, k, text in narrow:
        lines.append(
            f"{name}_out[{k}] {'+=' if name in routine.adds else '='} {late.get(text, text)};"
        )
    return lines
