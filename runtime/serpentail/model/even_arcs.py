"""Arcs of tapered tails: each has the mass of its slice of the cone, but evenly along itself."""

import warnings

import numpy as np

from serpentail_scene.units import in_unit

from ..basics.errors import UnusualSize
from .parameters import Values

MOST = 0.02  # of the moment of inertia about the mount that even arcs may be off without a warning
ARC = ("arc_masses", "arc_lengths")
LINK = ("link_masses", "link_lengths", "link_centers", "link_inertias")
NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)  # exact for the polynomials of a cone


def warn_of_even_arcs(manifest: dict, values: Values, calls: int) -> None:
    """Warn if even arcs change the inertia of a tapered tail; ``calls``: frames above this one."""
    off = excess(manifest, values) if "arc_masses" in values else 0.0
    if off > MOST:
        told = (
            f"taper: the straight tail's moment of inertia about the mount is {100 * off:.2g} % too"
            f" large, more than {100 * MOST:g} %, because each arc has an even mass: divide it into"
            " more segments"
        )
        warnings.warn(told, UnusualSize, stacklevel=calls + 1)


def excess(manifest: dict, values: Values) -> float:
    """Return by how much of it even arcs make the inertia about the mount of a straight tail too
    large.
    """
    scene = manifest["scene"]
    segments = scene["segments"]
    tables = segments if isinstance(segments, list) else [{}] * segments
    arcs, links = _pieces(values, ARC), _pieces(values, LINK)
    whole = sum(length for _, length, *_ in (*arcs, *links))
    place = even = cone = 0.0
    for table in tables:
        if table.get("kind", scene["kind"]) == "articulated":
            for _ in range(table["links"]):
                mass, length, center, inertia, *_ = links.pop(0)
                of_link = inertia + mass * (place + center) ** 2
                even, cone, place = even + of_link, cone + of_link, place + length
            continue
        mass, length = arcs.pop(0)
        ends = np.array([place, place + length])
        radii = in_unit(table.get("radii", [1.0, 1.0]), "m")
        if "taper" in scene:
            radii = np.interp(ends, [0, whole], in_unit(scene["taper"]["radii"], "m"))
        where = (1 + NODES) / 2
        share = WEIGHTS * np.interp(where, [0, 1], radii) ** 2
        cone += mass * share @ (place + length * where) ** 2 / share.sum()
        even += mass * (length**2 / 12 + ends.mean() ** 2)
        place += length
    return float(even / cone - 1)


def _pieces(values: Values, names: tuple[str, ...]) -> list[list[float]]:
    """Return a row of these numbers for each link or arc; nothing if there is none."""
    if names[0] not in values:
        return []
    count = np.size(values[names[0]])
    return np.hstack([np.reshape(values[name], (count, -1)) for name in names]).tolist()
