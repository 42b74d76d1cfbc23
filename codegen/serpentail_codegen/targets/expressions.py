"""Prints the scalar expressions of steps: one definition on each line, in the dialect of a
language.
"""

from collections import Counter, defaultdict
from dataclasses import dataclass, field

from ..ir.program import Index
from ..ir.tape import BINARY, LEAVES, lanes_of, live_nodes, operands
from ..passes.schedule import scheduled

LEAST_SINGLE = 2.0**-126
SYMBOL = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


def index_text(index: Index) -> str:
    """Print an affine index."""
    terms = [name if factor == 1 else f"{factor} * {name}" for name, factor in index.terms]
    return " + ".join([*terms, *([str(index.offset)] if index.offset or not terms else [])])


def literal(value, real: str) -> str:
    """Print a number by its shortest exact decimal; 0 if single precision cannot hold it."""
    single = real == "float"
    tiny = single and abs(value) < LEAST_SINGLE
    return repr(0.0 if tiny else float(value)) + ("f" if single else "")


@dataclass(frozen=True)
class Dialect:
    """How a language defines a name, prints a number and calls functions."""

    definition: str
    functions: dict[str, str]
    wide_functions: dict[str, str] = field(default_factory=dict)  # of wide arguments
    real: str = "double"
    select: str = "{c} > {zero} ? {a} : {b}"
    wide_select: str = ""  # of wide operands
    sincos: str = ""  # defines sine and cosine of one argument together; empty: two functions
    wide_sincos: str = ""  # the same of a wide argument
    wide: str = ""  # defines a wide scalar: one number in each lane
    load: str = ""  # the current lanes at an address

    def literal(self, value) -> str:
        """Print a number of the language's real type."""
        return literal(value, self.real)


EARLY, LATE = "early", "late"  # parts of narrow scalars; LATE ones need a lane of some wide one
Part = str | int  # one of these, or the lanes of a part of wide scalars


class Scalars:
    """Prints the nodes that the results need, part by part.

    ``wide`` are the lanes of the wide inputs, by number. Narrow nodes come first, then wide ones,
    then narrow ones that need a lane. A product or sign that is used once is printed inside its
    use.
    """

    def __init__(self, nodes, results, names, dialect: Dialect, wide: dict[int, int] | None = None):
        self.nodes, self.names, self.dialect = nodes, names, dialect
        self.live = live_nodes(nodes, results)
        self.uses = Counter(a for n in self.live for a in operands(nodes[n]))
        self.uses.update(results)
        self.text: dict[object, str] = {}
        self.stored: dict[
            int, int
        ] = {}  # position in the workspace of scalars of which a lane is needed
        self.count = 0
        self.part, self.lanes = self._parts(wide or {})
        self.abroad = {
            a for n in self.live for a in operands(nodes[n]) if self.part[a] != self.part[n]
        }
        self.results = results

    def _parts(self, wide: dict[int, int]) -> tuple[dict[int, Part], dict[int, int]]:
        if not wide and not any(self.nodes[n][0] == "unit" for n in self.live):
            return dict.fromkeys(self.live, EARLY), dict.fromkeys(self.live, 0)
        inputs = defaultdict(int, wide)
        lanes: dict[int, int] = {}
        part: dict[int, Part] = {}
        for n in sorted(self.live):
            lanes[n] = lanes_of(self.nodes[n], lanes, inputs)
            late = self.nodes[n][0] == "lane" or any(
                part[a] == LATE for a in operands(self.nodes[n])
            )
            if late and lanes[n]:
                raise ValueError("a wide scalar that needs a lane of another cannot be printed")
            part[n] = LATE if late else lanes[n] or EARLY
        return part, lanes

    def lines(self, part: Part = EARLY) -> list[str]:
        """Return the definitions of a part in order; afterwards ``text`` prints its nodes."""
        out = []
        for node in scheduled(
            self.nodes, [n for n in self.live if self.part[n] == part], self.results
        ):
            op, *args = self.nodes[node]

            # both functions of an angle at once, where the language has it
            if op in ("sin", "cos") and self.dialect.sincos:
                out += self._sincos(args[0])
                self.text[node] = self.text[op, args[0]]
                continue

            text = self._expression(op, args)
            if self._goes_into_its_use(node):
                self.text[node] = text
            else:
                self.text[node] = name = self._name()
                form = self.dialect.wide if self.lanes[node] else self.dialect.definition
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
        form = self.dialect.wide_sincos if self.lanes[argument] else self.dialect.sincos
        return [form.format(argument=self.text[argument], **names)]

    def _expression(self, op: str, args) -> str:
        if op in BINARY:
            return f"{self._operand(args[0], op)} {SYMBOL[op]} {self._operand(args[1], op)}"
        if op == "neg":
            return f"-{self._operand(args[0], op)}"
        if op == "select":
            return self._selection(args)
        if op == "lane":
            return f"work[{self.stored[args[0]] + args[1]}]"
        if op in LEAVES:
            return self._leaf(op, args)
        wide = self.lanes[args[0]]
        functions = self.dialect.wide_functions if wide else self.dialect.functions
        return f"{functions[op]}({self.text[args[0]]})"

    def _selection(self, args) -> str:
        texts = [self.text[n] for n in args]
        form = self.dialect.select
        if any(self.lanes[n] for n in args):  # narrow operands are the same in all lanes
            widened = zip(texts, args, strict=True)
            texts = [text if self.lanes[n] else f"WIDE({text})" for text, n in widened]
            form = self.dialect.wide_select
        c, a, b = texts
        return form.format(c=c, a=a, b=b, zero=self.dialect.literal(0))

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
    if not any(node[0] in ("sin", "cos", "sqrt", "select") for node in nodes):
        return set()
    lanes: list[int] = []
    helpers = set()
    for op, *args in nodes:
        lanes.append(lanes_of((op, *args), lanes, inputs))
        if op in ("sin", "cos"):
            helpers |= {"sincos", "wide_sincos"} if lanes[args[0]] else {"sincos"}
        if op == "sqrt" and lanes[args[0]]:
            helpers.add("wide_sqrt")
        if op == "select" and lanes[-1]:
            helpers.add("wide_select")
    return helpers
