"""Small loop nests for tests, all of exact arithmetic, and two checks of them: dual numbers, and
runs of few lanes.
"""

import random
from fractions import Fraction
from types import SimpleNamespace

import numpy as np

from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import Tape

NONE = SimpleNamespace(sin=None, cos=None, sqrt=None)
EXACT = Numbers(NONE, Fraction)


class Dual:
    """A number and its derivatives in some directions."""

    def __init__(self, value, slopes=None):
        self.value, self.slopes = Fraction(value), slopes

    def _slopes(self, other, mine, theirs):
        pairs = [(mine, self.slopes), (theirs, other.slopes)]
        terms = [[factor * s for s in slopes] for factor, slopes in pairs if slopes is not None]
        return [sum(column) for column in zip(*terms, strict=True)] if terms else None

    def __add__(self, other):
        return Dual(self.value + other.value, self._slopes(other, 1, 1))

    def __sub__(self, other):
        return Dual(self.value - other.value, self._slopes(other, 1, -1))

    def __mul__(self, other):
        return Dual(self.value * other.value, self._slopes(other, other.value, self.value))

    def __truediv__(self, other):
        quotient = self.value / other.value
        return Dual(quotient, self._slopes(other, 1 / other.value, -quotient / other.value))

    def __neg__(self):
        return Dual(-self.value, None if self.slopes is None else [-s for s in self.slopes])


DUALS = Numbers(NONE, Dual)


class Narrow(Run):
    """A run that computes only the lanes that a step is told to; a lane that was never computed is
    NaN.
    """

    def apply(self, call, at):
        """Run a step, then undo the lanes that are not its own."""
        wide = [ref for ref in call.writes if ref.lanes and call.columns is not None]
        before = [self.read(ref, at) for ref in wide]
        super().apply(call, at)
        for ref, rows in zip(wide, before, strict=True):
            own = np.arange(ref.lanes) < call.columns.at(at)
            pairs = zip(self.read(ref, at), rows, strict=True)
            kept = [np.where(own, new, np.nan if old is None else old) for new, old in pairs]
            self.write(ref, at, kept)


def jacobian(program, arguments, active):
    """Derivatives of all outputs: name -> rows, a column for each scalar of the active arrays."""
    count = sum(len(arguments[name]) for name in active)
    units, duals = iter(np.eye(count, dtype=int).tolist()), {}
    for name in active:
        duals[name] = [Dual(x, next(units)) for x in arguments[name]]
    still = {name: [Dual(x) for x in xs] for name, xs in arguments.items() if name not in active}
    values = Run(program, DUALS, still | duals).values
    return {
        a.name: [x.slopes or [0] * count for x in values[a.name]] for a in program.of_role("output")
    }


def numbers(program, seed=1):
    """Random rationals for the arguments of a program."""
    rng = random.Random(seed)
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    return {
        a.name: [Fraction(rng.randint(-9, 9), rng.randint(1, 5)) for _ in range(a.length)]
        for a in arrays
    }


def step_of(name, inputs, outputs, build):
    """A step recorded by ``build(tape, *nodes)``."""
    tape = Tape()
    nodes = [tape.input(k) for k in range(sum(size for _, size in inputs))]
    results = build(tape, *nodes)
    return Step(name, "A step.", inputs, outputs, tuple(tape.nodes), tuple(results))


ONES = (("s", 1), ("x", 1), ("y", 1))
NEXT = step_of("next", ONES, (("s", 1),), lambda t, s, x, y: [t.add(t.mul(s, x), y)])
SQUARE = step_of("square", (("x", 1),), (("s", 1),), lambda t, x: [t.mul(x, x)])
SUM = step_of("plus", (("x", 1), ("y", 1)), (("s", 1),), lambda t, x, y: [t.add(x, y)])
CROSS = step_of("cross", (("x", 2),), (("x", 2),), lambda t, a, b: [b, t.mul(a, b)])
TURN = step_of(
    "turn",
    (("x", 2), ("y", 1)),
    (("s", 2),),
    lambda t, a, b, y: [t.sub(t.mul(a, y), b), t.add(a, t.mul(b, t.mul(y, y)))],
)
BELOW = lambda t, x, y: [t.div(x, t.add(t.mul(y, y), t.const(1)))]  # noqa: E731
RATIO = step_of("ratio", (("x", 1), ("y", 1)), (("s", 1),), BELOW)
SWAP = step_of("swap", (("x", 2),), (("x", 2),), lambda t, a, b: [b, a])


def built(count=3):
    """A builder with inputs x, y of ``count`` scalars, a parameter and outputs u of ``count``
    scalars and w of one.
    """
    b = Builder("nest", "A loop nest.")
    mass = b.array("mass", 1, role="parameters")
    x, y = b.array("x", 1, count, "input"), b.array("y", 1, count, "input")
    return b, mass, x, y, b.array("u", 1, count, "output"), b.array("w", 1, role="output")


def carry(downward=False):
    """A state that is overwritten in every iteration, whose values are kept; the sum of all."""
    b, mass, x, y, u, w = built()
    s = b.array("s", 1)
    b.copy(s[0], mass[0])
    b.fill(w[0], 2)
    with b.loop("i", 3, downward) as i:
        b.apply(NEXT, {"s": s[0], "x": x[i], "y": y[i]}, s=s[0])
        b.copy(u[i], s[0])
        b.copy(w[0], s[0], adds=True)
    return b.finish()


def accumulators():
    """A sum, and one that grows by a function of itself; both are read on the way and after."""
    b, mass, x, y, u, w = built()
    a, total = b.array("a", 1), b.array("total", 1)
    b.fill(a[0], 1)
    b.fill(total[0], 0)
    with b.loop("i", 3) as i:
        b.apply(SQUARE, {"x": x[i]}, s_=total[0])
        b.apply(NEXT, {"s": a[0], "x": y[i], "y": total[0]}, s_=a[0])
        b.apply(SQUARE, {"x": total[0]}, s=u[i])
    b.apply(NEXT, {"s": a[0], "x": total[0], "y": mass[0]}, s=w[0])
    return b.finish()


def temporaries():
    """A temporary that starts again in every iteration and is squared and doubled in place."""
    b, mass, x, y, u, w = built()
    t = b.array("t", 1)
    b.fill(w[0], 0)
    with b.loop("i", 3) as i:
        b.fill(t[0], Fraction(3, 2))
        b.copy(t[0], x[i], adds=True)
        b.apply(SQUARE, {"x": t[0]}, s=t[0])
        b.copy(t[0], t[0], adds=True)
        b.apply(NEXT, {"s": t[0], "x": y[i], "y": mass[0]}, s=u[i])
        b.copy(t[0], u[i])
        b.copy(w[0], t[0], adds=True)
    return b.finish()


def columns():
    """A 2 x 3 matrix column by column, written, added to and read with strides."""
    b = Builder("nest", "Strides.")
    m, u = b.array("m", 6, role="input"), b.array("u", 6, role="output")
    y, t = b.array("y", 1, 3, "input"), b.array("t", 6)
    b.fill(t[0], *range(6))
    with b.loop("i", 3) as i:
        b.apply(TURN, {"x": m.part(i, 2, 3), "y": y[i]}, s_=t.part(i, 2, 3))
    with b.loop("i", 3, downward=True) as i:
        b.apply(CROSS, {"x": t.part(i, 2, 3)}, x=t.part(i, 2, 3))
        b.copy(u.part(2 * i, 2), t.part(i, 2, 3))
    return b.finish()


def nested():
    """A state that a loop within a loop overwrites, the inner one downward."""
    b, mass, x, y, u, w = built()
    s, t = b.array("s", 1), b.array("t", 2, 3)
    b.copy(s[0], mass[0])
    with b.loop("i", 3) as i:
        with b.loop("j", 3, downward=True) as j:
            b.apply(NEXT, {"s": s[0], "x": x[i], "y": y[j]}, s=s[0])
            b.copy(t.part(2 * j, 1), s[0])
            b.copy(t.part(2 * j + 1, 1), x[j])
            b.apply(CROSS, {"x": t[j]}, x=t[j])
        b.apply(SUM, {"x": t.part(1, 1), "y": t.part(4, 1)}, s=u[i])
    b.copy(w[0], s[0])
    return b.finish()


def chain():
    """An array that grows from its own last entry; a part of it is cleared, then used again."""
    b, mass, x, y, u, w = built()
    a = b.array("a", 1, 4)
    b.copy(a[0], mass[0])
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": a[i], "x": x[i], "y": a[i]}, s=a[i + 1])
        b.apply(RATIO, {"x": a[i + 1], "y": y[i]}, s=u[i])
    b.fill(a[2], 5)
    with b.loop("i", 3) as i:
        b.apply(SQUARE, {"x": a[i + 1]}, s=a[i])
    b.apply(SUM, {"x": a[1], "y": a[0]}, s=w[0])
    return b.finish()


def outputs_read():
    """Outputs that are read again, overwritten and added to before the end."""
    b, mass, x, y, u, w = built()
    b.apply(SQUARE, {"x": x[0]}, s=w[0])
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": w[0], "x": y[i], "y": x[i]}, s=u[i])
        b.apply(NEXT, {"s": w[0], "x": u[i], "y": mass[0]}, s=w[0])
    with b.loop("i", 3) as i:
        b.apply(SQUARE, {"x": u[i]}, s_=u[i])
    return b.finish()


def guarded():
    """A guard, a step without active inputs, and statements that no output needs."""
    b, mass, x, y, u, w = built()
    t, dead = b.array("t", 1), b.array("dead", 1, 3)
    with b.loop("i", 3) as i:
        b.apply(SQUARE, {"x": mass[0]}, s=t[0])
        b.guard(t[0], "TOO_SMALL", u[i])
        b.apply(SQUARE, {"x": x[i]}, s=dead[i])
        b.apply(RATIO, {"x": t[0], "y": x[i]}, s=t[0])
        b.apply(RATIO, {"x": t[0], "y": y[i]}, s=u[i])
    b.apply(SUM, {"x": x[2], "y": x[2]}, s=w[0])
    return b.finish()


def scratch():
    """A temporary that one statement alone writes, in every iteration."""
    b, mass, x, y, u, w = built()
    t = b.array("t", 1)
    b.fill(w[0], 0)
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": x[i], "x": y[i], "y": mass[0]}, s=t[0])
        b.apply(SQUARE, {"x": t[0]}, s_=w[0])
        b.apply(RATIO, {"x": t[0], "y": t[0]}, s=u[i])
    return b.finish()


def triangle():
    """A sum over pairs: the inner loop ends where the outer one is."""
    b, mass, x, y, u, w = built()
    t = b.array("t", 1)
    b.fill(w[0], 0)
    with b.loop("i", 3) as i:
        b.copy(u[i], mass[0])
        with b.loop("j", i + 1) as j:
            b.apply(NEXT, {"s": x[i], "x": y[j], "y": mass[0]}, s=t[0])
            b.apply(NEXT, {"s": t[0], "x": x[j], "y": t[0]}, s_=u[i])
        b.copy(w[0], u[i], adds=True)
    return b.finish()


FUNCTIONS = (accumulators, temporaries, columns, nested, chain, outputs_read, guarded, scratch)
RECTANGULAR = {"carry_up": carry(), "carry_down": carry(downward=True)}
RECTANGULAR |= {function.__name__: function() for function in FUNCTIONS}
PROGRAMS = RECTANGULAR | {"triangle": triangle()}
