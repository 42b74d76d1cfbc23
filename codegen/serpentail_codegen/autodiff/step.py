"""Derivatives of steps: a straight-line step goes in, the step of its tangents or of its adjoints
comes out.

Both walk the tape once and differentiate each operation by its rule.  Tangents are called
``d_<vector>``, adjoints ``b_<vector>``; where a tangent is wide it stands for all directions at
once.
"""

from collections import Counter
from functools import cache

from ..ir.step import Step, compacted
from ..ir.tape import LEAVES, Tape, live_nodes, operands, replay
from .angles import SinesAndCosines


def _quotient(tape: Tape, y: int, a: int, b: int) -> tuple[int, int]:
    inverse = tape.div(tape.const(1), b)
    return inverse, tape.neg(tape.mul(y, inverse))


def _chosen(tape: Tape, c: int) -> tuple[int, int]:
    """1 for the operand that counts, 0 for the other; what does not count must have a derivative
    all the same.
    """
    one, zero = tape.const(1), tape.const(0)
    return tape.select(c, one, zero), tape.select(c, zero, one)


# partial derivatives of y = op(operands) with respect to each operand
PARTIALS = {
    "add": lambda tape, y, a, b: (tape.const(1), tape.const(1)),
    "sub": lambda tape, y, a, b: (tape.const(1), tape.const(-1)),
    "mul": lambda tape, y, a, b: (b, a),
    "div": _quotient,
    "neg": lambda tape, y, a: (tape.const(-1),),
    "sin": lambda tape, y, a: (tape.cos(a),),
    "cos": lambda tape, y, a: (tape.neg(tape.sin(a)),),
    "sqrt": lambda tape, y, a: (tape.div(tape.const(0.5), y),),
    "select": lambda tape, y, c, a, b: (tape.const(0), *_chosen(tape, c)),
}


class Rules:
    """Partial derivatives of the operations, recorded on a tape beside the values."""

    def __init__(self, step: Step):
        self.tape, self.step = Tape(), step
        self.count = sum(size for _, size in step.inputs)
        self.values = replay(step.nodes, [self.tape.input(k) for k in range(self.count)], self.tape)

    def partials(self, node: int) -> dict[int, int]:
        """Return the node of the partial derivative for each operand of an operation."""
        op, *args = self.step.nodes[node]
        out: dict[int, int] = {}
        for operand, partial in zip(
            args,
            PARTIALS[op](self.tape, self.values[node], *(self.values[a] for a in args)),
            strict=True,
        ):
            out[operand] = self.tape.add(out[operand], partial) if operand in out else partial
        return out

    def finish(self, prefix: str, doc: str, inputs, outputs, results) -> Step:
        """Return what was recorded as a step."""
        name = f"{prefix}_{self.step.name}"
        return compacted(
            Step(name, doc, tuple(inputs), tuple(outputs), tuple(self.tape.nodes), tuple(results))
        )


def some_of(vectors, chosen: frozenset[str], word: str = "") -> str:
    """Return the chosen vectors as a part of a name, nothing where all are."""
    return (
        ""
        if len(chosen) == len(vectors)
        else "_".join([word, *(name for name, _ in vectors if name in chosen)])
    )


def spans(vectors) -> dict[str, range]:
    """Return the positions of named vectors that follow each other."""
    out, first = {}, 0
    for name, size in vectors:
        out[name] = range(first, first + size)
        first += size
    return out


class Combinations:
    """Tangents as combinations of rows with narrow coefficients, summed up only where that saves
    work on rows.

    A node that is used once goes into its use: d(a (b + c)) = a db + a dc + (b + c) da needs no row
    for d(b + c).
    """

    MOST_TERMS = 2  # terms that are scaled one by one; more are summed first

    def __init__(self, rules: Rules):
        self.rules, self.tape, self.step = rules, rules.tape, rules.step
        live = live_nodes(self.step.nodes, self.step.results)
        self.uses = Counter(a for n in live for a in operands(self.step.nodes[n]))
        self.uses.update(self.step.results)

    def summed(self, terms: dict[int, int]) -> int:
        """Return one node for a combination."""
        total = self.tape.const(0)
        for row, coefficient in terms.items():
            total = self.tape.add(total, self.tape.mul(coefficient, row))
        return total

    def one_row(self, terms: dict[int, int]) -> dict[int, int]:
        """Return a combination of several rows as one row."""
        return {self.summed(terms): self.tape.const(1)} if len(terms) > 1 else terms

    def of(self, node: int, changes: list[dict[int, int]]) -> dict[int, int]:
        """Return the tangent of an operation from those of earlier nodes."""
        tape, total = self.tape, {}
        for operand, partial in self.rules.partials(node).items():
            terms = changes[operand]
            if len(terms) > self.MOST_TERMS and tape.value(partial) not in (1, -1):
                terms = changes[operand] = self.one_row(terms)
            for row, coefficient in terms.items():
                total[row] = tape.add(total.get(row, tape.const(0)), tape.mul(partial, coefficient))
        total = {
            row: coefficient for row, coefficient in total.items() if tape.value(coefficient) != 0
        }
        return self.one_row(total) if self.uses[node] > 1 else total


AngleInputs = frozenset[tuple[str, SinesAndCosines]]


def moved_inputs(rules: Rules, active: frozenset[str], angle_inputs: dict[str, SinesAndCosines]):
    """Return the tangents that a step takes, and the tangent of each of its input scalars as a
    combination of them.
    """
    tape, count, moving, slopes = rules.tape, rules.count, [], {}
    for name, span in spans(rules.step.inputs).items():
        if name in angle_inputs:
            for k, (angle, sign, other) in zip(span, angle_inputs[name].scalars, strict=True):
                partner = tape.input(span[other])
                slopes[k] = {tape.input(count + angle): partner if sign > 0 else tape.neg(partner)}
            moving.append((f"d_{name}_angles", angle_inputs[name].angles))
        elif name in active:
            slopes |= {k: {tape.input(count + n): tape.const(1)} for n, k in enumerate(span)}
            moving.append((f"d_{name}", len(span)))
        else:
            continue
        count += moving[-1][1]
    return moving, slopes


@cache
def tangent(step: Step, active: frozenset[str], angle_inputs: AngleInputs = frozenset()) -> Step:
    """Return the step with ``d_<output>`` for tangents ``d_<input>`` of the active inputs, and its
    own outputs.

    Of the inputs in ``angle_inputs``, which are sines and cosines, it takes ``d_<input>_angles``.
    """
    rules = Rules(step)
    moving, slopes = moved_inputs(rules, active, dict(angle_inputs))
    combinations, changes = Combinations(rules), []
    for node, (op, *args) in enumerate(step.nodes):
        if op in LEAVES:
            changes.append(slopes.get(args[0], {}) if op == "input" else {})
        else:
            changes.append(combinations.of(node, changes))
    outputs = (*step.outputs, *((f"d_{name}", size) for name, size in step.outputs))
    results = [rules.values[r] for r in step.results] + [
        combinations.summed(changes[r]) for r in step.results
    ]
    return rules.finish(
        f"d{some_of(step.inputs, active)}",
        f"Tangents of {step.name}.",
        (*step.inputs, *moving),
        outputs,
        results,
    )


@cache
def adjoint(
    step: Step,
    wanted: frozenset[str],
    given: frozenset[str],
    angle_inputs: AngleInputs = frozenset(),
) -> Step:
    """Return the step that takes ``b_<output>`` of the given outputs to ``b_<input>`` of the wanted
    inputs.

    Of the inputs in ``angle_inputs``, which are sines and cosines, it gives ``b_<input>_angles``.
    """
    rules, angles_of = Rules(step), dict(angle_inputs)
    tape, count, incoming = rules.tape, rules.count, []
    weight = [tape.const(0)] * len(step.nodes)
    for name, span in spans(step.outputs).items():
        if name in given:
            incoming.append((f"b_{name}", len(span)))
            for n, k in enumerate(span):
                weight[step.results[k]] = tape.add(weight[step.results[k]], tape.input(count + n))
            count += len(span)
    for node in reversed(live_nodes(step.nodes, step.results)):
        if step.nodes[node][0] not in LEAVES:
            for operand, partial in rules.partials(node).items():
                weight[operand] = tape.add(weight[operand], tape.mul(partial, weight[node]))
    position = {args[0]: node for node, (op, *args) in enumerate(step.nodes) if op == "input"}
    outputs, results = [], []
    for name, span in spans(step.inputs).items():
        if name in wanted:
            own = [weight[position[k]] if k in position else tape.const(0) for k in span]
            own = angle_adjoints(tape, span, angles_of[name], own) if name in angles_of else own
            outputs.append((f"b_{name}_angles" if name in angles_of else f"b_{name}", len(own)))
            results += own
    partly = some_of(step.inputs, wanted) + some_of(step.outputs, given, "_of")
    return rules.finish(
        f"b{partly}", f"Adjoints of {step.name}.", (*step.inputs, *incoming), outputs, results
    )


def angle_adjoints(tape: Tape, span: range, kind: SinesAndCosines, weights: list[int]) -> list[int]:
    """Return the adjoints of angles from those of their sines and cosines."""
    out = [tape.const(0)] * kind.angles
    for (angle, sign, other), weight in zip(kind.scalars, weights, strict=True):
        term = tape.mul(tape.input(span[other]), weight)
        out[angle] = tape.add(out[angle], term if sign > 0 else tape.neg(term))
    return out
