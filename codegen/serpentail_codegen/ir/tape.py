"""The tape: scalar operations in evaluation order, each distinct one stored once.

Formulas are recorded on a tape as they are derived, and read from it when they are differentiated,
scheduled, printed or evaluated.  Looking up an operation before it is stored finds common
subexpressions; folding constants keeps what is stored small.
"""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from .algebra import Algebra, Number

Node = tuple  # an operation's name and what it works on: nodes, or the numbers of a leaf
Lanes = Sequence[int] | Mapping[int, int]  # lanes by number of a node, or of an input
UNARY = ("neg", "sin", "cos", "sqrt")
BINARY = ("add", "sub", "mul", "div")
TERNARY = ("select",)
LEAVES = ("input", "const", "unit")


def operands(node: Node) -> tuple[int, ...]:
    """Return the nodes that a node is computed from."""
    if node[0] in LEAVES:
        return ()
    return node[1:2] if node[0] == "lane" else node[1:]


class Tape:
    """An append-only list of operations; a node is its position in the list.

    The methods are an algebra on nodes: whatever computes with ``add, sub, mul, div, neg, sin, cos,
    sqrt, select`` and ``const`` can be recorded here.  Rules: constants fold, 0 and 1 vanish,
    negation moves outward, operands of commutative operations are ordered by node.  Nothing is
    re-associated or distributed, so rounding is kept.

    A node may be wide: it then holds several numbers, its lanes, one for each direction of
    differentiation.  Unit vectors are wide, and so is what is computed from a wide node; a narrow
    operand counts for every lane.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.lanes: list[int] = []
        self.has_wide_nodes = False
        self._position: dict[Node, int] = {}

    def _node(self, *node: Any) -> int:
        """Return the position of an operation, recording it if it is new."""
        position = self._position.get(node)
        if position is None:
            position = self._position[node] = len(self.nodes)
            self.nodes.append(node)
            self.has_wide_nodes = self.has_wide_nodes or node[0] == "unit"
            self.lanes.append(lanes_of(node, self.lanes) if self.has_wide_nodes else 0)
        return position

    def unit(self, lane: int, lanes: int) -> int:
        """Return the node of ``lanes`` numbers that is 1 in one lane and 0 elsewhere."""
        return self._node("unit", lane, lanes)

    def lane(self, a: int, lane: int) -> int:
        """Return one lane of a wide node; a narrow node is the same in all."""
        if not self.lanes[a]:
            return a
        op, *args = self.nodes[a]
        if op == "unit":
            return self.const(int(args[0] == lane))
        return self._node("lane", a, lane)

    def placed(self, a: int, lane: int, lanes: int, value: int) -> int:
        """Refuse to replace one lane: wide nodes are recorded as a whole."""
        raise TypeError("a tape cannot record that one lane of a wide node is replaced")

    def input(self, index: int) -> int:
        """Return the node of scalar input number ``index``."""
        return self._node("input", index)

    def const(self, value: Number) -> int:
        """Return the node of an exact constant; 1 and 1.0 are one node."""
        if value == int(value):
            value = int(value)
        if value < 0:
            return self.neg(self._node("const", -value))
        return self._node("const", value)

    def value(self, node: int) -> Number | None:
        """Return the constant that a node stands for, or None."""
        found = self.nodes[node]
        if found[0] == "neg" and self.nodes[found[1]][0] == "const":
            return -self.nodes[found[1]][1]
        return found[1] if found[0] == "const" else None

    def _negated(self, node: int) -> int | None:
        """Return what a node is the negation of, or None."""
        found = self.nodes[node]
        return found[1] if found[0] == "neg" else None

    def _without_signs(self, a: int, b: int) -> tuple[int, int, int]:
        """Return two nodes without their negations, and how many negations were taken off."""
        minus_a, minus_b = self._negated(a), self._negated(b)
        signs = 0
        if minus_a is not None:
            a, signs = minus_a, signs + 1
        if minus_b is not None:
            b, signs = minus_b, signs + 1
        return a, b, signs

    def neg(self, a: int) -> int:
        """Return -a."""
        op, *args = self.nodes[a]
        if op == "neg":
            return args[0]
        if op == "const" and args[0] == 0:
            return a
        if op == "sub":
            return self.sub(args[1], args[0])
        return self._node("neg", a)

    def add(self, a: int, b: int) -> int:
        """Return a + b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x + y)
        if x == 0 or y == 0:
            return b if x == 0 else a

        # signs move outward: -a - b = -(a + b), a + -b = a - b
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None and minus_b is not None:
            return self.neg(self.add(minus_a, minus_b))
        if minus_b is not None:
            return self.sub(a, minus_b)
        if minus_a is not None:
            return self.sub(b, minus_a)
        return self._node("add", min(a, b), max(a, b))

    def sub(self, a: int, b: int) -> int:
        """Return a - b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x - y)
        if a == b:
            return self.const(0)
        if x == 0 or y == 0:
            return self.neg(b) if x == 0 else a

        # signs move outward: a - -b = a + b, -a - b = -(a + b)
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_b is not None:
            return self.add(a, minus_b)
        if minus_a is not None:
            return self.neg(self.add(minus_a, b))
        return self._node("sub", a, b)

    def mul(self, a: int, b: int) -> int:
        """Return a * b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x * y)
        if x == 0 or y == 0:
            return self.const(0)
        if x == 1:
            return b
        if y == 1:
            return a

        # signs move outward
        a, b, signs = self._without_signs(a, b)
        if signs:
            product = self.mul(a, b)
            return self.neg(product) if signs == 1 else product
        return self._node("mul", min(a, b), max(a, b))

    def div(self, a: int, b: int) -> int:
        """Return a / b."""
        x, y = self.value(a), self.value(b)
        if y == 0:
            raise ZeroDivisionError("the derivation divides by the constant zero")
        if x is not None and y is not None:
            return self.const(exact_quotient(x, y))
        if x == 0 or y == 1:
            return a

        # signs move outward
        a, b, signs = self._without_signs(a, b)
        if signs:
            quotient = self.div(a, b)
            return self.neg(quotient) if signs == 1 else quotient
        return self._node("div", a, b)

    def sin(self, a: int) -> int:
        """Return sin(a); odd, so a sign moves outward."""
        if self.value(a) == 0:
            return a
        minus_a = self._negated(a)
        if minus_a is not None:
            return self.neg(self.sin(minus_a))
        return self._node("sin", a)

    def cos(self, a: int) -> int:
        """Return cos(a); even, so a sign vanishes."""
        if self.value(a) == 0:
            return self.const(1)
        minus_a = self._negated(a)
        return self._node("cos", a if minus_a is None else minus_a)

    def sqrt(self, a: int) -> int:
        """Return the square root of a."""
        return a if self.value(a) in (0, 1) else self._node("sqrt", a)

    def select(self, c: int, a: int, b: int) -> int:
        """Return a where c > 0, else b; a sign of both moves outward."""
        if a == b:
            return a
        positive = self.decide(c)
        if positive is not None:
            return a if positive else b
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None and minus_b is not None:
            return self.neg(self.select(c, minus_a, minus_b))
        return self._node("select", c, a, b)

    def decide(self, c: int) -> bool | None:
        """Tell if c > 0, or None where that is not known."""
        value = self.value(c)
        return None if value is None else value > 0

    def max(self, a: int, b: int) -> int:
        """Return the larger of a and b."""
        return self.select(self.sub(a, b), a, b)


def lanes_of(node: Node, lanes: Lanes, inputs: Lanes = ()) -> int:
    """Return how many lanes a node has, 0 if it is narrow; ``lanes`` are those of earlier nodes.

    ``inputs`` are the lanes of the inputs; where they are not given, inputs are narrow.
    """
    op = node[0]
    if op == "input":
        return inputs[node[1]] if inputs else 0
    if op == "unit":
        return node[2]
    if op in ("const", "lane"):
        return 0

    # an operation is as wide as its wide operands, which agree
    widths = {lanes[a] for a in node[1:]}
    widths.discard(0)
    if len(widths) > 1:
        raise ValueError(f"{op} joins operands of {sorted(widths)} lanes")
    return widths.pop() if widths else 0


def exact_quotient(x: Number, y: Number) -> Number:
    """Return x / y, exact where both are rational."""
    if isinstance(x, float) or isinstance(y, float):
        return x / y
    return Fraction(x) / Fraction(y)


def replay(nodes: Iterable[Node], scalars: Sequence, algebra: Algebra) -> list:
    """Evaluate nodes in an algebra, such as numbers or another tape; ``scalars`` are the inputs."""
    values: list = []
    value = values.__getitem__
    for node in nodes:
        op = node[0]
        if op == "input":
            values.append(scalars[node[1]])
        elif op == "const":
            values.append(algebra.const(node[1]))
        elif op == "unit":
            values.append(algebra.unit(node[1], node[2]))
        elif op == "lane":
            values.append(algebra.lane(values[node[1]], node[2]))
        else:
            values.append(getattr(algebra, op)(*map(value, node[1:])))
    return values


def live_nodes(nodes: Sequence[Node], results: Iterable[int]) -> list[int]:
    """Return the nodes that the results need, in order (dead-code elimination)."""
    needed = set(results)
    for node in range(len(nodes) - 1, -1, -1):
        if node in needed:
            needed.update(operands(nodes[node]))
    return sorted(needed)


def operation_count(nodes: Sequence[Node], results: Iterable[int]) -> int:
    """Return the number of arithmetic operations that the results need, negation not counted."""
    return sum(nodes[node][0] in BINARY for node in live_nodes(nodes, results))
