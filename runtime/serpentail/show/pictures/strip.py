"""``Strip``: what a filmstrip or a moving film draws of motions, and in which windows."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from serpentail_scene.layout import POSITION

from ...basics.attitude import rotation_matrix
from ...basics.checks import numbers_in, refusal
from ...basics.errors import ViewError
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..animal import animal_of, centre_of_mass
from ..motions import checked_models, checked_names
from .frames import LONGEST, Frame, drawn_points, frames, window_around
from .style import FORCE, HEAD, INK, LEG, QUIET, TAIL, Array
from .views import SIDE, View

MOVING = 6.0  # times as much as the time that passed counts the way that was gone
HIGHEST = 4.0  # widths of a panel that a motion may rise for its panels to have the ground in them
DOT: dict[str, Any] = {"color": HEAD, "linestyle": "", "marker": "o", "markersize": 4}
KEY: dict[str, dict[str, Any]] = {
    "head": DOT,
    "head, far side": DOT | {"markerfacecolor": "white"},
    "back": {"color": INK, "linewidth": 1.4},
    "tail": {"color": TAIL, "linewidth": 1.4},
    "path of the COM": {"color": QUIET, "linestyle": ":"},
}
OF_TORSO = ("head", "head, far side", "back", "path of the COM")  # not drawn for a fixed base


@dataclass(frozen=True, eq=False)
class Strip:
    """What is drawn: for each motion its frames and the path (K, 3) of its centre of mass.

    names: of the motions, to tell them apart. grounded: there is ground at z = 0. largest: the
    largest force (N).
    """

    films: list[list[Frame]]
    coms: list[Array]
    views: list[View]
    names: list[str]
    grounded: bool
    largest: float

    def origin(self, frame: Frame) -> Array:
        """The world point at the middle of a frame's panels: over the ground its height is 0."""
        return frame.com * (1, 1, 0) if self.anchored else frame.com

    @cached_property
    def every(self) -> list[Frame]:
        """All frames."""
        return [frame for film in self.films for frame in film]

    @cached_property
    def anchored(self) -> bool:
        """Whether every panel shows the ground, because it is near enough."""
        reach = np.ptp(np.vstack([drawn_points(f, SIDE) - SIDE.of(f.com)[:2] for f in self.every]))
        return self.grounded and max(f.com[2] for f in self.every) < HIGHEST * reach

    def windows(self) -> list[Array]:
        """What the panels of each view show, about their origins."""
        windows = []
        for view in self.views:
            shapes = [drawn_points(f, view) - view.of(self.origin(f))[:2] for f in self.every]
            if self.anchored and view.matrix[1, 2] > 0:
                shapes.append(np.array([[0.0, -0.02]]))
            windows.append(window_around(shapes))
        # widened to both sides until all are as wide as the widest
        widest = max(window[1, 0] - window[0, 0] for window in windows)
        for window in windows:
            window[:, 0] += (widest - (window[1, 0] - window[0, 0])) / 2 * np.array([-1, 1])
        return windows

    def key(self) -> dict[str, dict[str, Any]]:
        """What the marks mean."""
        legs = {"leg": {"color": LEG, "linewidth": 1.4}} if len(self.every[0].legs) else {}
        force = f"force, {1e3 * LONGEST:.0f} mm: {self.largest:.3g} N"
        forces = {force: {"color": FORCE, "linewidth": 1.4}} if self.largest else {}
        under = any(frame.lowest < -2e-3 for frame in self.every)
        pale: dict[str, Any] = {"color": TAIL, "linewidth": 1.4, "alpha": 0.3}
        below = {"below the ground": pale} if self.grounded and under else {}
        torsos = not all(frame.animal.fixed for frame in self.every)
        marks = {name: look for name, look in KEY.items() if torsos or name not in OF_TORSO}
        return marks | legs | forces | below


def strip_of(
    motions: list[Trajectory],
    wanted: int | Sequence[float] | Array,
    views: list[View],
    names: Sequence[str] | None,
    model: Model | None,
) -> Strip:
    """Return what to draw of motions."""
    labels = checked_names(names, motions) if len(motions) > 1 or names else [""]
    models = checked_models(motions, model)
    rows = _rows(models, motions, wanted)
    largest = largest_force(motions, rows)
    films = [frames(*each, largest) for each in zip(models, motions, rows, strict=True)]
    pairs = zip(models, motions, strict=True)
    coms = [centre_of_mass(model, motion.q, motion.v, *motion.given) for model, motion in pairs]
    lowest = min(frame.lowest for film in films for frame in film)
    grounded = lowest > 0 or any(motion.contact is not None for motion in motions)
    return Strip(films, coms, views, labels, grounded, largest)


def _rows(models: list[Model], motions: list[Trajectory], wanted: Any) -> Array:
    """The samples (motions, frames) to draw, those nearest to the times."""
    times = numbers_in(wanted)
    if isinstance(wanted, int | np.integer) and not isinstance(wanted, bool) and wanted > 0:
        tracks = [(pair[1].t, way_of(*pair)) for pair in zip(models, motions, strict=True)]
        times = moments(tracks, int(wanted))
    elif times is None or times.ndim != 1 or not times.size or not np.isfinite(times).all():
        raise refusal("frames", wanted, "a whole number from 1, or times in s", ViewError)
    nearest = [[int(np.abs(m.t - time).argmin()) for time in np.sort(times)] for m in motions]
    return np.unique(nearest, axis=1)


def largest_force(motions: Iterable[Trajectory], rows: Iterable[Iterable[int]]) -> float:
    """The largest force (N) at a point in samples of motions; 0 in flight."""
    sizes = [
        np.linalg.norm(motion.contact.forces[list(chosen)], axis=-1).max(initial=0)
        for motion, chosen in zip(motions, rows, strict=True)
        if motion.contact is not None
    ]
    return float(max(sizes, default=0.0))


def way_of(model: Model, motion: Trajectory) -> Array:
    """How far (K,), m, head, back and tail have gone by each sample, on the average."""
    _, length, height = animal_of(model).semi_axes
    marks, rotations = np.array([[0, length, 0], [0, 0, height]]), rotation_matrix(motion.attitude)
    torso = motion.pose[:, None, POSITION] + np.einsum("kij,nj->kni", rotations, marks)
    points = np.concatenate([torso, model.tail_points(motion.q, *motion.given)], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2).mean(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def moments(tracks: list[tuple[Array, Array]], count: int) -> Array:
    """Return times (s), at most ``count``, between which the motions (times, ways) change alike."""
    begin, end = max(t[0] for t, _ in tracks), min(t[-1] for t, _ in tracks)
    grid = np.linspace(begin, end, 4001)
    share = np.linspace(0, 1, len(grid))
    for t, way in tracks:
        passed = np.interp(grid, t, way)
        passed -= passed[0]
        share += MOVING * passed / (passed[-1] or 1.0)
    return np.interp(np.linspace(0, share[-1], count), share, grid)
