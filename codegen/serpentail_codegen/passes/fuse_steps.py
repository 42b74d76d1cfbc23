"""Steps that follow each other become one: what one hands to the next is not stored on the way."""

import hashlib
from collections.abc import Container
from dataclasses import replace

from ..ir.dataflow import overlap, pruned
from ..ir.program import Apply, Body, Fill, Index, Loop, Program, Ref, Statement
from ..ir.step import Step, compacted
from ..ir.tape import Tape, replay

THEN = "_then_"  # between the names of steps that were joined
AFTER = " Then: "  # between their descriptions
MOST_WRITTEN_OUT = 400  # nodes of all iterations of a loop
MOST_NODES = 1500  # of one step: beyond, its text and its spilled values cost more than it saves


def fused(program: Program) -> Program:
    """Return a program with fewer, larger steps; it has no calls."""
    return pruned(replace(program, body=_joined_body(_without_loops(program.body))))


def _without_loops(body: Body) -> Body:
    """Write out the outermost loops that are short, if they have steps alone."""
    out: list[Statement] = []
    for statement in body:
        if isinstance(statement, Loop) and _short(statement):
            span = range(statement.start.offset, statement.stop.offset)
            steps = [inner for inner in statement.body if isinstance(inner, Apply)]
            for k in reversed(span) if statement.downward else span:
                out += [_at(step, statement.var, k) for step in steps]
        else:
            out.append(statement)
    return tuple(out)


def _short(loop: Loop) -> bool:
    steps = [inner for inner in loop.body if isinstance(inner, Apply)]
    nodes = sum(len(step.step.nodes) for step in steps)
    count = loop.stop.offset - loop.start.offset
    return len(steps) == len(loop.body) and nodes * count <= MOST_WRITTEN_OUT


def _at(call: Apply, variable: str, value: int) -> Apply:
    """Return a step in one iteration of a loop."""

    def moved(index: Index) -> Index:
        kept = tuple(term for term in index.terms if term[0] != variable)
        return Index(kept, index.offset + value * dict(index.terms).get(variable, 0))

    def at(ref: Ref) -> Ref:
        lane = None if ref.lane is None else moved(ref.lane)
        return replace(ref, offset=moved(ref.offset), lane=lane)

    reads, writes = tuple(map(at, call.reads)), tuple(map(at, call.writes))
    columns = None if call.columns is None else moved(call.columns)
    return replace(call, reads=reads, writes=writes, columns=columns)


def _joined_body(body: Body) -> Body:
    out: list[Statement] = []
    for statement in body:
        before = out[-1] if out else None
        if isinstance(before, Fill) and _adds_to(statement, before.target):
            before = out[-1] = _as_step(before)
        if isinstance(statement, Loop):
            out.append(replace(statement, body=_joined_body(statement.body)))
        elif isinstance(statement, Apply) and isinstance(before, Apply) and fit(before, statement):
            out[-1] = joined(before, statement)
        else:
            out.append(statement)
    return tuple(out)


def _targets(call: Apply) -> list[tuple[Ref, bool]]:
    return list(zip(call.writes, call.adds, strict=True))


def _adds_to(statement: Statement, target: Ref) -> bool:
    return isinstance(statement, Apply) and (target, True) in _targets(statement)


def _as_step(fill: Fill) -> Apply:
    """Return a fill as a step without inputs."""
    tape = Tape()
    nodes = tuple(tape.const(value) for value in fill.values)
    outputs = (("filled", fill.target.size),)
    step = Step("fill", "Constants.", (), outputs, tuple(tape.nodes), nodes)
    return Apply(step, (), (fill.target,), (False,))


def fit(first: Apply, second: Apply) -> bool:
    """Tell if two steps can be one, which reads all before it writes."""
    nodes = len(first.step.nodes) + len(second.step.nodes)
    if first.columns != second.columns or nodes > MOST_NODES:
        return False
    refs = (*first.reads, *first.writes, *second.reads, *second.writes)
    if len({ref.lanes for ref in refs} - {0}) > 1:
        return False  # directions of one are not those of the other
    handed = first.stored()
    for written in first.writes:
        read = [ref for ref in second.reads if overlap(ref, written)]
        if any(ref != written or ref not in handed for ref in read):
            return False
        both = [(ref, adds) for ref, adds in _targets(second) if overlap(ref, written)]
        if any(ref != written or ref not in handed or not adds for ref, adds in both):
            return False  # sums are not added up in another order
    return True


def joined(first: Apply, second: Apply) -> Apply:
    """Return one step in place of two."""
    recording = _Recording()
    outputs: dict[str, tuple[Ref, bool, list[int]]] = {}
    for call in (first, second):
        results = recording.run(call)
        for (name, ref), adds in zip(call.outputs().items(), call.adds, strict=True):
            given = [n for n, (other, _, _) in outputs.items() if other == ref]
            if given:  # what the first stores, and the second adds to
                pairs = zip(outputs[given[0]][2], results[name], strict=True)
                outputs[given[0]] = ref, False, [recording.tape.add(a, b) for a, b in pairs]
            else:
                outputs[unused(name, outputs)] = ref, adds, results[name]
                recording.vectors[ref] = results[name]

    step = compacted(
        Step(
            "",
            f"{first.step.doc}{AFTER}{second.step.doc}",
            tuple((name, ref.size) for name, ref in recording.reads.items()),
            tuple((name, ref.size) for name, (ref, _, _) in outputs.items()),
            tuple(recording.tape.nodes),
            tuple(node for _, _, nodes in outputs.values() for node in nodes),
        )
    )
    # two steps may be joined in several ways: a digest tells these apart
    digest = hashlib.sha256(repr(step).encode()).hexdigest()[:6]
    name = f"{first.step.name.split(THEN)[0]}{THEN}{second.step.name}_{digest}"
    targets = [ref for ref, _, _ in outputs.values()]
    added = [adds for _, adds, _ in outputs.values()]
    return replace(
        Apply.named(replace(step, name=name), recording.reads, targets, added),
        columns=first.columns,
    )


class _Recording:
    """Steps on one tape: what is read of the program is an input, once.

    vectors: the nodes of what a reference means now.
    """

    def __init__(self) -> None:
        self.tape = Tape()
        self.vectors: dict[Ref, list[int]] = {}
        self.reads: dict[str, Ref] = {}

    def run(self, call: Apply) -> dict[str, list[int]]:
        """Record a step, and return the nodes of its outputs."""
        scalars: list[int] = []
        for name, ref in call.inputs().items():
            if ref not in self.vectors:
                first = sum(read.size for read in self.reads.values())
                self.vectors[ref] = [self.tape.input(first + k) for k in range(ref.size)]
                self.reads[unused(name, self.reads)] = ref
            scalars += self.vectors[ref]
        nodes = replay(call.step.nodes, scalars, self.tape)
        results = (nodes[r] for r in call.step.results)
        return {name: [next(results) for _ in range(size)] for name, size in call.step.outputs}


def unused(name: str, names: Container[str]) -> str:
    """Return a name that is not taken yet."""
    while name in names:
        name = f"{name}_too"
    return name
