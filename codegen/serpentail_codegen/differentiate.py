"""Derivatives of steps: a straight-line step goes in, the step of its tangents or of its adjoints comes out.

Both walk the tape once and differentiate each operation by its rule.  Tangents are called ``d_<vector>``, adjoints
``b_<vector>``; where a tangent is wide it stands for all directions at once.
"""

from functools import cache

from .tape import Step, Tape, compacted, live_nodes, replay


def _quotient(tape: Tape, y: int, a: int, b: int) -> tuple[int, int]:
    inverse = tape.div(tape.const(1), b)
    return inverse, tape.neg(tape.mul(y, inverse))


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
            args, PARTIALS[op](self.tape, self.values[node], *(self.values[a] for a in args)), strict=True
        ):
            out[operand] = self.tape.add(out[operand], partial) if operand in out else partial
        return out

    def finish(self, prefix: str, doc: str, inputs, outputs, results) -> Step:
        """Return what was recorded as a step."""
        name = f"{prefix}_{self.step.name}"
        return compacted(Step(name, doc, tuple(inputs), tuple(outputs), tuple(self.tape.nodes), tuple(results)))


def spans(vectors) -> dict[str, range]:
    """Return the positions of named vectors that follow each other."""
    out, first = {}, 0
    for name, size in vectors:
        out[name] = range(first, first + size)
        first += size
    return out


@cache
def tangent(step: Step, active: frozenset[str]) -> Step:
    """Return the step with ``d_<output>`` for tangents ``d_<input>`` of the active inputs, and its own outputs."""
    rules, moving = Rules(step), []
    tape, count = rules.tape, rules.count
    slopes: dict[int, int] = {}
    for name, span in spans(step.inputs).items():
        if name in active:
            moving.append((f"d_{name}", len(span)))
            slopes |= {k: tape.input(count + n) for n, k in enumerate(span)}
            count += len(span)
    change = []
    for node, (op, *args) in enumerate(step.nodes):
        total = slopes.get(args[0], tape.const(0)) if op == "input" else tape.const(0)
        if op not in ("input", "const"):
            for operand, partial in rules.partials(node).items():
                total = tape.add(total, tape.mul(partial, change[operand]))
        change.append(total)
    outputs = (*step.outputs, *((f"d_{name}", size) for name, size in step.outputs))
    results = [rules.values[r] for r in step.results] + [change[r] for r in step.results]
    partly = "" if len(active) == len(step.inputs) else "_" + "_".join(n for n, _ in step.inputs if n in active)
    return rules.finish(f"d{partly}", f"Tangents of {step.name}.", (*step.inputs, *moving), outputs, results)


@cache
def adjoint(step: Step, wanted: frozenset[str], given: frozenset[str]) -> Step:
    """Return the step that takes ``b_<output>`` of the given outputs to ``b_<input>`` of the wanted inputs."""
    rules = Rules(step)
    tape, count, incoming = rules.tape, rules.count, []
    weight = [tape.const(0)] * len(step.nodes)
    for name, span in spans(step.outputs).items():
        if name in given:
            incoming.append((f"b_{name}", len(span)))
            for n, k in enumerate(span):
                weight[step.results[k]] = tape.add(weight[step.results[k]], tape.input(count + n))
            count += len(span)
    for node in reversed(live_nodes(step.nodes, step.results)):
        if step.nodes[node][0] not in ("input", "const"):
            for operand, partial in rules.partials(node).items():
                weight[operand] = tape.add(weight[operand], tape.mul(partial, weight[node]))
    position = {args[0]: node for node, (op, *args) in enumerate(step.nodes) if op == "input"}
    outputs, results = [], []
    for name, span in spans(step.inputs).items():
        if name in wanted:
            outputs.append((f"b_{name}", len(span)))
            results += [weight[position[k]] if k in position else tape.const(0) for k in span]
    partly = "" if len(wanted) == len(step.inputs) else "_" + "_".join(n for n, _ in step.inputs if n in wanted)
    partly += "" if len(given) == len(step.outputs) else "_of_" + "_".join(n for n, _ in step.outputs if n in given)
    return rules.finish(f"b{partly}", f"Adjoints of {step.name}.", (*step.inputs, *incoming), outputs, results)
