"""MJCF of an articulated model.

Joint equalities couple the joints of a segment to those of its first link. These have motors for
the model's torques, and its springs and damping. MuJoCo's own limits depend on the inertia behind
them, so stops are springs of tendons that are slack in between.
"""

from xml.etree import ElementTree as Xml

from ...basics.checks import shown
from ...basics.errors import ExportError
from ...model.model import Model
from ...model.weight import fall
from .bodies import Bodies, Capsule, Link, along, bodies_of, origin, text, torso_capsule
from .export import xml_file

LEAST = 1e-15  # kg, kg m^2: MuJoCo takes none of a moving body that is not above it (mjMINVAL)
MARGIN = 1e-12  # tolerance of the sum of two moments, because of rounding
MOST_LINKS = 480  # MuJoCo reads no deeper than 500 elements
# MuJoCo's equalities are soft.  As stiff as its own time step of 2 ms allows, joints of a segment
# differ by 1e-4 rad in fast motions; by default, 0.1 rad.
STIFF = {"solref": "0.004 1", "solimp": "0.9999 0.9999 0.001"}
STOPS = (
    "Stops are slack tendons: exact up to a stop and from its width on. Between, those of "
    "serpentail push more, by up to 3/32 tail_stop_stiffness tail_stop_width. "
)


def mjcf(model: Model) -> bytes:
    """Return the file; ExportError if the tail is not a chain of links that MuJoCo can read."""
    bodies, p = bodies_of(model, "mjcf"), model.parameters
    if len(bodies.links) > MOST_LINKS:
        raise ExportError(
            f"kind: value 'mjcf': needs {MOST_LINKS} links or fewer, since MuJoCo reads no deeper "
            f'files, and {model.name} has {len(bodies.links)}: export a "urdf", or fewer links'
        )
    _refuse_slight("torso_mass", bodies.torso_mass)
    _refuse_slight("torso_inertia", bodies.torso_inertia)
    for link in bodies.links:
        _refuse_slight(f"mass of {link.name}", link.mass)
        _refuse_slight(f"inertia of {link.name}", link.inertia)
    root = Xml.Element("mujoco", model=model.name)
    root.append(Xml.Comment(origin(model, STOPS)))
    Xml.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", autolimits="true")
    Xml.SubElement(root, "option", gravity=text(fall(p)))
    # it touches a floor that a user adds, but not itself
    default = Xml.SubElement(root, "default")
    Xml.SubElement(default, "geom", contype="0", conaffinity="1")
    Xml.SubElement(default, "equality", STIFF)
    torso = Xml.SubElement(Xml.SubElement(root, "worldbody"), "body", name="torso")
    Xml.SubElement(torso, "freejoint", name="torso", align="false")
    _inertial(torso, (0.0, 0.0, 0.0), bodies.torso_mass, bodies.torso_inertia)
    _capsule(torso, torso_capsule(model))
    placed = {"torso": torso}
    for link in bodies.links:
        placed[link.name] = _add_link(placed[link.before], link)
    for name, last in bodies.tips:
        Xml.SubElement(placed[last.name], "site", name=name, pos=text(last.end))
    _add_ties(root, bodies)
    _add_passive(root, bodies)
    return xml_file(root)


def _refuse_slight(name: str, value: float | tuple[float, ...]) -> None:
    """Refuse a mass or moments that MuJoCo takes of no body that moves."""
    values = value if isinstance(value, tuple) else (value,)
    three = len(values) == 3
    if min(values) <= LEAST or (three and 2 * max(values) > sum(values) * (1 + MARGIN)):
        needs = ", none above the sum of the other two" if three else ""
        raise ExportError(
            f"{name}: value {shown(value)}: MuJoCo needs more than {LEAST} (SI units){needs}: load "
            f'the model with such a value, or export a "urdf"'
        )


def _inertial(
    body: Xml.Element, centre: tuple[float, ...], mass: float, moments: tuple[float, ...]
) -> None:
    """Give a body a mass, and moments of inertia along its axes."""
    numbers = {"pos": text(centre), "mass": text(mass), "diaginertia": text(moments)}
    Xml.SubElement(body, "inertial", numbers)


def _capsule(torso: Xml.Element, capsule: Capsule) -> None:
    """Give the torso its shape."""
    size = text(capsule.radius)
    if not capsule.half:
        Xml.SubElement(torso, "geom", name="torso", type="sphere", size=size)
        return
    ends = (*along(capsule.axis, capsule.half), *along(capsule.axis, -capsule.half))
    Xml.SubElement(torso, "geom", name="torso", type="capsule", size=size, fromto=text(ends))


def _add_link(before: Xml.Element, link: Link) -> Xml.Element:
    """Return the body of a link, added to the one before it; sites mark its joints."""
    body = Xml.SubElement(before, "body", name=link.name, pos=text(link.place))
    if any(link.turn):
        from scipy.spatial.transform import Rotation

        x, y, z, w = Rotation.from_euler("xyz", link.turn).as_quat()
        body.set("quat", text((w, x, y, z)))
    for joint in link.joints:
        rotor = {"armature": text(joint.rotor)} if joint.rotor else {}
        words = {"name": joint.name, "type": "hinge", "axis": text(joint.axis)}
        Xml.SubElement(body, "joint", words | rotor)
    _inertial(body, link.center, link.mass, link.inertia)
    if link.along:
        ends = {"fromto": text((0.0, 0.0, 0.0, *link.end)), "size": text(link.radius)}
        Xml.SubElement(body, "geom", {"name": link.name, "type": "capsule", **ends})
    for point in link.points:
        Xml.SubElement(body, "site", name=point)
    return body


def _add_ties(root: Xml.Element, bodies: Bodies) -> None:
    """Couple the joints of each segment, and add motors to those of its first link."""
    equality = Xml.SubElement(root, "equality")
    actuator = Xml.SubElement(root, "actuator")
    for joint in [joint for link in bodies.links for joint in link.joints]:
        if not joint.free:
            Xml.SubElement(equality, "joint", joint1=joint.name, joint2=joint.first)
        elif joint.driven:
            Xml.SubElement(actuator, "motor", name=f"tau_{joint.coordinate}", joint=joint.name)


def _add_passive(root: Xml.Element, bodies: Bodies) -> None:
    """Add springs, damping and stops; behind its width a stop is a spring from half of it on."""
    joints = {joint.get("name"): joint for joint in root.iter("joint")}
    tendon = Xml.SubElement(root, "tendon")
    for joint, own in bodies.passive.items():
        numbers = {"stiffness": own.stiffness, "springref": own.rest, "damping": own.damping}
        joints[joint].attrib |= {key: text(value) for key, value in numbers.items() if value}
        if half := own.stop_width / 2:
            joints[joint].attrib |= {
                "range": text((own.stop_lower, own.stop_upper)),
                "limited": "false",  # by MuJoCo itself
            }
            slack = text((own.stop_lower - half, own.stop_upper + half))
            words = {"name": f"stop_{joint}", "stiffness": text(own.stop_stiffness)}
            stop = Xml.SubElement(tendon, "fixed", words, springlength=slack)
            Xml.SubElement(stop, "joint", joint=joint, coef="1")
