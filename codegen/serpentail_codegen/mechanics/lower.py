"""Turns functions of SymPy vectors into steps of straight-line operations.

A step function takes ``let``, which names intermediate results, and vectors whose annotations say
their shapes; it returns a dictionary of vectors.
"""

import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from fractions import Fraction
from functools import cache
from typing import Annotated, Any, get_origin

import sympy

from ..ir.step import Step, compacted
from ..ir.tape import Tape


class Recorder:
    """Lowers SymPy expressions to one tape; its ``let`` names intermediate results by fresh
    symbols.
    """

    def __init__(self):
        self.tape = Tape()
        self.node_of: dict[sympy.Basic, int] = {}
        self.count = 0

    def symbol(self, name: str, node: int) -> sympy.Symbol:
        """Return a fresh symbol that stands for a node."""
        self.count += 1
        symbol = sympy.Symbol(f"{name}_{self.count:04d}")
        self.node_of[symbol] = node
        return symbol

    def vector(self, name: str, first: int, size: int) -> sympy.Matrix:
        """Return fresh symbols for input scalars ``first`` to ``first + size``."""
        return sympy.Matrix([self.symbol(name, self.tape.input(first + k)) for k in range(size)])

    def let(self, name: str, value):
        """Lower an expression or matrix now and return symbols of the same shape for it."""
        if isinstance(value, sympy.MatrixBase):
            return sympy.Matrix(value.rows, value.cols, [self.let(name, entry) for entry in value])
        value = sympy.sympify(value)
        return value if value.is_Atom else self.symbol(name, self.lower(value))

    def lower(self, e: sympy.Basic) -> int:
        """Return the node of an expression."""
        if e not in self.node_of:
            self.node_of[e] = self._lower(e)
        return self.node_of[e]

    def _lower(self, e: sympy.Basic) -> int:
        if e.is_Number:
            return self.tape.const(exact(e))
        if e.is_Add:
            return self._chain(self.tape.add, e.args)
        if e.is_Mul:
            return self._product(e)
        if e.is_Pow:
            return self._power(e.base, e.exp)
        if isinstance(e, sympy.sin | sympy.cos):
            return getattr(self.tape, type(e).__name__)(self.lower(e.args[0]))
        return self._choice(e)

    def _chain(self, operation, terms) -> int:
        total = self.lower(terms[0])
        for term in terms[1:]:
            total = operation(total, self.lower(term))
        return total

    def _product(self, e: sympy.Mul) -> int:
        coefficient, rest = e.as_coeff_Mul()
        above, below = sympy.fraction(rest)
        factors = above.args if above.is_Mul else (above,)
        node = self._chain(self.tape.mul, factors if coefficient == 1 else (coefficient, *factors))
        return node if below == 1 else self.tape.div(node, self.lower(below))

    def _power(self, base: sympy.Basic, exponent: sympy.Basic) -> int:
        if exponent == sympy.Rational(1, 2):
            return self.tape.sqrt(self.lower(base))
        if exponent == sympy.Rational(-1, 2):
            return self.tape.div(self.tape.const(1), self.lower(sympy.sqrt(base)))
        if not exponent.is_Integer:
            raise TypeError(f"no rule lowers the exponent {exponent}")
        product = self._chain(self.tape.mul, [base] * abs(int(exponent)))
        return product if exponent > 0 else self.tape.div(self.tape.const(1), product)

    def _choice(self, e: sympy.Basic) -> int:
        if e.is_Piecewise:
            return self._cases(list(e.args))
        if isinstance(e, sympy.Max):
            return self._chain(self.tape.max, sorted(e.args, key=sympy.default_sort_key))
        raise TypeError(f"no rule lowers {type(e).__name__}: {e}")

    def _cases(self, cases: list) -> int:
        """The first expression whose condition holds; the last condition must be True."""
        (e, condition), *others = cases
        if condition == True:  # noqa: E712  SymPy's own truth
            return self.lower(e)
        if not others:
            raise TypeError(
                f"no rule lowers a Piecewise without a last case (..., True): {condition}"
            )
        if isinstance(condition, sympy.StrictGreaterThan | sympy.StrictLessThan):
            return self.tape.select(
                self.lower(condition.gts - condition.lts), self.lower(e), self._cases(others)
            )
        if isinstance(condition, sympy.GreaterThan | sympy.LessThan):
            return self.tape.select(
                self.lower(condition.lts - condition.gts), self._cases(others), self.lower(e)
            )
        raise TypeError(f"no rule lowers the condition {condition}")


def exact(number: sympy.Number):
    """Return an exact Python number."""
    if number.is_Integer:
        return int(number)
    return Fraction(int(number.p), int(number.q)) if number.is_Rational else float(number)


@cache
def declared_shapes(function: Callable) -> dict[str, tuple[int, int]]:
    """Rows and columns of each vector that a step reads, as its annotations say.

    An argument is one vector, several of equal size (``V3x8``), or a group: a dataclass of vectors.
    """
    shapes: dict[str, tuple[int, int]] = {}
    for argument in _arguments(function):
        shapes |= _shapes_of(function, argument)
    return shapes


@cache
def _arguments(function: Callable) -> list[inspect.Parameter]:
    """Return what a step reads: no ``let``, no settings of the derivation, which have defaults."""
    arguments = inspect.signature(function).parameters.values()
    return [a for a in arguments if a.default is a.empty][1:]


def _shapes_of(function: Callable, argument: inspect.Parameter) -> dict[str, tuple[int, int]]:
    """Return the shapes of an argument's vectors."""
    kind: Any = argument.annotation
    if is_dataclass(kind):  # a group
        return {name: part.__metadata__[0] for name, part in kind.__annotations__.items()}
    if get_origin(kind) is not Annotated:
        raise TypeError(
            f"{function.__name__}: {argument.name} needs an annotation of mechanics.shapes"
        )
    shape, *count = kind.__metadata__
    names = [f"{argument.name}_{k}" for k in range(*count)] if count else [argument.name]
    return dict.fromkeys(names, shape)


def derived(function: "Callable | Step") -> Step:
    """Return a step, or the one derived from a function."""
    return function if isinstance(function, Step) else derive(function)


@cache
def derive(function: Callable, one_coordinate: bool = False, **settings: Any) -> Step:
    """Derive a step: call ``function(let, *vectors)`` with SymPy vectors of the declared shapes.

    one_coordinate: for segments that have one instead of two, vectors of 2 numbers, or of 6 for
    each, have half of these.
    """
    # symbols of the declared shapes stand for the vectors
    recorder, first, values, inputs = Recorder(), 0, [], []
    for argument in _arguments(function):
        vectors = {}
        for name, (rows, columns) in _shapes_of(function, argument).items():
            size = rows * columns // (2 if one_coordinate and rows in (2, 12) else 1)
            shape = size // columns, columns
            vectors[name] = recorder.vector(name, first, size).reshape(*shape)
            inputs.append((name, size))
            first += size
        kind: Any = argument.annotation
        if isinstance(kind, type):
            values.append(kind(**vectors))
        else:
            values.append(vectors.get(argument.name) or tuple(vectors.values()))

    # what the function returns is recorded on the tape
    outputs = {
        name: list(value) for name, value in function(recorder.let, *values, **settings).items()
    }
    results = tuple(recorder.lower(sympy.sympify(e)) for values in outputs.values() for e in values)
    sizes = tuple((name, len(values)) for name, values in outputs.items())
    doc = " ".join((inspect.getdoc(function) or "").partition("\n\n")[0].split())
    name = function.__name__ + "".join(
        f"_{key}_{value}" for key, value in settings.items() if value
    )
    name += "_of_hinge" if one_coordinate else ""
    return compacted(Step(name, doc, tuple(inputs), sizes, tuple(recorder.tape.nodes), results))
