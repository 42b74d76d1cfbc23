"""Derivatives of steps: the step of a step's tangents, and that of its adjoints.

Both walk the operations once and differentiate each by its rule.  Tangents are called
``d_<vector>``, adjoints ``b_<vector>``; where a tangent is wide, its lanes are the directions.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache

from ..ir.step import Step, Vectors, compacted, spans
from ..ir.tape import LEAVES, Tape, live_nodes, operands, replay
from .angles import AngleInputs, SinesAndCosines

Combination = dict[int, int]  # a sum of tangents: the coefficient of each


def _quotient(tape: Tape, y: int, a: int, b: int) -> tuple[int, ...]:
    inverse = tape.div(tape.const(1), b)
    return inverse, tape.neg(tape.mul(y, inverse))


def _selection(tape: Tape, y: int, c: int, a: int, b: int) -> tuple[int, ...]:
    """1 for the operand that is selected, 0 for the other, which must have a derivative as well."""
    one, zero = tape.const(1), tape.const(0)
    return zero, tape.select(c, one, zero), tape.select(c, zero, one)


# partial derivatives of y = op(operands) with respect to each operand
PARTIALS: dict[str, Callable[..., tuple[int, ...]]] = {
    "add": lambda tape, y, a, b: (tape.const(1), tape.const(1)),
    "sub": lambda tape, y, a, b: (tape.const(1), tape.const(-1)),
    "mul": lambda tape, y, a, b: (b, a),
    "div": _quotient,
    "neg": lambda tape, y, a: (tape.const(-1),),
    "sin": lambda tape, y, a: (tape.cos(a),),
    "cos": lambda tape, y, a: (tape.neg(tape.sin(a)),),
    "sqrt": lambda tape, y, a: (tape.div(tape.const(0.5), y),),
    "select": _selection,
}


class Rules:
    """A tape on which a step's values are recorded, and the partial derivatives beside them."""

    def __init__(self, step: Step):
        self.tape, self.step = Tape(), step
        self.count = sum(size for _, size in step.inputs)
        self.values = replay(step.nodes, [self.tape.input(k) for k in range(self.count)], self.tape)

    def partials(self, node: int) -> dict[int, int]:
        """Return the node of the partial derivative for each operand of an operation."""
        op, *args = self.step.nodes[node]
        partials = PARTIALS[op](self.tape, self.values[node], *(self.values[a] for a in args))
        out: dict[int, int] = {}
        for operand, partial in zip(args, partials, strict=True):
            if operand in out:  # the same node twice, as in a * a
                out[operand] = self.tape.add(out[operand], partial)
            else:
                out[operand] = partial
        return out

    def finish(
        self, name: str, doc: str, inputs: Vectors, outputs: Vectors, results: Iterable[int]
    ) -> Step:
        """Return what was recorded as a step."""
        nodes = tuple(self.tape.nodes)
        return compacted(Step(name, doc, tuple(inputs), tuple(outputs), nodes, tuple(results)))


def some_of(vectors: Vectors, chosen: frozenset[str], word: str = "") -> str:
    """Return the chosen vectors as a part of a name, nothing where all are."""
    if len(chosen) == len(vectors):
        return ""
    return "_".join([word, *(name for name, _ in vectors if name in chosen)])


class Combinations:
    """Tangents as sums of wide nodes with narrow coefficients, added up only where that pays.

    A node that is used once goes into its use: d(a (b + c)) = a db + a dc + (b + c) da needs no
    wide node for d(b + c).
    """

    MOST_TERMS = 2  # that are scaled one by one; more are summed first

    def __init__(self, rules: Rules):
        self.rules, self.tape, self.step = rules, rules.tape, rules.step
        live = live_nodes(self.step.nodes, self.step.results)
        self.uses = Counter(a for n in live for a in operands(self.step.nodes[n]))
        self.uses.update(self.step.results)

    def summed(self, terms: Combination) -> int:
        """Return one node for a combination."""
        total = self.tape.const(0)
        for tangent_node, coefficient in terms.items():
            total = self.tape.add(total, self.tape.mul(coefficient, tangent_node))
        return total

    def as_one_term(self, terms: Combination) -> Combination:
        """Return a combination of several terms as one term."""
        if len(terms) <= 1:
            return terms
        return {self.summed(terms): self.tape.const(1)}

    def of(self, node: int, changes: list[Combination]) -> Combination:
        """Return the tangent of an operation from those of earlier nodes."""
        tape = self.tape
        total: Combination = {}
        for operand, partial in self.rules.partials(node).items():
            # a long sum that is to be scaled is added up first, for whatever else reads it as well
            terms = changes[operand]
            if len(terms) > self.MOST_TERMS and tape.value(partial) not in (1, -1):
                terms = changes[operand] = self.as_one_term(terms)
            for tangent_node, coefficient in terms.items():
                before = total.get(tangent_node, tape.const(0))
                total[tangent_node] = tape.add(before, tape.mul(partial, coefficient))

        # what cancels goes; what is used more than once is added up here
        total = {term: factor for term, factor in total.items() if tape.value(factor) != 0}
        return self.as_one_term(total) if self.uses[node] > 1 else total


def moved_inputs(
    rules: Rules, active: frozenset[str], angle_inputs: dict[str, SinesAndCosines]
) -> tuple[list[tuple[str, int]], dict[int, Combination]]:
    """Return the tangents that a step takes, and that of each input scalar as a sum of them."""
    tape, first = rules.tape, rules.count
    moving: list[tuple[str, int]] = []
    slopes: dict[int, Combination] = {}
    for name, span in spans(rules.step.inputs).items():
        if name in angle_inputs:
            # d sin = cos dalpha, d cos = -sin dalpha
            for k, (angle, sign, other) in zip(span, angle_inputs[name].scalars, strict=True):
                partner = tape.input(span[other])
                slopes[k] = {tape.input(first + angle): partner if sign > 0 else tape.neg(partner)}
            moving.append((f"d_{name}_angles", angle_inputs[name].angles))
        elif name in active:
            slopes |= {k: {tape.input(first + n): tape.const(1)} for n, k in enumerate(span)}
            moving.append((f"d_{name}", len(span)))
        else:
            continue
        first += moving[-1][1]
    return moving, slopes


@cache
def tangent(step: Step, active: frozenset[str], angle_inputs: AngleInputs = frozenset()) -> Step:
    """Return the step that gives ``d_<output>`` beside its outputs, from ``d_<input>`` of some.

    Of the inputs in ``angle_inputs``, which are sines and cosines, it takes ``d_<input>_angles``.
    """
    rules = Rules(step)
    moving, slopes = moved_inputs(rules, active, dict(angle_inputs))
    combinations = Combinations(rules)

    # the tangent of each node; constants and inputs that are not active have none
    changes: list[Combination] = []
    for node, (op, *args) in enumerate(step.nodes):
        if op == "input":
            changes.append(slopes.get(args[0], {}))
        elif op in LEAVES:
            changes.append({})
        else:
            changes.append(combinations.of(node, changes))

    results = [rules.values[r] for r in step.results]
    results += [combinations.summed(changes[r]) for r in step.results]
    return rules.finish(
        f"d{some_of(step.inputs, active)}_{step.name}",
        f"Tangents of {step.name}.",
        (*step.inputs, *moving),
        (*step.outputs, *((f"d_{name}", size) for name, size in step.outputs)),
        results,
    )


@cache
def adjoint(
    step: Step,
    wanted: frozenset[str],
    given: frozenset[str],
    angle_inputs: AngleInputs = frozenset(),
) -> Step:
    """Return the step from ``b_<output>`` of given outputs to ``b_<input>`` of wanted inputs.

    Of the inputs in ``angle_inputs``, which are sines and cosines, it gives ``b_<input>_angles``.
    """
    rules, kinds = Rules(step), dict(angle_inputs)
    tape = rules.tape
    incoming, adjoints = _output_adjoints(rules, given)

    # each operation passes its adjoint on to its operands, sines and cosines to their angles
    angles = AngleAdjoints(tape, step, kinds)
    for node in reversed(live_nodes(step.nodes, step.results)):
        if step.nodes[node][0] not in LEAVES:
            for operand, partial in rules.partials(node).items():
                if operand in angles.slopes:
                    angles.add(operand, partial, adjoints[node])
                else:
                    passed_on = tape.mul(partial, adjoints[node])
                    adjoints[operand] = tape.add(adjoints[operand], passed_on)

    # those of the inputs, zero where no node reads a scalar
    position = {args[0]: node for node, (op, *args) in enumerate(step.nodes) if op == "input"}
    outputs: list[tuple[str, int]] = []
    results: list[int] = []
    for name, span in spans(step.inputs).items():
        if name in kinds:
            vector = [angles.total(name, angle) for angle in range(kinds[name].angles)]
            outputs.append((f"b_{name}_angles", len(vector)))
            results += vector
        elif name in wanted:
            vector = [adjoints[position[k]] if k in position else tape.const(0) for k in span]
            outputs.append((f"b_{name}", len(vector)))
            results += vector

    chosen = some_of(step.inputs, wanted) + some_of(step.outputs, given, "_of")
    return rules.finish(
        f"b{chosen}_{step.name}",
        f"Adjoints of {step.name}.",
        (*step.inputs, *incoming),
        outputs,
        results,
    )


def _output_adjoints(
    rules: Rules, given: frozenset[str]
) -> tuple[list[tuple[str, int]], list[int]]:
    """Return the adjoints that a step takes, and those of all nodes before any is passed on."""
    tape, step, first = rules.tape, rules.step, rules.count
    incoming: list[tuple[str, int]] = []
    adjoints = [tape.const(0)] * len(step.nodes)
    for name, span in spans(step.outputs).items():
        if name in given:
            incoming.append((f"b_{name}", len(span)))
            for n, k in enumerate(span):
                node = step.results[k]
                adjoints[node] = tape.add(adjoints[node], tape.input(first + n))
            first += len(span)
    return incoming, adjoints


class AngleAdjoints:
    """Adjoints of angles, gathered by the adjoints of the nodes that read their sines and cosines:
    of y = c v + s w, (c w - s v) times that of y.

    slopes: of each node that is a sine or cosine, its input, its angle and its derivative.
    """

    def __init__(self, tape: Tape, step: Step, kinds: dict[str, SinesAndCosines]):
        self.tape, self.slopes = tape, {}
        self.terms: dict[tuple[str, int], Combination] = {}
        positions = {args[0]: node for node, (op, *args) in enumerate(step.nodes) if op == "input"}
        for name, span in spans(step.inputs).items():
            if name in kinds:
                for k, (angle, sign, other) in zip(span, kinds[name].scalars, strict=True):
                    if k in positions:
                        partner = tape.input(span[other])
                        slope = partner if sign > 0 else tape.neg(partner)
                        self.slopes[positions[k]] = (name, angle), slope

    def add(self, node: int, partial: int, adjoint_node: int) -> None:
        """Add what a sine or cosine passes on to its angle."""
        tape, (angle, slope) = self.tape, self.slopes[node]
        op, *args = tape.nodes[adjoint_node]
        if op == "neg":
            adjoint_node, partial = args[0], tape.neg(partial)
        terms = self.terms.setdefault(angle, {})
        before = terms.get(adjoint_node, tape.const(0))
        terms[adjoint_node] = tape.add(before, tape.mul(slope, partial))

    def total(self, name: str, angle: int) -> int:
        """Return the adjoint of one angle of an input."""
        total = self.tape.const(0)
        for adjoint_node, coefficient in self.terms.get((name, angle), {}).items():
            total = self.tape.add(total, self.tape.mul(coefficient, adjoint_node))
        return total
