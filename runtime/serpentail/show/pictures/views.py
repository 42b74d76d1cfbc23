"""Parallel views of a motion, by azimuth and elevation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...basics.checks import numbers_in, one_of, refusal
from ...basics.errors import ViewError
from .style import Array


@dataclass(frozen=True, eq=False)
class View:
    """A parallel view; the rows of its matrix are the directions right, up and to the viewer."""

    name: str
    matrix: Array

    def of(self, world: Array) -> Array:
        """World vectors (n, 3) as (right, up, towards the viewer)."""
        return world @ self.matrix.T


def looking(name: str, azimuth: float, elevation: float) -> View:
    """Return the view of an observer who looks down by `elevation` degrees.

    The observer stands `azimuth` degrees from the animal's right towards its head, for an animal
    that heads along y.
    """
    c, s = np.cos(np.radians([azimuth, elevation])), np.sin(np.radians([azimuth, elevation]))
    right = [-s[0], c[0], 0]
    up = [-s[1] * c[0], -s[1] * s[0], c[1]]
    towards = [c[1] * c[0], c[1] * s[0], s[1]]
    return View(name, np.round([right, up, towards], 15) + 0.0)


SIDE, TOP = looking("side", 0, 0), looking("top", 0, 90)
NAMED = {view.name: view for view in (SIDE, TOP, looking("oblique", 40, 20))}


def views_of(wanted: Sequence[str | tuple[float, float]]) -> list[View]:
    """Return the views of names or of (azimuth, elevation), deg; ViewError if one is wrong."""
    if isinstance(wanted, str) or not isinstance(wanted, Sequence) or not wanted:
        needs = 'a tuple of names or of (azimuth, elevation), such as ("side", (60, 15))'
        raise refusal("views", wanted, needs, ViewError)
    return [_view(k, each) for k, each in enumerate(wanted)]


def _view(k: int, wanted: object) -> View:
    """One of the named views, or one by its angles."""
    if isinstance(wanted, str):
        return NAMED[one_of(f"views[{k}]", wanted, NAMED, ViewError)]
    angles = numbers_in(wanted)
    if angles is None or angles.shape != (2,) or not np.isfinite(angles).all():
        needs = f"{' or '.join(map(repr, NAMED))}, or (azimuth, elevation) in degrees"
        raise refusal(f"views[{k}]", wanted, needs, ViewError)
    azimuth, elevation = (float(angle) for angle in angles)
    if not 0 <= elevation <= 90:
        raise refusal(f"views[{k}]", wanted, "an elevation from 0 to 90 degrees", ViewError)
    return looking(f"{azimuth:g}°, {elevation:g}°", azimuth, elevation)
