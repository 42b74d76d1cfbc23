"""The animal as pictures, pages, live views and exports show it: its parts, their sizes, its poses.

Torso and head are balls, that is ellipsoids, in the torso's axes; tail and legs are rods between
points.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import POSITION, ChainLayout

from ..basics.attitude import Array, pose_of
from ..model.chains import HINGE, values_of
from ..model.model import Model
from ..model.polar import polar_to_bend
from ..motion.body import semi_axes
from ..motion.trajectory import Trajectory

THINNEST = 0.15  # a semi-axis that is drawn, over the largest
BELLY = (-0.22, -0.08)  # semi-axes of the torso: between these heights the coat turns pale
# the head's centre, in semi-axes of the torso, and its radius over the smaller of x and z
HEAD, HEAD_RADIUS = (0.0, 0.9, 0.42), 0.72
# colour, place and semi-axes of its balls, in its radii
SKULL = ("fur", (0.0, 0.1, 0.0), (0.85, 1.05, 0.85))
SNOUT = ("fur", (0.0, 0.95, -0.22), (0.42, 0.62, 0.4))
NOSE = ("eye", (0.0, 1.5, -0.2), (0.15, 0.13, 0.13))
EAR = ("fur", (0.52, -0.35, 0.8), (0.34, 0.14, 0.48))
EYE = ("eye", (0.62, 0.6, 0.22), (0.19, 0.19, 0.19))
LEFT = (-1, 1, 1)
LEG = 0.085  # radius of a leg over the torso's smallest semi-axis
JOINT = 1.25  # radius of a joint that is marked, over the tail's
MOST_JOINTS = 60  # that are marked on a tail
SLENDER = 0.015  # radius over length of a tail without a parameter for its radius
THICKER = 1.15  # at the root, over the radius
WATER = 1e3  # kg/m^3


@dataclass(frozen=True)
class Ball:
    """An ellipsoid of the head: its colour, place (3,) and semi-axes (3,), m, in torso axes."""

    colour: str
    place: tuple[float, ...]
    semi_axes: tuple[float, ...]


@dataclass(frozen=True)
class Animal:
    """The drawn animal of a model: semi-axes of the torso and radii of the rods of all chains, m.

    alike: whether all parts of the tail are equally thick but for its taper.  jointed: whether its
    joints are marked.  fixed: a ball at the tail's mount stands for the torso, without a head.
    """

    semi_axes: tuple[float, ...]
    tail_radii: tuple[float, ...]
    tail_length: float
    alike: bool
    jointed: bool
    fixed: bool

    @property
    def length(self) -> float:
        """How long it is with its tail straight, m."""
        return 2 * self.semi_axes[1] + self.tail_length

    @property
    def leg_radius(self) -> float:
        """Radius of the legs' rods, m."""
        return LEG * min(self.semi_axes)

    @cached_property
    def head(self) -> tuple[Ball, ...]:
        """Skull, snout, nose, ears and eyes."""
        if self.fixed:
            return ()
        radius = HEAD_RADIUS * min(self.semi_axes[0], self.semi_axes[2])
        sides = [(colour, np.multiply(LEFT, at), size) for colour, at, size in (EAR, EYE)]
        return tuple(
            Ball(
                colour,
                tuple((np.multiply(HEAD, self.semi_axes) + np.multiply(radius, at)).tolist()),
                tuple(np.multiply(radius, size).tolist()),
            )
            for colour, at, size in (SKULL, SNOUT, NOSE, EAR, EYE, *sides)
        )


def animal_of(model: Model) -> Animal:
    """Return the drawn animal of a model; its semi-axes are large enough to be seen."""
    p, axes = model.parameters, semi_axes(model)
    if model.fixed:
        reach = float(np.linalg.norm(p["tail_mount"]))
        axes = np.full(3, max(reach, 2 * usual_radius(p)))
    few = model.manifest["dimensions"]["total"] <= MOST_JOINTS
    return Animal(
        semi_axes=tuple(np.maximum(axes, THINNEST * axes.max()).tolist()),
        tail_radii=tuple(_tail_radii(model).tolist()),
        tail_length=float(p["tail_length"]),
        alike=len(model.layout.chains) == 1 and not {"link_masses", "arc_masses"} & p.keys(),
        jointed=model.kind == "articulated" and few,
        fixed=model.fixed,
    )


def usual_radius(p: Mapping[str, Any]) -> float:
    """Return the radius (m) of a tail whose links are all alike, from its parameters."""
    return float(p.get("link_radius") or SLENDER * p["tail_length"])


def _tail_radii(model: Model) -> Array:
    """Return the radius (m) of the tail between its points, then of other chains; 0 between two
    chains.
    """
    each = [np.append(0.0, _radii_of(model, chain)) for chain in model.layout.chains]
    return np.concatenate(each)[1:]


def _radii_of(model: Model, chain: ChainLayout) -> Array:
    """Return the radius (m) of a chain between its points.

    Links with inertias of their own are as thick as cylinders of that inertia, arcs with masses of
    their own as thick as that mass of water. Other chains become thinner towards the tip.
    """
    p, points = values_of(chain, model.parameters), model.manifest["dimensions"]["links"]
    counts = np.broadcast_to(points, model.segments)[chain.segments]
    count = int(counts.sum())
    usual, radii = usual_radius({**model.parameters, **p}), np.zeros(count)
    if not {"link_masses", "arc_masses"} & p.keys():
        return usual * (THICKER - np.arange(count) / (2 * count + 2))
    kinds = model.kinds[chain.segments]
    jointed = np.repeat(np.array(kinds) != "continuum", counts)
    if HINGE in kinds:  # of which some have no body
        joints = model.manifest["scene"]["chain"][chain.owner]["joints"]
        jointed = np.array(["mass" in joint for joint in joints])
    if "link_masses" in p:
        along, masses = np.reshape(p["link_inertias"], (-1, 3))[:, 1], np.array(p["link_masses"])
        solid = (along > 0) & (masses > 0)
        radii[jointed] = np.where(solid, np.sqrt(2 * along / np.where(solid, masses, 1)), usual)
    if "arc_masses" in p:
        sections = np.array(p["arc_masses"]) / p["arc_lengths"] / WATER
        arcs = np.array(kinds) == "continuum"
        radii[~jointed] = np.repeat(np.sqrt(sections / np.pi), counts[arcs])
    return radii


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the animal is in K samples: m, world.

    torso (K, 7): centre and quaternion.  tail (K, P + 1, 3): points from the mount to the tip,
    then those of other chains.
    legs (K, 2, 6, 3): their joints; None where their angles or the model's function
    ``leg_points`` are missing.
    """

    torso: Array
    tail: Array
    legs: Array | None


def poses_of(model: Model, q: Array, angles: Array | None, *given: Array) -> Poses:
    """Return the poses of configurations (K, nq) with angles (K, 4) of the legs, rad; ``given`` of
    prescribed joints.
    """
    legs = None
    if angles is not None and "leg_points" in model.kernels:
        legs = np.asarray(model.leg_points(q, angles))
    return Poses(pose_of(q, model.layout), model.tail_points(q, *given), legs)


def centre_of_mass(model: Model, q: Array, v: Array, *given: Array) -> Array:
    """Return the centre of mass (K, 3), m; that of the torso if the scene left out
    ``center_of_mass``; on a fixed base the place of the base.
    """
    if model.fixed or "center_of_mass" not in model.kernels:
        return pose_of(q, model.layout)[:, POSITION]
    return np.asarray(model.center_of_mass(q, v, *given)[0])


def bends(model: Model, tail: Array) -> Array:
    """Return the bends (K, nt) of the segments in pitch and yaw, rad, of tail coordinates (K, nt).

    The bend of an articulated segment is the sum of its links' angles, that of a hinge its angle.
    """
    if model.links is not None:
        return np.repeat(model.turns_each, np.array(model.layout.widths, int)) * tail
    if model.manifest["scene"]["coordinates"] != "polar":
        return tail
    pitch, yaw, *_ = polar_to_bend(tail[:, 0::2], tail[:, 1::2])
    return np.stack([pitch, yaw], axis=2).reshape(tail.shape)


def leg_joints(model: Model, motion: Trajectory, angles: ArrayLike) -> np.ndarray:
    """Return the joints of both legs along a motion (Eqs. 5 to 9).

    Parameters
    ----------
    model : Model
        A model with feet.
    motion : Trajectory
        The motion, of K samples.
    angles : array_like, shape (K, 4)
        gamma and delta of the right leg, then of the left (rad), as in ``Contact.legs``.

    Returns
    -------
    ndarray, shape (K, 2, 6, 3)
        Hip, D, knee, A, M and T of the right leg, then of the left (m, world).

    Raises
    ------
    StateError
        The angles have a wrong shape.
    ModelError
        The model has no function "leg_points".
    """
    return model.leg_points(motion.q, angles)
