"""The CasADi target: a scene's programs go in, a Python module that builds ``casadi.Function``s
comes out.
"""

import re

from ...functions.function import assemble, struct_parameters
from ...functions.tail import Tail
from ...ir.dataflow import inlined
from ...ir.program import Apply, Copy, Factor, Fill, Guard, Loop, Program, Ref, Solve, padded
from ...ir.step import Step
from ...scene.scene import Scene
from ..expressions import Dialect, Scalars, index_text
from ..templating import render

PYTHON = Dialect(
    "{name} = {text}",
    "",
    {"sin": "sin", "cos": "cos", "sqrt": "sqrt"},
    "if_else({c} > {zero}, {a}, {b})",
)


def slice_text(ref: Ref) -> str:
    """Print the slice of a list that a reference means."""
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

    def __init__(self, program: Program):
        self.program = inlined(program)
        self.steps: dict[str, Step] = {}

    def lines(self) -> list[str]:
        """Return the body of the function."""
        body = self._body(self.program.body)
        used = set(re.findall(r"\w+", " ".join(body)))
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

    def _body(self, body) -> list[str]:
        return [line for s in body for line in getattr(self, f"_{type(s).__name__.lower()}")(s)]

    def _loop(self, loop: Loop) -> list[str]:
        span = f"range({index_text(loop.start)}, {index_text(loop.stop)})"
        head = f"for {loop.var} in {f'reversed({span})' if loop.downward else span}:"
        return [head, *("    " + line for line in self._body(loop.body))]

    def _fill(self, fill: Fill) -> list[str]:
        values = ", ".join(map(PYTHON.literal, fill.values))
        if len(set(fill.values)) == 1:
            return [
                f"{slice_text(fill.target)} = [{PYTHON.literal(fill.values[0])}] * "
                f"{fill.target.size}"
            ]
        return [f"{slice_text(fill.target)} = [{values}]"]

    def _copy(self, copy: Copy) -> list[str]:
        return [f"{slice_text(copy.target)} = {slice_text(copy.source)}"]

    def _guard(self, guard: Guard) -> list[str]:
        return [
            f"{slice_text(ref)} = where({slice_text(guard.scalar)}, {slice_text(ref)})"
            for ref in guard.protects
        ]

    def _factor(self, factor: Factor) -> list[str]:
        return [
            f"{factor.matrix.name} = ldl_factor({factor.matrix.name}, {factor.size}, "
            f"{padded(factor.size)})"
        ]

    def _solve(self, solve: Solve) -> list[str]:
        return [
            f"{slice_text(solve.x)} = ldl_solve({solve.matrix.name}, {slice_text(solve.x)}, "
            f"{padded(solve.x.size)})"
        ]

    def _apply(self, call: Apply) -> list[str]:
        self.steps.setdefault(call.step.name, call.step)
        call_text = f"{call.step.name}({', '.join(map(slice_text, call.reads))})"
        targets = [
            f"new_{k}" if adds else slice_text(w)
            for k, (w, adds) in enumerate(zip(call.writes, call.adds, strict=True))
        ]
        sums = [
            f"{slice_text(w)} = added({slice_text(w)}, new_{k})"
            for k, (w, adds) in enumerate(zip(call.writes, call.adds, strict=True))
            if adds
        ]
        return [f"({', '.join(targets)},) = {call_text}", *sums]


def casadi_module(scene: Scene, tail: Tail, functions, version: str, content_hash: str) -> str:
    """Render the module."""
    views, steps = [], {}
    for function in functions:
        printer = PythonPrinter(assemble(function, tail))
        shapes = {a.name: list(a.shape(tail)) for a in (*function.inputs, *function.outputs)}
        views.append(
            {
                "name": function.name,
                "doc": function.doc,
                "inputs": [a.name for a in function.inputs],
                "outputs": [a.name for a in function.outputs],
                "shapes": shapes,
                "lines": printer.lines(),
            }
        )
        steps |= printer.steps
    sizes = {p.name: p.size for p in struct_parameters(scene)}
    data = {
        "scene": scene,
        "version": version,
        "content_hash": content_hash,
        "functions": views,
        "sizes": sizes,
    }
    selects = any(op == "select" for s in steps.values() for op, *_ in s.nodes)
    return render(
        "casadi",
        "module.py.jinja",
        data | {"steps": [step_view(s) for s in steps.values()], "selects": selects},
    )
