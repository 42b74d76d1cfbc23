"""What the paper says (published.toml), and whether a value of ours is inside its band."""

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
    """A number or a sentence of the paper.

    value: True for a sentence. band: least and most of ours, None for a sentence and where there is
    no comparison; incomparable: why there is none. why: what is known of a difference.
    """

    name: str
    says: str
    value: float
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
    """A figure or a table: its title, where it stands, the page that moves, its rows."""

    title: str
    where: str
    page: str
    rows: tuple[Row, ...]


def read(path: Path = FILE) -> dict[str, Item]:
    """Return the figures and tables by name; SerpentailError where the file is wrong."""
    return {name: item(name, of) for name, of in tomllib.loads(path.read_text("utf-8")).items()}


def item(name: str, of: dict) -> Item:
    """Return a figure or a table of the file, checked."""
    if not isinstance(of, dict) or set(of) != {"title", "where", "page", "rows"}:
        raise refusal(name, of, "title, where, page and rows", st.SerpentailError)
    rows = tuple(row(f"{name}.rows[{k}]", each) for k, each in enumerate(of["rows"]))
    if len({each.name for each in rows}) != len(rows):
        names = [each.name for each in rows]
        raise refusal(f"{name}.rows", names, "a name for each row", st.SerpentailError)
    return Item(of["title"], of["where"], of["page"], rows)


def row(field: str, of: dict) -> Row:
    """Return a row, checked: a number has a band that it lies in, or a reason for having none."""
    known = set(Row.__dataclass_fields__)
    if not set(of) <= known or not {"name", "says", "value"} <= set(of):
        raise refusal(field, sorted(of), f"of {sorted(known)}, name, says, value", st.SerpentailError)
    found, is_sentence = Row(**of), of["value"] is True
    if is_sentence == ("unit" in of) or is_sentence + ("band" in of) + ("incomparable" in of) != 1:
        needs = "true alone, or a number with a unit and either a band or incomparable"
        raise refusal(field, of, needs, st.SerpentailError)
    if found.band is not None and (len(found.band) != 2 or found.verdict(found.value) != INSIDE):
        raise refusal(f"{field}.band", found.band, "[least, most] with the value inside", st.SerpentailError)
    return found
