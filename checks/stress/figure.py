"""A figure of the stress report: a measured number and its limit."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Figure:
    """A measured number and its limit. ``of`` names the quantity; ``note`` adds a remark."""

    of: str
    found: float
    limit: float
    note: str = ""

    @property
    def passed(self) -> bool:
        """Tell if the number is within its limit; NaN is not."""
        return bool(self.found <= self.limit)

    def row(self) -> dict:
        """Return the figure as plain data."""
        return asdict(self) | {"passed": self.passed}


def table(figures: list[Figure]) -> str:
    """Return figures as a Markdown table."""
    lines = ["| of | found | limit | | note |", "|---|---|---|---|---|"]
    for each in figures:
        verdict = "" if each.passed else "**FAILED**"
        lines.append(
            f"| {each.of} | {each.found:.3g} | {each.limit:.3g} | {verdict} | {each.note} |"
        )
    return "\n".join(lines)
