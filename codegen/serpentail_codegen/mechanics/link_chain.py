"""Chains of equal links that bend equally: two of them in a row are one of twice the length.

A chain hangs on a base, the frame that its first joint turns against; its tip is the frame of its
last link, at that link's far end.  In axes of the base: ``E`` and ``P`` are the tip's attitude and
place, ``S`` = (w, v, w, v) its angular velocity and the velocity of its origin per unit alpha_dot
and beta_dot of all joints, ``h`` and ``I`` first moment and inertia about the base, ``pitch`` and
``yaw`` = (momentum, its moment) per unit alpha_dot and beta_dot, ``H`` = (H_pp, H_py, H_yy) the
chain's own block of H.
"""

from sympy import Matrix, cos, diag, eye, sin

from .link import joint_turns
from .rotations import X, Y, Z, entries, symmetric
from .shapes import M33, V1, V2, V3, V6, V12


def one_link(let, angles: V2, link: V6) -> dict:
    """A chain of one link: it turns about its joint (Eqs. 11, 13, 15)."""
    alpha, beta = angles
    joint = let("joint", Matrix([cos(alpha), sin(alpha), cos(beta), sin(beta)]))
    turn_x, turn_z = joint_turns(joint)
    E = let("E", turn_x * turn_z)
    _, length, b, Ix, Iy, Iz = link
    axes, P = (X, let("axis", turn_x * Z)), let("P", -length * E * Y)

    # a body that turns about its joint
    h, tensor = let("h", -b * E * Y), E * diag(Ix, Iy, Iz) * E.T
    I = let("I", entries(tensor))
    momenta = [let("L", symmetric(I) * axis) for axis in axes]
    columns = [Matrix([axis.cross(h), moment]) for axis, moment in zip(axes, momenta, strict=True)]
    pitch, yaw = momenta
    return {
        "E": E,
        "P": P,
        "S": Matrix([entry for axis in axes for entry in (*axis, *axis.cross(P))]),
        "h": h,
        "I": I,
        "pitch": columns[0],
        "yaw": columns[1],
        "H": Matrix([X.dot(pitch), X.dot(yaw), axes[1].dot(yaw)]),
    }


def joined(
    let,
    E: M33,
    P: V3,
    S: V12,
    h: V3,
    I: V6,
    pitch: V6,
    yaw: V6,
    H: V3,
    mass_beyond: V1,
    E_beyond: M33,
    P_beyond: V3,
    S_beyond: V12,
    h_beyond: V3,
    I_beyond: V6,
    pitch_beyond: V6,
    yaw_beyond: V6,
    H_beyond: V3,
) -> dict:
    """Join two chains: the base of the chain ``beyond`` is the tip of the first one.

    The one beyond bends, and the first one carries it as a rigid body (Eqs. A5 to A8, 16).
    """
    mass = mass_beyond[0]
    arm = let("arm", E * P_beyond)
    moment = let("moment", E * h_beyond)
    half = let("half", E * symmetric(I_beyond))
    tensor = symmetric(let("tensor", entries(half * E.T)))
    shifted = let("shifted", moment + mass * P)

    S_out, columns, rigid, moving = [], [], [], []
    for k, own, column in ((0, pitch, pitch_beyond), (6, yaw, yaw_beyond)):
        # how the tip of the first moves, and from there that of the one beyond
        w, v = S[k : k + 3, :], S[k + 3 : k + 6, :]
        turned = let("turned", E * S_beyond[k : k + 3, :])
        S_out += [w + turned, v + w.cross(arm) + E * S_beyond[k + 3 : k + 6, :]]

        # momenta of the one beyond about its base: as it bends, and as it is carried
        bent = [let("bent", E * column[0:3, :]), let("bent", E * column[3:6, :])]
        carried = [
            let("carried", mass * v + w.cross(moment)),
            let("carried", tensor * w + moment.cross(v)),
        ]
        p, L = let("p", bent[0] + carried[0]), let("L", bent[1] + carried[1])
        columns.append(own + Matrix([p, L + P.cross(p)]))
        moving.append((w, v))
        rigid.append((bent, (p, L)))

    def power(c: int, momentum):
        """Momentum of the one beyond times how coordinate c moves its base."""
        (w, v), (p, L) = moving[c], momentum
        return v.dot(p) + w.dot(L)

    # each pair of joints: both in the first, both beyond, one in each
    blocks = [power(c, rigid[d][1]) + power(d, rigid[c][0]) for c, d in ((0, 0), (0, 1), (1, 1))]
    spread = (moment + shifted).dot(P) * eye(3) - (moment * P.T + P * shifted.T)
    return {
        "E": E * E_beyond,
        "P": P + arm,
        "S": Matrix([entry for part in S_out for entry in part]),
        "h": h + shifted,
        "I": I + entries(tensor + spread),
        "pitch": columns[0],
        "yaw": columns[1],
        "H": H + H_beyond + Matrix(blocks),
    }


def chain_tip(let, E: M33, P: V3, S: V12) -> dict:
    """The quantities that determine the tip's motion, in its axes, as in
    ``free_segment.tip_motion``.
    """
    turn = E.T
    swept = Matrix.hstack(*(turn * axis.cross(P) for axis in (X, Y, Z)))
    columns = [turn * S[k : k + 3, :] for k in (3, 0, 9, 6)]
    return {"tip_map": Matrix([*turn, *swept, *(entry for part in columns for entry in part)])}


def chain_bias(
    let,
    rates: V2,
    w: V3,
    E: M33,
    P: V3,
    S: V12,
    S_pitch: V12,
    S_yaw: V12,
    h: V3,
    I: V6,
    pitch: V6,
    yaw: V6,
    I_pitch: V6,
    I_yaw: V6,
    pitch_pitch: V6,
    pitch_yaw: V6,
    yaw_pitch: V6,
    yaw_yaw: V6,
    H_pitch: V3,
    H_yaw: V3,
) -> dict:
    """Terms of velocities alone: wrench at the base, torques on the coordinates, and acceleration
    of the tip, in its axes.

    ``x_pitch`` and ``x_yaw`` are derivatives of x by alpha and beta.  The base turns with ``w``; it
    neither moves nor accelerates.  Lagrange: d(dT/dq_dot)/dt - dT/dq.
    """
    alpha, beta = rates

    def rate(by_pitch, by_yaw):
        return let("rate", alpha * by_pitch + beta * by_yaw)

    # momentum in base axes, and its rate
    momentum = let("momentum", alpha * pitch + beta * yaw)
    changes = rate(pitch_pitch, pitch_yaw), rate(yaw_pitch, yaw_yaw)
    change = let("change", alpha * changes[0] + beta * changes[1])
    force = change[0:3, :] + w.cross(let("twice", w.cross(h) + 2 * momentum[0:3, :]))
    L = let("L", symmetric(I) * w + momentum[3:6, :])
    L_dot = let("L_dot", symmetric(rate(I_pitch, I_yaw)) * w + change[3:6, :])

    # of T, H and the columns are the second derivatives by the rates
    torques = []
    H_dot = rate(H_pitch, H_yaw)
    gains = (alpha * H_dot[0] + beta * H_dot[1], alpha * H_dot[1] + beta * H_dot[2])
    by_coordinate = (
        (I_pitch, pitch_pitch, yaw_pitch, H_pitch),
        (I_yaw, pitch_yaw, yaw_yaw, H_yaw),
    )
    for changed, gain, (I_c, pitch_c, yaw_c, H_c) in zip(
        changes, gains, by_coordinate, strict=True
    ):
        turning = symmetric(I_c) * w / 2 + alpha * pitch_c[3:6, :] + beta * yaw_c[3:6, :]
        own = (alpha**2 * H_c[0] + beta**2 * H_c[2]) / 2 + alpha * beta * H_c[1]
        torques.append(w.dot(changed[3:6, :]) + gain - w.dot(let("turning", turning)) - own)

    # the tip
    S_dot = rate(S_pitch, S_yaw)
    relative = let("relative", alpha * S[0:6, :] + beta * S[6:12, :])
    turn, move = relative[0:3, :], relative[3:6, :]
    faster = alpha * S_dot[0:6, :] + beta * S_dot[6:12, :]
    w_dot = w.cross(turn) + faster[0:3, :]
    a = w.cross(let("v", w.cross(P) + 2 * move)) + faster[3:6, :]
    return {
        "F_next": Matrix([force, L_dot + w.cross(L)]),
        "torque": Matrix(torques),
        "w_dot": E.T * let("w_dot", w_dot),
        "a": E.T * let("a", a),
    }


def mass_of_links(let, link: V6, count: V1) -> dict:
    """Mass of a number of links."""
    return {"mass": [link[0] * count[0]]}
