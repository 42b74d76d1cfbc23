"""URDF of an articulated model: the joints of a segment mimic those of its first link."""

import math
from xml.etree import ElementTree as Xml

from ...basics.errors import ExportError
from ...model.model import Model
from .bodies import (
    Capsule,
    Link,
    Passive,
    Vector,
    along,
    bodies_of,
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
    bodies, capsule = bodies_of(model, "urdf"), torso_capsule(model)
    if any(own.stiffness for own in bodies.passive.values()):
        springs = [n for n in model.parameters if n.endswith("_stiffness") and "stop" not in n]
        raise ExportError(
            f"kind: value 'urdf': needs chains without springs ({model.name}), which URDF lacks: "
            f'export an "mjcf", or load the model with {" = 0, ".join(springs)} = 0'
        )
    robot = Xml.Element("robot", name=model.name)
    robot.append(Xml.Comment(origin(model, STOPS)))
    # the torso
    torso = Xml.SubElement(robot, "link", name="torso")
    _inertial(torso, FIXED, bodies.torso_mass, bodies.torso_inertia)
    _rod(torso, FIXED, capsule)
    for end in (capsule.half, -capsule.half):
        _solid(torso, along(capsule.axis, end), 2, "sphere", radius=text(capsule.radius))
    # the chains, each link on the one before it
    for link in bodies.links:
        _add_link(robot, link, bodies.passive)
    for name, last in bodies.tips:
        Xml.SubElement(robot, "link", name=name)
        fixed = "tail_end" if name == "tip" else f"{name}_end"
        joint = Xml.SubElement(robot, "joint", name=fixed, type="fixed")
        _between(joint, last.end, last.name, name)
    return xml_file(robot)


def _add_link(robot: Xml.Element, link: Link, passive: dict[str, Passive]) -> None:
    """Add crosses without mass, which all joints but the last turn, and the link."""
    parent, place, turn, last = link.before, link.place, link.turn, len(link.joints) - 1
    children = [link.cross + f"_{k}" * (k > 0) for k in range(last)] + [link.name]
    for cross in children[:-1]:
        Xml.SubElement(robot, "link", name=cross)
    body = Xml.SubElement(robot, "link", name=link.name)
    _inertial(body, link.center, link.mass, link.inertia)
    if link.along:
        half = -link.end[1] / 2
        _rod(body, (0.0, -half, 0.0), Capsule(1, half, link.radius))
    for hinge, child in zip(link.joints, children, strict=True):
        joint = Xml.SubElement(robot, "joint", name=hinge.name, type="revolute")
        _between(joint, place, parent, child, turn)
        parent, place, turn = child, FIXED, FIXED
        Xml.SubElement(joint, "axis", xyz=text(hinge.axis))
        own, limits = passive[hinge.first], {"lower": -HALF_TURN, "upper": HALF_TURN}
        if own.stop_width:
            limits = {"lower": own.stop_lower, "upper": own.stop_upper}
        limits |= {"effort": NO_LIMIT, "velocity": NO_LIMIT}
        Xml.SubElement(joint, "limit", {key: text(value) for key, value in limits.items()})
        if not hinge.free:
            Xml.SubElement(joint, "mimic", joint=hinge.first, multiplier="1", offset="0")
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
