"""The steps of one link where all columns of H and the bias are swept at once (Eqs. 16, 17).

Column k of the wide wrench ``F_lanes`` is the momentum of all links beyond per unit rate of tail
coordinate k, the last column their inertial wrench.  A column is addressed by a row that is 1 there
and 0 elsewhere: ``at_pitch`` and ``at_yaw``, for the coordinates of the link's segment, and
``at_bias``.
"""

from sympy import Matrix

from .link import along_link, joint_turns, turned_inertia, with_link
from .rotations import X, Z, symmetric, turned
from .shapes import V1, V2, V3, V4, V6, V10, V12


def gather_composite(let, joint: V4, twice: V10, link: V6, mass: V1, h: V3, I: V6) -> dict:
    """Mass, first moment and inertia of a link and all beyond, and the columns of its own joint
    (Eq. 16).

    ``pitch`` is taken between the joint's two turns, ``yaw`` beyond both; ``own``: what each adds
    to H_pp and H_yy.
    """
    turn_x, turn_z = joint_turns(joint)
    h, I = with_link(let, mass, link, h, I)
    yaw, H_yy = let("yaw", Matrix([Z.cross(h), symmetric(I) * Z])), I[2]
    h, I = (
        let("h_mid", turn_z * h),
        let("I_mid", turned_inertia(let, (0, 1, 2), turn_z, twice[5:10], I)),
    )
    pitch, H_pp = let("pitch", Matrix([X.cross(h), symmetric(I) * X])), I[0]
    return {
        "mass": mass + Matrix([link[0]]),
        "h": turn_x * h,
        "I": turned_inertia(let, (1, 2, 0), turn_x, twice[0:5], I),
        "pitch": pitch,
        "yaw": yaw,
        "own": [H_pp, H_yy],
    }


def gather_lanes(
    let,
    joint: V4,
    link: V6,
    F: V6,
    pitch: V6,
    yaw: V6,
    at_bias: V1,
    at_pitch: V1,
    at_yaw: V1,
    F_lanes: V6,
) -> dict:
    """Add a link's wrench and columns, read the torques of its joint, and pass all on to the
    parent's frame.
    """
    turn_x, turn_z = joint_turns(joint)
    total = let("total", along_link(let, link[1], F_lanes) + at_bias[0] * F + at_yaw[0] * yaw)
    mid = let("added", turned(let, "mid", turn_z, total) + at_pitch[0] * pitch)
    return {"F_lanes": turned(let, "out", turn_x, mid), "H_pitch": [mid[3]], "H_yaw": [total[5]]}


def lanes_at_torso(let, tail_mount: V3, F_lanes: V6) -> dict:
    """Move all wrenches from the tail mount to B."""
    force = F_lanes[0:3, :]
    return {"F_lanes": Matrix([force, F_lanes[3:6, :] + tail_mount.cross(force)])}


def torso_bias(let, torso_mass: V1, torso_inertia: V3, w: V3, a: V3, F: V6) -> dict:
    """Inertial force and moment of torso and tail at B, where ``F`` is that of the tail; no
    rotation accelerates.
    """
    euler = w.cross(let("I_w", torso_inertia.multiply_elementwise(w)))
    return {"force": F[0:3, :] + torso_mass[0] * a, "moment": F[3:6, :] + euler}


def lanes_without_translation(let, com: V3, F_lanes: V6) -> dict:
    """Coupling of omega with the tail coordinates about the COM: n_k - c x f_k."""
    coupling = F_lanes[3:6, :] - com.cross(F_lanes[0:3, :])
    return {f"A_{r}": [coupling[r]] for r in range(3)}


def row_without_translation(let, inverse_mass: V1, column: V6, F_lanes: V6) -> dict:
    """Terms that elimination of translation subtracts from a row of H: f_k . f_l / M for all l."""
    scaled = let("scaled", column[0:3, :] * inverse_mass[0])
    return {"H_row": [-scaled.dot(F_lanes[0:3, :])]}


def segment_block(
    let, inverse_mass: V1, columns: V12, own: V2, H_pp: V1, H_py: V1, H_yp: V1, H_yy: V1
) -> dict:
    """A segment's own block of H: pairs of its joints were met once, and count twice; a joint with
    itself counts once.

    Translation is eliminated already, so what it took is given back where it would count twice.
    """
    scaled, force = let("scaled", columns[0:3, :] * inverse_mass[0]), columns[0:3, :]
    yaw = columns[6:9, :]
    return {
        "A_pp": [2 * H_pp[0] - own[0] + scaled.dot(force)],
        "A_yp": [H_py[0] + H_yp[0] + scaled.dot(yaw)],
        "A_yy": [2 * H_yy[0] - own[1] + inverse_mass[0] * let("square", yaw.dot(yaw))],
    }
