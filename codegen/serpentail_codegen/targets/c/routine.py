"""Steps as C functions, and the parts of all C function bodies: addresses, loops over lanes."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from ...ir.cost import executed
from ...ir.program import Array, Index, Program, Ref
from ...ir.step import Step
from ..expressions import Dialect, Scalars, index_text


@dataclass(frozen=True)
class Routine:
    """A step as one C function."""

    step: Step
    wide: frozenset[str] = frozenset()  # inputs and outputs whose scalars have lanes
    pitch: int = 1  # numbers from one wide scalar to the next
    adds: frozenset[str] = frozenset()  # outputs that are added, not stored
    apart: tuple[tuple[str, int], ...] = ()  # strides of inputs whose scalars are not contiguous
    chosen: frozenset[str] = frozenset()  # outputs that only lanes with ``where`` > 0 store

    @property
    def name(self) -> str:
        """Return a name that distinguishes the routines of one step."""
        names = {n for n, _ in (*self.step.inputs, *self.step.outputs)}
        usual = {n for n in names if n.startswith("d_")} or names
        odd = sorted(self.wide ^ usual) if self.wide else []
        lanes = [f"rows_of_{self.pitch}", *odd] if self.wide else []
        adds = ["add", *sorted(self.adds)] if self.adds else []
        apart = [f"{name}_apart_{stride}" for name, stride in self.apart]
        chosen = ["where", *sorted(self.chosen)] if self.chosen else []
        return "_".join([self.step.name, *lanes, *adds, *apart, *chosen])


@dataclass(frozen=True)
class CFunction:
    """The body of one C function, except its end: the routines, helpers and programs that it calls,
    and its cost.
    """

    lines: tuple[str, ...]
    work: int  # scalars of workspace
    routines: tuple[Routine, ...]
    helpers: frozenset[str]
    cost: Program | int  # operations, or the program whose run counts them
    callees: "tuple[tuple[Program, CFunction], ...]" = ()  # programs that it calls, with their C

    @cached_property
    def operations(self) -> int:
        """Operations executed, each lane counted."""
        return self.cost if isinstance(self.cost, int) else executed(self.cost)


def dialect(real: str, prefix: str = "") -> Dialect:
    """Return how C writes scalars of a real type."""
    both = "({argument}, &{sine}, &{cosine});"
    return Dialect(
        "const real {name} = {text};",
        {"sqrt": "sqrtf" if real == "float" else "sqrt"},
        {"sqrt": f"{prefix}_sqrt_row"},
        real,
        wide_select=f"{prefix}_select_row({{c}}, {{a}}, {{b}})",
        sincos=f"real {{sine}}, {{cosine}}; {prefix}_sincos{both}",
        wide_sincos=f"lanes {{sine}}, {{cosine}}; {prefix}_sincos_row{both}",
        wide="const lanes {name} = {text};",
        load="LOAD({address} + c)",
    )


def begin(ref: Ref) -> Index:
    """Return the start of a reference, in numbers."""
    return ref.offset * ref.array.row + (ref.lane or 0)


def pointer(ref: Ref) -> str:
    """Print the address of a reference's first scalar."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters" and ref.array.length == 1:
        return f"&{name}"
    offset = index_text(begin(ref))
    return name if offset == "0" else f"{name} + {offset}"


def scalar(ref: Ref, k: int) -> str:
    """Print scalar number k of a reference."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters" and ref.array.length == 1:
        return name
    return f"{name}[{index_text(begin(ref) + k * ref.stride)}]"


def singles(ref: Ref) -> list[Ref]:
    """Return a reference to each scalar of a reference."""
    return [Ref(ref.array, ref.offset + k * ref.stride, 1) for k in range(ref.size)]


def argument_name(array: Array) -> str:
    """Print the name of an array in a C function."""
    return f"parameters->{array.name}" if array.role == "parameters" else array.name


def each_lane(columns: str, lines: Iterable[str]) -> list[str]:
    """Print a loop over lanes, as many at a time as a vector holds."""
    return [f"for (int c = 0; c < {columns}; c += LANES) {{", *("  " + line for line in lines), "}"]


def routine_arguments(routine: Routine) -> str:
    """Print the arguments of a step."""
    inputs = [f"const real *{name}" for name, _ in routine.step.inputs]
    outputs = [f"real *{name}_out" for name, _ in routine.step.outputs]
    where = ["const real *where"] if routine.chosen else []
    return ", ".join([*inputs, *outputs, *where, *(["int count"] if routine.wide else [])])


def routine_lines(routine: Routine, real: str, prefix: str) -> list[str]:
    """Print the body of a step: inputs by their names, outputs as ``<name>_out``."""
    names, lanes = input_names(routine)
    step = routine.step
    scalars = Scalars(step.nodes, step.results, names, dialect(real, prefix), lanes)
    lines = scalars.lines()
    wide_lines = scalars.lines(routine.pitch) if routine.wide else []

    # wide outputs are stored lane by lane, narrow ones at the end
    stores, narrow, results = [], [], iter(step.results)
    for name, size in step.outputs:
        for k in range(size):
            node = next(results)
            if name in routine.wide:
                stores.append(store(routine, name, k, scalars, node, prefix))
            else:
                narrow.append((name, k, scalars.text[node]))

    # every input is read before an output is written: outputs may overwrite inputs
    read_before = {text: f"r{k}" for k, (_, _, text) in enumerate(narrow) if "[" in text}
    lines += [f"const real {name} = {text};" for text, name in read_before.items()]
    lines += each_lane("count", wide_lines + stores) if stores else []
    for name, k, text in narrow:
        sign = "+=" if name in routine.adds else "="
        lines.append(f"{name}_out[{k}] {sign} {read_before.get(text, text)};")
    return lines


def input_names(routine: Routine) -> tuple[list[str], dict[int, int]]:
    """Return how a step's scalar inputs are written, and the lanes of the wide ones by number."""
    names: list[str] = []
    lanes: dict[int, int] = {}
    strides = dict(routine.apart)
    for name, size in routine.step.inputs:
        stride = strides.get(name, 1)
        if name in routine.wide:
            lanes |= {len(names) + k: routine.pitch for k in range(size)}
            names += [f"&{name}[{k * stride * routine.pitch}]" for k in range(size)]
        else:
            names += [f"{name}[{k * stride}]" for k in range(size)]
    return names, lanes


def store(
    routine: Routine, name: str, k: int, scalars: Scalars, node: int, prefix: str = ""
) -> str:
    """Print the statement that stores scalar number k of a wide output, in a loop over lanes."""
    text = scalars.text[node] if scalars.lanes[node] else f"WIDE({scalars.text[node]})"
    address = f"&{name}_out[{k * routine.pitch}] + c"
    value = f"LOAD({address}) + {text}" if name in routine.adds else text
    if name in routine.chosen:
        value = f"{prefix}_select_row(LOAD(where + c), {value}, LOAD({address}))"
    return f"STORE({address}, {value});"
