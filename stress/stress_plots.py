"""Draws the stress report's figures, and errors over the bend of a continuum."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Page

from stress.figures import Figure
from stress.poses import Point
from stress.subjects import PER_CONDITION

LEAST = 1e-5  # smaller shares of a limit are drawn as this one


def draw(found: dict[str, list[Figure]], swept: list[Point], folder: Path) -> None:
    """Write bends.png, condition.png and margins.png."""
    with mpl.rc_context({"font.size": 9}):
        bends(swept).savefig(folder / "bends.png", dpi=120)
        conditions(found).savefig(folder / "condition.png", dpi=120)
        margins(found).savefig(folder / "margins.png", dpi=120)


def bends(swept: list[Point]) -> Page:
    """Draw errors of H, C and v_dot over the bend, in one diagram for each tail."""
    page = Page(figsize=(8, 6), layout="constrained")
    tails = list(dict.fromkeys(p.tail for p in swept))
    places = sorted({p.bend for p in swept})
    for axes, tail in zip(
        page.subplots(len(tails), 1, sharex=True, sharey=True), tails, strict=True
    ):
        points = [p for p in swept if p.tail == tail]
        for name, marker in (("H", "o"), ("C", "s"), ("per_condition", "^")):
            found = [max(getattr(p.errors, name), 1e-18) for p in points]
            words = "v_dot / cond(H)" if name == "per_condition" else name
            axes.plot(
                [places.index(p.bend) for p in points], found, marker, label=words, markersize=5
            )
        axes.set(yscale="log", title=tail, ylabel="error against 30 digits")
        axes.grid(axis="x", color="0.9")
    axes.set_xticks(range(len(places)), [f"{bend:.3g}" for bend in places], rotation=60)
    axes.set_xlabel("bend of each segment, rad")
    page.legend(*axes.get_legend_handles_labels(), loc="outside right upper")
    return page


def conditions(found: dict[str, list[Figure]]) -> Page:
    """Draw errors of v_dot over the condition number of H, with their bound."""
    page = Page(figsize=(8, 4), layout="constrained")
    axes = page.subplots()
    for part, figures in found.items():
        solved = [f for f in figures if f.note.startswith("cond(H)")]
        numbers = [float(f.note.split()[1]) for f in solved]
        if solved:
            axes.plot(
                numbers,
                [max(c * f.found, 1e-18) for c, f in zip(numbers, solved, strict=True)],
                ".",
                label=part,
            )
    ends = np.array([1, max(10, axes.get_xlim()[1])])
    axes.plot(ends, PER_CONDITION * ends, "k--", label="5e-15 cond(H)")
    axes.set(xscale="log", yscale="log", xlabel="cond(H), unit diagonal", ylabel="error of v_dot")
    axes.set_title("above the line: torso and tail of unlike size", fontsize=9)
    page.legend(loc="outside right upper")
    return page


def margins(found: dict[str, list[Figure]]) -> Page:
    """Draw each figure as a share of its limit, by part."""
    page = Page(figsize=(8, 4), layout="constrained")
    axes = page.subplots()
    names = [name for name in found if any(f.limit > 0 for f in found[name])]
    for row, name in enumerate(names):
        shares = [max(f.found / f.limit, LEAST) for f in found[name] if f.limit > 0]
        axes.plot(shares, [row] * len(shares), "|", markersize=10)
    axes.axvline(1, color="k", linestyle="--")
    axes.set(
        xscale="log",
        xlabel=f"found / limit (left edge: {LEAST:g} or less)",
        yticks=range(len(names)),
    )
    axes.set(xlim=(LEAST / 2, 3), yticklabels=names)
    axes.invert_yaxis()
    return page
