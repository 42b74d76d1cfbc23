"""The table of docs/paper.md: published, ours, and why."""

import re

from examples.front import ROOT
from examples.paper.published import INSIDE, OUTSIDE, Item, Row

PAGE = ROOT / "docs" / "paper.md"
BEGIN, END = "<!-- paper -->\n", "<!-- /paper -->"  # the table stands between these lines
HEAD = ("what", "published", "ours", "", "band", "`st.plan`", "why")


def write(items: dict[str, Item], values: dict[str, dict]) -> None:
    """Write the table into the page, between its marks."""
    text = "\n".join([*lines(items, values), ""])
    before, after = re.split(f"(?<={BEGIN}).*(?={END})", PAGE.read_text("utf-8"), flags=re.DOTALL)
    PAGE.write_text(before + text + after, encoding="utf-8")


def lines(items: dict[str, Item], values: dict[str, dict]) -> list[str]:
    """Return the table of values by figure and row; one value, or ours and that of `st.plan`."""
    found = [cells(HEAD), "|---" * len(HEAD) + "|"]
    for name, item in items.items():
        title = f"**{item.title}** ({item.where}; `{item.page}`)"
        found.append(cells([title, *[""] * (len(HEAD) - 1)]))
        found += [cells(told(row, values[name][row.name])) for row in item.rows]
    return found


def cells(texts) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(texts)} |"


def told(row: Row, value: object) -> list[str]:
    """Return the cells of a row."""
    ours, by_plan = value if isinstance(value, list) else (value, None)
    verdict = row.verdict(ours)
    marked = {INSIDE: INSIDE, OUTSIDE: f"**{OUTSIDE}**"}.get(verdict, verdict)
    other = "" if by_plan is None else shown(row, by_plan)
    reason = "; ".join(filter(None, (row.incomparable, row.why)))
    return [*claim(row), shown(row, ours), marked, band(row), other, reason]


def claim(row: Row) -> list[str]:
    """Return the cells of a row that the paper fills: what it is, and what it says."""
    return [row.says, shown(row, row.value)]


def band(row: Row) -> str:
    """Return the cell of a band."""
    return "" if row.band is None else " to ".join(f"{end:.4g}" for end in row.band)


def shown(row: Row, value: float) -> str:
    """Return the text of a value: yes or no of a sentence, else a number with its unit."""
    if row.value is True:
        return "yes" if value else "no"
    return f"{value:.5g} {row.unit}".rstrip()
