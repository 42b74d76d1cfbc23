"""Dependences in a program, and programs rewritten: pruned, inlined, on other arrays."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from typing import Any

from . import program as ir
from .builder import narrowed
from .step import Step

Around = tuple[ir.Loop | ir.When, ...]  # a statement
More = Callable[[ir.Statement, Around, set[str]], set[str]]


def overlap(ref: ir.Ref, other: ir.Ref) -> bool:
    """Tell if two references may share a number."""
    if ref.array.name != other.array.name:
        return False
    if ref.lane or other.lane or ref.offset.terms != other.offset.terms:
        return True
    first, other_first = ref.offset.offset, other.offset.offset
    last = first + (ref.size - 1) * ref.stride
    other_last = other_first + (other.size - 1) * other.stride
    return first <= other_last and other_first <= last


def accesses(statement: ir.Statement) -> tuple[tuple[ir.Ref, ...], tuple[ir.Ref, ...]]:
    """Return what a statement reads, including targets that it adds to or overwrites in place, and
    what it writes.
    """
    match statement:
        case ir.Apply(_, reads, writes, adds):
            return (*reads, *(ref for ref, sums in zip(writes, adds, strict=True) if sums)), writes
        case ir.Copy(target, source, adds):
            return (source, target) if adds else (source,), (target,)
        case ir.Fill(target) | ir.Unit(target):
            return (), (target,)
        case ir.Factor(matrix):
            return (matrix[0],), (matrix[0],)
        case ir.Solve(matrix, x):
            return (matrix[0], x), (x,)
        case ir.Guard(scalar):
            return (scalar,), ()
    raise TypeError(f"no rule says what {type(statement).__name__} reads and writes")


def reads(statement: ir.Statement) -> tuple[ir.Ref, ...]:
    """Return what a statement reads."""
    return accesses(statement)[0]


def writes(statement: ir.Statement) -> tuple[ir.Ref, ...]:
    """Return what a statement writes."""
    return accesses(statement)[1]


def names(refs: Iterable[ir.Ref]) -> set[str]:
    """Return the names of the arrays that references point into."""
    return {ref.array.name for ref in refs}


def rule_of(visitor: object, statement: ir.Statement, does: str) -> Callable[..., Any]:
    """Return the method of a visitor that is named like a statement: ``solve`` of Solve.

    does: what the visitor's methods do, for the error if it has none.
    """
    name = type(statement).__name__
    rule = getattr(visitor, name.lower(), None)
    if rule is None:
        raise TypeError(f"no rule {does} {name}")
    return rule


def read_names(body: ir.Body) -> set[str]:
    """Return the names of the arrays that statements read, or hand to other programs."""
    found: set[str] = set()
    for statement, _ in ir.statements(body):
        if isinstance(statement, ir.Call):
            found |= {array.name for _, array in statement.arguments}
        else:
            found |= names(reads(statement))
    return found


def rewritten(body: ir.Body, rewrite: Callable[[ir.Statement], Iterable[ir.Statement]]) -> ir.Body:
    """Return a loop nest with each statement replaced by those that ``rewrite`` returns.

    A condition is rewritten without its body; loops and conditions that are empty then vanish.
    """
    out: list[ir.Statement] = []
    for statement in body:
        if isinstance(statement, ir.Loop):
            inner = rewritten(statement.body, rewrite)
            if inner:
                out.append(replace(statement, body=inner))
        elif isinstance(statement, ir.When):
            inner = rewritten(statement.body, rewrite)
            for head in rewrite(replace(statement, body=())) if inner else ():
                assert isinstance(head, ir.When), "a condition is rewritten as a condition"
                out.append(replace(head, body=inner))
        else:
            out += rewrite(statement)
    return tuple(out)


def _fixpoint(body: ir.Body, start: Collection[str], more: More) -> set[str]:
    """Return names with what each statement adds to them, until none adds any."""
    reached, before = set(start), -1
    while before < len(reached):
        before = len(reached)
        for statement, around in ir.statements(body):
            reached |= more(statement, around, reached)
    return reached


def forward_slice(body: ir.Body, start: Collection[str], decided: bool = False) -> set[str]:
    """Return the arrays that may depend on the arrays ``start``, by name; ``decided``: also those
    that conditions on these decide about.
    """

    def more(statement: ir.Statement, around: Around, reached: set[str]) -> set[str]:
        deciding = [outer.scalar for outer in around if decided and isinstance(outer, ir.When)]
        moves = names((*reads(statement), *deciding)) & reached
        return names(writes(statement)) if moves else set()

    return _fixpoint(body, start, more)


def backward_slice(body: ir.Body, end: Collection[str]) -> set[str]:
    """Return the arrays that the arrays ``end`` may depend on, by name."""

    def more(statement: ir.Statement, around: Around, reached: set[str]) -> set[str]:
        targets = statement.protects if isinstance(statement, ir.Guard) else writes(statement)
        if not names(targets) & reached:
            return set()
        return names(reads(_narrowed(statement, reached)))

    return _fixpoint(body, end, more)


def with_outputs(call: ir.Apply, wanted: Iterable[str], step: Step | None = None) -> ir.Apply:
    """Return an application of a step with only some outputs; ``step``: another one in its place,
    which reads no more.
    """
    step = narrowed(step or call.step, set(wanted))
    targets = dict(zip(call.outputs(), zip(call.writes, call.adds, strict=True), strict=True))
    writes, adds = zip(*(targets[name] for name, _ in step.outputs), strict=True)
    return replace(ir.Apply.named(step, call.inputs(), writes, adds), columns=call.columns)


def _narrowed(statement: ir.Statement, needed: Collection[str]) -> ir.Statement:
    """Return an Apply without the outputs that go to unneeded arrays."""
    if not isinstance(statement, ir.Apply):
        return statement
    kept = {name for name, ref in statement.outputs().items() if ref.array.name in needed}
    return statement if len(kept) == len(statement.writes) else with_outputs(statement, kept)


def pruned(program: ir.Program) -> ir.Program:
    """Return a program without the statements and arrays that no output needs.

    Statements are moved onto the arrays that are declared by the names of theirs.
    """
    array = {a.name: a for a in program.arrays}
    needed = backward_slice(program.body, {a.name for a in program.of_role("output")})

    def rewrite(statement: ir.Statement) -> Iterator[ir.Statement]:
        if isinstance(statement, ir.When):
            yield with_arrays(statement, array)
        elif isinstance(statement, ir.Guard):
            protects = tuple(ref for ref in statement.protects if ref.array.name in needed)
            if protects:
                yield with_arrays(replace(statement, protects=protects), array)
        elif names(writes(statement)) & needed:
            yield with_arrays(_narrowed(statement, needed), array)

    body = rewritten(program.body, rewrite)
    kept = {a.name for a in program.arrays if a.role in ("input", "output", "parameters")} | needed
    return replace(program, arrays=tuple(a for a in program.arrays if a.name in kept), body=body)


def inner_arrays(program: ir.Program) -> tuple[ir.Array, ...]:
    """Return a program's arrays as a part of another one: its outputs are local."""
    return tuple(replace(a, role="local") if a.role == "output" else a for a in program.arrays)


def with_arrays(statement: ir.Statement, array: Mapping[str, ir.Array]) -> ir.Statement:
    """Return a statement on other arrays, given by the names of its own."""

    def moved(ref: ir.Ref) -> ir.Ref:
        other = array[ref.array.name]
        return ref if other is ref.array else replace(ref, array=other)

    changes: dict[str, Any] = {}
    for field in fields(statement):
        value = getattr(statement, field.name)
        if isinstance(value, ir.Ref):
            changes[field.name] = moved(value)
        elif isinstance(value, ir.Array):
            changes[field.name] = array[value.name]
        elif field.name in ("reads", "writes", "protects"):
            changes[field.name] = tuple(moved(ref) for ref in value)
    return replace(statement, **changes)


def on_arrays(body: ir.Body, array: Mapping[str, ir.Array]) -> ir.Body:
    """Return a loop nest on other arrays, given by the names of its own."""
    return rewritten(body, lambda statement: (with_arrays(statement, array),))


def inlined(program: ir.Program) -> ir.Program:
    """Return a program with the programs that it calls written out, their own arrays renamed."""
    arrays = {a.name: a for a in program.arrays}

    def rewrite(statement: ir.Statement) -> Iterable[ir.Statement]:
        if not isinstance(statement, ir.Call):
            return (statement,)
        inner, arguments = inlined(statement.program), dict(statement.arguments)
        array = {}
        for a in inner.arrays:
            array[a.name] = arguments.get(a.name) or _adopted(a, inner.name, arrays)
        return on_arrays(inner.body, array)

    body = rewritten(program.body, rewrite)
    return replace(program, arrays=tuple(arrays.values()), body=body)


def _adopted(array: ir.Array, program: str, arrays: dict[str, ir.Array]) -> ir.Array:
    """Return an array of a called program: the shared parameter, or a new one of a new name."""
    if array.role == "parameters":
        return arrays[array.name]
    name = prefixed = f"{program}_{array.name}"
    while name in arrays:
        name = f"{prefixed}_{len(arrays)}"
    arrays[name] = replace(array, name=name)
    return arrays[name]
