"""Plots: figures and a sweep over bends go in; PNG files come out."""

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure as Page

from figures import Figure
from poses import Point
from subjects import PER_CONDITION


def draw(found: dict[str, list[Figure]], swept: list[Point], folder: Path) -> None:
    """Write bends.png, condition.png and margins.png."""
    with mpl.rc_context({"font.size": 9}):
        bends(swept).savefig(folder / "bends.png", dpi=120)
        conditions(found).savefig(folder / "condition.png", dpi=120)
        margins(found).savefig(folder / "margins.png", dpi=120)


def bends(swept: list[Point]) -> Page:
    """Errors of H, C and v_dot along the bend, one row of axes for each tail."""
    page = Page(figsize=(8, 3.4), layout="constrained")
    tails = list(dict.fromkeys(p.tail for p in swept))
    for axes, tail in zip(page.subplots(1, len(tails), sharey=True), tails, strict=True):
        points = [p for p in swept if p.tail == tail and p.bend > 0]
        for name, marker in (("H", "o"), ("C", "s"), ("per_condition", "^")):
            axes.plot(
                [p.bend for p in points], [max(getattr(p.errors, name), 1e-18) for p in points], marker, label=name
            )
        axes.set(xscale="log", yscale="log", title=tail, xlabel="bend of each segment, rad")
        axes.legend(["H", "C", "v_dot / cond(H)"])
    page.axes[0].set_ylabel("error against 30 digits")
    return page


def conditions(found: dict[str, list[Figure]]) -> Page:
    """Errors of v_dot against the condition number of H, and their bound."""
    page = Page(figsize=(6, 4), layout="constrained")
    axes = page.subplots()
    for part, figures in found.items():
        solved = [f for f in figures if f.note.startswith("cond(H)")]
        numbers = [float(f.note.split()[1]) for f in solved]
        if solved:
            axes.plot(numbers, [max(c * f.found, 1e-18) for c, f in zip(numbers, solved, strict=True)], ".", label=part)
    high = axes.get_xlim()[1]
    axes.plot([1, max(high, 10)], [PER_CONDITION, PER_CONDITION * max(high, 10)], "k--", label="5e-15 cond(H)")
    axes.set(xscale="log", yscale="log", xlabel="cond(H), unit diagonal", ylabel="error of v_dot")
    axes.legend()
    return page


def margins(found: dict[str, list[Figure]]) -> Page:
    """How much of its limit each figure takes, by part."""
    page = Page(figsize=(7, 4), layout="constrained")
    axes = page.subplots()
    names = [name for name in found if any(f.limit > 0 for f in found[name])]
    for row, name in enumerate(names):
        shares = [max(f.found / f.limit, 1e-6) for f in found[name] if f.limit > 0]
        axes.plot(shares, [row] * len(shares), "|", markersize=10)
    axes.axvline(1, color="k", linestyle="--")
    axes.set(xscale="log", xlabel="found / limit", yticks=range(len(names)), yticklabels=names)
    return page
