"""A figure of the stress report: a measured number and its limit."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Figure:
    """A measured number and its limit.  ``of`` names the quantity; ``note`` adds a remark."""

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
        return asdict(self) | {
            "found": float(self.found),
            "limit": float(self.limit),
            "passed": self.passed,
        }


def table(figures: list[Figure]) -> str:
    """Return figures as a Markdown table."""
    head = ["| of | found | limit | | note |", "|---|---|---|---|---|"]
    rows = [
        f"| {f.of} | {f.found:.3g} | {f.limit:.3g} | {'' if f.passed else '**FAILED**'} | {f.note} "
        "|"
        for f in figures
    ]
    return "\n".join([*head, *rows])
