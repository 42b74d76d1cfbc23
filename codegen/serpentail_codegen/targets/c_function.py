"""C function bodies: programs go in, the lines of their C functions come out, straight or as loops over steps."""

from dataclasses import dataclass

from ..interpret import executed, unroll
from ..program import Apply, Array, Copy, Fill, Guard, Loop, Program, Ref, Solve
from ..tape import BINARY, Step
from .scalars import Dialect, Scalars, index_text

FEW = 3  # scalars are written one by one, more by a helper
ON_STACK = 12  # scalars: larger local arrays go to the caller's workspace


@dataclass(frozen=True)
class CFunction:
    """One C function body: its lines, the scalars of workspace, the steps and helpers it calls, what it costs."""

    lines: tuple[str, ...]
    work: int
    steps: tuple[Step, ...]
    helpers: frozenset[str]
    operations: int


def dialect(real: str, prefix: str = "") -> Dialect:
    """Return how C writes scalars of a real type."""
    suffix = "f" if real == "float" else ""
    sincos = f"real {{sine}}, {{cosine}}; {prefix}_sincos({{argument}}, &{{sine}}, &{{cosine}});"
    return Dialect("const real {name} = {text};", suffix, {"sqrt": "sqrt" + suffix}, sincos)


def pointer(ref: Ref) -> str:
    """Print the address of a reference's first scalar."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters":
        return name if ref.array.length > 1 else f"&{name}"
    offset = index_text(ref.offset)
    return name if offset == "0" else f"{name} + {offset}"


def scalar(ref: Ref, k: int) -> str:
    """Print scalar number k of a reference."""
    name = argument_name(ref.array)
    if ref.array.role == "parameters" and ref.array.length == 1:
        return name
    return f"{name}[{index_text(ref.offset + k * ref.stride)}]"


def argument_name(array: Array) -> str:
    """Print what a C function calls an array."""
    return f"parameters->{array.name}" if array.role == "parameters" else array.name


def step_lines(step: Step, real: str, prefix: str) -> list[str]:
    """Print the body of a step: inputs by their names, outputs as ``<name>_out``."""
    names = [f"{name}[{k}]" for name, size in step.inputs for k in range(size)]
    scalars = Scalars(step.nodes, step.results, names, dialect(real, prefix))
    lines = scalars.lines()
    targets = [f"{name}_out[{k}]" for name, size in step.outputs for k in range(size)]
    # every input is read before an output is written: outputs may overwrite inputs
    texts = [scalars.text[r] for r in step.results]
    late = {text: f"r{k}" for k, text in enumerate(texts) if "[" in text}
    lines += [f"const real {name} = {text};" for text, name in late.items()]
    return lines + [f"{target} = {late.get(text, text)};" for target, text in zip(targets, texts, strict=True)]


def straight_line(program: Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program without loops."""
    tape, outputs, guards = unroll(program, fixed)
    results = [node for a in program.of_role("output") for node in outputs[a.name]]
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    names = [scalar(a.part(0, a.length), k) for a in arrays for k in range(a.length)]
    scalars = Scalars(tape.nodes, [*results, *(node for _, node in guards)], names, dialect(real, prefix))
    lines = scalars.lines()
    targets = [scalar(a.part(0, a.length), k) for a in program.of_role("output") for k in range(a.length)]
    lines += [f"{target} = {scalars.text[node]};" for target, node in zip(targets, results, strict=True)]
    zero = dialect(real).literal(0)
    for status in dict.fromkeys(status for status, _ in guards):
        tests = " && ".join(f"{scalars.text[node]} > {zero}" for name, node in guards if name == status)
        lines += [f"if (!({tests})) {{", f"  return STATUS_{status};", "}"]
    lines.append("return STATUS_OK;")
    operations = sum(tape.nodes[n][0] in BINARY for n in scalars.live)
    return CFunction(tuple(lines), 0, (), frozenset(called(tape.nodes)), operations)


class LoopPrinter:
    """Prints a program as C loops that call its steps."""

    def __init__(self, program: Program, real: str, prefix: str, fixed=None):
        self.program, self.prefix, self.fixed = program, prefix, fixed or {}
        self.dialect = dialect(real)
        self.steps: dict[str, Step] = {}
        self.helpers: set[str] = set()
        self.used: dict[str, Array] = {}

    def function(self) -> CFunction:
        """Return the printed function."""
        body = self._body(self.program.body)
        declarations, work = self._declarations()
        lines = (*declarations, *body, "return STATUS_OK;")
        return CFunction(lines, work, tuple(self.steps.values()), frozenset(self.helpers), executed(self.program))

    def _declarations(self) -> tuple[list[str], int]:
        lines, work = [], 0
        for array in self.used.values():
            values = self.fixed.get(array.name, array.values)
            if array.role == "constant" or array.name in self.fixed:
                text = ", ".join(self.dialect.literal(v) for v in values)
                lines.append(f"static const real {array.name}[{array.length}] = {{{text}}};")
            elif array.role == "local" and array.length <= ON_STACK:
                lines.append(f"real {array.name}[{array.length}];")
            elif array.role == "local":
                lines.append(f"real *const {array.name} = work + {work};")
                work += array.length
        return lines, work

    def _ref(self, ref: Ref) -> Ref:
        if ref.array.name in self.fixed:
            values = tuple(self.fixed[ref.array.name])
            ref = Ref(Array(ref.array.name, "constant", ref.array.size, 1, values), ref.offset, ref.size)
        self.used.setdefault(ref.array.name, ref.array)
        return ref

    def _body(self, body) -> list[str]:
        return [line for s in body for line in getattr(self, f"_{type(s).__name__.lower()}")(s)]

    def _loop(self, loop: Loop) -> list[str]:
        start, stop, var = index_text(loop.start), index_text(loop.stop), loop.var
        head = f"for (int {var} = {start}; {var} < {stop}; ++{var}) {{"
        if loop.downward:
            head = f"for (int {var} = {index_text(loop.stop + -1)}; {var} >= {start}; --{var}) {{"
        return [head, *("  " + line for line in self._body(loop.body)), "}"]

    def _fill(self, fill: Fill) -> list[str]:
        target = self._ref(fill.target)
        if target.size > FEW and len(set(fill.values)) == 1:
            value = self.dialect.literal(fill.values[0])
            return [f"{self._helper('fill')}({target.size}, {value}, {pointer(target)});"]
        return [f"{scalar(target, k)} = {self.dialect.literal(v)};" for k, v in enumerate(fill.values)]

    def _copy(self, copy: Copy) -> list[str]:
        target, source = self._ref(copy.target), self._ref(copy.source)
        if target.size > FEW:
            return [f"{self._helper('copy')}({target.size}, {pointer(source)}, {pointer(target)});"]
        return [f"{scalar(target, k)} = {scalar(source, k)};" for k in range(target.size)]

    def _helper(self, name: str) -> str:
        self.helpers.add(name)
        return f"{self.prefix}_{name}"

    def _guard(self, guard: Guard) -> list[str]:
        test = f"!({scalar(self._ref(guard.scalar), 0)} > {self.dialect.literal(0)})"
        return [f"if ({test}) {{", f"  return STATUS_{guard.status};", "}"]

    def _solve(self, solve: Solve) -> list[str]:
        matrix, x = self._ref(solve.matrix[0]), self._ref(solve.x)
        call = f"{self._helper('ldl_solve')}({x.size}, {pointer(matrix)}, {pointer(x)})"
        return [f"if ({call} != STATUS_OK) {{", "  return STATUS_NOT_POSITIVE_DEFINITE;", "}"]

    def _apply(self, call: Apply) -> list[str]:
        self.steps.setdefault(call.step.name, call.step)
        self.helpers |= called(call.step.nodes)
        arguments = [pointer(self._ref(ref)) for ref in call.reads]
        before, after = [], []
        for (name, size), target, adds in zip(call.step.outputs, map(self._ref, call.writes), call.adds, strict=True):
            if not adds and target.stride == 1:
                arguments.append(pointer(target))
                continue
            before.append(f"real {name}_new[{size}];")
            sign = "+=" if adds else "="
            if adds and size > FEW:
                after.append(f"{self._helper('add')}({size}, {name}_new, {pointer(target)});")
            else:
                after += [f"{scalar(target, k)} {sign} {name}_new[{k}];" for k in range(size)]
            arguments.append(f"{name}_new")
        line = f"{self.prefix}_{call.step.name}({', '.join(arguments)});"
        return [line] if not before else ["{", *("  " + x for x in (*before, line, *after)), "}"]


def called(nodes) -> set[str]:
    """Return the helpers that nodes call."""
    return {"sincos"} if any(op in ("sin", "cos") for op, *_ in nodes) else set()


def in_loops(program: Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program as loops."""
    return LoopPrinter(program, real, prefix, fixed).function()
