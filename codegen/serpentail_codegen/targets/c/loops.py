"""C function bodies: programs go in, the lines of their C functions come out, straight or as loops
over steps.
"""

from ...ir.cost import executed
from ...ir.program import (
    Apply,
    Array,
    Call,
    Copy,
    Factor,
    FactorPair,
    Fill,
    Guard,
    Loop,
    Program,
    Ref,
    Solve,
    SolvePair,
    Unit,
    When,
    padded,
)
from ..expressions import called, index_text
from .routine import CFunction, Routine, dialect, pointer, scalar

FEW = 3  # scalars are written one by one, more by a helper
ON_STACK = 12  # scalars: larger local arrays go to the caller's workspace
CALLEES_WORK = "<work>"  # stands for where the workspace of what is called begins


class LoopPrinter:
    """Prints a program as C loops that call its steps."""

    def __init__(self, program: Program, real: str, prefix: str, fixed=None):
        self.program, self.real, self.prefix, self.fixed = program, real, prefix, fixed or {}
        self.dialect = dialect(real)
        self.callees: dict[str, tuple[Program, CFunction]] = {}
        self.routines: dict[str, Routine] = {}
        self.helpers: set[str] = set()
        self.used: dict[str, Array] = {}

    def function(self) -> CFunction:
        """Return the printed function."""
        body = self._body(self.program.body)
        declarations, work = self._declarations()
        own = padded(work)  # what is called begins at a whole vector, too
        lines = (
            *declarations,
            *(line.replace(CALLEES_WORK, str(own)) for line in body),
            "return STATUS_OK;",
        )
        work = max(
            [work, *(own + function.work for _, function in self.callees.values() if function.work)]
        )
        routines, callees = tuple(self.routines.values()), tuple(self.callees.values())
        return CFunction(
            lines, work, routines, frozenset(self.helpers), executed(self.program), callees
        )

    def _declarations(self) -> tuple[list[str], int]:
        lines, work = [], 0
        for array in sorted(
            self.used.values(), key=lambda a: not a.lanes
        ):  # rows first, where vectors are aligned
            values = self.fixed.get(array.name, array.values)
            if array.role == "constant" or array.name in self.fixed:
                text = ", ".join(self.dialect.literal(v) for v in values)
                lines.append(f"static const real {array.name}[{array.length}] = {{{text}}};")
            elif array.role == "local" and array.length * array.row <= ON_STACK:
                lines.append(f"real {array.name}[{array.length * array.row}];")
            elif array.role == "local":
                lines.append(f"real *const {array.name} = work + {work};")
                work += array.length * array.row
        return lines, work

    def _ref(self, ref: Ref) -> Ref:
        if ref.array.name in self.fixed:
            values = tuple(self.fixed[ref.array.name])
            ref = Ref(
                Array(ref.array.name, "constant", ref.array.size, 1, values), ref.offset, ref.size
            )
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

    def _when(self, when: When) -> list[str]:
        head = f"if ({scalar(self._ref(when.scalar), 0)} > {self.dialect.literal(0)}) {{"
        return [head, *("  " + line for line in self._body(when.body)), "}"]

    def _fill(self, fill: Fill) -> list[str]:
        target = self._ref(fill.target)
        if target.lanes:
            return self._fill_rows(target, fill.values)
        if target.size > FEW and len(set(fill.values)) == 1:
            value = self.dialect.literal(fill.values[0])
            return [f"{self._helper('fill')}({target.size}, {value}, {pointer(target)});"]
        return [
            f"{scalar(target, k)} = {self.dialect.literal(v)};" for k, v in enumerate(fill.values)
        ]

    def _fill_rows(self, target: Ref, values) -> list[str]:
        if not any(values):
            return [
                f"{self._helper('clear_rows')}({target.size * target.array.row}, "
                f"{pointer(target)});"
            ]
        fill, row = self._helper("fill_rows"), target.array.row
        texts = [self.dialect.literal(v) for v in values]
        return [
            f"{fill}({row}, {text}, {pointer(one)});"
            for text, one in zip(texts, singles(target), strict=True)
        ]

    def _unit(self, unit: Unit) -> list[str]:
        target, row = self._ref(unit.target), unit.target.array.row
        zeros = f"{self._helper('clear_rows')}({target.size * row}, {pointer(target)});"
        ones = [target.offset * row + k * row + unit.first + k for k in range(target.size)]
        return [
            zeros,
            *(f"{target.array.name}[{index_text(at)}] = {self.dialect.literal(1)};" for at in ones),
        ]

    def _copy(self, copy: Copy) -> list[str]:
        target, source = self._ref(copy.target), self._ref(copy.source)
        if target.lanes:
            return self._copy_rows(target, source, "add_rows" if copy.adds else "copy_rows")
        if target.size > FEW and target.stride == source.stride == 1:
            helper = self._helper("add" if copy.adds else "copy")
            return [f"{helper}({target.size}, {pointer(source)}, {pointer(target)});"]
        sign = "+=" if copy.adds else "="
        return [f"{scalar(target, k)} {sign} {scalar(source, k)};" for k in range(target.size)]

    def _copy_rows(self, target: Ref, source: Ref, how: str) -> list[str]:
        row = target.array.row
        if not source.lanes:
            fill, pairs = self._helper("fill_rows"), enumerate(singles(target))
            return [f"{fill}({row}, {scalar(source, k)}, {pointer(one)});" for k, one in pairs]
        copy = self._helper(how)
        if target.stride == source.stride == 1:
            return [f"{copy}({target.size * row}, {pointer(source)}, {pointer(target)});"]
        pairs = zip(singles(source), singles(target), strict=True)
        return [f"{copy}({row}, {pointer(one)}, {pointer(other)});" for one, other in pairs]

    def _helper(self, name: str) -> str:
        self.helpers.add(name)
        return f"{self.prefix}_{name}"

    def _guard(self, guard: Guard) -> list[str]:
        given = self._ref(guard.scalar)
        test = f"!({' && '.join(f'{scalar(given, k)} > {self.dialect.literal(0)}' for k in range(given.size))})"
        if given.lanes:
            test = (
                f"!{self._helper('all_positive')}({given.size * given.array.row}, {pointer(given)})"
            )
        return [f"if ({test}) {{", f"  return STATUS_{guard.status};", "}"]

    def _factor(self, factor: Factor) -> list[str]:
        matrix = self._ref(factor.matrix[0])
        if matrix.lanes:
            self.helpers |= {"all_positive"}
            call = (
                f"{self._helper('ldl_factor_side_by_side')}({factor.size}, {matrix.array.row}, "
                f"{pointer(matrix)})"
            )
        else:
            self.helpers |= {"lanes"}
            call = f"{self._helper('ldl_factor')}({factor.size}, {pointer(matrix)})"
        return [f"if ({call} != STATUS_OK) {{", "  return STATUS_NOT_POSITIVE_DEFINITE;", "}"]

    def _solve(self, solve: Solve) -> list[str]:
        matrix, x = self._ref(solve.matrix[0]), self._ref(solve.x)
        if not x.lanes:
            return [f"{self._helper('ldl_solve')}({x.size}, {pointer(matrix)}, {pointer(x)});"]
        self.helpers.add("lanes")
        if matrix.lanes:
            helper = self._helper("ldl_solve_side_by_side")
            return [f"{helper}({x.size}, {x.array.row}, {pointer(matrix)}, {pointer(x)});"]
        helper = self._helper("ldl_solve_rows")
        return [f"{helper}({x.size}, {x.lanes}, {x.array.row}, {pointer(matrix)}, {pointer(x)});"]

    def _factorpair(self, factor: FactorPair) -> list[str]:
        self.helpers |= {"lanes"}
        matrix = pointer(self._ref(factor.matrix[0]))
        call = f"{self._helper('pair_factor')}({factor.size}, {matrix})"
        return [f"if ({call} != STATUS_OK) {{", "  return STATUS_NOT_POSITIVE_DEFINITE;", "}"]

    def _solvepair(self, solve: SolvePair) -> list[str]:
        matrix, x = pointer(self._ref(solve.matrix[0])), pointer(self._ref(solve.x))
        return [f"{self._helper('pair_solve')}({solve.x.size}, {matrix}, {x});"]

    def _call(self, call: Call) -> list[str]:
        inner = in_loops(call.program, self.real, self.prefix, self.fixed)
        name = call.program.name
        if self.callees.setdefault(name, (call.program, inner))[0] != call.program:
            raise ValueError(f"two programs are called {name}")
        self.callees |= {program.name: (program, function) for program, function in inner.callees}
        self.helpers |= inner.helpers
        arguments, given = ["parameters"], dict(call.arguments)
        for array in (*call.program.of_role("input"), *call.program.of_role("output")):
            arguments.append(pointer(self._ref(given[array.name].part(0, 1))))
        text = f"{self.prefix}_{name}({', '.join(arguments)}, work + {CALLEES_WORK})"
        return [
            "{",
            f"  const int status = {text};",
            "  if (status != STATUS_OK) {",
            "    return status;",
            "  }",
            "}",
        ]

    def _apply(self, call: Apply) -> list[str]:
        outputs = list(zip(call.step.outputs, map(self._ref, call.writes), call.adds, strict=True))
        routine, lanes = self._routine(call)
        arguments = [pointer(self._ref(ref)) for ref in call.reads]
        before, after = [], []
        for (name, size), target, adds in outputs:
            if target.stride == 1:
                arguments.append(pointer(target))
                continue
            before.append(f"real {name}_new[{size * target.array.row}];")
            after += self._scattered(name, target, adds)
            arguments.append(f"{name}_new")
        if lanes:
            arguments.append(index_text(call.columns) if call.columns else str(lanes))
        line = f"{self.prefix}_{routine.name}({', '.join(arguments)});"
        return [line] if not before else ["{", *("  " + x for x in (*before, line, *after)), "}"]

    def _scattered(self, name: str, target: Ref, adds: bool) -> list[str]:
        if target.lanes:
            source = Array(f"{name}_new", "local", target.size, lanes=target.lanes)[0]
            return self._copy_rows(target, source, "add_rows" if adds else "copy_rows")
        return [
            f"{scalar(target, k)} {'+=' if adds else '='} {name}_new[{k}];"
            for k in range(target.size)
        ]

    def _routine(self, call: Apply) -> tuple[Routine, int]:
        """Return what to call, and the lanes of its rows."""
        wide = {
            n: ref
            for named in (call.inputs(), call.outputs())
            for n, ref in named.items()
            if ref.lanes
        }
        written = zip(call.outputs().items(), call.adds, strict=True)
        adds = {name for (name, ref), adds in written if adds and ref.stride == 1}
        row = next((ref.array.row for ref in wide.values()), 1)
        apart = tuple((name, ref.stride) for name, ref in call.inputs().items() if ref.stride > 1)
        if any(name in wide for name, _ in apart):
            raise ValueError(
                f"{call.step.name} reads rows from places apart, which a pointer cannot show"
            )
        routine = Routine(call.step, frozenset(wide), row, frozenset(adds), apart)
        if self.routines.setdefault(routine.name, routine) != routine:
            raise ValueError(f"two steps are called {routine.name}")
        given = [
            padded(wide[name].lanes) if name in wide else 0
            for name, size in call.step.inputs
            for _ in range(size)
        ]
        self.helpers |= called(call.step.nodes, given) | ({"lanes"} if wide else set())
        return routine, next((ref.lanes for ref in wide.values()), 0)


def singles(ref: Ref) -> list[Ref]:
    """Return a reference to each scalar of a reference."""
    return [Ref(ref.array, ref.offset + k * ref.stride, 1) for k in range(ref.size)]


def in_loops(program: Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program as loops."""
    return LoopPrinter(program, real, prefix, fixed).function()
