"""Text that all targets share: nodes of a tape and a dialect go in, one definition a line comes out."""

from collections import Counter
from dataclasses import dataclass

from ..program import Index
from ..schedule import scheduled
from ..tape import BINARY, live_nodes

LEAST_SINGLE = 2.0**-126
SYMBOL = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


def index_text(index: Index) -> str:
    """Print an affine index."""
    terms = [name if factor == 1 else f"{factor} * {name}" for name, factor in index.terms]
    return " + ".join([*terms, *([str(index.offset)] if index.offset or not terms else [])])


@dataclass(frozen=True)
class Dialect:
    """How a language defines a name, ends a real constant and calls functions."""

    definition: str
    suffix: str
    functions: dict[str, str]
    sincos: str = ""  # defines sine and cosine of one argument at once; empty: by two functions

    def literal(self, value) -> str:
        """Print a number by its shortest exact decimal; what a single-precision real cannot hold is zero."""
        tiny = self.suffix and abs(value) < LEAST_SINGLE
        return repr(0.0 if tiny else float(value)) + self.suffix


class Scalars:
    """Prints the nodes that the results need; a product or sign that is used once goes into its use."""

    def __init__(self, nodes, results, names, dialect: Dialect):
        self.nodes, self.names, self.dialect = nodes, names, dialect
        self.live = scheduled(nodes, live_nodes(nodes, results), results)
        self.uses = Counter(a for n in self.live if nodes[n][0] not in ("input", "const") for a in nodes[n][1:])
        self.uses.update(results)
        self.text: dict[object, str] = {}

    def lines(self) -> list[str]:
        """Return the definitions in evaluation order; ``text`` then tells how to write any node."""
        out = []
        for node in self.live:
            op, *args = self.nodes[node]
            if op in ("sin", "cos") and self.dialect.sincos:
                out += self._sincos(args[0], len(out))
                self.text[node] = self.text[op, args[0]]
                continue
            text = self._expression(op, args)
            if op in ("input", "const") or (op in ("mul", "neg") and self.uses[node] == 1):
                self.text[node] = text
            else:
                self.text[node] = name = f"t{len(out)}"
                out.append(self.dialect.definition.format(name=name, text=text))
        return out

    def _sincos(self, argument: int, count: int) -> list[str]:
        """Define both sine and cosine of an argument when the first of them is needed."""
        if ("sin", argument) in self.text:
            return []
        names = {"sine": f"t{count}", "cosine": f"t{count}c"}
        self.text["sin", argument], self.text["cos", argument] = names.values()
        return [self.dialect.sincos.format(argument=self.text[argument], **names)]

    def _expression(self, op: str, args) -> str:
        if op == "input":
            return self.names[args[0]]
        if op == "const":
            return self.dialect.literal(args[0])
        if op in BINARY:
            return f"{self._operand(args[0], op)} {SYMBOL[op]} {self._operand(args[1], op)}"
        if op == "neg":
            return f"-{self._operand(args[0], op)}"
        return f"{self.dialect.functions[op]}({self.text[args[0]]})"

    def _operand(self, node: int, op: str) -> str:
        text, product = self.text[node], self.nodes[node][0] == "mul"
        plain = not text.startswith("-") and (" " not in text or self.nodes[node][0] == "input")
        return text if plain or (product and op in ("add", "sub")) else f"({text})"
