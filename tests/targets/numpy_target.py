"""A target of plain NumPy, written by the recipe in CONTRIBUTING: it shows what a target takes."""

import re
from functools import singledispatchmethod

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.dataflow import inlined
from serpentail_codegen.targets import target
from serpentail_codegen.targets.expressions import Dialect, Scalars, index_text
from serpentail_codegen.targets.target import SEAL, body_lines, refused, unknown_statement

NUMPY = Dialect(
    "{name} = {text}",
    {name: f"np.{name}" for name in ("sin", "cos", "sqrt")},
    select="np.where({c} > {zero}, {a}, {b})",
)
HELPERS = """
def store(target, values, adds):
    for k, value in enumerate(values):
        target[k] = target[k] + value if adds else value


def factor(upper, lower, size, row):  # A = U D L from the last row up; U = L^T where A is symmetric
    for k in reversed(range(size)):
        if not np.all(lower[k * row + k] > 0):
            raise ArithmeticError("NOT_POSITIVE_DEFINITE")
        inverse = 1.0 / lower[k * row + k]
        above, left = upper[k * row : k * row + k].copy(), lower[k * row : k * row + k].copy()
        for i in range(k):
            lower[i * row : i * row + i + 1] -= above[i] * inverse * left[: i + 1]
            if upper is not lower:
                upper[i * row : i * row + i + 1] -= left[i] * inverse * above[: i + 1]
        upper[k * row : k * row + k], upper[k * row + k] = above * inverse, inverse
        lower[k * row : k * row + k], lower[k * row + k] = left * inverse, inverse


def solve(upper, lower, x, row):
    for k in reversed(range(len(x))):
        for i in range(k):
            x[i] = x[i] - upper[k * row + i] * x[k]
    for k in range(len(x)):
        x[k] = x[k] * lower[k * row + k]
    for k in range(len(x)):
        for i in range(k):
            x[k] = x[k] - lower[k * row + i] * x[i]
"""


def view(ref):
    """Print the part of an array that a reference means: one axis, and one more for lanes."""
    name, start = f"{ref.array.name}", index_text(ref.offset)
    if ref.lane and ref.stride == 1:
        return f"{name}[{start}, {index_text(ref.lane)} : {index_text(ref.lane + ref.size)}]"
    if ref.lane:
        return f"{name}[{start} : {index_text(ref.offset + ref.size)}, {index_text(ref.lane)}]"
    stop = index_text(ref.offset + ((ref.size - 1) * ref.stride + 1))
    return f"{name}[{start} : {stop} : {ref.stride}]"


def numbers(values):
    """Print a list of numbers."""
    return f"[{', '.join(map(NUMPY.literal, values))}]"


def step_lines(step):
    """Print a step as a function of arrays; NumPy's rules extend it to lanes."""
    names = [f"{name}[{k}]" for name, size in step.inputs for k in range(size)]
    scalars = Scalars(step.nodes, step.results, names, NUMPY)
    lines, results = scalars.lines(), iter(step.results)
    texts = [[scalars.text[next(results)] for _ in range(size)] for _, size in step.outputs]
    outputs = ", ".join(f"[{', '.join(output)}]" for output in texts)
    head = f"def {step.name}({', '.join(name for name, _ in step.inputs)}):"
    return [head, *(f"    {line}" for line in (*lines, f"return ({outputs},)"))]


class NumpyPrinter:
    """Prints a program as Python loops over NumPy arrays."""

    def __init__(self, program):
        self.program, self.steps = inlined(program), {}

    def lines(self):
        """Return the function: arrays first, then the statements."""
        arrays, body = self.program.arrays, body_lines(self, self.program.body)
        inputs = [a.name for a in arrays if a.role == "input"]
        outputs = [a.name for a in arrays if a.role == "output"]
        made = [
            f"{a.name} = np.array({numbers(a.values)})"
            if a.role == "constant"
            else f"{a.name} = np.full({(a.length, a.lanes) if a.lanes else a.length}, np.nan)"
            for a in arrays
            if a.role in ("constant", "local", "output")
        ]
        used = set(re.findall(r"\w+", " ".join(body)))
        fields = [a.name for a in arrays if a.role == "parameters" and a.name in used]
        made += [f'{name} = np.ravel(parameters["{name}"])' for name in fields]
        result = f"return {{{', '.join(f'{name!r}: {name}' for name in outputs)}}}"
        head = f"def {self.program.name}({', '.join(['parameters', *inputs])}):"
        return [head, *(f"    {line}" for line in (*made, *body, result))]

    statement = singledispatchmethod(unknown_statement)

    @statement.register
    def _loop(self, loop: ir.Loop):
        span = f"range({index_text(loop.start)}, {index_text(loop.stop)})"
        head = f"for {loop.var} in {f'reversed({span})' if loop.downward else span}:"
        return [head, *(f"    {line}" for line in body_lines(self, loop.body))]

    @statement.register
    def _when(self, when: ir.When):
        body = body_lines(self, when.body)
        return [f"if {view(when.scalar)}[0] > 0:", *(f"    {line}" for line in body)]

    @statement.register
    def _fill(self, fill: ir.Fill):
        return [f"store({view(fill.target)}, {numbers(fill.values)}, False)"]

    @statement.register
    def _unit(self, unit: ir.Unit):
        first, count, lanes = index_text(unit.first), unit.target.size, unit.target.lanes
        return [f"{view(unit.target)} = np.eye({lanes})[{first} : {first} + {count}]"]

    @statement.register
    def _copy(self, copy: ir.Copy):
        return [f"store({view(copy.target)}, {view(copy.source)}.copy(), {copy.adds})"]

    @statement.register
    def _apply(self, apply: ir.Apply):
        self.steps[apply.step.name] = apply.step
        call = f"{apply.step.name}({', '.join(f'{view(ref)}.copy()' for ref in apply.reads)})"
        outputs = zip(apply.writes, apply.adds, strict=True)
        stores = [f"store({view(r)}, new[{k}], {adds})" for k, (r, adds) in enumerate(outputs)]
        return [f"new = {call}", *stores]

    @statement.register
    def _guard(self, guard: ir.Guard):
        head = f"if not np.all({view(guard.scalar)} > 0):"
        return [head, f'    raise ArithmeticError("{guard.status}")']

    @statement.register
    def _factor(self, factor: ir.Factor):
        name, row = factor.matrix.name, ir.padded(factor.size)
        first = f"{name}[{factor.size * row} :]" if factor.pair else name
        return [f"factor({first}, {name}, {factor.size}, {row})"]

    @statement.register
    def _solve(self, solve: ir.Solve):
        name, row = solve.matrix.name, ir.padded(solve.x.size)
        first = f"{name}[{solve.x.size * row} :]" if solve.pair else name
        return [f"solve({first}, {name}, {view(solve.x)}, {row})"]

    @statement.register
    def _call(self, call: ir.Call):
        raise refused(self, call, "programs are inlined before they are printed")


def emit(scene, tail, functions, version):
    """Return the module of a scene: helpers, steps, functions."""
    printers = [NumpyPrinter(assemble(function, tail)) for function in functions]
    texts = ["\n".join(printer.lines()) for printer in printers]
    steps = {name: step for printer in printers for name, step in printer.steps.items()}
    head = f'"""{scene.name} in NumPy, by serpentail {version}; derivation {SEAL}."""'
    parts = [head, "import numpy as np", HELPERS.strip()]
    parts += ["\n".join(step_lines(step)) for step in steps.values()]
    path = f"{scene.name}_numpy.py"
    return target.Emission({path: "\n\n\n".join([*parts, *texts]) + "\n"}, (path,), {}, {})


TARGET = target.Target("numpy", NumpyPrinter, emit)
