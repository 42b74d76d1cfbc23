"""The steps of one link: its motion, wrench and momentum, and the composite inertia beyond it.

A link is given by ``link`` = (m, L, b, I_x, I_y, I_z): b is m times the COM's distance from the
joint, m L / 2 of an even link, and the moments of inertia are taken about the joint.  It lies along
-y of its frame (Eq. 15), which a universal joint rotates about x, then about z (Eq. 11).  A body
set is given by its mass, first moment ``h`` = sum m r, and ``I`` = (xx, yy, zz, xy, xz, yz) about
the frame's origin.  A wrench or momentum ``F`` = (force or momentum, its moment about the origin).
"""

from sympy import Matrix, cos, sin, zeros

from .rotations import X, Y, Z, entries, rotation_x, rotation_z, symmetric, turned
from .shapes import M33, V1, V2, V3, V4, V6, V10, CoordinateMotion, FrameMotion, VirtualMotion


def link_properties(let, tail_mass: V1, tail_length: V1, link_inertia: V3, share: V1) -> dict:
    """Properties of one of N equal links, ``share`` = 1 / N: m_at = m_t / N, L_j2c = L_j2j / 2
    (Sect. 4).
    """
    # Eqs. 13, 15: the COM is L_j2c = L_j2j / 2 from the joint, b = m L_j2c its first moment
    m, length = let("even", Matrix([tail_mass[0], tail_length[0]]) * share[0])
    half_moment = let("b", m * length / 2)
    steiner = let("steiner", half_moment * length / 2)
    Ix, Iy, Iz = link_inertia
    return {"link": Matrix([m, length, half_moment, Ix + steiner, Iy, Iz + steiner])}


def own_link_properties(
    let, link_masses: V1, link_lengths: V1, link_centers: V1, link_inertias: V3
) -> dict:
    """Properties of a link by itself, its COM ``link_centers`` from the joint (Eqs. 13, 15)."""
    m, center = link_masses[0], link_centers[0]
    first_moment = let("b", m * center)
    steiner = let("steiner", first_moment * center)
    Ix, Iy, Iz = link_inertias
    inertia = [Ix + steiner, Iy, Iz + steiner]
    return {"link": Matrix([m, link_lengths[0], first_moment, *inertia])}


def link_wrench(let, link: V6, w: V3, w_dot: V3, a_joint: V3, swing: V3) -> dict:
    """Inertial wrench of one link at its joint (Eq. 17), Newton and Euler in the link frame."""
    # force = m v_dot_com (A10), v_dot_j2c being -(L / 2) swing (A12)
    m, _, b, Ix, Iy, Iz = link
    force = m * a_joint - b * swing
    euler = Matrix(
        [
            Ix * w_dot[0] + (Iz - Iy) * w[1] * w[2],
            Iy * w_dot[1] + (Ix - Iz) * w[0] * w[2],
            Iz * w_dot[2] + (Iy - Ix) * w[0] * w[1],
        ]
    )
    return {"F": Matrix([force, euler + b * Matrix([-a_joint[2], 0, a_joint[0]])])}


def link_power(
    let, joint: V4, moving: CoordinateMotion, link: V6, base: FrameMotion, virtual: VirtualMotion
) -> dict:
    """Power of the inertial wrench of one link (Eq. 17) under a virtual motion; both motions
    carried on.
    """
    # the motion of the link, and its wrench
    motion = link_motion(let, joint, moving.rates, moving.accelerations, link, base)
    motion = {name: let(name, vector) for name, vector in motion.items()}
    reads = (motion[name] for name in ("w", "w_dot", "a_joint", "swing"))
    F = let("F", link_wrench(let, link, *reads)["F"])

    # the virtual motion of the link
    turn = link_angular_velocity(let, joint, moving.virtual_rates, virtual.w_virtual)
    turn = let("turn", turn["w"])
    slide = link_linear_velocity(let, joint, link, turn, virtual.u_virtual)
    slide = {name: let(name, vector) for name, vector in slide.items()}
    power = F[0:3, :].dot(slide["u_joint"]) + F[3:6, :].dot(turn)
    carried = {name: motion[name] for name in ("w", "w_dot", "a")}
    return {"power": [power], **carried, "w_virtual": turn, "u_virtual": slide["u"]}


def along_link(let, length, F) -> Matrix:
    """Move a wrench from the next joint to this one: n' = n + (-L y) x f."""
    return let(
        "moved", Matrix([F[0], F[1], F[2], F[3] - length * F[2], F[4], F[5] + length * F[0]])
    )


def gather_wrench(let, joint: V4, link: V6, F: V6, F_next: V6) -> dict:
    """Add what the next link passes on, read the joint torques (A5 on Eq. 17), pass on to the
    parent frame.
    """
    turn_x, turn_z = joint_turns(joint)
    total = let("total", F + along_link(let, link[1], F_next))
    mid = turned(let, "mid", turn_z, total)
    return {"F_next": turned(let, "out", turn_x, mid), "torque": Matrix([mid[3], total[5]])}


def turned_inertia(let, axes, turn, twice, I) -> Matrix:
    """R I R^T for a turn in the plane of axes (i, j), k normal to it, by the double angle."""
    # A13 from link to link instead of from each link to the world
    i, j, k = axes
    c, s = turn[i, i], turn[j, i]
    sine_squared, product, double_product, cosine, cosine_squared = twice
    tensor = symmetric(I)
    d = let("d", tensor[i, i] - tensor[j, j])
    t = let("t", double_product * tensor[i, j])
    out = zeros(3, 3)
    # sums, not I_ii - s^2 d: a thin link turned by 90 degrees would be the difference of two
    # thick ones
    out[i, i] = cosine_squared * tensor[i, i] + sine_squared * tensor[j, j] - t
    out[j, j] = sine_squared * tensor[i, i] + cosine_squared * tensor[j, j] + t
    out[k, k] = tensor[k, k]
    out[i, j] = product * d + cosine * tensor[i, j]
    out[i, k] = c * tensor[i, k] - s * tensor[j, k]
    out[j, k] = s * tensor[i, k] + c * tensor[j, k]
    out[j, i], out[k, i], out[k, j] = out[i, j], out[i, k], out[j, k]
    return entries(out)


def with_link(let, mass, link, h, I) -> tuple[Matrix, Matrix]:
    """First moment and inertia about this joint of one link and of the bodies at its end, whose
    ``mass, h, I`` are about that end.
    """
    # the link's COM (Eq. 13) enters by its first moment b along -y
    _, length, b, Ix, Iy, Iz = link
    moment = let("moment", h[1] - mass[0] * length)
    steiner = let("steiner", length * (h[1] + moment))
    h_sum = Matrix([h[0], moment - b, h[2]])
    I_sum = [
        I[0] - steiner + Ix,
        I[1] + Iy,
        I[2] - steiner + Iz,
        I[3] + length * h[0],
        I[4],
        I[5] + length * h[2],
    ]
    return let("h_sum", h_sum), let("I_sum", Matrix(I_sum))


def gather_links(
    let, joint: V4, twice: V10, link: V6, mass: V1, h: V3, I: V6, pitch: V6, yaw: V6, ratio=1
) -> dict:
    """One link of the tip-to-base sweep of Eq. 16: composite inertia and the momentum columns of
    the segment.

    ``pitch`` and ``yaw`` are momenta, at this frame's origin, of everything beyond per unit
    alpha_dot and beta_dot of the segment's joints passed so far; ``H_pp, H_py, H_yy`` are what this
    joint, which turns by ``ratio`` times these angles, adds to the segment's own block.
    """
    # J_com (A6) is not formed: momentum columns sum m J_com over all links beyond
    turn_x, turn_z = joint_turns(joint)
    h, I = with_link(let, mass, link, h, I)
    pitch, yaw = along_link(let, link[1], pitch), along_link(let, link[1], yaw)
    H_yy, H_py = ratio * (2 * yaw[5] + ratio * I[2]), ratio * pitch[5]
    yaw = let("yaw_here", yaw + ratio * Matrix([Z.cross(h), symmetric(I) * Z]))

    h, I = (
        let("h_mid", turn_z * h),
        let("I_mid", turned_inertia(let, (0, 1, 2), turn_z, twice[5:10], I)),
    )
    pitch, yaw = turned(let, "pitch_mid", turn_z, pitch), turned(let, "yaw_mid", turn_z, yaw)
    H_pp, H_py = ratio * (2 * pitch[3] + ratio * I[0]), H_py + ratio * yaw[3]
    pitch = let("pitch_here", pitch + ratio * Matrix([X.cross(h), symmetric(I) * X]))

    return {
        "mass": mass + Matrix([link[0]]),
        "h": turn_x * h,
        "I": turned_inertia(let, (1, 2, 0), turn_x, twice[0:5], I),
        "pitch": turned(let, "pitch_out", turn_x, pitch),
        "yaw": turned(let, "yaw_out", turn_x, yaw),
        "H_pp": [H_pp],
        "H_py": [H_py],
        "H_yy": [H_yy],
    }


def gather_moment(let, joint: V4, link: V6, mass: V1, h: V3) -> dict:
    """Mass and first moment of one link and all beyond, about its joint, in the parent's frame."""
    turn_x, turn_z = joint_turns(joint)
    moment = Matrix([h[0], h[1] - mass[0] * link[1] - link[2], h[2]])
    return {"mass": mass + Matrix([link[0]]), "h": turn_x * let("mid", turn_z * moment)}


def link_momentum(let, link: V6, w: V3, u_joint: V3) -> dict:
    """Momentum of one link, its moment about the joint, and the kinetic energy (u . p + omega . L)
    / 2.
    """
    # p = m v_com, v_com = v_jnt + v_j2c (A2)
    m, _, b, Ix, Iy, Iz = link
    p = let("p", m * u_joint + b * Matrix([w[2], 0, -w[0]]))
    L = let("L", Matrix([Ix * w[0] - b * u_joint[2], Iy * w[1], Iz * w[2] + b * u_joint[0]]))
    return {"F": Matrix([p, L]), "kinetic": [let("twice", u_joint.dot(p) + w.dot(L)) / 2]}


def joint_turns(joint) -> tuple[Matrix, Matrix]:
    """Return R_x(alpha) and R_z(beta) of one universal joint (Eq. 11)."""
    return rotation_x(joint[0], joint[1]), rotation_z(joint[2], joint[3])


def joint_trigonometry(let, angles: V2) -> dict:
    """Cosines and sines of (alpha_i, beta_i), once for the n equal joints of segment i."""
    alpha, beta = angles
    return {"joint": Matrix([cos(alpha), sin(alpha), cos(beta), sin(beta)])}


def double_angles(let, joint: V4) -> dict:
    """s^2, s c, 2 s c, c^2 - s^2 and c^2 of both joint angles: what turns a symmetric tensor in the
    plane.
    """
    rows = []
    for c, s in (joint[0:2], joint[2:4]):
        sine_squared, product = let("k", Matrix([s * s, s * c]))
        rows += [sine_squared, product, 2 * product, 1 - 2 * sine_squared, c * c]
    return {"twice": Matrix(rows)}


def link_pose(let, joint: V4, link: V6, R: M33, P: V3) -> dict:
    """R_j = R_{j-1} R_x R_z (Eqs. 11, 12) and the next joint p_j+1 = p_j - L y_j (Eqs. 14, 15)."""
    turn_x, turn_z = joint_turns(joint)
    mid = let("mid", R * turn_x)
    turned = let("turned", mid * turn_z)
    return {"R": turned, "P": P - link[1] * turned.col(1)}


def joint_twist(let, joint: V4, R: M33, P: V3) -> dict:
    """Spatial columns of one joint at B: (x_{j-1}, p_j x x_{j-1}) and (z_j, p_j x z_j) (Eqs. A5,
    A7).
    """
    turn_x, _ = joint_turns(joint)
    pitch, yaw = R.col(0), let("yaw", R * turn_x * Z)
    return {"S": Matrix([pitch, P.cross(pitch), yaw, P.cross(yaw)])}


def link_angular_velocity(let, joint: V4, rates: V2, w: V3) -> dict:
    """omega_j = omega_{j-1} + alpha_dot x_{j-1} + beta_dot z_j (Eq. A1), in the frame of link j."""
    turn_x, turn_z = joint_turns(joint)
    mid = let("mid", turn_x.T * w + rates[0] * X)
    return {"w": turn_z.T * mid + rates[1] * Z}


def link_linear_velocity(let, joint: V4, link: V6, w: V3, u: V3) -> dict:
    """v_jnt of this joint in the frame of link j, and v_j+1,jnt = v_j,jnt - L omega_j x y_j (Eqs.
    A3, A4).
    """
    turn_x, turn_z = joint_turns(joint)
    u_joint = let("here", turn_z.T * let("mid", turn_x.T * u))
    return {"u_joint": u_joint, "u": u_joint - link[1] * w.cross(Y)}


def link_motion(let, joint: V4, rates: V2, accelerations: V2, link: V6, base: FrameMotion) -> dict:
    """omega_j (A1), omega_dot_j (A9), acceleration of this joint and the next (A11, A12), in the
    frame of link j.

    ``swing`` is omega_dot x y + omega x (omega x y): accelerations along the link are multiples of
    it.
    """
    turn_x, turn_z = joint_turns(joint)

    # angular velocity and its rate: between the joint's two axes, then beyond both
    w_mid = let("w_mid", turn_x.T * base.w + rates[0] * X)
    w_dot_mid = let(
        "w_dot_mid", turn_x.T * base.w_dot + accelerations[0] * X + rates[0] * w_mid.cross(X)
    )
    w_here = let("w_here", turn_z.T * w_mid + rates[1] * Z)
    w_dot_here = let(
        "w_dot_here", turn_z.T * w_dot_mid + accelerations[1] * Z + rates[1] * w_here.cross(Z)
    )

    # acceleration of this joint, and of the next along the link
    a_here = let("a_here", turn_z.T * let("a_mid", turn_x.T * base.a))
    products = let(
        "ww",
        Matrix([w_here[0] * w_here[1], w_here[0] ** 2 + w_here[2] ** 2, w_here[1] * w_here[2]]),
    )
    swing = let(
        "k", Matrix([products[0] - w_dot_here[2], -products[1], products[2] + w_dot_here[0]])
    )
    return {
        "w": w_here,
        "w_dot": w_dot_here,
        "a_joint": a_here,
        "swing": swing,
        "a": a_here - link[1] * swing,
    }
