"""Programs in parts: rewriting a loop nest, dropping what nothing needs, writing out what a program
calls.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace

from .builder import narrowed
from .program import (
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
    statements,
)


def reads(statement) -> tuple[Ref, ...]:
    """Return what a statement reads; sums and what is overwritten in place are read too."""
    if isinstance(statement, Apply):
        return statement.reads + tuple(
            w for w, adds in zip(statement.writes, statement.adds, strict=True) if adds
        )
    if isinstance(statement, Copy):
        return (statement.source, statement.target) if statement.adds else (statement.source,)
    if isinstance(statement, Factor | FactorPair):
        return (statement.matrix[0],)
    if isinstance(statement, Solve | SolvePair):
        return (statement.matrix[0], statement.x)
    return (statement.scalar,) if isinstance(statement, Guard) else ()


def writes(statement) -> tuple[Ref, ...]:
    """Return what a statement writes."""
    if isinstance(statement, Apply):
        return statement.writes
    if isinstance(statement, Copy | Fill | Unit):
        return (statement.target,)
    if isinstance(statement, Factor | FactorPair):
        return (statement.matrix[0],)
    return (statement.x,) if isinstance(statement, Solve | SolvePair) else ()


def names(refs) -> set[str]:
    """Return the names of the arrays that references point into."""
    return {ref.array.name for ref in refs}


def rewritten(body: tuple, rewrite: Callable[[object], Iterator]) -> tuple:
    """Return a loop nest with each statement replaced by those that ``rewrite`` yields; empty loops
    vanish.
    """
    out = []
    for statement in body:
        if isinstance(statement, Loop):
            inner = rewritten(statement.body, rewrite)
            out += [replace(statement, body=inner)] if inner else []
        elif isinstance(statement, When):
            inner = rewritten(statement.body, rewrite)
            out += [replace(head, body=inner) for head in rewrite(replace(statement, body=()))]
        else:
            out += rewrite(statement)
    return tuple(out)


def _fixpoint(
    body: tuple, start: Collection[str], more: Callable[[object, set[str]], set[str]]
) -> set[str]:
    """Return names with what each statement adds to them, until none adds any."""
    found, before = set(start), -1
    while before < len(found):
        before = len(found)
        for statement, _ in statements(body):
            found |= more(statement, found)
    return found


def forward_slice(body: tuple, start: Collection[str]) -> set[str]:
    """Return the arrays that may depend on the arrays ``start``, by name."""
    return _fixpoint(
        body, start, lambda s, found: names(writes(s)) if names(reads(s)) & found else set()
    )


def backward_slice(body: tuple, end: Collection[str]) -> set[str]:
    """Return the arrays that the arrays ``end`` may depend on, by name."""

    def more(statement, found: set[str]) -> set[str]:
        targets = statement.protects if isinstance(statement, Guard) else writes(statement)
        return names(reads(_with_outputs(statement, found))) if names(targets) & found else set()

    return _fixpoint(body, end, more)


def _with_outputs(statement, needed: Collection[str]):
    """Return an Apply without the outputs that go to unneeded arrays."""
    if not isinstance(statement, Apply):
        return statement
    kept = [k for k, ref in enumerate(statement.writes) if ref.array.name in needed]
    if len(kept) == len(statement.writes):
        return statement
    step = narrowed(statement.step, {statement.step.outputs[k][0] for k in kept})
    given = statement.inputs()
    return replace(
        statement,
        step=step,
        reads=tuple(given[name] for name, _ in step.inputs),
        writes=tuple(statement.writes[k] for k in kept),
        adds=tuple(statement.adds[k] for k in kept),
    )


def pruned(program: Program) -> Program:
    """Return a program without the statements and arrays that no output needs; arrays are what is
    declared by name.
    """
    array = {a.name: a for a in program.arrays}
    needed = backward_slice(program.body, {a.name for a in program.of_role("output")})

    def rewrite(statement):
        if isinstance(statement, Guard):
            protects = tuple(ref for ref in statement.protects if ref.array.name in needed)
            if protects:
                yield replace(statement, protects=protects)
        elif names(writes(statement)) & needed:
            yield _with_outputs(statement, needed)

    body = rewritten(program.body, lambda s: (with_arrays(kept, array) for kept in rewrite(s)))
    kept = {a.name for a in program.arrays if a.role in ("input", "output", "parameters")} | needed
    return replace(program, arrays=tuple(a for a in program.arrays if a.name in kept), body=body)


def inner_arrays(program: Program) -> tuple[Array, ...]:
    """Return a program's arrays as a part of another one: its outputs are local."""
    return tuple(replace(a, role="local") if a.role == "output" else a for a in program.arrays)


def with_arrays(statement, array: Mapping[str, Array]):
    """Return a statement on other arrays."""

    def moved(ref: Ref) -> Ref:
        return replace(ref, array=array[ref.array.name])

    changes = {}
    for name in ("target", "source", "scalar", "x"):
        if hasattr(statement, name):
            changes[name] = moved(getattr(statement, name))
    for name in ("reads", "writes", "protects"):
        if hasattr(statement, name):
            changes[name] = tuple(map(moved, getattr(statement, name)))
    if hasattr(statement, "matrix"):
        changes["matrix"] = array[statement.matrix.name]
    return replace(statement, **changes)


def inlined(program: Program) -> Program:
    """Return a program with the programs that it calls written out; their own arrays are
    renamed.
    """
    arrays = {a.name: a for a in program.arrays}

    def rewrite(statement):
        if not isinstance(statement, Call):
            return (statement,)
        inner, arguments = inlined(statement.program), dict(statement.arguments)
        array = {a.name: arguments.get(a.name) or _own(a, inner.name, arrays) for a in inner.arrays}
        return rewritten(inner.body, lambda s: (with_arrays(s, array),))

    body = rewritten(program.body, rewrite)
    return replace(program, arrays=tuple(arrays.values()), body=body)


def _own(array: Array, owner: str, arrays: dict[str, Array]) -> Array:
    """Return an array of a called program: the shared parameter, or a new one of a new name."""
    if array.role == "parameters":
        return arrays[array.name]
    name = number = f"{owner}_{array.name}"
    while name in arrays:
        name = f"{number}_{len(arrays)}"
    arrays[name] = replace(array, name=name)
    return arrays[name]
