"""Draws the figure of the morphology study."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from serpentail.show.pictures.style import drawn

COLORS = {1: "#0072b2", 2: "#d55e00", 3: "#009e73"}  # by segments
AXES = {
    "length": "tail's length over the rat's",
    "mass": "tail's mass over the rat's",
    "taper": "radius of the tip over the base's",
}
BINS = 8
FEWEST = 4  # plans in a bin
PANELS = {  # the quantity of each line of panels, and its factor
    "righted [%]": ("righted", 100.0),
    "energy [mJ]": ("energy_J", 1e3),
    "duration [ms]": ("duration_s", 1e3),
}


def draw(rows: list[dict], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw righted shares, energies and durations against the shape of a tail.

    Energies and durations are medians of the plans that right the animal. Bands are standard
    errors. All other properties vary in each bin as in the whole sample.
    """

    def make() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.subplots(3, len(AXES), sharey="row", sharex="col")
        for column, (name, label) in enumerate(AXES.items()):
            for segments, color in COLORS.items():
                own = [row for row in rows if row["segments"] == segments]
                for panel, shown in zip(axes[:, column], PANELS.values(), strict=True):
                    _draw(panel, own, name, shown, (color, f"{segments}"))
            axes[-1, column].set_xlabel(label)
        for line, label in enumerate(PANELS):
            axes[line, 0].set_ylabel(label)
        for panel in axes.flat:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        keys = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            *keys, loc="outside upper center", ncols=3, title="segments, of six links in all"
        )
        return figure, axes

    return drawn(make, path)


def _draw(
    panel: Axes, rows: list[dict], name: str, shown: tuple[str, float], look: tuple[str, str]
) -> None:
    """Draw one curve: of shares, or of medians."""
    key, factor = shown
    x = np.array([row[name] for row in rows])
    good = np.array([bool(row.get("righted")) for row in rows])
    values = np.array([factor * float(row.get(key) or 0.0) for row in rows])
    bins = min(BINS, len(rows) // FEWEST)
    found = []
    for here in np.array_split(np.argsort(x), bins) if bins else []:
        middle, share, righted = np.median(x[here]), good[here].mean(), values[here][good[here]]
        if key == "righted":
            error = factor * np.sqrt(share * (1 - share) / len(here))
            found.append((middle, *(factor * share + e for e in (0, -error, error))))
        elif len(righted) >= FEWEST:
            error = 50 / np.sqrt(len(righted))  # of a median's rank, in percent
            found.append((middle, *np.percentile(righted, [50, 50 - error, 50 + error])))
    if found:
        middles, height, low, high = np.array(found).T
        color, label = look
        panel.fill_between(middles, low, high, color=color, alpha=0.15, linewidth=0)
        panel.plot(middles, height, "o-", color=color, markersize=3, linewidth=1.2, label=label)
