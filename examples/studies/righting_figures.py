"""Draws the random starts of the righting study."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from examples.paper.figures import BLUE, write_times
from examples.studies.righting_kinds import TRUE, is_true
from serpentail.show.pictures.style import drawn

RATES = {"auto": (BLUE, "s"), "IPOPT": ("#009e73", "D"), "paper": ("#d55e00", "o")}


def draw_rates(rates: dict[str, dict[str, list[dict]]], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw, for each kind of random start and each way of planning, the share of true plans, and
    CPU time and true error of all plans: medians, and the range of nine tenths of them.
    """
    spans = {"cpu_s": "CPU time [s]", "open_loop_attitude_error_deg": "true error [deg]"}

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 1.2 + 0.3 * len(rates)), layout="constrained")
        axes = figure.subplots(1, 3, sharey=True)
        for shift, (way, (colour, mark)) in zip((0.22, 0, -0.22), RATES.items(), strict=True):
            places = [k for k, ways in enumerate(rates.values()) if way in ways]
            at = shift - np.array(places)
            rows = [ways[way] for ways in rates.values() if way in ways]
            shares = [100 * np.mean([is_true(row) for row in of]) for of in rows]
            look = {"color": colour, "label": way}
            axes[0].plot(shares, at, mark, markersize=3.5, linestyle="none", **look)
            for panel, key in zip(axes[1:], spans, strict=True):
                low, middle, high = np.transpose([_middle([r[key] for r in of]) for of in rows])
                panel.hlines(at, low, high, color=colour, linewidth=1)
                panel.plot(middle, at, mark, markersize=3.5, linestyle="none", **look)
        axes[0].set(xlabel="true plans [%]", xlim=(-4, 104))
        names = [f"{kind}: {len(ways['IPOPT'])}" for kind, ways in rates.items()]
        axes[0].set_yticks(-np.arange(len(rates)), names)
        for panel, name in zip(axes[1:], spans.values(), strict=True):
            panel.set(xlabel=name, xscale="log")
        write_times(axes[1].xaxis)
        axes[2].axvline(TRUE, color="0.5", linestyle=":")
        for panel in axes:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        keys = axes[0].get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper center", ncols=len(RATES))
        return figure, axes

    return drawn(draw, path)


def _middle(values: list[float]) -> np.ndarray:
    """Return the percentiles 5, 50 and 95 of the finite ones of values."""
    finite = np.array(values)[np.isfinite(values)]
    return np.percentile(finite, (5, 50, 95)) if len(finite) else np.full(3, np.nan)
