"""Prints programs as Python: plain loops over lists, whose scalars may be CasADi symbols."""

import re
from functools import singledispatchmethod

from ...ir import program as ir
from ...ir.dataflow import inlined
from ...ir.step import Step
from ..expressions import Dialect, Scalars, index_text
from ..target import UnprintableStatement, body_lines, refused, unknown_statement

PYTHON = Dialect(
    "{name} = {text}",
    {"sin": "sin", "cos": "cos", "sqrt": "sqrt"},
    select="if_else({c} > {zero}, {a}, {b})",
)
COMPILED = "only functions that CasADi gets as compiled C have it"


def slice_text(ref: ir.Ref) -> str:
    """Print the slice of a list for a reference."""
    if ref.array.lanes:
        raise UnprintableStatement(f"{ref.array.name} has lanes: the module's lists hold numbers")
    name = f'parameters["{ref.array.name}"]' if ref.array.role == "parameters" else ref.array.name
    if ref.size == ref.array.length:
        return f"{name}[:]"
    stop = index_text(ref.offset + ((ref.size - 1) * ref.stride + 1))
    return (
        f"{name}[{index_text(ref.offset)} : {stop}{f' : {ref.stride}' if ref.stride > 1 else ''}]"
    )


def step_view(step: Step) -> dict:
    """Return a step as a Python function of lists."""
    names = [f"{name}[{k}]" for name, size in step.inputs for k in range(size)]
    scalars = Scalars(step.nodes, step.results, names, PYTHON)
    lines, results = scalars.lines(), iter(step.results)
    outputs = [[scalars.text[next(results)] for _ in range(size)] for _, size in step.outputs]
    final = ", ".join(f"[{', '.join(texts)}]" for texts in outputs)
    arguments = ", ".join(name for name, _ in step.inputs)
    return {
        "name": step.name,
        "doc": step.doc,
        "arguments": arguments,
        "lines": [*lines, f"return ({final},)"],
    }


class PythonPrinter:
    """Prints a program as Python loops over lists."""

    def __init__(self, program: ir.Program):
        self.program = inlined(program)
        self.steps: dict[str, Step] = {}

    def lines(self) -> list[str]:
        """Return the body of the function."""
        body = body_lines(self, self.program.body)
        used = set(re.findall(r"\w+", " ".join(body)))

        # outputs and arrays that the body uses are lists; constants have their numbers
        arrays = [
            a
            for a in self.program.arrays
            if a.role == "output" or (a.role == "local" and a.name in used)
        ]
        lines = [f"{a.name} = [0.0] * {a.length}" for a in arrays]
        constants = [a for a in self.program.of_role("constant") if a.name in used]
        lines += [f"{a.name} = [{', '.join(map(PYTHON.literal, a.values))}]" for a in constants]

        outputs = ", ".join(f'"{a.name}": {a.name}' for a in self.program.of_role("output"))
        return [*lines, *body, f"return {{{outputs}}}"]

    statement = singledispatchmethod(unknown_statement)

    @statement.register
    def _loop(self, loop: ir.Loop) -> list[str]:
        span = f"range({index_text(loop.start)}, {index_text(loop.stop)})"
        head = f"for {loop.var} in {f'reversed({span})' if loop.downward else span}:"
        return [head, *("    " + line for line in body_lines(self, loop.body))]

    @statement.register
    def _fill(self, fill: ir.Fill) -> list[str]:
        target = slice_text(fill.target)
        if len(set(fill.values)) == 1:
            return [f"{target} = [{PYTHON.literal(fill.values[0])}] * {fill.target.size}"]
        return [f"{target} = [{', '.join(map(PYTHON.literal, fill.values))}]"]

    @statement.register
    def _copy(self, copy: ir.Copy) -> list[str]:
        target, source = slice_text(copy.target), slice_text(copy.source)
        return [f"{target} = added({target}, {source})" if copy.adds else f"{target} = {source}"]

    @statement.register
    def _guard(self, guard: ir.Guard) -> list[str]:
        if guard.scalar.size != 1:
            raise refused(self, guard, "`where` of the module takes a single scalar")
        return [
            f"{slice_text(ref)} = where({slice_text(guard.scalar)}, {slice_text(ref)})"
            for ref in guard.protects
        ]

    @statement.register
    def _factor(self, factor: ir.Factor) -> list[str]:
        if factor.pair:
            raise refused(self, factor, COMPILED)
        matrix, distance = factor.matrix.name, ir.padded(factor.size)
        return [f"{matrix} = ldl_factor({matrix}, {factor.size}, {distance})"]

    @statement.register
    def _solve(self, solve: ir.Solve) -> list[str]:
        if solve.pair:
            raise refused(self, solve, COMPILED)
        x, distance = slice_text(solve.x), ir.padded(solve.x.size)
        return [f"{x} = ldl_solve({solve.matrix.name}, {x}, {distance})"]

    @statement.register
    def _apply(self, apply: ir.Apply) -> list[str]:
        if self.steps.setdefault(apply.step.name, apply.step) != apply.step:
            raise ValueError(f"two steps are called {apply.step.name}")
        call = f"{apply.step.name}({', '.join(map(slice_text, apply.reads))})"

        # an output that is added gets a name first
        targets, sums = [], []
        for k, (ref, adds) in enumerate(zip(apply.writes, apply.adds, strict=True)):
            target = slice_text(ref)
            targets.append(f"new_{k}" if adds else target)
            sums += [f"{target} = added({target}, new_{k})"] if adds else []
        return [f"({', '.join(targets)},) = {call}", *sums]

    @statement.register
    def _when(self, statement: ir.When) -> list[str]:
        raise refused(self, statement, "a symbolic graph has no branches")

    @statement.register
    def _unit(self, unit: ir.Unit) -> list[str]:
        raise refused(self, unit, COMPILED)

    @statement.register
    def _call(self, statement: ir.Call) -> list[str]:
        raise refused(self, statement, "programs are inlined before they are printed")
