"""Rotations between the axes in which a tail begins and those of the torso, if they differ.

``mount`` rotates from the tail's root axes to those of the torso. Its angles are the pitch, roll
and yaw of reports: R = R_z(yaw) R_x(pitch) R_y(roll).
"""

from sympy import Matrix, cos, sin

from .rotations import rotation_x, rotation_z, turned, world_composite
from .shapes import M33, V3, V6


def mount_rotation(let, mount_angles: V3) -> dict:
    """R_z(yaw) R_x(pitch) R_y(roll)."""
    pitch, roll, yaw = (let("turn", Matrix([cos(x), sin(x)])) for x in mount_angles)
    c, s = roll
    about_y = Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return {"mount": let("half", rotation_z(*yaw) * rotation_x(*pitch)) * about_y}


def mounted_frame(let, mount: M33, R: M33) -> dict:
    """Attitude of the tail's root axes from that of the torso."""
    return {"R": R * mount}


def motion_at_root(let, mount: M33, w: V3, w_dot: V3, a: V3) -> dict:
    """A motion in the tail's root axes."""
    return {"w": mount.T * w, "w_dot": mount.T * w_dot, "a": mount.T * a}


def velocity_at_root(let, mount: M33, w: V3, u: V3) -> dict:
    """Angular and linear velocity in the tail's root axes."""
    return {"w": mount.T * w, "u": mount.T * u}


def flow_at_root(let, mount: M33, u: V3) -> dict:
    """A velocity in the tail's root axes."""
    return {"u": mount.T * u}


def virtual_velocity_at_root(let, mount: M33, w_virtual: V3, u_virtual: V3) -> dict:
    """Virtual velocities in the tail's root axes."""
    return {"w_virtual": mount.T * w_virtual, "u_virtual": mount.T * u_virtual}


def composite_at_mount(let, mount: M33, h: V3, I: V6) -> dict:
    """First moment and inertia in torso axes."""
    return world_composite(let, mount, h, I)


def moment_at_mount(let, mount: M33, h: V3) -> dict:
    """First moment in torso axes."""
    return {"h": mount * h}


def wrench_at_mount(let, mount: M33, F_next: V6) -> dict:
    """A wrench or a momentum in torso axes."""
    return {"F_next": turned(let, "at_mount", mount, F_next)}


def lanes_at_mount(let, mount: M33, F_lanes: V6) -> dict:
    """All wrenches of a sweep in lanes in torso axes."""
    return {"F_lanes": turned(let, "at_mount", mount, F_lanes)}
