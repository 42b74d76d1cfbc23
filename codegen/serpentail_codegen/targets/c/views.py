"""Views: arguments, functions, steps and parameters as the C templates see them."""

import re
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

from ...functions.function import Argument, struct_parameters
from ...functions.tail import Tail
from ...ir.program import Program
from ...ir.tape import operation_count
from ...scene.scene import Scene
from .form import PrintedFunction, values
from .routine import CFunction, Routine, routine_arguments, routine_lines

# operations: smaller steps are written out where they are called, others as the compiler sees fit
INLINED_OPERATIONS = 100


class HasBody(Protocol):
    """What has a C function body: a printed function, a batch, a batch rollout."""

    @property
    def body(self) -> CFunction:
        """The C function body."""


class ArgumentView:
    """An argument as the templates see it."""

    def __init__(self, argument: Argument, tail: Tail):
        self.name, self.meaning = argument.name, argument.meaning
        self.length = argument.length(tail)
        self.dims = "][".join(map(str, argument.shape(tail)))


class FunctionView:
    """A function as the templates see it: prototypes, call texts, lines."""

    def __init__(self, printed: PrintedFunction, tail: Tail, prefix: str):
        function, body = printed.function, printed.body
        self.name, self.doc = function.name, function.doc
        self.lines, self.work = body.lines, body.work
        self.emission, self.operations = printed.emission, body.operations
        views = [ArgumentView(a, tail) for a in (*function.inputs, *function.outputs)]
        self.inputs, self.outputs = views[: len(function.inputs)], views[len(function.inputs) :]
        real = f"{prefix}_real"
        arguments = [f"const {real} *{a.name}" for a in self.inputs] + [
            f"{real} *{a.name}" for a in self.outputs
        ]
        head = f"const {prefix}_parameters *parameters"
        self.prototype = wrapped(f"int {prefix}_{self.name}(", [head, *arguments, f"{real} *work"])
        self.names = ", ".join(a.name for a in views)
        self.unused = unused(self.lines)


def wrapped(head: str, arguments: list[str]) -> str:
    """Print a prototype, its arguments on as many lines as 118 columns need."""
    lines, indent = [head + arguments[0]], " " * len(head)
    for argument in arguments[1:]:
        if len(lines[-1]) + len(argument) > 116:
            lines[-1] += ","
            lines.append(indent + argument)
        else:
            lines[-1] += f", {argument}"
    return "\n".join(lines) + ")"


def parameter_views(scene: Scene) -> list[dict[str, Any]]:
    """Return the fields of the parameter struct."""
    return [
        {
            "name": p.name,
            "size": p.size,
            "unit": p.unit,
            "meaning": p.meaning,
            "defaults": values(scene, p.name),
        }
        for p in struct_parameters(scene)
    ]


def step_views(printed: Sequence[HasBody], real: str, prefix: str) -> list[dict[str, Any]]:
    """Return every step that some loop calls, once."""
    routines: dict[str, Routine] = {}
    bodies = [p.body for p in printed] + [body for _, body in callees_of(printed)]
    for routine in (r for body in bodies for r in body.routines):
        if routines.setdefault(routine.name, routine) != routine:
            raise ValueError(f"two steps are called {routine.name}")
    return [
        {
            "name": routine.name,
            "kind": "STEP"
            if operation_count(routine.step.nodes, routine.step.results) < INLINED_OPERATIONS
            else "static void",
            "doc": routine.step.doc,
            "lines": routine_lines(routine, real, prefix),
            "arguments": routine_arguments(routine),
        }
        for routine in routines.values()
    ]


def callees_of(printed: Sequence[HasBody]) -> list[tuple[Program, CFunction]]:
    """Return the programs that functions call, once, those first that others call."""
    callees: dict[str, tuple[Program, CFunction]] = {}
    for program, body in (callee for p in printed for callee in p.body.callees):
        for inner in (*body.callees, (program, body)):
            if callees.setdefault(inner[0].name, inner) != inner:
                raise ValueError(f"two programs are called {inner[0].name}")
    return list(callees.values())


def callee_view(program: Program, body: CFunction, prefix: str) -> dict[str, Any]:
    """Return a called program as a function of the C file."""
    arguments = [f"const {prefix}_parameters *parameters"]
    arguments += [f"const real *{a.name}" for a in program.of_role("input")]
    arguments += [f"real *{a.name}" for a in program.of_role("output")]
    head = f"static int {prefix}_{program.name}("
    return {
        "name": program.name,
        "doc": program.doc,
        "prototype": wrapped(head, [*arguments, "real *work"]),
        "lines": body.lines,
        "unused": unused(body.lines, [a.name for a in program.of_role("input")]),
    }


def unused(lines: Iterable[str], names: Iterable[str] = ()) -> list[str]:
    """Return which of these arguments, parameters and work a body does not read."""
    words = set(re.findall(r"\w+", " ".join(lines)))
    return [name for name in ("parameters", "work", *names) if name not in words]
