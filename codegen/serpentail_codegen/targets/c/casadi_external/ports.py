"""Inputs and outputs of functions for CasADi: their sparsity, and the positions of their numbers in
C.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from ....functions.catalogue import function_of
from ....functions.tail import Tail

VECTOR = 8  # doubles in a cache line
Nonzero = Callable[[int, int], bool]


def dense(row: int, column: int) -> bool:
    """Return True: every entry of a matrix may be nonzero."""
    return True


def zero(row: int, column: int) -> bool:
    """Return False: every entry of a matrix is zero."""
    return False


def pattern(rows: int, columns: int, nonzero: Nonzero = dense) -> tuple[int, ...]:
    """Return a sparsity pattern in CasADi's form.

    It has the size, then 1 if the matrix is dense, else the starts of the columns and the rows of
    nonzeros.
    """
    by_column = [[r for r in range(rows) if nonzero(r, c)] for c in range(columns)]
    if sum(map(len, by_column)) == rows * columns:
        return (rows, columns, 1)
    starts = [sum(map(len, by_column[:c])) for c in range(columns + 1)]
    return (rows, columns, *starts, *(r for column in by_column for r in column))


@dataclass(frozen=True)
class Port:
    """An input or output of a CasADi function, and the positions of its numbers in a dense
    array.
    """

    name: str
    pattern: tuple[int, ...]
    source: str = ""
    row: int = 1  # distance of neighbours in a column
    column: int = 1  # and of neighbours in a row
    differentiable: bool = True


@dataclass
class External:
    """One function for CasADi: its ports, and C from arrays of inputs to arrays of outputs."""

    symbol: str
    doc: str
    tail: Tail
    prefix: str
    works: dict[str, int]
    inputs: list[Port] = field(default_factory=list)
    outputs: list[Port] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    arrays: dict[str, int] = field(default_factory=dict)
    helpers: set[str] = field(default_factory=set)
    inner_work: int = 0

    def call(self, name: str, *arguments: str) -> None:
        """Call a function of the model."""
        function = function_of(name, self.tail)
        for a, array in zip((*function.inputs, *function.outputs), arguments, strict=True):
            self.arrays.setdefault(array, a.length(self.tail))
        self.inner_work = max(self.inner_work, self.works[name])
        text = f"{self.prefix}_unchecked_{name}(&parameters, {', '.join(arguments)}, work)"
        self.lines += [f"if ({text} != {self.prefix.upper()}_OK) {{", "  return 1;", "}"]

    def use(self, helper: str, *arguments, **made: int) -> None:
        """Call a helper of the template, which fills new arrays of the given lengths."""
        self.arrays |= made
        self.helpers.add(helper)
        self.lines.append(
            f"{self.prefix}_casadi_{helper}({', '.join(map(str, (*arguments, *made)))});"
        )

    def unknown(self, name: str) -> None:
        """Make an array of one number that is NaN."""
        self.arrays[name] = 1
        self.lines.append(f"*{name} = (real)NAN;")

    def places(self) -> dict[str, int]:
        """Return the start of each array, at whole cache lines."""
        places, first = {}, 0
        taken = {port.source: port.pattern[0] for port in self.inputs if port.source}
        for name, length in (taken | self.arrays).items():
            places[name] = first
            first += -(-length // VECTOR) * VECTOR
        return places | {"work": first}

    @property
    def size(self) -> int:
        """Return the reals of workspace, including the padding to a cache line."""
        return self.places()["work"] + self.inner_work + VECTOR - 1
