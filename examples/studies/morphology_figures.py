"""Draws the figure of the morphology study."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from serpentail.pictures.style import drawn

COLORS = {1: "#0072b2", 2: "#d55e00", 3: "#009e73"}  # by segments
AXES = {
    "length": "tail's length over the rat's",
    "mass": "tail's mass over the rat's",
    "taper": "radius of the tip over the base's",
}
BINS = 8
FEWEST = 4  # plans of which a median is drawn
KINDS = ("effort", "effort", "time")  # objectives of the rows of panels
LABELS = ("righted [%]", "energy [mJ]", "least time [ms]")


def draw(rows: list[dict], path: Path) -> tuple[Figure, np.ndarray]:
    """Righted share with its standard error, energy and least time against what a tail is.

    Medians with quartiles, of the plans that right; all else varies in each bin as it does in all.
    """

    def make() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.subplots(3, len(AXES), sharey="row", sharex="col")
        for column, (name, label) in enumerate(AXES.items()):
            for segments, color in COLORS.items():
                for line, objective in enumerate(KINDS):
                    own = [
                        r for r in rows if (r["segments"], r["objective"]) == (segments, objective)
                    ]
                    _draw(axes[line, column], own, name, line, color, f"{segments}")
            axes[-1, column].set_xlabel(label)
        for line, label in enumerate(LABELS):
            axes[line, 0].set_ylabel(label)
        for panel in axes.flat:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        keys = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            *keys, loc="outside upper center", ncols=3, title="segments, of six links in all"
        )
        return figure, axes

    return drawn(make, path)


def _draw(panel: Axes, rows: list[dict], name: str, line: int, color: str, label: str) -> None:
    """Draw one curve: of shares, or of medians."""
    x = np.array([row[name] for row in rows])
    good = np.array([bool(row.get("righted")) for row in rows])
    if not len(x):
        return
    edges = np.quantile(x, np.linspace(0, 1, BINS + 1))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    values = np.array([_value(row, line) for row in rows])
    found = []
    for k in range(BINS):
        here = place == k
        if line == 0 and here.any():
            share = good[here].mean()
            error = np.sqrt(share * (1 - share) / here.sum())
            found.append((np.median(x[here]), *(100 * (share + e) for e in (0, -error, error))))
        elif line and (here & good).sum() >= FEWEST:
            found.append((np.median(x[here]), *np.percentile(values[here & good], [50, 25, 75])))
    if found:
        middle, height, low, high = np.array(found).T
        panel.fill_between(middle, low, high, color=color, alpha=0.15, linewidth=0)
        panel.plot(middle, height, "o-", color=color, markersize=3, linewidth=1.2, label=label)


def _value(row: dict, line: int) -> float:
    """Return what of a row a line of panels shows, in mJ or ms."""
    value = row.get("energy_J" if line == 1 else "duration_s")
    return np.nan if value is None else 1e3 * value
