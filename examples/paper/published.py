"""What papers say (published.toml), and whether a value of ours is inside its band."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import serpentail as st
from serpentail.basics.checks import refusal

FILE = Path(__file__).with_name("published.toml")
SLACK = 1e-9  # of a band's ends, for rounding
INSIDE, OUTSIDE, INCOMPARABLE = "inside", "outside", "not comparable"


@dataclass(frozen=True)
class Row:
    """A number or a sentence of a paper.

    value: True for a sentence, a text where no number is published. band: least and most of ours,
    None for a sentence and where there is no comparison; incomparable: why there is none. why: what
    is known of a difference.
    """

    name: str
    says: str
    value: float | str
    unit: str = ""
    band: tuple[float, float] | None = None
    incomparable: str = ""
    why: str = ""

    def verdict(self, ours: float) -> str:
        """Return INSIDE or OUTSIDE for a value of ours; INCOMPARABLE if there is no band."""
        if self.incomparable:
            return INCOMPARABLE
        least, most = (1, 1) if self.band is None else self.band
        slack = SLACK * max(abs(least), abs(most))
        return INSIDE if least - slack <= ours <= most + slack else OUTSIDE


@dataclass(frozen=True)
class Item:
    """A figure or an animal: its title, where it stands, the page that moves, its rows."""

    title: str
    where: str
    page: str
    rows: tuple[Row, ...]


def read(path: Path = FILE) -> dict[str, Item]:
    """Return the figures and tables by name; SerpentailError where the file is wrong."""
    return {name: item(name, of) for name, of in tomllib.loads(path.read_text("utf-8")).items()}


def item(name: str, of: dict) -> Item:
    """Return a figure or a table of the file, checked."""
    if not isinstance(of, dict) or set(of) != set(Item.__dataclass_fields__):
        raise refused(name, of, "a table of title, where, page and rows")
    rows = tuple(row(f"{name}.rows[{k}]", each) for k, each in enumerate(of["rows"]))
    names = [each.name for each in rows]
    if len(set(names)) != len(names):
        raise refused(f"{name}.rows", names, "a name of its own for each")
    return Item(**of | {"rows": rows})


def row(field: str, of: dict) -> Row:
    """Return a row, checked: a number has a band that it lies in, or a reason for having none."""
    known = set(Row.__dataclass_fields__)
    if not {"name", "says", "value"} <= set(of) <= known:
        raise refused(field, sorted(of), f"name, says and value, of {', '.join(sorted(known))}")
    found, is_sentence, is_text = Row(**of), of["value"] is True, isinstance(of["value"], str)
    reasons = is_sentence + ("band" in of) + ("incomparable" in of)
    if reasons != 1 or (is_text and "band" in of) or not (is_text or is_sentence != ("unit" in of)):
        needs = "true alone, a text and incomparable, or a number, a unit, and band or incomparable"
        raise refused(field, of, needs)
    if found.band is not None and (len(found.band) != 2 or found.verdict(found.value) != INSIDE):
        raise refused(f"{field}.band", found.band, f"[least, most] around {found.value}")
    return found


def refused(field: str, value: object, needs: str) -> Exception:
    """Return the error about a value of the file."""
    return refusal(f"published.toml: {field}", value, needs, st.SerpentailError)
