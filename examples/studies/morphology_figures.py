"""Draws the figure of the morphology study."""

from itertools import product
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
FEWEST = 4  # plans in a bin
LONGEST, SHORTER = 0.58, 0.3  # s, flights that are shown
PANELS = (("righted in 0.58 s [%]", LONGEST), ("righted in 0.3 s [%]", SHORTER))
PANELS += (("energy in 0.58 s [mJ]", LONGEST),)
ENERGY = 2  # the line of panels that shows it


def draw(rows: list[dict], path: Path) -> tuple[Figure, np.ndarray]:
    """Righted shares with their standard errors, and energies, against what a tail is.

    Energies are medians with quartiles, of the plans that right; all else varies in each bin as it
    does in all.
    """

    def make() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.subplots(3, len(AXES), sharey="row", sharex="col")
        for column, (name, label) in enumerate(AXES.items()):
            for (segments, color), line in product(COLORS.items(), range(len(PANELS))):
                wanted = segments, PANELS[line][1]
                own = [row for row in rows if (row["segments"], row["flight"]) == wanted]
                _draw(axes[line, column], own, name, line == ENERGY, (color, f"{segments}"))
            axes[-1, column].set_xlabel(label)
        for line, (label, _) in enumerate(PANELS):
            axes[line, 0].set_ylabel(label)
        for panel in axes.flat:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        keys = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            *keys, loc="outside upper center", ncols=3, title="segments, of six links in all"
        )
        return figure, axes

    return drawn(make, path)


def _draw(panel: Axes, rows: list[dict], name: str, energy: bool, look: tuple[str, str]) -> None:
    """Draw one curve: of shares, or of energies."""
    x = np.array([row[name] for row in rows])
    good = np.array([bool(row.get("righted")) for row in rows])
    values = np.array([1e3 * (row.get("energy_J") or np.nan) for row in rows])
    bins = min(BINS, len(rows) // FEWEST)
    found = []
    for here in np.array_split(np.argsort(x), bins) if bins else []:
        middle, share, righted = np.median(x[here]), good[here].mean(), values[here][good[here]]
        if not energy:
            error = np.sqrt(share * (1 - share) / len(here))
            found.append((middle, *(100 * (share + e) for e in (0, -error, error))))
        elif len(righted) >= FEWEST:
            found.append((middle, *np.percentile(righted, [50, 25, 75])))
    if found:
        middles, height, low, high = np.array(found).T
        color, label = look
        panel.fill_between(middles, low, high, color=color, alpha=0.15, linewidth=0)
        panel.plot(middles, height, "o-", color=color, markersize=3, linewidth=1.2, label=label)
