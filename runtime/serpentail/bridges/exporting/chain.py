"""The rigid bodies of an articulated model: torso and links, their names, numbers and shapes."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...basics.errors import ExportError
from ...model.model import Model
from ...show.animal import animal_of, usual_radius

AXES = (("alpha", (1, 0, 0)), ("beta", (0, 0, 1)))  # of a link's two joints, in its own frame
NO_TURN = (0.0, 0.0, 0.0)
Vector = tuple[float, ...]


class Link(NamedTuple):
    """A link: its segment and its number in it, from 1; SI units.

    place, turn: its joints in the frame before it, and that frame's turn (roll, pitch and yaw,
    rad, about fixed axes x, y, z), which only a tilted tail's first link has.  center: of mass, in
    its own frame, whose axes are principal ones and whose y leads back to its joint.
    """

    segment: int
    number: int
    place: Vector
    turn: Vector
    length: float
    mass: float
    center: Vector
    inertia: Vector
    radius: float

    @property
    def name(self) -> str:
        """Its name."""
        return f"link_{self.segment}_{self.number}"

    @property
    def end(self) -> Vector:
        """Its end in its frame, m."""
        return (0.0, -self.length, 0.0)

    def joint(self, axis: str, number: int | None = None) -> str:
        """Return the name of its joint about an axis, or of that of another link of its segment."""
        return f"{axis}_{self.segment}_{number or self.number}"


class Passive(NamedTuple):
    """Parameters of a tail coordinate, less "tail_", SI units; 0 where the scene names none."""

    stiffness: float
    rest: float
    damping: float
    stop_lower: float
    stop_upper: float
    stop_stiffness: float
    stop_width: float


class Chain(NamedTuple):
    """A torso and links, SI units, and what acts on each tail coordinate by its joint's name."""

    links: tuple[Link, ...]
    passive: dict[str, Passive]
    torso_mass: float
    torso_inertia: Vector


class Capsule(NamedTuple):
    """A cylinder between two half balls about the torso's COM, m; one ball where half is 0."""

    axis: int
    half: float
    radius: float


def chain_of(model: Model, kind: str) -> Chain:
    """Return the chain of links of a model; ExportError if it is not such a chain."""
    _refuse_other(model, kind)
    p = model.parameters
    numbers = [(i + 1, j + 1) for i, count in enumerate(model.joints_each) for j in range(count)]
    place, turn = p["tail_mount"], _mount_turn(model)
    links: list[Link] = []
    for (segment, number), body in zip(numbers, _bodies(model, len(numbers)), strict=True):
        length, mass, center, inertia, radius = body
        com = (0.0, -center, 0.0)
        link = Link(segment, number, place, turn, length, mass, com, inertia, radius)
        links.append(link)
        place, turn = link.end, NO_TURN
    joints = [link.joint(axis) for link in links if link.number == 1 for axis, _ in AXES]
    none = (0.0,) * len(joints)
    columns = zip(*(p.get(f"tail_{name}", none) for name in Passive._fields), strict=True)
    passive = dict(zip(joints, map(Passive._make, columns), strict=True))
    return Chain(tuple(links), passive, p["torso_mass"], p["torso_inertia"])


def _refuse_other(model: Model, kind: str) -> None:
    """ExportError unless a model is a free chain of rigid links."""
    if model.kind != "articulated":
        needs = "an articulated tail, because a continuum tail is not a chain of rigid links"
        remedy = 'generate a scene with kind = "articulated" and some links'
        if model.manifest["real"] == "double" and model.manifest["scene"]["coordinates"] != "polar":
            remedy += ', or export an "fmu"'
    elif model.fixed:
        needs, remedy = "a torso that moves", 'generate the scene with base = "free"'
    elif "tail_rotor" in model.parameters:
        needs, remedy = "a tail without rotors", 'leave out tail_rotor, or export an "fmu"'
    elif "air_density" in model.parameters:
        needs, remedy = "a model without air", 'leave out air_density, or export an "fmu"'
    else:
        return
    raise ExportError(f"kind: value {kind!r}: needs {needs} ({model.name}): {remedy}")


def _bodies(model: Model, count: int) -> Iterable[tuple]:
    """Return length, mass, distance from joint to COM, moments of inertia and radius of links."""
    p = model.parameters
    if "link_masses" not in p:
        length = p["tail_length"] / count
        body = (length, p["tail_mass"] / count, length / 2, p["link_inertia"], usual_radius(p))
        return [body] * count
    lengths, masses, centers = (
        np.ravel(p[f"link_{name}"]).tolist() for name in ("lengths", "masses", "centers")
    )
    inertias = map(tuple, np.reshape(p["link_inertias"], (count, 3)).tolist())
    return zip(lengths, masses, centers, inertias, animal_of(model).tail_radii, strict=True)


def _mount_turn(model: Model) -> Vector:
    """Return roll, pitch and yaw about fixed axes of the frame in which the tail begins."""
    if "mount_angles" not in model.parameters:
        return NO_TURN
    from scipy.spatial.transform import Rotation

    pitch, roll, yaw = model.parameters["mount_angles"]
    return tuple(Rotation.from_euler("ZXY", [yaw, pitch, roll]).as_euler("xyz").tolist())


def torso_capsule(model: Model) -> Capsule:
    """Return a capsule as long as the torso, its cross-section of the torso's area."""
    axes = np.array(animal_of(model).semi_axes)
    axis = int(axes.argmax())
    radius = float(np.sqrt(np.prod(np.delete(axes, axis))))
    return Capsule(axis, max(float(axes[axis]) - radius, 0.0), radius)


def along(axis: int, distance: float) -> Vector:
    """Return a vector along an axis."""
    return tuple(distance if k == axis else 0.0 for k in range(3))


def text(numbers: float | Iterable[float]) -> str:
    """Return numbers as the shortest text from which the same numbers are read."""
    return " ".join(map(repr, np.atleast_1d(np.asarray(numbers, float)).tolist()))


def origin(model: Model, stops: str) -> str:
    """Return the line about a file's origin, what it leaves out, and how it has stops, if any."""
    return (
        f" {model.name}, made by serpentail {__version__}. SI units; B is the torso's origin. "
        "Legs and feet have no mass and are left out, and so are contacts. "
    ) + ("tail_stop_lower" in model.parameters) * stops
