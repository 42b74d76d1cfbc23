"""``plot``: panels over time, such as height, attitude, tail and forces, of one run or several."""

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...basics.checks import one_of
from ...basics.errors import ViewError
from ...basics.extras import needed
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..motions import Motions, checked_motions, checked_names
from .panels import PANELS, Panel, beside, colour_of
from .style import QUIET, Array, Axes, Figure, drawn

WIDTH, TALL, ROW = 7.2, 1.05, 0.15  # inches: the figure, a panel, a row of its legend on top
LETTER, HANDLE = 0.056, 0.55  # inches in a legend
APART = 0.07  # of the time axis, between labels of events
ABOVE = 0.09  # of a panel, from the first row of labels to the second
FIRST = ("feet", "torso", "tail")  # whose events are labelled where there is no room for all
WORDS = {QUIET: "#555555"}  # colours of labels that differ from those of their lines
Event = tuple[str, dict[str, Any]]  # with its colour
LEGEND: dict[str, Any] = {
    **{"fontsize": 7, "labelspacing": 0.25, "columnspacing": 1.2, "borderaxespad": 0.2},
    **{"borderpad": 0.1, "frameon": True, "fancybox": False, "framealpha": 1.0},
    **{"facecolor": "white", "edgecolor": "none"},
}


def plot(
    motions: Motions,
    *panels: str,
    ax: "Axes | Sequence[Axes] | None" = None,
    path: str | os.PathLike[str] | None = None,
    names: Sequence[str] | None = None,
    model: Model | None = None,
) -> tuple["Figure", Any]:
    """Draw panels of a motion over time; of several motions in one colour each.

    Vertical lines are touch-downs (solid) and take-offs (dashed).

    Parameters
    ----------
    motions : Trajectory, str, path, sequence or dict of these
        The motions or their .npz files; a dict has names as keys.
    *panels : str
        Names: "height", "attitude", "tilt", "tail", "torque", "force", "rate", "energy",
        "momentum", "angular_momentum". Default: all that do not stay zero.
    ax : matplotlib.axes.Axes or sequence of these, optional
        Axes to draw on, as many as panels. Default: a new figure.
    path : str or path, optional
        A .pdf, .png or .svg file to write the new figure to, whole or not at all.
    names : sequence of str, optional
        Names of several motions, for the legend of the first panel.
    model : Model, optional
        The model of motions that were read from files; it is needed for the bends of segments.

    Returns
    -------
    figure : matplotlib.figure.Figure
        The figure.
    axes : matplotlib.axes.Axes or ndarray of these
        The given axes, else an array of the new ones.

    Raises
    ------
    ViewError
        An argument is wrong.
    ExtraMissing
        Matplotlib is not installed; it comes with the extra "plot".

    Examples
    --------
    >>> figure, axes = st.plot(motion, "height", "tail")  # doctest: +SKIP
    >>> figure, axes = st.plot({"long": motion, "short": other}, "tilt")  # doctest: +SKIP
    """
    needed("matplotlib", "plot")
    wanted = [one_of(f"panels[{k}]", name, PANELS, ViewError) for k, name in enumerate(panels)]
    every, names = checked_motions(motions, names, model)
    for k, motion in enumerate(every):
        if len(motion.t) < 2:
            raise ViewError(f"motions[{k}]: one sample: give at least two to draw over time")
    runs = checked_names(names, every) if len(every) > 1 else []
    chosen: list[Panel] = []
    for name in wanted or PANELS:
        each = [PANELS[name](motion, motion.model or model) for motion in every]
        panel = beside(each, [] if chosen else runs) if runs else each[0].without_still()
        if wanted or panel.names:
            chosen.append(panel)
    if ax is None:
        return drawn(lambda: stacked(every, chosen), path)
    # given axes keep their style
    given = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
    if len(given) != len(chosen):
        raise ViewError(f"ax: {len(given)} axes for {len(chosen)} panels: name one panel for each")
    if path is not None:
        raise ViewError("path: is for a new figure only: leave ax out, or save ax.figure")
    _draw(given, every, chosen)
    return given[0].figure, ax


def stacked(motions: list[Trajectory], chosen: list[Panel]) -> tuple[Figure, Array]:
    """A figure of stacked panels."""
    from .figure import Drawing

    tall = [TALL + ROW * _legend_rows(panel, WIDTH - 0.9)[0] for panel in chosen]
    figure = Drawing(figsize=(WIDTH, 0.6 + sum(tall)), layout="constrained")
    look: dict[str, Any] = {"squeeze": False, "height_ratios": tall}
    every = figure.subplots(len(chosen), 1, sharex=True, **look)[:, 0]
    _draw(every, motions, chosen)
    figure.align_ylabels(every)
    return figure, every


def _draw(every: Any, motions: list[Trajectory], chosen: list[Panel]) -> None:
    """A panel on each of the axes, marks of events on all."""
    t = np.concatenate([motion.t for motion in motions])
    colours = [colour_of(k) for k in range(len(motions))] if len(motions) > 1 else [QUIET]
    events = [
        (colour, event)
        for colour, motion in zip(colours, motions, strict=True)
        for event in motion.info.get("events", [])
    ]
    for axes, panel in zip(every, chosen, strict=True):
        _draw_panel(axes, t, panel)
        _draw_events(axes, events)
    _label_events(every[0], events, APART * (t.max() - t.min()))
    every[-1].set(xlabel="time [s]", xlim=(t.min(), t.max()))


def _draw_panel(axes: Axes, t: Array, panel: Panel) -> None:
    """Curves, grid, and above them a legend."""
    from matplotlib.ticker import MaxNLocator

    # curves
    for curve, name, (colour, dash) in zip(panel.curves.T, panel.names, panel.styles, strict=True):
        axes.plot(t, curve, dash, color=colour, label=name)
    for name, (colour, dash) in panel.key:
        axes.plot([], [], dash, color=colour, label=name)

    # the axis, with room for the legend
    size = axes.get_window_extent().transformed(axes.figure.dpi_scale_trans.inverted())
    rows, columns = _legend_rows(panel, size.width)
    low, high = _limits(panel)
    room = min(0.6, (ROW * rows + 0.06) / size.height) if rows else 0.0
    axes.set(ylabel=panel.label, ylim=(low, low + (high - low) / (1 - room)))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    steps = [1, 1.5, 3, 4.5, 9, 10] if "[deg]" in panel.label else [1, 2, 2.5, 5, 10]
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=steps))
    if rows:
        labelled(axes, columns)


def labelled(axes: Axes, columns: int) -> None:
    """A legend of all that has a label."""
    axes.legend(loc="upper left", ncols=columns, **LEGEND)


def _limits(panel: Panel) -> tuple[float, float]:
    """The least and the largest value on the axis, curves between them with a margin."""
    low, high = 0.0, 0.0
    if panel.curves.size and np.isfinite(panel.curves).any():
        low, high = float(np.nanmin(panel.curves)), float(np.nanmax(panel.curves))
    margin = 0.06 * (high - low) + max(0.0, panel.span - (high - low)) / 2
    return low - margin, high + margin


def _legend_rows(panel: Panel, width: float) -> tuple[int, int]:
    """Rows and columns of a legend on axes of a width in inches; none for a single curve."""
    labels = [name for name in panel.names if name[0] != "_"] + [name for name, _ in panel.key]
    if len(labels) < 2:
        return 0, 0
    letters = max(len(label.replace("$", "").replace("\\phi_", "")) for label in labels)
    columns = max(1, min(len(labels), int(width / (LETTER * letters + HANDLE))))
    return math.ceil(len(labels) / columns), columns


def _draw_events(axes: Axes, events: Sequence[Event]) -> None:
    """A vertical line at each event."""
    for kind, dash in (("touch_down", "-"), ("take_off", "--")):
        marks = [(colour, event["time"]) for colour, event in events if event["kind"] == kind]
        if marks:
            colours, times = zip(*marks, strict=True)
            look: dict[str, Any] = {"colors": colours, "linewidth": 0.6, "zorder": 0.5}
            look |= {"transform": axes.get_xaxis_transform(), "label": f"_{kind}"}
            axes.vlines(times, 0, 1, linestyles=dash, **look)


def _label_events(axes: Axes, events: Sequence[Event], apart: float) -> None:
    """What happens, above the first axes, in two rows: feet first, then torso, then tail."""
    words = {"touch_down": "on", "take_off": "off"}
    rows = [[math.inf], [math.inf]]
    for colour, event in sorted(events, key=lambda each: FIRST.index(each[1]["group"])):
        time, text = event["time"], f"{event['group']} {words[event['kind']]}"
        free = [k for k, row in enumerate(rows) if min(abs(time - x) for x in row) > apart]
        if free:
            rows[free[0]].append(time)
            look: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 6}
            look |= {"transform": axes.get_xaxis_transform(), "color": WORDS.get(colour, colour)}
            axes.text(time, 1.02 + ABOVE * free[0], text, **look)
