"""A figure of the stress report: what was found, and what it may be at most."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Figure:
    """One number that was found, and its limit; ``of`` says of what, ``note`` what else is worth
    telling.
    """

    of: str
    found: float
    limit: float
    note: str = ""

    @property
    def passed(self) -> bool:
        """Within the limit; what is no number is not."""
        return bool(self.found <= self.limit)

    def row(self) -> dict:
        """Return the figure as plain data."""
        return asdict(self) | {
            "found": float(self.found),
            "limit": float(self.limit),
            "passed": self.passed,
        }


def table(figures: list[Figure]) -> str:
    """Return figures as a table in Markdown."""
    head = ["| of | found | limit | | note |", "|---|---|---|---|---|"]
    rows = [
        f"| {f.of} | {f.found:.3g} | {f.limit:.3g} | {'' if f.passed else '**FAILED**'} | {f.note} "
        "|"
        for f in figures
    ]
    return "\n".join([*head, *rows])
