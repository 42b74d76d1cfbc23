"""The rigid bodies of an articulated model: torso and links, their names, numbers and shapes."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from serpentail_scene.layout import ChainLayout

from ... import __version__
from ...basics.errors import ExportError
from ...model.chains import HINGE, values_of
from ...model.model import Model
from ...show.animal import animal_of, usual_radius

AXES = (("alpha", (1, 0, 0)), ("beta", (0, 0, 1)))  # of a link's two joints, in its own frame
NO_TURN = (0.0, 0.0, 0.0)
Vector = tuple[float, ...]


class Joint(NamedTuple):
    """A hinge: its axis in the frame before it, its coordinate, the first joint that has this, its
    rotor's inertia (kg m^2); driven: it has an actuator.
    """

    name: str
    axis: Vector
    coordinate: str
    first: str
    rotor: float = 0.0
    driven: bool = True

    @property
    def free(self) -> bool:
        """Whether it follows no other joint."""
        return self.name == self.first


class Link(NamedTuple):
    """A rigid body and the joints that turn it, one after another about one place; SI units.

    before: the link, or torso, that it is on.  place, turn: its joints in that frame, and the turn
    of their own frame (roll, pitch and yaw, rad, about fixed axes x, y, z), which only a chain's
    first link has.  center: of mass, in its own frame, whose axes are principal ones; end: where
    the next link is.  points: names of the model's points at its joints.  cross: of its joints.
    """

    name: str
    cross: str
    before: str
    place: Vector
    turn: Vector
    joints: tuple[Joint, ...]
    points: tuple[str, ...]
    end: Vector
    mass: float
    center: Vector
    inertia: Vector
    radius: float

    @property
    def along(self) -> bool:
        """Whether it reaches along -y, as a capsule can show."""
        return self.end[1] < 0 and not self.end[0] and not self.end[2]


class Passive(NamedTuple):
    """Parameters of a tail coordinate, less "tail_", SI units; 0 where the scene names none."""

    stiffness: float
    rest: float
    damping: float
    stop_lower: float
    stop_upper: float
    stop_stiffness: float
    stop_width: float


class Bodies(NamedTuple):
    """A torso and links, SI units; the name of each chain's end and its last link; and what acts on
    each coordinate, by the name of its first joint.
    """

    links: tuple[Link, ...]
    tips: tuple[tuple[str, Link], ...]
    passive: dict[str, Passive]
    torso_mass: float
    torso_inertia: Vector


class Capsule(NamedTuple):
    """A cylinder between two half balls about the torso's COM, m; one ball where half is 0."""

    axis: int
    half: float
    radius: float


def bodies_of(model: Model, kind: str) -> Bodies:
    """Return the rigid bodies of a model; ExportError if it has others, too."""
    _refuse_other(model, kind)
    links: list[Link] = []
    tips: list[tuple[str, Link]] = []
    passive: dict[str, Passive] = {}
    for chain in model.layout.chains:
        made = _hinged if HINGE in model.kinds[chain.segments] else _linked
        own = made(model, chain)
        links += own
        tips.append((f"{_start(chain)}tip", own[-1]))
        p, count = values_of(chain, model.parameters), len(chain.names)
        columns = [np.ravel(p.get(f"tail_{name}", (0.0,) * count)) for name in Passive._fields]
        firsts = [joint.first for link in own for joint in link.joints if joint.free]
        rows = np.array(columns).T.tolist()
        passive |= dict(zip(firsts, map(Passive._make, rows), strict=True))
    torso = (model.parameters[f"torso_{name}"] for name in ("mass", "inertia"))
    return Bodies(tuple(links), tuple(tips), passive, *torso)


def _start(chain: ChainLayout) -> str:
    """Return what the names of a chain's links and joints begin with."""
    return f"{chain.name}_" if chain.owner else ""


def _side(chain: ChainLayout, place: Iterable[float]) -> Vector:
    """Return a place in a chain's own frame, mirrored if the chain is."""
    x, y, z = place
    return (-x if chain.mirrored and x else x, y, z)


def _axis(chain: ChainLayout, axis: Vector) -> Vector:
    """Return the axis of a turn, mirrored if the chain is: the image turns the other way."""
    x, y, z = axis
    return (x, -y if y else y, -z if z else z) if chain.mirrored else axis


def _linked(model: Model, chain: ChainLayout) -> list[Link]:
    """Return the links of a chain whose segments have two coordinates."""
    p, start, links = values_of(chain, model.parameters), _start(chain), list[Link]()
    counts = model.joints_each[chain.segments]
    numbers = [(i + 1, j + 1) for i, count in enumerate(counts) for j in range(count)]
    before, place, turn = "torso", _side(chain, p["tail_mount"]), _mount_turn(p, chain)
    radii: Sequence[float] = animal_of(model).tail_radii[chain.points.start :]
    if "link_masses" not in p:
        radii = [usual_radius(p)] * len(numbers)
    for k, (i, j) in enumerate(numbers):
        length, mass, center, inertia = _body(p, k, len(numbers))
        joints = tuple(
            Joint(
                f"{start}{name}_{i}_{j}",
                _axis(chain, axis),
                chain.names[2 * i - 2 + c],
                f"{start}{name}_{i}_1",
                0.0,
                chain.driven[2 * i - 2 + c],
            )
            for c, (name, axis) in enumerate(AXES)
        )
        end, com = (0.0, -length, 0.0), (0.0, -center, 0.0)
        name, cross, point = (f"{start}{what}_{i}_{j}" for what in ("link", "cross", "joint"))
        frame = (name, cross, before, place, turn, joints, (point,))
        links.append(Link(*frame, end, mass, com, inertia, radii[k]))
        before, place, turn = name, end, NO_TURN
    return links


def _hinged(model: Model, chain: ChainLayout) -> list[Link]:
    """Return the links of a limb; hinges without bodies are further joints of the next link."""
    p, links, joints = values_of(chain, model.parameters), list[Link](), list[Joint]()
    table = model.manifest["scene"]["chain"][chain.owner]["joints"]
    rotors = np.ravel(p.get("rotors", np.zeros(len(table)))).tolist()
    masses, moments = np.ravel(p["link_masses"]).tolist(), np.reshape(p["link_inertias"], (-1, 3))
    if "link_tips" in p:
        tips, centers = (np.reshape(p[f"link_{x}"], (-1, 3)) for x in ("tips", "offsets"))
    else:
        tips, centers = (np.outer(p[f"link_{x}"], (0, -1, 0)) for x in ("lengths", "centers"))
    tips, centers = tips + 0.0, centers + 0.0  # no -0
    radii = animal_of(model).tail_radii[chain.points.start :]
    before, place, turn = "torso", _side(chain, p["tail_mount"]), _mount_turn(p, chain)
    for k, (hinge, name) in enumerate(zip(table, chain.names, strict=True)):
        axis = _axis(chain, along("xyz".index(hinge.get("axis", "x")), 1.0))
        joints.append(Joint(name, axis, name, name, rotors[k], chain.driven[k]))
        if "mass" not in hinge:
            continue
        b = len(links)
        end, com = (_side(chain, each[b].tolist()) for each in (tips, centers))
        points = tuple(f"joint_{joint.name}" for joint in joints)
        frame = (f"link_{name}", f"cross_{name}", before, place, turn, tuple(joints), points)
        links.append(Link(*frame, end, masses[b], com, tuple(moments[b].tolist()), radii[k]))
        before, place, turn, joints = f"link_{name}", end, NO_TURN, []
    return links


def _refuse_other(model: Model, kind: str) -> None:
    """ExportError unless a model consists of rigid links and moves freely."""
    p = model.parameters
    if {*model.kinds} - {"articulated", HINGE}:
        needs = "an articulated tail, because a continuum tail is not a chain of rigid links"
        remedy = 'generate a scene with kind = "articulated" and some links'
        if model.manifest["real"] == "double" and model.manifest["scene"]["coordinates"] != "polar":
            remedy += ', or export an "fmu"'
    elif model.fixed:
        needs, remedy = "a torso that moves", 'generate the scene with base = "free"'
    elif "tail_rotor" in p:
        needs, remedy = "a tail without rotors", 'leave out tail_rotor, or export an "fmu"'
    elif kind == "urdf" and any(np.any(p[n]) for n in p if n.endswith("_rotors")):
        needs = "limbs without rotors, which URDF lacks"
        remedy = 'export an "mjcf", or load the model with 0 for them'
    elif "tail_stop_damping" in p:
        needs, remedy = "stops without damping", 'leave out tail_stop_damping, or export an "fmu"'
    elif "joint_ratios" in p:
        needs, remedy = "joints that turn alike", 'leave out joint_ratios, or export an "fmu"'
    elif "air_density" in p:
        needs, remedy = "a model without air", 'leave out air_density, or export an "fmu"'
    elif model.layout.tendons:
        needs, remedy = "a tail without tendons", "leave out the tables [tendon.NAME]"
    else:
        return
    raise ExportError(f"kind: value {kind!r}: needs {needs} ({model.name}): {remedy}")


def _body(p: Mapping[str, Any], k: int, count: int) -> tuple[float, float, float, Vector]:
    """Return length, mass, distance from joint to COM and moments of inertia of link k."""
    if "link_masses" not in p:
        length = p["tail_length"] / count
        return length, p["tail_mass"] / count, length / 2, p["link_inertia"]
    length, mass, center = (np.ravel(p[f"link_{x}"])[k] for x in ("lengths", "masses", "centers"))
    inertia = np.reshape(p["link_inertias"], (count, 3))[k]
    return float(length), float(mass), float(center), tuple(inertia.tolist())


def _mount_turn(p: Mapping[str, Any], chain: ChainLayout) -> Vector:
    """Return roll, pitch and yaw about fixed axes of the frame in which a chain begins."""
    if "mount_angles" not in p:
        return NO_TURN
    from scipy.spatial.transform import Rotation

    pitch, roll, yaw = _axis(chain, p["mount_angles"])
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
