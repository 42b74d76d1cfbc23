"""Laws of inertia, dynamics, energy and flight: how the functions of a model belong together."""

from typing import Any

import numpy as np

from serpentail_scene.layout import (
    OMEGA,
    POSITION,
    QUATERNION,
    TAIL_V,
    TORSO_NV,
    VELOCITY,
)

from ..basics.attitude import rotation_matrix
from ..model.model import Model
from ..model.passive import stop_damping
from ..model.weight import fall, total_mass
from ..motion.trajectory import Trajectory
from ..simulation.controllers.schedules import Legs
from ..simulation.simulate import simulate
from .errors import block_error, blocks_of, difference, differing, relative, rounding, worst
from .law import ACTING, PIECEWISE, VALUE_LIMIT, Errors, fastest, law, slope
from .states import Case

FLIGHT, STEPS = 0.2, 2000  # s
SWING = 0.02  # s, of a tail on a fixed base, which gravity folds and whips
CLEAR = 10.0  # m: more than a flight falls, or than a tail's length


# Inertia, dynamics, energy, flight


@law("mass_matrix")
def mass_matrix_is_symmetric(model: Model, s: Case) -> Errors:
    """H equals its transpose, bit for bit."""
    H = model.mass_matrix(s.q)
    return differing(H, H.T)


@law("mass_matrix")
def mass_matrix_is_positive_definite(model: Model, s: Case) -> Errors:
    """The smallest eigenvalue of H, scaled to a unit diagonal, is above eps times the largest."""
    H = model.mass_matrix(s.q).astype(float)
    if not np.diag(H).min() > 0:
        return np.nan
    scale = np.sqrt(np.diag(H))
    eigenvalues = np.linalg.eigvalsh(H / np.outer(scale, scale))
    return worst([rounding(model) - eigenvalues[0] / eigenvalues[-1]])


@law("mass_matrix", 4, only="free")
def translation_carries_the_whole_mass(model: Model, s: Case) -> Errors:
    """The first block of H is (m_torso + m_tail) 1."""
    return relative(
        model.mass_matrix(s.q)[VELOCITY, VELOCITY], total_mass(model.parameters) * np.eye(3)
    )


@law("mass_matrix bias_force inverse_dynamics", VALUE_LIMIT)
def inverse_dynamics_is_mass_times_acceleration_plus_bias(model: Model, s: Case) -> Errors:
    """Inverse dynamics is H v_dot + C, relative to |H| |v_dot| + |C|."""
    H, C = model.mass_matrix(s.q), model.bias_force(s.q, s.v)
    found, scale = model.inverse_dynamics(s.q, s.v, s.v_dot), abs(H) @ abs(s.v_dot) + abs(C)
    return block_error(found, H @ s.v_dot + C, scale, blocks_of(model))


@law("mount_wrench inverse_dynamics", VALUE_LIMIT, only="free")
def a_tail_that_moves_pushes_its_mount(model: Model, s: Case) -> Errors:
    """What the motion of the tail alone adds to H v_dot + C at B, its wrench at the mount lacks."""
    R, added, moving = rotation_matrix(s.q[QUATERNION]), np.zeros(TORSO_NV), np.ones(model.nv)
    largest, tail = np.zeros(TORSO_NV), model.layout.chains[0].v
    for sign in (1, -1):
        v, v_dot = s.v * moving, s.v_dot * moving
        force, moment = model.mount_wrench(s.q, v, v_dot)
        arm = np.cross(model.parameters["tail_mount"], force)
        needed = model.inverse_dynamics(s.q, v, v_dot)[:TORSO_NV]
        added += sign * (needed + np.r_[R @ force, moment + arm])
        largest, moving[tail] = np.maximum(largest, abs(needed)), 0
    return block_error(added, 0 * added, largest, (VELOCITY, OMEGA))


@law("mass_matrix inverse_dynamics forward_dynamics", VALUE_LIMIT)
def forward_dynamics_needs_the_torques_it_was_given(model: Model, s: Case) -> Errors:
    """Inverse dynamics of forward dynamics is [0; tau], relative to |H| |v_dot| + |tau|."""
    v_dot = model.forward_dynamics(s.q, s.v, s.tau)
    applied = np.concatenate([np.zeros(model.nv - len(s.tau)), s.tau])
    scale = abs(model.mass_matrix(s.q)) @ abs(v_dot) + abs(applied)
    found = model.inverse_dynamics(s.q, s.v, v_dot)
    return block_error(found, applied, scale, blocks_of(model))


# behind its stops a tail is pushed so much harder than it moves that roundings of that are seen
@law("mass_matrix inverse_dynamics forward_dynamics_external", VALUE_LIMIT, without=PIECEWISE)
def forward_dynamics_inverts_inverse_dynamics(model: Model, s: Case) -> Errors:
    """Under the loads that v_dot needs, forward dynamics returns v_dot, relative to cond(H)."""
    force = model.inverse_dynamics(s.q, s.v, s.v_dot)
    load = model.external_force(force[VELOCITY], force[OMEGA])
    return difference(
        model, s.q, "v_dot", model.forward_dynamics(s.q, s.v, force[TAIL_V], load), s.v_dot
    )


@law("mass_matrix energy", VALUE_LIMIT)
def kinetic_energy_is_half_v_H_v(model: Model, s: Case) -> Errors:
    """T = v . H v / 2."""
    return relative(model.energy(s.q, s.v)[0], s.v @ model.mass_matrix(s.q) @ s.v / 2)


@law("mass_matrix momentum", VALUE_LIMIT, only="free")
def momentum_is_mass_times_velocity(model: Model, s: Case) -> Errors:
    """Momentum is the upper part of H v, angular momentum the middle part, moved to the COM."""
    linear, angular = model.momentum(s.q, s.v)
    impulse = model.mass_matrix(s.q) @ s.v
    force, moment = impulse[VELOCITY], impulse[OMEGA]
    arm = center_of_mass(model, s.q) - s.q[POSITION]
    moment = rotation_matrix(s.q[QUATERNION]) @ moment
    scale = abs(moment) + abs(np.cross(arm, force))
    return {
        "linear": relative(linear, force),
        "angular": relative(angular, moment - np.cross(arm, force), scale),
    }


@law("momentum", VALUE_LIMIT, only="articulated")
def a_planar_tail_turns_the_torso_as_bodies_at_pins(model: Model, s: Case) -> Errors:
    """Bent in pitch alone, links turn a torso without angular momentum by -h / J: J is the inertia
    of all bodies in the plane, h their angular momentum about the COM if the torso is at rest.
    """
    p, counts = model.parameters, model.joints_each
    if model.fixed or "mount_angles" in p or len(model.layout.chains) > 1:
        return {}
    n = int(np.sum(counts))
    pitch = np.arange(0, model.layout.nt, 2)
    joints = (np.repeat(x[-model.layout.nt :][pitch], counts) for x in (s.q, s.v))
    angles, rates = (np.cumsum(x * np.ravel(p.get("joint_ratios", 1.0))) for x in joints)

    # y + i z of each link's ends and COM, and its rate
    lengths = np.array(p.get("link_lengths", np.full(n, p["tail_length"] / n)))
    along = -np.exp(1j * angles)
    ends = complex(*p["tail_mount"][1:]) + np.cumsum(lengths * along)
    back = np.array(p.get("link_centers", lengths / 2)) - lengths
    places = np.concatenate([[0], ends + back * along])
    turning = 1j * rates * along
    moving = np.concatenate([[0], np.cumsum(lengths * turning) + back * turning])
    masses = np.array([p["torso_mass"], *p.get("link_masses", np.full(n, p["tail_mass"] / n))])
    inertias = np.resize(p.get("link_inertias", p.get("link_inertia")), (n, 3))[:, 0]

    arms = places - np.average(places, weights=masses)
    J = p["torso_inertia"][0] + np.sum(inertias) + masses @ abs(arms) ** 2
    each = np.concatenate([inertias * rates, masses * (arms.conj() * moving).imag])
    q, swing = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7 + pitch], swing[6 + pitch] = 1.0, s.q[7 + pitch], s.v[6 + pitch]
    turn, h = np.eye(model.nv)[3], np.sum(each)
    found = [model.momentum(q, v)[1][0] for v in (turn, swing)]
    return {"J": relative(found[0], J), "h": relative(found[1], h, np.sum(abs(each)))}


def center_of_mass(model: Model, q: np.ndarray) -> np.ndarray:
    """Return the COM (..., 3) from H: p + R h / M with H_p,omega = -R skew(h)."""
    H, R = model.mass_matrix(q).astype(float), rotation_matrix(q[..., QUATERNION])
    skew = -np.swapaxes(R, -1, -2) @ H[..., VELOCITY, OMEGA]
    h = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return q[..., POSITION] + (R @ h[..., None])[..., 0] / H[..., :1, 0]


@law("mass_matrix center_of_mass", VALUE_LIMIT, only="free")
def center_of_mass_is_that_of_the_mass_matrix(model: Model, s: Case) -> Errors:
    """The COM and its Jacobian follow from H; the Jacobian is the upper part of H over the mass."""
    position, _, J = model.center_of_mass(s.q, s.v)
    upper = model.mass_matrix(s.q)[VELOCITY]
    return {
        "position": relative(position, center_of_mass(model, s.q)),
        "J": relative(J, upper / upper[0, 0]),
    }


@law("momentum center_of_mass", VALUE_LIMIT)
def momentum_is_mass_times_velocity_of_the_center_of_mass(model: Model, s: Case) -> Errors:
    """Momentum is the mass times the velocity of the COM: of the animal, or of a tail on a fixed
    base.
    """
    velocity = model.center_of_mass(s.q, s.v)[1]
    return relative(total_mass(model.parameters) * velocity, model.momentum(s.q, s.v)[0])


@law("center_of_mass", VALUE_LIMIT)
def velocity_of_the_center_of_mass_is_J_v(model: Model, s: Case) -> Errors:
    """The velocity of the COM is its Jacobian times v, relative to the largest part of that."""
    _, velocity, J = model.center_of_mass(s.q, s.v)
    return relative(velocity, J @ s.v, abs(J) @ abs(s.v))


@law("energy forward_dynamics", VALUE_LIMIT, without=PIECEWISE)
def energy_changes_by_the_power_of_the_torques(model: Model, s: Case) -> Errors:
    """Along forward dynamics dE/dt = tau . q_t_dot less the power of the tail's own damping.

    The error is relative to energy times the fastest rate.
    """
    v_dot = model.forward_dynamics(s.q, s.v, s.tau).astype(float)
    rate = 2 * fastest(model, s.v)  # energy has products of two sines

    def energy(time: float) -> np.ndarray:
        return np.array(model.energy(model.integrate(s.q, s.v, time), s.v + time * v_dot), float)

    power, largest = slope(energy, rate)
    rates = s.v[model.layout.tail_v]
    damped = np.asarray(model.passive_values.get("tail_damping", 0.0)) * rates
    damped = damped + stop_damping(model.passive_values, s.q[model.layout.tail_q]) * rates
    return relative(power.sum(), rates @ (s.tau - damped), rate * largest.sum())


def flight(model: Model, s: Case, **settings: Any) -> Trajectory:
    """Fly without torques, links turning at up to 10 rad/s: undamped tails whip, long ones more.

    A model with contacts flies above the ground with its legs at rest. settings: method and
    tolerance; without them 2000 steps of RK4.
    """
    q, v = s.q.copy(), 10 / fastest(model, s.v) * s.v
    if model.contacts:
        q[2] += CLEAR
    legs: dict[str, Any] = {"legs": Legs.fixed(0.0, 0.0)} if "feet" in model.contacts else {}
    span = SWING if model.fixed else FLIGHT
    settings = settings or {"method": "rk4", "step": span / STEPS}
    motion = simulate(model, q, v, t_span=span, **legs, **settings)
    assert isinstance(motion, Trajectory)  # one start, one motion
    return motion


@law("rollout energy momentum", 4 * STEPS, floor=1e-10, without=ACTING)
def flights_keep_energy_momentum_and_a_parabola(model: Model, s: Case) -> Errors:
    """In 0.2 s of flight without torques, or 0.02 s on a fixed base (2000 steps of RK4), the sum of
    both energies is constant, and without a base angular momentum about the COM is constant,
    momentum changes by - M g t, and the COM, where H tells it, is at c + c_dot t - g t^2 / 2.
    """
    motion = flight(model, s)
    size = abs(motion.kinetic) + abs(motion.potential)
    error = {"energy": relative(motion.energy, motion.energy[0], size)}
    if model.fixed:
        return error
    error |= momentum_errors(model, motion)
    if "mass_matrix" in model.kernels:
        t, centers = motion.t[:, None], center_of_mass(model, motion.q)
        speed = motion.linear_momentum[0] / total_mass(model.parameters)
        parabola = centers[0] + t * speed + t**2 / 2 * fall(model.parameters)
        error["place"] = relative(centers, parabola)
    return error


def momentum_errors(model: Model, motion: Trajectory) -> dict[str, float]:
    """Return the errors of the momenta of a flight, under gravity alone."""
    pull = total_mass(model.parameters) * fall(model.parameters)
    linear = motion.linear_momentum[0] + np.outer(motion.t, pull)
    angular = motion.angular_momentum
    return {
        "linear": relative(motion.linear_momentum, linear),
        "angular": relative(angular, angular[0]),
    }
