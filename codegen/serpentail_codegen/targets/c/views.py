"""Views: arguments, functions, steps and parameters in the form that the C templates need."""

import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any, Protocol

from serpentail_scene.signatures.arguments import FACTORS, Argument

from ...functions.tail import Tail
from ...ir.program import Program
from ...ir.tape import operation_count
from ...passes.fuse_steps import AFTER
from .form import PrintedFunction
from .routine import CFunction, Routine, routine_arguments, routine_lines

# operations: smaller steps are always inlined; for others the compiler decides
INLINED_OPERATIONS = 100
# results: vectors of fewer would be loaded before all that they hold is stored
STORED_ONE_BY_ONE = 16

QUATERNIONS = {"q": 3, "x": 0}  # where they begin, by the first argument's name


class HasBody(Protocol):
    """Anything with a C function body: a printed function, a batch, a batch rollout."""

    @property
    def body(self) -> CFunction:
        """The C function body."""


class ArgumentView:
    """An argument in the form that the templates need."""

    def __init__(self, argument: Argument, tail: Tail):
        self.name, self.meaning = argument.name, argument.meaning
        self.length = argument.length(tail)
        self.dims = "][".join(map(str, argument.shape(tail)))


class FunctionView:
    """A function in the form that the templates need: its prototype, and the checks before and
    after.
    """

    def __init__(self, printed: PrintedFunction, tail: Tail, prefix: str):
        function = printed.function
        self.name, self.doc, self.work = function.name, function.doc, printed.body.work
        self.emission, self.operations = printed.emission, printed.body.operations
        views = [ArgumentView(a, tail) for a in (*function.inputs, *function.outputs)]
        self.inputs, self.outputs = views[: len(function.inputs)], views[len(function.inputs) :]
        self.prototype = self.prototype_of(f"{prefix}_{self.name}", prefix)
        self.names = ", ".join(a.name for a in views)
        unchecked = f"{prefix}_unchecked_{self.name}"
        self.call = f"{unchecked}(parameters, {self.names}, work)"
        inputs = [a.name for a in self.inputs]
        body = self.prototype_of(unchecked, prefix), printed.body, inputs
        self.unchecked = body_view(self.name, self.doc, *body)

        # factors are many and not checked: the results of solving with them are
        self.quaternion = "" if tail.fixed else quaternion_in(self.inputs[0].name)
        read = [a for a in self.inputs if a.name != FACTORS.name]
        self.arguments = zero_where_finite(f"{prefix}_zero_times", read)
        few = sum(a.length for a in self.outputs) < STORED_ONE_BY_ONE
        each = "_each" if few else ""
        self.results = zero_where_finite(f"{prefix}_zero_times{each}", self.outputs)

    def prototype_of(self, symbol: str, prefix: str) -> str:
        """Print the prototype of a function with these arguments."""
        real = f"{prefix}_real"
        arguments = [f"const {real} *{a.name}" for a in self.inputs]
        arguments += [f"{real} *{a.name}" for a in self.outputs]
        head = f"const {prefix}_parameters *parameters"
        return wrapped(f"int {symbol}(", [head, *arguments, f"{real} *work"])


def quaternion_in(name: str, states: str = "") -> str:
    """Print the address of the quaternion in a function's first argument, if it has one."""
    start = QUATERNIONS.get(name)
    if start is None:
        return ""
    return f"{name} + {start}{states}" if start else name


def zero_where_finite(helper: str, arguments: Sequence[ArgumentView]) -> str:
    """Print a sum that is zero if all numbers of some arguments are finite."""
    return " + ".join(f"{helper}({a.length}, {a.name})" for a in arguments)


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
            "doc": comment(routine.step.doc),
            "lines": routine_lines(routine, real, prefix),
            "arguments": routine_arguments(routine),
        }
        for routine in routines.values()
    ]


def comment(doc: str) -> str:
    """Return a step's description as a comment, each repeated part of it once, with a count."""
    parts = []
    for part, alike in groupby(doc.replace("``", "`").split(AFTER)):
        count = len(list(alike))
        parts.append(f"{part} ({count} times)" if count > 1 else part)
    return AFTER.join(parts)


def callees_of(printed: Sequence[HasBody]) -> list[tuple[Program, CFunction]]:
    """Return the programs that functions call, once each; a callee comes before its callers."""
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
    prototype = wrapped(f"static int {prefix}_{program.name}(", [*arguments, "real *work"])
    inputs = [a.name for a in program.of_role("input")]
    return body_view(program.name, program.doc, prototype, body, inputs)


def body_view(
    name: str, doc: str, prototype: str, body: CFunction, inputs: Iterable[str]
) -> dict[str, Any]:
    """Return a function without checks in the form that the templates need; ``unused``: which
    arguments it does not read.
    """
    words = set(re.findall(r"\w+", " ".join(body.lines)))
    unused = [name for name in ("parameters", "work", *inputs) if name not in words]
    view = {"name": name, "doc": doc, "prototype": prototype}
    return view | {"lines": body.lines, "unused": unused}
