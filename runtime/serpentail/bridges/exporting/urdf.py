"""URDF of an articulated model: the joints of a segment mimic those of its first link."""

import math
from xml.etree import ElementTree as Xml

from ...basics.errors import ExportError
from ...model.model import Model
from .chain import (
    AXES,
    Capsule,
    Link,
    Passive,
    Vector,
    along,
    chain_of,
    origin,
    text,
    torso_capsule,
)
from .export import xml_file

HALF_TURN = math.pi
# The model has no limits of effort (N m) and speed (rad/s), but a revolute joint must.
NO_LIMIT = 1e9
TURNS = ((0.0, HALF_TURN / 2, 0.0), (HALF_TURN / 2, 0.0, 0.0), (0.0, 0.0, 0.0))  # z to each axis
STOPS = "Limits of joints are where stops begin; how stiff these are is left out. "
FIXED = (0.0, 0.0, 0.0)


def urdf(model: Model) -> bytes:
    """Return the file; ExportError if the tail has springs, or is not a chain of rigid links."""
    chain, capsule = chain_of(model, "urdf"), torso_capsule(model)
    if any(own.stiffness for own in chain.passive.values()):
        raise ExportError(
            f"kind: value 'urdf': needs a tail without springs ({model.name}), which URDF lacks: "
            'export an "mjcf", or load the model with tail_stiffness = 0'
        )
    robot = Xml.Element("robot", name=model.name)
    robot.append(Xml.Comment(origin(model, STOPS)))
    # the torso
    torso = Xml.SubElement(robot, "link", name="torso")
    _inertial(torso, FIXED, chain.torso_mass, chain.torso_inertia)
    _rod(torso, FIXED, capsule)
    for end in (capsule.half, -capsule.half):
        _solid(torso, along(capsule.axis, end), 2, "sphere", radius=text(capsule.radius))
    # the tail, each link on the one before it
    before = "torso"
    for link in chain.links:
        _add_link(robot, before, link, chain.passive)
        before = link.name
    Xml.SubElement(robot, "link", name="tip")
    joint = Xml.SubElement(robot, "joint", name="tail_end", type="fixed")
    _between(joint, chain.links[-1].end, before, "tip")
    return xml_file(robot)


def _add_link(robot: Xml.Element, before: str, link: Link, passive: dict[str, Passive]) -> None:
    """Add a cross without mass, which alpha turns, and the link, which beta turns on it."""
    cross = f"cross_{link.segment}_{link.number}"
    Xml.SubElement(robot, "link", name=cross)
    body = Xml.SubElement(robot, "link", name=link.name)
    _inertial(body, link.center, link.mass, link.inertia)
    _rod(body, (0.0, -link.length / 2, 0.0), Capsule(1, link.length / 2, link.radius))
    ends = ((link.place, link.turn, before, cross), (FIXED, FIXED, cross, link.name))
    for (name, axis), (place, turn, parent, child) in zip(AXES, ends, strict=True):
        joint = Xml.SubElement(robot, "joint", name=link.joint(name), type="revolute")
        _between(joint, place, parent, child, turn)
        Xml.SubElement(joint, "axis", xyz=text(axis))
        own, limits = passive[link.joint(name, 1)], {"lower": -HALF_TURN, "upper": HALF_TURN}
        if own.stop_width:
            limits = {"lower": own.stop_lower, "upper": own.stop_upper}
        limits |= {"effort": NO_LIMIT, "velocity": NO_LIMIT}
        Xml.SubElement(joint, "limit", {key: text(value) for key, value in limits.items()})
        if link.number > 1:
            Xml.SubElement(joint, "mimic", joint=link.joint(name, 1), multiplier="1", offset="0")
        elif own.damping:
            Xml.SubElement(joint, "dynamics", damping=text(own.damping), friction="0")


def _between(
    joint: Xml.Element, place: Vector, parent: str, child: str, turn: Vector = FIXED
) -> None:
    """Place a joint in its parent's frame."""
    Xml.SubElement(joint, "origin", xyz=text(place), rpy=text(turn))
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)


def _inertial(link: Xml.Element, centre: Vector, mass: float, moments: Vector) -> None:
    """Give a link a mass, and moments of inertia along its axes."""
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=text(centre), rpy=text(FIXED))
    Xml.SubElement(inertial, "mass", value=text(mass))
    products = dict.fromkeys(("ixy", "ixz", "iyz"), 0.0)
    tensor = dict(zip(("ixx", "iyy", "izz"), moments, strict=True)) | products
    Xml.SubElement(inertial, "inertia", {key: text(value) for key, value in tensor.items()})


def _rod(link: Xml.Element, centre: Vector, rod: Capsule) -> None:
    """Give a link a cylinder, as long as the straight part of a capsule."""
    sizes = {"radius": text(rod.radius), "length": text(2 * rod.half)}
    _solid(link, centre, rod.axis, "cylinder", **sizes)


def _solid(link: Xml.Element, centre: Vector, axis: int, kind: str, **sizes: str) -> None:
    """Give a link a solid to see and to collide with, its z turned to an axis."""
    for use in ("visual", "collision"):
        part = Xml.SubElement(link, use)
        Xml.SubElement(part, "origin", xyz=text(centre), rpy=text(TURNS[axis]))
        Xml.SubElement(Xml.SubElement(part, "geometry"), kind, sizes)
