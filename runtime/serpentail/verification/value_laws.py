"""Laws: a model and a state go in; the error of every law that the model must obey there comes
out.
"""

from dataclasses import replace
from itertools import starmap

import numpy as np

from ..attitude import rotation_matrix
from ..model.model import Model
from ..simulation.simulate import simulate
from .errors import (
    block_error,
    difference,
    differences,
    differing,
    differing_outputs,
    is_derivative,
    matrix_error,
    relative,
    rounding,
    same_bits,
    turned_array,
    worst,
)
from .law import NEAR, Law, fastest, moved, product, registry, slope
from .states import State, arguments, casadi_outputs, judged, named, outputs, scaled, total_mass

FLIGHT, STEPS = 0.2, 2000  # s
WORLD = ("mass_matrix_world", "bias_force_world")
# what position and velocity of B enter
PLACED = (
    "energy",
    "energy_derivatives",
    "momentum",
    "center_of_mass",
    "tail_points",
    "contact_points",
)
LAWS: list[Law] = []
law = registry(LAWS)


def changed_axes(top: np.ndarray, middle: np.ndarray, size: int) -> np.ndarray:
    """Return blkdiag(top, middle, 1): how a change of axes acts on velocities, forces and
    accelerations.
    """
    X = np.eye(size)
    X[:3, :3], X[3:6, 3:6] = top, middle
    return X


# Inertia, dynamics, energy, flight


@law("mass_matrix")
def mass_matrix_is_symmetric(model: Model, s: State):
    """H equals its transpose, bit for bit."""
    H = model.mass_matrix(s.q)
    return differing(H, H.T)


@law("mass_matrix")
def mass_matrix_is_positive_definite(model: Model, s: State):
    """The smallest eigenvalue of H, scaled to a unit diagonal, is above eps times the largest."""
    H = model.mass_matrix(s.q).astype(float)
    if not np.diag(H).min() > 0:
        return np.nan
    scale = np.sqrt(np.diag(H))
    eigenvalues = np.linalg.eigvalsh(H / np.outer(scale, scale))
    return worst([rounding(model) - eigenvalues[0] / eigenvalues[-1]])


@law("mass_matrix", units=4)
def translation_carries_the_whole_mass(model: Model, s: State):
    """The first block of H is (m_torso + m_tail) 1."""
    return relative(model.mass_matrix(s.q)[:3, :3], total_mass(model) * np.eye(3))


@law("mass_matrix", "bias_force", "inverse_dynamics", units=NEAR)
def inverse_dynamics_is_mass_times_acceleration_plus_bias(model: Model, s: State):
    """Inverse dynamics is H v_dot + C, relative to |H| |v_dot| + |C|."""
    H, C = model.mass_matrix(s.q), model.bias_force(s.q, s.v)
    return block_error(
        model.inverse_dynamics(s.q, s.v, s.v_dot), H @ s.v_dot + C, abs(H) @ abs(s.v_dot) + abs(C)
    )


@law("mass_matrix", "inverse_dynamics", "forward_dynamics", units=NEAR)
def forward_dynamics_needs_the_torques_it_was_given(model: Model, s: State):
    """Inverse dynamics of forward dynamics is [0; tau], relative to |H| |v_dot| + |tau|."""
    v_dot = model.forward_dynamics(s.q, s.v, s.tau)
    applied = np.concatenate([np.zeros(6), s.tau])
    scale = abs(model.mass_matrix(s.q)) @ abs(v_dot) + abs(applied)
    return block_error(model.inverse_dynamics(s.q, s.v, v_dot), applied, scale)


@law("mass_matrix", "inverse_dynamics", "forward_dynamics_external", units=NEAR)
def forward_dynamics_inverts_inverse_dynamics(model: Model, s: State):
    """Under the loads that v_dot needs, forward dynamics returns v_dot, relative to cond(H)."""
    force = model.inverse_dynamics(s.q, s.v, s.v_dot)
    load = model.external_force(force[:3], force[3:6])
    return difference(
        model, s.q, "v_dot", model.forward_dynamics(s.q, s.v, force[6:], load), s.v_dot
    )


@law("mass_matrix", "energy", units=NEAR)
def kinetic_energy_is_half_v_H_v(model: Model, s: State):
    """T = v . H v / 2."""
    return relative(model.energy(s.q, s.v)[0], s.v @ model.mass_matrix(s.q) @ s.v / 2)


@law("mass_matrix", "momentum", units=NEAR)
def momentum_is_mass_times_velocity(model: Model, s: State):
    """Momentum is the upper part of H v; angular momentum is the middle part, moved from B to the
    COM.
    """
    linear, angular = model.momentum(s.q, s.v)
    force, moment = (model.mass_matrix(s.q) @ s.v)[:6].reshape(2, 3)
    arm = center_of_mass(model, s.q) - s.q[:3]
    moment = rotation_matrix(s.q[3:7]) @ moment
    scale = abs(moment) + abs(np.cross(arm, force))
    return {
        "linear": relative(linear, force),
        "angular": relative(angular, moment - np.cross(arm, force), scale),
    }


def center_of_mass(model: Model, q: np.ndarray) -> np.ndarray:
    """Return the COM (..., 3) from H: p + R h / M with H_p,omega = -R skew(h)."""
    H, R = model.mass_matrix(q).astype(float), rotation_matrix(q[..., 3:7])
    skew = -np.swapaxes(R, -1, -2) @ H[..., :3, 3:6]
    h = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return q[..., :3] + (R @ h[..., None])[..., 0] / H[..., :1, 0]


@law("mass_matrix", "center_of_mass", units=NEAR)
def center_of_mass_is_that_of_the_mass_matrix(model: Model, s: State):
    """The centre of mass is where H puts it, and its Jacobian is the upper part of H over the
    mass.
    """
    position, _, J = model.center_of_mass(s.q, s.v)
    arm, upper = center_of_mass(model, s.q) - s.q[:3], model.mass_matrix(s.q)[:3]
    return {
        "position": relative(position, s.q[:3] + arm),
        "J": relative(J, upper / upper[0, 0]),
    }


@law("momentum", "center_of_mass", units=NEAR)
def momentum_is_mass_times_velocity_of_the_center_of_mass(model: Model, s: State):
    """Momentum is the mass of the whole animal times the velocity of its centre of mass."""
    velocity = model.center_of_mass(s.q, s.v)[1]
    return relative(total_mass(model) * velocity, model.momentum(s.q, s.v)[0])


@law("center_of_mass", units=NEAR)
def velocity_of_the_center_of_mass_is_J_v(model: Model, s: State):
    """The velocity of the centre of mass is its Jacobian times v, relative to the largest part of
    that.
    """
    _, velocity, J = model.center_of_mass(s.q, s.v)
    return relative(velocity, J @ s.v, abs(J) @ abs(s.v))


@law("energy", "forward_dynamics", units=NEAR)
def energy_changes_by_the_power_of_the_torques(model: Model, s: State):
    """Along forward dynamics dE/dt = tau . q_t_dot, relative to the energy times the links' fastest
    turn.
    """
    v_dot = model.forward_dynamics(s.q, s.v, s.tau).astype(float)
    rate = 2 * fastest(model, s.v)  # energy has products of two sines

    def energy(time):
        return np.array(model.energy(moved(s.q, s.v, time), s.v + time * v_dot), float)

    power, largest = slope(energy, rate)
    return relative(power.sum(), s.v[6:] @ s.tau, rate * largest.sum())


def flight(model: Model, s: State):
    """Fly without torques, links turning at up to 10 rad/s: an undamped tail whips, and long ones
    faster.
    """
    return simulate(model, s.q, 10 / fastest(model, s.v) * s.v, t_span=FLIGHT, step=FLIGHT / STEPS)


@law("rollout", "energy", "momentum", units=4 * STEPS, floor=1e-10)
def energy_is_constant_in_flight(model: Model, s: State):
    """In 0.2 s of flight without torques (RK4, 0.1 ms) kinetic plus potential energy stays as it
    is.
    """
    found = flight(model, s)
    return relative(found.energy, found.energy[0], abs(found.kinetic) + abs(found.potential))


@law("rollout", "energy", "momentum", units=4 * STEPS, floor=1e-10)
def momentum_is_constant_in_flight(model: Model, s: State):
    """In flight angular momentum about the COM is constant, and momentum changes by - M g t."""
    found = flight(model, s)
    weight = total_mass(model) * model.parameters["gravity"]
    linear = found.linear_momentum[0] - np.outer(found.t, [0, 0, weight])
    angular = found.angular_momentum
    return {
        "linear": relative(found.linear_momentum, linear),
        "angular": relative(angular, angular[0]),
    }


@law("rollout", "mass_matrix", "energy", "momentum", units=4 * STEPS, floor=1e-10)
def center_of_mass_flies_a_parabola(model: Model, s: State):
    """In flight the COM is at c + c_dot t - g t^2 / 2."""
    found = flight(model, s)
    t, centers = found.t[:, None], center_of_mass(model, found.q)
    speed, g = found.linear_momentum[0] / total_mass(model), model.parameters["gravity"]
    return relative(centers, centers[0] + t * speed - t**2 / 2 * [0, 0, g])


@law(units=NEAR)
def pose_in_the_world_turns_all_alike(model: Model, s: State):
    """Turning the world about z and shifting it turns and shifts every result."""
    angle, shift = 1.1, np.array([0.3, -0.7, 0.5])
    c, n = np.cos(angle), np.sin(angle)
    Z = np.array([[c, -n, 0], [n, c, 0], [0, 0, 1]])
    half = np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
    q = np.concatenate([Z @ s.q[:3] + shift, product(half, s.q[3:7]), s.q[7:]])
    X = changed_axes(Z, np.eye(3), model.nv)
    loads = s.f_ext.reshape(-1, 3) @ Z.T
    loads[1:2] = s.f_ext[3:6]
    turned = replace(s, q=q, f_ext=loads.ravel())
    turned = replace(
        turned, **{name: X @ getattr(s, name) for name in ("v", "v_dot", "dq", "dv", "multiplier")}
    )
    found = {}
    for name in judged(model):
        axes = changed_axes(Z, Z if name in WORLD else np.eye(3), model.nv)
        there = turned_outputs(model, outputs(model, name, s), axes, shift)
        found[name] = differences(model, name, turned, there.values())
    return found


def turned_outputs(model: Model, found: dict, X: np.ndarray, shift: np.ndarray) -> dict:
    """Return what outputs become in a world turned by X's first block and shifted."""
    Z, weight = X[:3, :3], total_mass(model) * model.parameters["gravity"]
    turn = {
        "potential": lambda V: V + weight * shift[2],
        **dict.fromkeys(("points", "positions", "position"), lambda p: p @ Z.T + shift),
        "velocities": lambda u: u @ Z.T,
        "J": lambda J: Z @ J @ X.T,
        "dparameters": lambda D: X @ D,
    }
    return {key: turn[key](x) if key in turn else turned_array(x, X) for key, x in found.items()}


@law()
def position_and_speed_of_the_torso_do_not_matter(model: Model, s: State):
    """Another position and velocity of B leave H, C, v_dot and Jacobians as they are, bit for
    bit.
    """
    far = replace(
        s, q=s.q + 5.0 * (np.arange(model.nq) < 3), v=s.v - 3.0 * (np.arange(model.nv) < 3)
    )
    return same_bits(model, [name for name in judged(model) if name not in PLACED], s, far)


@law()
def quaternion_has_no_norm_and_no_sign(model: Model, s: State):
    """The quaternion times -2 is the same attitude: the same results, bit for bit."""
    q = s.q.copy()
    q[3:7] *= -2
    return same_bits(model, judged(model), s, replace(s, q=q))


@law("tail_points", units=NEAR, only="articulated")
def links_have_equal_length(model: Model, s: State):
    """The first tail point is the mount, and each is L_t / N from the next."""
    points = model.tail_points(s.q).astype(float)
    mount = s.q[:3] + rotation_matrix(s.q[3:7]) @ model.parameters["tail_mount"]
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = model.parameters["tail_length"] / len(lengths)
    return {
        "mount": relative(points[0], mount, points),
        "lengths": relative(lengths, np.full(len(lengths), length), points),
    }


@law("tail_points", "tail_point_jacobians", units=NEAR)
def jacobians_are_the_derivatives_of_the_points(model: Model, s: State):
    """J v is the derivative of the tail points along each unit velocity, relative to |points| times
    the links' turn.
    """
    q = s.q.copy()
    q[:3] = 0
    J, found = model.tail_point_jacobians(q), []
    for k, unit in enumerate(np.eye(model.nv)):
        rate = max(1.0, fastest(model, unit))
        column, largest = slope(
            lambda t, v=unit: model.tail_points(moved(q, v, t)).astype(float), rate
        )
        found.append(relative(J[:, :, k], column, rate * largest))
    return worst(found)


@law(
    "mass_matrix",
    "forward_dynamics",
    "forward_dynamics_external",
    "tail_point_jacobians",
    units=NEAR,
)
def loads_accelerate_by_their_generalised_force(model: Model, s: State):
    """H (v_dot under loads - v_dot without) = [f; n; 0] + sum J_k^T f_k, relative to cond(H)."""
    H, J = model.mass_matrix(s.q).astype(float), model.tail_point_jacobians(s.q)
    force = np.einsum("kxi,kx->i", J, s.f_ext[6:].reshape(-1, 3))
    force[:6] += s.f_ext[:6]
    free = model.forward_dynamics(s.q, s.v, s.tau)
    loaded = model.forward_dynamics(s.q, s.v, s.tau, s.f_ext)
    return difference(model, s.q, "v_dot", loaded, free + np.linalg.solve(H, force))


@law("forward_dynamics", "forward_dynamics_external", units=NEAR)
def no_load_is_no_change(model: Model, s: State):
    """Forward dynamics under zero loads is forward dynamics, relative to cond(H)."""
    free = model.forward_dynamics(s.q, s.v, s.tau)
    return difference(
        model, s.q, "v_dot", model.forward_dynamics(s.q, s.v, s.tau, 0 * s.f_ext), free
    )


@law("mass_matrix", "mass_matrix_world", units=NEAR)
def mass_matrix_in_world_axes(model: Model, s: State):
    """The world-frame H is X^-T H X^-1 with X = blkdiag(1, R, 1)."""
    X = changed_axes(np.eye(3), rotation_matrix(s.q[3:7]), model.nv)
    return matrix_error(model.mass_matrix_world(s.q), X @ model.mass_matrix(s.q) @ X.T)


@law("bias_force", "bias_force_world", units=NEAR)
def bias_force_in_world_axes(model: Model, s: State):
    """The world-frame C is X^-T C: d(R omega)/dt = R omega_dot, so that X_dot adds nothing."""
    X = changed_axes(np.eye(3), rotation_matrix(s.q[3:7]), model.nv)
    return block_error(model.bias_force_world(s.q, s.v), X @ model.bias_force(s.q, s.v))


@law()
def calls_repeat(model: Model, s: State):
    """The same call gives the same bits, at once and after another call."""
    found = {}
    for name in judged(model):
        first, second, _, last = (outputs(model, name, case) for case in (s, s, scaled(s, 0.5), s))
        found[name] = differing_outputs(first, second) + differing_outputs(first, last)
    return found


@law()
def batches_are_singles(model: Model, s: State):
    """A batch of nine states gives the bits of nine calls."""
    cases = [scaled(s, 1 - k / 16) for k in range(9)]
    found = {}
    for name in judged(model):
        stacked = zip(*(arguments(model, name, case) for case in cases), strict=True)
        result = model.kernel(name)(*map(np.stack, stacked))
        whole = named(model, name, result)
        singles = [outputs(model, name, case) for case in cases]
        found[name] = differing_outputs(
            whole, {key: np.stack([one[key] for one in singles]) for key in whole}
        )
    return found


@law(units=NEAR)
def casadi_functions_agree(model: Model, s: State):
    """The CasADi functions of SX operations give what the C gives, v_dot relative to cond(H)."""
    return {
        name: differences(
            model, name, s, casadi_outputs(model, name, getattr(model.casadi, name), s)
        )
        for name in judged(model)
        if not is_derivative(model, name)
    }


@law(only="double")
def casadi_externals_are_the_compiled_code(model: Model, s: State):
    """casadi.external on the compiled C gives the bits of the model's own call."""
    found = {}
    for name in judged(model):
        results = casadi_outputs(
            model, name, model.casadi.external(name), s, model.casadi.parameter_vector
        )
        found[name] = sum(
            starmap(differing, zip(outputs(model, name, s).values(), results, strict=True))
        )
    return found
