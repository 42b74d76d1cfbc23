"""Tables of published values beside ours, and why they differ: of docs/paper.md and others."""

import re
from pathlib import Path

from examples.front import ROOT
from examples.paper.published import OUTSIDE, Item, Row

PAGE = ROOT / "docs" / "paper.md"
MARK = "<!-- {} -->\n", "<!-- /{} -->"  # the table stands between these lines
PLANNED = "`st.plan`"
HEAD = ("what", "published", "ours", "", "band", PLANNED, "why")
RED = f'<b style="color: #c62828">{OUTSIDE}</b>'


def write(items: dict[str, Item], values: dict[str, dict], page: Path = PAGE) -> None:
    """Write the table into a page, between its marks, which have the page's name."""
    text = "\n".join([*lines(items, values), ""])
    begin, end = marks(page)
    before, after = re.split(f"(?<={begin}).*(?={end})", page.read_text("utf-8"), flags=re.DOTALL)
    page.write_text(before + text + after, encoding="utf-8")


def marks(page: Path) -> list[str]:
    """Return the lines before and after a page's table."""
    return [mark.format(page.stem) for mark in MARK]


def lines(items: dict[str, Item], values: dict[str, dict]) -> list[str]:
    """Return the table of values by item and row; one value, or ours and that of `st.plan`, whose
    column is left out if there is none; a row without a value needs what we do not have.
    """
    found = [list(HEAD), ["---"] * len(HEAD)]
    for name, item in items.items():
        title = f"**{item.title}** ({item.where}{f'; `{item.page}`' if item.page else ''})"
        found.append([title, *[""] * (len(HEAD) - 1)])
        found += [told(row, values.get(name, {}).get(row.name)) for row in item.rows]
    plans = [isinstance(value, list) for of in values.values() for value in of.values()]
    kept = [k for k, column in enumerate(HEAD) if column != PLANNED or any(plans)]
    return [cells(line[k] for k in kept) for line in found]


def cells(texts) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(texts)} |"


def told(row: Row, value: object) -> list[str]:
    """Return the cells of a row."""
    ours, by_plan = value if isinstance(value, list) else (value, None)
    verdict = row.verdict(ours)
    marked = RED if verdict == OUTSIDE else verdict
    other = "" if by_plan is None else shown(row, by_plan)
    reason = "; ".join(filter(None, (row.incomparable, row.why)))
    return [*claim(row), shown(row, ours), marked, band(row), other, reason]


def claim(row: Row) -> list[str]:
    """Return the cells of a row that the paper fills: what it is, and what it says."""
    return [row.says, shown(row, row.value)]


def band(row: Row) -> str:
    """Return the cell of a band."""
    return "" if row.band is None else " to ".join(f"{end:.4g}" for end in row.band)


def shown(row: Row, value: float | str | None) -> str:
    """Return the text of a value: yes or no of a sentence, else a number with its unit."""
    if value is None or isinstance(value, str):
        return value or ""
    if row.value is True:
        return "yes" if value else "no"
    return f"{value:.5g} {row.unit}".rstrip()
