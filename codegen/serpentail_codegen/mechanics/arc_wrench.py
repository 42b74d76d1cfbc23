"""Inertial wrench and generalised forces of a segment of the continuum tail (Eq. 19).

The integrals over x are the form factors of `arc_shape`.
"""

from sympy import Matrix

from .arc import ArcTip, geometry, segment_motion, segment_velocity
from .arc_inertia import ArcInertia
from .arc_shape import factors
from .rotations import Y, symmetric
from .shapes import (
    M33,
    V2,
    V3,
    V6,
    V8,
    V12,
    V16,
    CoordinateMotion,
    FrameMotion,
    VirtualMotion,
)


def bending_rates(let, angles, rates) -> tuple:
    """Return z_dot, z_ddot at constant rates, a_dot b - a b_dot, and u_dot."""
    a, b = angles
    z_dot = let("z_dot", 2 * (a * rates[0] + b * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    return z_dot, z_ddot, let("area", rates[0] * b - a * rates[1]), Matrix([rates[1], 0, -rates[0]])


def relative_wrench(let, angles, rates, shape, w) -> tuple[Matrix, Matrix]:
    """Terms of bending at fixed rates: integrals of r_ddot over m L, of r x (2 w x r_dot + r_ddot)
    over m L^2.

    r = -sigma y + gamma u; with N the integral of r r_dot^T, that of r x (w x r_dot) is tr(N) w -
    N^T w.
    """
    # of Eq. 19 what bending adds by its rates alone
    f = factors(shape)
    _, _, _, u, _ = geometry(let, angles)
    z_dot, z_ddot, area, u_dot = bending_rates(let, angles, rates)

    # r_ddot, along y, u and u_dot
    square_rate, w_u, wy = let("square_rate", z_dot**2), let("w_u", w.dot(u)), w[1]
    on_y, on_u = (let("r_ddot", f[n + "_zz"] * square_rate + f[n + "_z"] * z_ddot) for n in "sg")
    force = on_u * u + 2 * let("lean", f["g_z"] * z_dot) * u_dot - on_y * Y

    # the integral of r x (w x r_dot) by N
    N_y = let("N_y", z_dot * (f["ss_z"] / 2 * wy - f["sz_g"] * w_u))
    N_u = let("N_u", z_dot * (f["gg_z"] / 2 * w_u - f["s_gz"] * wy))
    coriolis = (
        let("trace", f["g_z"] * z_dot) * w
        - N_y * Y
        - N_u * u
        - let("N_d", f["gg"] * w_u - f["sg"] * wy) * u_dot
    )

    # the integral of r x r_ddot
    moment = let("side", f["side_z"] * square_rate + f["side"] * z_ddot) * Y.cross(u)
    moment += f["gg_z"] * z_dot * area * Y - let("tilt", 2 * f["s_gz"] * z_dot) * Y.cross(u_dot)
    return force, 2 * coriolis + moment


def relative_loads(let, angles, rates, shape, w) -> list:
    """Integrals of dr/da and dr/db times w x (w x r) + 2 w x r_dot + r_ddot at fixed rates, over m
    L^2.

    The last is Lagrange's: bending alone has the energy (gg (a_dot^2 + b_dot^2) + along (z_dot /
    2)^2) / 2.
    """
    # of Eq. 19 what velocities give, along a and b
    f = factors(shape)
    a, b, _, u, du = geometry(let, angles)
    z_dot, z_ddot, area, _ = bending_rates(let, angles, rates)
    w_u, wy = let("w_u", w.dot(u)), w[1]

    # what acts along the bend itself, whatever its direction
    quadratic = f["ss_z"] * wy**2 - 2 * f["sg_z"] * wy * w_u + f["gg_z"] * w_u**2
    gyro = 2 * f["sz_g"] * (rates[0] * w[0] + rates[1] * w[2]) + f["gg_z"] * area * wy
    bending = f["along_z"] / 4 * z_dot**2 + (f["along"] - f["gg_z"]) / 2 * z_ddot
    common = let("common", quadratic - 2 * f["g_z"] * let("ww", w.dot(w)) - 2 * gyro + bending)

    # what acts along du/da, du/db, and across the bend
    lever = let("lever", f["gg"] * w_u - f["sg"] * wy)
    tilt, turn = let("tilt", 2 * f["sz_g"] * z_dot), let("turn", f["gg_z"] * z_dot * wy)
    swing = let("swing", 2 * f["gg"] * wy)
    loads = []
    for k, (across, across_rate) in enumerate(((b, rates[1]), (-a, -rates[0]))):
        relative = (
            tilt * w[2 * k] + turn * across + swing * across_rate + f["gg_z"] * z_dot * rates[k]
        )
        loads.append(angles[k] * common + lever * w.dot(du[k]) + relative)
    return loads


def segment_wrench(
    let,
    angles: V2,
    rates: V2,
    accelerations: V2,
    shape: V16,
    section: V2,
    own: ArcInertia,
    root: FrameMotion,
) -> dict:
    """Inertial wrench of a segment at its root and its two generalised forces (Eq. 19), in the root
    frame.

    ``w, w_dot, a`` are of the root frame.
    """
    m, length = section
    w, w_dot, a, h_own, H_own = root.w, root.w_dot, root.a, own.h_own, own.H_own

    # by the rates of the bend alone
    moment, spread = let("mL", Matrix([m * length, m * length * length]))
    force_r, moment_r = relative_wrench(let, angles, rates, shape, w)
    loads = relative_loads(let, angles, rates, shape, w)

    # force and moment at the root
    p = let("p", rates[0] * own.pitch_own[0:3, :] + rates[1] * own.yaw_own[0:3, :])
    bending = let("bending", accelerations[0] * own.pitch_own + accelerations[1] * own.yaw_own)
    force = (
        m * a
        + w_dot.cross(h_own)
        + w.cross(let("c", w.cross(h_own) + 2 * p))
        + bending[0:3, :]
        + moment * force_r
    )
    inertia = symmetric(own.I_own)
    torque = h_own.cross(a) + inertia * w_dot + w.cross(let("Iw", inertia * w)) + bending[3:6, :]

    # generalised forces of a and b
    torques = []
    for k, column in enumerate((own.pitch_own, own.yaw_own)):
        inertial = (
            column[0:3, :].dot(a) + column[3:6, :].dot(w_dot) + spread * let("load", loads[k])
        )
        torques.append(inertial + H_own[k] * accelerations[0] + H_own[k + 1] * accelerations[1])
    return {
        "F": Matrix([force, torque + spread * let("moment", moment_r)]),
        "torque_own": Matrix(torques),
    }


def segment_power(
    let,
    angles: V2,
    moving: CoordinateMotion,
    shape: V16,
    section: V2,
    tip: V8,
    end: ArcTip,
    own: ArcInertia,
    root: FrameMotion,
    virtual: VirtualMotion,
) -> dict:
    """Power of the inertial wrench of a segment and of its generalised forces (Eq. 19) under a
    virtual motion.
    """
    rates, accelerations, virtual_rates = moving.rates, moving.accelerations, moving.virtual_rates
    w_virtual, u_virtual = virtual.w_virtual, virtual.u_virtual
    wrench = segment_wrench(let, angles, rates, accelerations, shape, section, own, root)
    F, torque = let("F", wrench["F"]), let("torque", wrench["torque_own"])
    power = F[0:3, :].dot(u_virtual) + F[3:6, :].dot(w_virtual) + torque.dot(virtual_rates)
    motion = segment_motion(let, angles, rates, accelerations, section, tip, end, root)
    moved = segment_velocity(let, virtual_rates, end, w_virtual, u_virtual)
    return {"power": [power], **motion, "w_virtual": moved["w"], "u_virtual": moved["u"]}


def gather_segment_wrench(let, E: M33, r: V3, bend: V12, F: V6, torque_own: V2, F_next: V6) -> dict:
    """Add the next segment's wrench in this segment's root frame; generalised forces of a and b."""
    force, moment = let("force", E * F_next[0:3, :]), let("moment", E * F_next[3:6, :])
    torque = [bend[k : k + 3, :].dot(moment) + bend[k + 3 : k + 6, :].dot(force) for k in (0, 6)]
    total = Matrix([F[0:3, :] + force, F[3:6, :] + moment + r.cross(force)])
    return {"F_next": total, "torque": torque_own + Matrix(torque)}
