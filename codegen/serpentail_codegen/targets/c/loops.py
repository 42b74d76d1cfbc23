"""Prints a program as C loops that call its steps, each a function of its own."""

from dataclasses import replace
from functools import singledispatchmethod

from ...ir import program as ir
from ..expressions import called, index_text
from ..target import UnprintableStatement, body_lines, refused, unknown_statement
from .conditions import copied_where, stored_where, when_in_lanes
from .routine import CFunction, Routine, dialect, pointer, scalar, singles

INLINE_SCALARS = 3  # are written one by one, more by a helper
STACK_SCALARS = 12  # larger local arrays go to the caller's workspace
CALLEES_WORK = "<work>"  # placeholder for the start of a called function's workspace


class LoopPrinter:
    """Prints a program as C loops that call its steps."""

    def __init__(self, program: ir.Program, real: str, prefix: str, fixed=None):
        self.program, self.real, self.prefix, self.fixed = program, real, prefix, fixed or {}
        self.dialect = dialect(real)
        self.callees: dict[str, tuple[ir.Program, CFunction]] = {}
        self.routines: dict[str, Routine] = {}
        self.helpers: set[str] = set()
        self.used: dict[str, ir.Array] = {}
        self.where: tuple[str, ...] = ()  # rows that are positive in the lanes that store

    def function(self) -> CFunction:
        """Return the printed function."""
        body = body_lines(self, self.program.body)
        declarations, work = self._declarations()
        inner = ir.padded(work)  # the workspace of called functions begins at a whole vector, too
        lines = (
            *declarations,
            *(line.replace(CALLEES_WORK, str(inner)) for line in body),
        )
        behind = [inner + body.work for _, body in self.callees.values() if body.work]
        work = max([work, *behind])
        routines, callees = tuple(self.routines.values()), tuple(self.callees.values())
        return CFunction(lines, work, routines, frozenset(self.helpers), self.program, callees)

    def _declarations(self) -> tuple[list[str], int]:
        lines, work = [], 0
        # wide arrays first, where vectors are aligned
        for array in sorted(self.used.values(), key=lambda a: not a.lanes):
            values = self.fixed.get(array.name, array.values)
            if array.role == "constant" or array.name in self.fixed:
                text = ", ".join(self.dialect.literal(v) for v in values)
                lines.append(f"static const real {array.name}[{array.length}] = {{{text}}};")
            elif array.role == "local" and array.length * array.row <= STACK_SCALARS:
                lines.append(f"real {array.name}[{array.length * array.row}];")
            elif array.role == "local":
                lines.append(f"real *const {array.name} = work + {work};")
                work += array.length * array.row
        return lines, work

    def _ref(self, ref: ir.Ref) -> ir.Ref:
        if ref.array.name in self.fixed:
            values = tuple(self.fixed[ref.array.name])
            ref = replace(ref, array=replace(ref.array, role="constant", values=values))
        self.used.setdefault(ref.array.name, ref.array)
        return ref

    statement = singledispatchmethod(unknown_statement)

    @statement.register
    def _loop(self, loop: ir.Loop) -> list[str]:
        start, stop, var = index_text(loop.start), index_text(loop.stop), loop.var
        head = f"for (int {var} = {start}; {var} < {stop}; ++{var}) {{"
        if loop.downward:
            head = f"for (int {var} = {index_text(loop.stop + -1)}; {var} >= {start}; --{var}) {{"
        return [head, *("  " + line for line in body_lines(self, loop.body)), "}"]

    @statement.register
    def _when(self, when: ir.When) -> list[str]:
        if when.scalar.lanes:
            return when_in_lanes(self, when, self._ref(when.scalar))
        head = f"if ({scalar(self._ref(when.scalar), 0)} > {self.dialect.literal(0)}) {{"
        return [head, *("  " + line for line in body_lines(self, when.body)), "}"]

    @statement.register
    def _fill(self, fill: ir.Fill) -> list[str]:
        target = self._ref(fill.target)
        if target.lanes:
            return self._fill_wide(target, fill.values)
        alike = target.stride == 1 and len(set(fill.values)) == 1
        if target.size > INLINE_SCALARS and alike:
            value = self.dialect.literal(fill.values[0])
            return [f"{self.helper('fill')}({target.size}, {value}, {pointer(target)});"]
        return [
            f"{scalar(target, k)} = {self.dialect.literal(v)};" for k, v in enumerate(fill.values)
        ]

    def _fill_wide(self, target: ir.Ref, values) -> list[str]:
        if target.stride == 1 and not any(values):
            return [
                f"{self.helper('clear_rows')}({target.size * target.array.row}, {pointer(target)});"
            ]
        fill, pitch = self.helper("fill_rows"), target.array.row
        texts = [self.dialect.literal(v) for v in values]
        return [
            f"{fill}({pitch}, {text}, {pointer(one)});"
            for text, one in zip(texts, singles(target), strict=True)
        ]

    @statement.register
    def _unit(self, unit: ir.Unit) -> list[str]:
        target, pitch = self._ref(unit.target), unit.target.array.row
        zeros = f"{self.helper('clear_rows')}({target.size * pitch}, {pointer(target)});"
        ones = [target.offset * pitch + k * pitch + unit.first + k for k in range(target.size)]
        return [
            zeros,
            *(f"{target.array.name}[{index_text(at)}] = {self.dialect.literal(1)};" for at in ones),
        ]

    @statement.register
    def _copy(self, copy: ir.Copy) -> list[str]:
        target, source = self._ref(copy.target), self._ref(copy.source)
        if target.lanes:
            return self._copy_wide(target, source, copy.adds)
        if target.size > INLINE_SCALARS and target.stride == source.stride == 1:
            helper = self.helper("add" if copy.adds else "copy")
            return [f"{helper}({target.size}, {pointer(source)}, {pointer(target)});"]
        sign = "+=" if copy.adds else "="
        return [f"{scalar(target, k)} {sign} {scalar(source, k)};" for k in range(target.size)]

    def _copy_wide(self, target: ir.Ref, source: ir.Ref, adds: bool) -> list[str]:
        pitch = target.array.row
        if self.where:
            return copied_where(self, target, source, adds)
        if source.lanes:
            copy = self.helper("add_rows" if adds else "copy_rows")
            if target.stride == source.stride == 1:
                return [f"{copy}({target.size * pitch}, {pointer(source)}, {pointer(target)});"]
            pairs = zip(singles(source), singles(target), strict=True)
            return [f"{copy}({pitch}, {pointer(one)}, {pointer(other)});" for one, other in pairs]

        # a number goes to all lanes
        if adds:
            raise UnprintableStatement(
                f"numbers cannot be added to the lanes of {target.array.name}"
            )
        fill = self.helper("fill_rows")
        return [
            f"{fill}({pitch}, {scalar(source, k)}, {pointer(one)});"
            for k, one in enumerate(singles(target))
        ]

    def helper(self, name: str) -> str:
        """Return the C name of a helper, which is then emitted."""
        self.helpers.add(name)
        return f"{self.prefix}_{name}"

    @statement.register
    def _guard(self, guard: ir.Guard) -> list[str]:
        scalars, zero = self._ref(guard.scalar), self.dialect.literal(0)
        if scalars.lanes:
            # rows that are not full hold anything behind their lanes
            full, lanes = scalars.lanes == scalars.array.row, scalars.lanes
            rows = [(scalars, scalars.size)] if full else [(one, 1) for one in singles(scalars)]
            positive = self.helper("all_positive")
            tests = [f"{positive}({size * lanes}, {pointer(ref)})" for ref, size in rows]
            holds = tests[0] if full else f"({' && '.join(tests)})"
        else:
            tests = [f"{scalar(scalars, k)} > {zero}" for k in range(scalars.size)]
            holds = f"({' && '.join(tests)})"
        return [f"if (!{holds}) {{", f"  return STATUS_{guard.status};", "}"]

    @statement.register
    def _factor(self, factor: ir.Factor) -> list[str]:
        helper = "pair_factor" if factor.pair else "ldl_factor"
        matrix = self._ref(factor.matrix[0])
        self.helpers.add("all_positive" if matrix.lanes else "lanes")
        if matrix.lanes:
            arguments = f"{factor.size}, {matrix.array.row}, {pointer(matrix)}"
            return unless_definite(f"{self.helper(f'{helper}_side_by_side')}({arguments})")
        return unless_definite(f"{self.helper(helper)}({factor.size}, {pointer(matrix)})")

    @statement.register
    def _solve(self, solve: ir.Solve) -> list[str]:
        matrix, x = self._ref(solve.matrix[0]), self._ref(solve.x)
        helper = "pair_solve" if solve.pair else "ldl_solve"
        if not x.lanes:
            return [f"{self.helper(helper)}({x.size}, {pointer(matrix)}, {pointer(x)});"]
        self.helpers.add("lanes")
        if matrix.lanes:
            helper = self.helper(f"{helper}_side_by_side")
            return [f"{helper}({x.size}, {x.array.row}, {pointer(matrix)}, {pointer(x)});"]
        if solve.pair:
            raise refused(self, solve, "of a pair, all is wide or nothing")
        helper = self.helper(f"{helper}_rows")
        return [f"{helper}({x.size}, {x.lanes}, {x.array.row}, {pointer(matrix)}, {pointer(x)});"]

    @statement.register
    def _call(self, call: ir.Call) -> list[str]:
        inner = in_loops(call.program, self.real, self.prefix, self.fixed)
        name = call.program.name
        if self.callees.setdefault(name, (call.program, inner))[0] != call.program:
            raise ValueError(f"two programs are called {name}")
        self.callees |= {program.name: (program, function) for program, function in inner.callees}
        self.helpers |= inner.helpers

        # arrays are passed by their addresses, and the callee's workspace lies behind ours
        arguments, arrays = ["parameters"], dict(call.arguments)
        for array in (*call.program.of_role("input"), *call.program.of_role("output")):
            arguments.append(pointer(self._ref(arrays[array.name].part(0, 1))))
        text = f"{self.prefix}_{name}({', '.join(arguments)}, work + {CALLEES_WORK})"
        return [
            "{",
            f"  const int status = {text};",
            "  if (status != STATUS_OK) {",
            "    return status;",
            "  }",
            "}",
        ]

    @statement.register
    def _apply(self, call: ir.Apply) -> list[str]:
        outputs = list(zip(call.step.outputs, map(self._ref, call.writes), call.adds, strict=True))
        routine, lanes = self._routine(call)
        arguments = [pointer(self._ref(ref)) for ref in call.reads]

        # an output whose scalars are not contiguous is computed elsewhere, then copied
        before, after = [], []
        for (name, size), target, adds in outputs:
            if target.stride == 1:
                arguments.append(pointer(target))
            else:
                before.append(f"real {name}_new[{size * target.array.row}];")
                after += self._scattered(name, target, adds)
                arguments.append(f"{name}_new")
        arguments += [self.where[-1]] if routine.chosen else []
        if lanes:
            arguments.append(index_text(call.columns) if call.columns else str(lanes))
        line = f"{self.prefix}_{routine.name}({', '.join(arguments)});"
        return [line] if not before else ["{", *("  " + x for x in (*before, line, *after)), "}"]

    def _scattered(self, name: str, target: ir.Ref, adds: bool) -> list[str]:
        if target.lanes:
            source = ir.Array(f"{name}_new", "local", target.size, lanes=target.lanes)[0]
            return self._copy_wide(target, source, adds)
        return [
            f"{scalar(target, k)} {'+=' if adds else '='} {name}_new[{k}];"
            for k in range(target.size)
        ]

    def _routine(self, call: ir.Apply) -> tuple[Routine, int]:
        """Return what to call, and the lanes of what is wide."""
        inputs, outputs = call.inputs(), call.outputs()
        refs = (*inputs.items(), *outputs.items())
        wide = {name: ref for name, ref in refs if ref.lanes}
        pitch = next((ref.array.row for ref in wide.values()), 1)

        written = zip(outputs.items(), call.adds, strict=True)
        adds = {name for (name, ref), added in written if added and ref.stride == 1}
        apart = tuple((name, ref.stride) for name, ref in inputs.items() if ref.stride > 1)
        chosen = stored_where(self, call)
        routine = Routine(call.step, frozenset(wide), pitch, frozenset(adds), apart, chosen)
        if self.routines.setdefault(routine.name, routine) != routine:
            raise ValueError(f"two steps are called {routine.name}")
        lanes = {name: ir.padded(ref.lanes) for name, ref in wide.items()}
        input_lanes = [lanes.get(name, 0) for name, size in call.step.inputs for _ in range(size)]
        self.helpers |= called(call.step.nodes, input_lanes) | ({"lanes"} if wide else set())
        return routine, next((ref.lanes for ref in wide.values()), 0)


def unless_definite(call: str) -> list[str]:
    """Print a call that gives up if a matrix is not positive definite."""
    return [f"if ({call} != STATUS_OK) {{", "  return STATUS_NOT_POSITIVE_DEFINITE;", "}"]


def in_loops(program: ir.Program, real: str, prefix: str, fixed=None) -> CFunction:
    """Print a program as loops."""
    return LoopPrinter(program, real, prefix, fixed).function()
