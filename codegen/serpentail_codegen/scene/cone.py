"""Mass properties of links that are cut out of one tapered body: a truncated cone of one density.

A link is a slice of the cone across its axis. It is a truncated cone itself, and its mass, centre
of mass and moments of inertia are exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from math import pi

from serpentail_scene.parameters import ellipsoid


@dataclass(frozen=True)
class LinkValues:
    """Numbers of links: kg, m, COM from the joint (m), kg m^2 about the COM."""

    masses: tuple[float, ...]
    lengths: tuple[float, ...]
    centers: tuple[float, ...]
    inertias: tuple[float, ...]  # 3 for each link, y along it

    def __add__(self, other: "LinkValues") -> "LinkValues":
        return LinkValues(*(a + b for a, b in zip(_fields(self), _fields(other), strict=True)))


def _fields(links: LinkValues) -> tuple[tuple[float, ...], ...]:
    """Return all numbers of links."""
    return links.masses, links.lengths, links.centers, links.inertias


def links_of_cone(lengths: Sequence[float], radii: Sequence[float], density: float) -> LinkValues:
    """Return links of these lengths, from the root on, cut out of a cone with radii at both
    ends.
    """
    total = sum(lengths)
    places = [place / total for place in accumulate(lengths, initial=0.0)]
    at = [radii[0] + (radii[1] - radii[0]) * place for place in places]
    at[-1] = radii[1]
    slices = [
        _slice(*ends, length, density) for ends, length in zip(pairwise(at), lengths, strict=True)
    ]
    return LinkValues(
        tuple(mass for mass, _, _ in slices),
        tuple(lengths),
        tuple(center for _, center, _ in slices),
        tuple(moment for *_, moments in slices for moment in moments),
    )


def volume(radii: Sequence[float], length: float) -> float:
    """Return the volume (m^3) of a cone with radii at both ends."""
    a, b = radii
    return pi / 3 * length * (a * a + a * b + b * b)


def _slice(
    a: float, b: float, length: float, density: float
) -> tuple[float, float, tuple[float, float, float]]:
    """Mass, COM from the root, and moments about the COM of a cone with radii a and b."""
    mass = density * volume((a, b), length)
    square = a * a + a * b + b * b
    center = length * (a * a + 2 * a * b + 3 * b * b) / (4 * square)

    # along the axis: the integral of r^4 / 2; across: half of that plus the integral of r^2 s^2,
    # where s is measured from the COM
    both, product = a * a + b * b, a * b
    fourth = (both - product) * (a + b) * (a + b) + product * product
    along = density * pi / 10 * length * fourth
    spread = both * both + 4 * product * both + 8 * product * product
    across = along / 2 + mass * length * length * 3 * spread / (80 * square * square)
    return mass, center, (across, along, across)


def single_links(
    masses: Sequence[float],
    lengths: Sequence[float],
    centers: Sequence[float],
    inertias: Sequence[float],
    radius: float,
) -> LinkValues:
    """Return single links; without ``inertias`` each is an ellipsoid of semi-axes (r, L / 2, r)."""
    moments = tuple(inertias) or tuple(
        moment
        for m, length in zip(masses, lengths, strict=True)
        for moment in ellipsoid(m, length, radius)
    )
    return LinkValues(tuple(masses), tuple(lengths), tuple(centers), moments)
