"""A hash-consed tape: scalar operations go in, each distinct one is stored once, in evaluation
order.
"""

from fractions import Fraction

Number = int | float | Fraction
UNARY = ("neg", "sin", "cos", "sqrt")
BINARY = ("add", "sub", "mul", "div")
TERNARY = ("select",)
LEAVES = ("input", "const", "unit")


def operands(node: tuple) -> tuple[int, ...]:
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

    A node may be wide: a row of numbers, its lanes, one for each direction of differentiation.
    Unit rows are wide, and so is what is computed from a wide node; a narrow operand counts for
    every lane.
    """

    def __init__(self):
        self.nodes: list[tuple] = []
        self.lanes: list[int] = []
        self.has_rows = False
        self._known: dict[tuple, int] = {}

    def _node(self, *key) -> int:
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = len(self.nodes)
            self.nodes.append(key)
            self.has_rows = self.has_rows or key[0] == "unit"
            self.lanes.append(lanes_of(key, self.lanes) if self.has_rows else 0)
        return found

    def unit(self, lane: int, lanes: int) -> int:
        """Return the row of ``lanes`` numbers that is 1 in one lane and 0 elsewhere."""
        return self._node("unit", lane, lanes)

    def lane(self, a: int, lane: int) -> int:
        """Return one lane of a row; a narrow node is the same in all."""
        if not self.lanes[a]:
            return a
        op, *args = self.nodes[a]
        return self.const(int(args[0] == lane)) if op == "unit" else self._node("lane", a, lane)

    def input(self, index: int) -> int:
        """Return the node of scalar input number ``index``."""
        return self._node("input", index)

    def const(self, value: Number) -> int:
        """Return the node of an exact constant; integral values are stored as int, so 1 and 1.0 are
        one node.
        """
        value = int(value) if value == int(value) else value
        return self.neg(self._node("const", -value)) if value < 0 else self._node("const", value)

    def value(self, node: int) -> Number | None:
        """Return the constant that a node stands for, or None."""
        op, *args = self.nodes[node]
        if op == "neg" and self.nodes[args[0]][0] == "const":
            return -self.nodes[args[0]][1]
        return args[0] if op == "const" else None

    def _negated(self, node: int) -> int | None:
        op, *args = self.nodes[node]
        return args[0] if op == "neg" else None

    def neg(self, a: int) -> int:
        """Return -a."""
        op, *args = self.nodes[a]
        if op == "neg" or (op == "const" and args[0] == 0):
            return args[0] if op == "neg" else a
        return self.sub(args[1], args[0]) if op == "sub" else self._node("neg", a)

    def add(self, a: int, b: int) -> int:
        """Return a + b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x + y)
        if x == 0 or y == 0:
            return b if x == 0 else a
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None and minus_b is not None:
            return self.neg(self.add(minus_a, minus_b))
        if minus_a is not None or minus_b is not None:
            return self.sub(a, minus_b) if minus_a is None else self.sub(b, minus_a)
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
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_b is not None:
            return self.add(a, minus_b)
        return self.neg(self.add(minus_a, b)) if minus_a is not None else self._node("sub", a, b)

    def mul(self, a: int, b: int) -> int:
        """Return a * b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x * y)
        if x == 0 or y == 0:
            return self.const(0)
        if x == 1 or y == 1:
            return b if x == 1 else a
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None or minus_b is not None:
            product = self.mul(a if minus_a is None else minus_a, b if minus_b is None else minus_b)
            return product if minus_a is not None and minus_b is not None else self.neg(product)
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
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None or minus_b is not None:
            quotient = self.div(
                a if minus_a is None else minus_a, b if minus_b is None else minus_b
            )
            return quotient if minus_a is not None and minus_b is not None else self.neg(quotient)
        return self._node("div", a, b)

    def sin(self, a: int) -> int:
        """Return sin(a); odd, so a sign moves outward."""
        if self.value(a) == 0:
            return a
        minus = self._negated(a)
        return self._node("sin", a) if minus is None else self.neg(self.sin(minus))

    def cos(self, a: int) -> int:
        """Return cos(a); even, so a sign vanishes."""
        if self.value(a) == 0:
            return self.const(1)
        minus = self._negated(a)
        return self._node("cos", a if minus is None else minus)

    def sqrt(self, a: int) -> int:
        """Return the square root of a."""
        return a if self.value(a) in (0, 1) else self._node("sqrt", a)

    def select(self, c: int, a: int, b: int) -> int:
        """Return a where c > 0, else b; a sign of both moves outward."""
        known = self.value(c)
        if known is not None or a == b:
            return a if known is None or known > 0 else b
        minus_a, minus_b = self._negated(a), self._negated(b)
        if minus_a is not None and minus_b is not None:
            return self.neg(self.select(c, minus_a, minus_b))
        return self._node("select", c, a, b)

    def decide(self, c: int) -> bool | None:
        """Tell if c > 0, or None where that is not known."""
        known = self.value(c)
        return None if known is None else known > 0

    def max(self, a: int, b: int) -> int:
        """Return the larger of a and b."""
        return self.select(self.sub(a, b), a, b)


def lanes_of(node: tuple, lanes, inputs=()) -> int:
    """Return how many lanes a node has, 0 if it is narrow, from those of earlier nodes and of the
    inputs.
    """
    op, *args = node
    if op in LEAVES:
        return args[1] if op == "unit" else inputs[args[0]] if inputs and op == "input" else 0
    if op == "lane":
        return 0
    widths = {lanes[a] for a in args} - {0}
    if widths and op in TERNARY:
        raise ValueError(f"{op} takes no rows")
    if len(widths) > 1:
        raise ValueError(f"{op} joins rows of {sorted(widths)} lanes")
    return max(widths, default=0)


def exact_quotient(x: Number, y: Number) -> Number:
    """Return x / y, exact where both are rational."""
    return x / y if isinstance(x, float) or isinstance(y, float) else Fraction(x) / Fraction(y)


def replay(nodes, scalars, algebra) -> list:
    """Evaluate nodes in an algebra (numbers, another tape, CasADi symbols) with the given input
    scalars.
    """
    values = []
    for op, *args in nodes:
        if op == "input":
            values.append(scalars[args[0]])
        elif op == "const":
            values.append(algebra.const(args[0]))
        elif op == "unit":
            values.append(algebra.unit(*args))
        elif op == "lane":
            values.append(algebra.lane(values[args[0]], args[1]))
        else:
            values.append(getattr(algebra, op)(*(values[a] for a in args)))
    return values


def live_nodes(nodes, results) -> list[int]:
    """Return the nodes that the results need, in order (dead-code elimination)."""
    needed = set(results)
    for node in range(len(nodes) - 1, -1, -1):
        if node in needed:
            needed.update(operands(nodes[node]))
    return sorted(needed)


def operation_count(nodes, results) -> int:
    """Return the number of arithmetic operations that the results need, negation not counted."""
    return sum(nodes[node][0] in BINARY for node in live_nodes(nodes, results))
