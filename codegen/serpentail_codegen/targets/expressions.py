"""Text that all targets share: nodes of a tape and a dialect go in, one definition a line comes
out.
"""

from collections import Counter, defaultdict
from dataclasses import dataclass

from ..ir.program import Index
from ..ir.tape import BINARY, LEAVES, lanes_of, live_nodes, operands
from ..passes.schedule import scheduled

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
    select: str = "{c} > {zero} ? {a} : {b}"
    sincos: str = ""  # defines sine and cosine of one argument at once; empty: by two functions
    sincos_row: str = ""  # the same of a row
    row: str = ""  # defines a row of lanes
    load: str = ""  # the lanes at an address that are in turn

    def literal(self, value) -> str:
        """Print a number by its shortest exact decimal; what a single-precision real cannot hold is
        zero.
        """
        tiny = self.suffix and abs(value) < LEAST_SINGLE
        return repr(0.0 if tiny else float(value)) + self.suffix


EARLY, LATE = "early", "late"  # narrow nodes; LATE ones need a lane of some row


class Scalars:
    """Prints the nodes that the results need; a product or sign that is used once goes into its
    use.

    ``rows`` are the lanes of the inputs that are rows, by number.  Nodes are printed part by part:
    narrow ones first, then those of so many lanes, then narrow ones that need a lane.
    """

    def __init__(self, nodes, results, names, dialect: Dialect, rows: dict[int, int] | None = None):
        self.nodes, self.names, self.dialect = nodes, names, dialect
        self.live = live_nodes(nodes, results)
        self.uses = Counter(a for n in self.live for a in operands(nodes[n]))
        self.uses.update(results)
        self.text: dict[object, str] = {}
        self.stored: dict[
            int, int
        ] = {}  # rows of which a lane is needed: where they are in the workspace
        self.count = 0
        self.part, self.lanes = self._parts(rows or {})
        self.abroad = {
            a for n in self.live for a in operands(nodes[n]) if self.part[a] != self.part[n]
        }
        self.results = results

    def _parts(self, rows: dict[int, int]) -> tuple[dict, dict]:
        if not rows and not any(self.nodes[n][0] == "unit" for n in self.live):
            return dict.fromkeys(self.live, EARLY), dict.fromkeys(self.live, 0)
        inputs = defaultdict(int, rows)
        lanes, part = {}, {}
        for n in sorted(self.live):
            lanes[n] = lanes_of(self.nodes[n], lanes, inputs)
            late = self.nodes[n][0] == "lane" or any(
                part[a] == LATE for a in operands(self.nodes[n])
            )
            if late and lanes[n]:
                raise ValueError("a row that needs a lane of another row cannot be printed")
            part[n] = LATE if late else lanes[n] or EARLY
        return part, lanes

    def lines(self, part=EARLY) -> list[str]:
        """Return the definitions of a part in evaluation order; ``text`` then tells how to write
        any node.
        """
        out = []
        for node in scheduled(
            self.nodes, [n for n in self.live if self.part[n] == part], self.results
        ):
            op, *args = self.nodes[node]
            if op in ("sin", "cos") and self.dialect.sincos:
                out += self._sincos(args[0])
                self.text[node] = self.text[op, args[0]]
                continue
            text = self._expression(op, args)
            if self._goes_into_its_use(node):
                self.text[node] = text
            else:
                self.text[node] = name = self._name()
                form = self.dialect.row if self.lanes[node] else self.dialect.definition
                out.append(form.format(name=name, text=text))
        return out

    def _goes_into_its_use(self, node: int) -> bool:
        op = self.nodes[node][0]
        if op in ("mul", "neg"):
            return self.uses[node] == 1 and node not in self.abroad
        return op in ("const", "lane") or (op == "input" and not self.lanes[node])

    def _name(self) -> str:
        self.count += 1
        return f"t{self.count - 1}"

    def _sincos(self, argument: int) -> list[str]:
        """Define both sine and cosine of an argument when the first of them is needed."""
        if ("sin", argument) in self.text:
            return []
        name = self._name()
        names = {"sine": name, "cosine": f"{name}c"}
        self.text["sin", argument], self.text["cos", argument] = names.values()
        form = self.dialect.sincos_row if self.lanes[argument] else self.dialect.sincos
        return [form.format(argument=self.text[argument], **names)]

    def _expression(self, op: str, args) -> str:
        if op in BINARY:
            return f"{self._operand(args[0], op)} {SYMBOL[op]} {self._operand(args[1], op)}"
        if op == "neg":
            return f"-{self._operand(args[0], op)}"
        if op == "select":
            c, a, b = (self.text[n] for n in args)
            return self.dialect.select.format(c=c, a=a, b=b, zero=self.dialect.literal(0))
        if op == "lane":
            return f"work[{self.stored[args[0]] + args[1]}]"
        return (
            self._leaf(op, args)
            if op in LEAVES
            else f"{self.dialect.functions[op]}({self.text[args[0]]})"
        )

    def _leaf(self, op: str, args) -> str:
        if op == "const":
            return self.dialect.literal(args[0])
        address = f"&one[{args[1] - 1 - args[0]}]" if op == "unit" else self.names[args[0]]
        return self.dialect.load.format(address=address) if address.startswith("&") else address

    def _operand(self, node: int, op: str) -> str:
        text, product = self.text[node], self.nodes[node][0] == "mul"
        plain = not text.startswith("-") and (" " not in text or self.nodes[node][0] == "input")
        return text if plain or (product and op in ("add", "sub")) else f"({text})"


def called(nodes, inputs=()) -> set[str]:
    """Return the helpers that nodes call, from the lanes of their inputs."""
    if not any(node[0] in ("sin", "cos") for node in nodes):
        return set()
    lanes, helpers = [], set()
    for op, *args in nodes:
        lanes.append(lanes_of((op, *args), lanes, inputs))
        if op in ("sin", "cos"):
            helpers |= {"sincos", "sincos_row"} if lanes[args[0]] else {"sincos"}
    return helpers
