"""Laws of contact with the ground, of tracking by the tail, and of implicit steps."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from serpentail_scene.layout import POSITION, TORSO_NV, VELOCITY

from ..model.model import Model
from .errors import relative, sensitivity, worst
from .law import PIECEWISE, SLOPE_LIMIT, VALUE_LIMIT, Errors, fastest, law, slope
from .states import Case, at_origin

DEPTH = 3e-3  # m, of the lowest point in the ground
HEIGHT = 100.0  # m: far from the ground
LEGS = np.array([3.6, -0.4, 3.7, -0.6, 5.0, -20.0, -8.0, 10.0])
GAINS = np.array([4e4, 400.0])  # 1/s^2, 1/s: Table 1


def legs(model: Model, time: float = 0.0) -> tuple[np.ndarray, ...]:
    """Return the legs at a time, if the model has legs."""
    if "feet" not in model.contacts:
        return ()
    angles, rates = LEGS[:4], LEGS[4:]
    return (np.concatenate([angles + time * rates, rates]),)


def bristles(model: Model) -> np.ndarray:
    """Return stretched friction springs."""
    return 1e-3 * np.sin(np.arange(2 * sum(model.contacts.values())))


def sunk(model: Model, s: Case) -> Case:
    """Return the state with its lowest point in the ground."""
    positions, _ = model.contact_points(s.q, s.v, *legs(model))
    return replace(s, q=raised(s, -(positions[:, 2].min() + DEPTH)))


def raised(s: Case, height: float) -> np.ndarray:
    """Return the configuration with B higher by a height (m), unless it is fixed."""
    q = s.q.copy()
    if not s.fixed:
        q[2] += height
    return q


# behind its stops a tail is pushed so much harder than it moves that roundings of that are seen
@law("pfl forward_dynamics", VALUE_LIMIT, without=PIECEWISE)
def tail_gets_the_accelerations_that_torques_are_for(model: Model, s: Case) -> Errors:
    """Torques of partial feedback linearisation give wanted accelerations, relative to cond(H)."""
    v_dot = model.forward_dynamics(s.q, s.v, model.pfl(s.q, s.v, s.accelerations))
    return relative(v_dot[model.layout.tail_v], s.accelerations, v_dot) / sensitivity(model, s.q)


@law("tracked_dynamics pfl forward_dynamics", VALUE_LIMIT, without=PIECEWISE)
def tracking_moves_as_its_torques_do(model: Model, s: Case) -> Errors:
    """Torques and v_dot of one call equal those of two calls, relative to cond(H)."""
    tau, v_dot = model.kernel("tracked_dynamics")(s.q, s.v, s.accelerations)
    expected = model.forward_dynamics(s.q, s.v, tau)
    torques = model.pfl(s.q, s.v, s.accelerations)
    return {
        "tau": relative(tau, torques, torques),
        "v_dot": relative(v_dot, expected, expected) / sensitivity(model, s.q),
    }


@law("implicit_factor implicit_solve mass_matrix", VALUE_LIMIT)
def implicit_steps_solve_their_system(model: Model, s: Case) -> Errors:
    """High up, (1 - w J) k = r with J of damping and gains alone, relative to cond(H)."""
    tail = model.layout.tail_v
    inertia = model.mass_matrix(s.q).astype(float)[tail, tail]
    return implicit_errors(model, s, GAINS, lambda k_q, k_v: inertia @ (GAINS @ [k_q, k_v]))


def implicit_errors(
    model: Model, s: Case, gains: np.ndarray, force: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> dict[str, float]:
    """Return the errors of k high up, of right-hand sides dq and dv, and of bristles if there are
    contacts. force: what acts against k of the tail's angles and rates, besides damping.
    """
    w, damping, tail = 1e-3, np.linspace(1e-3, 2e-3, len(s.tau)), model.layout.tail_v
    u = (bristles(model),) if model.contacts else ()
    weight, ground = ([w, 1.0], (*u, *legs(model))) if u else ([w], ())
    high = raised(s, HEIGHT)
    factors = model.kernel("implicit_factor")(high, s.v, damping, gains, weight, *ground)
    solved = model.kernel("implicit_solve")(factors, s.dq, s.dv, *u)
    k_q, k_v, *k_u = (x.astype(float) for x in solved)

    # the expected k; q is in the tangent space, so tail angles have the places of their rates
    H, load = model.mass_matrix(s.q).astype(float), np.zeros(model.nv)
    load[tail] = -w * (force(k_q[tail], k_v[tail]) + damping * k_v[tail])
    scale = np.sqrt(np.diag(H))
    relaxed = [bristles(model) / (1 + w / model.parameters["D_f"])] if k_u else []
    return {
        "v": relative(H @ (k_v - s.dv) / scale, load / scale) / sensitivity(model, s.q),
        "q": relative(k_q, s.dq + w * k_v),
        "bristles": worst(map(relative, k_u, relaxed)),
    }


@law("contact_points", SLOPE_LIMIT, only="contact")
def velocities_are_the_rates_of_the_points(model: Model, s: Case) -> Errors:
    """Points of feet and tail move as they say; the torso's lowest is one point after another."""
    count = sum(n for name, n in model.contacts.items() if name != "torso")
    s = at_origin(s)
    rate = fastest(model, s.v) + np.abs(LEGS[4:]).max()

    def positions(time: float) -> np.ndarray:
        q = model.integrate(s.q, s.v, time)
        return model.contact_points(q, s.v, *legs(model, time))[0][:count].astype(float)

    change, largest = slope(positions, rate)
    velocities = model.contact_points(s.q, s.v, *legs(model))[1][:count]
    return relative(velocities, change, np.abs(change) + rate * largest)


@law("contact_points", VALUE_LIMIT, only="contact")
def points_are_carried_by_the_torso(model: Model, s: Case) -> Errors:
    """A change of B's position and velocity is added to those of every point."""
    move = np.array([0.5, -0.25, 1.0])
    first = model.contact_points(s.q, s.v, *legs(model))
    q, v = s.q.copy(), s.v.copy()
    q[POSITION] += move
    v[VELOCITY] += move
    second = model.contact_points(q, v, *legs(model))
    return worst(relative(b, a + move, np.abs(a) + 1) for a, b in zip(first, second, strict=True))


@law("leg_points contact_points", VALUE_LIMIT, only="contact")
def legs_end_in_their_feet(model: Model, s: Case) -> Errors:
    """A, M and T of the legs' joints are the feet's points."""
    joints = model.leg_points(s.q, LEGS[:4])
    feet = model.contact_points(s.q, s.v, *legs(model))[0][:6]
    return relative(joints[:, 3:].reshape(feet.shape), feet)


@law("leg_points", VALUE_LIMIT, only="contact")
def legs_have_their_lengths(model: Model, s: Case) -> Errors:
    """Hips are as far from B, and each joint from the next, as the parameters say."""
    P, joints = model.parameters, model.leg_points(s.q, LEGS[:4]).astype(float)
    B = np.broadcast_to(s.q[POSITION], (2, 1, 3))
    lengths = np.linalg.norm(np.diff(np.concatenate([B, joints], axis=1), axis=1), axis=2)
    links = [P[name] for name in ("L_h2d", "L_d2k", "L_k2a", "L_a2m", "L_m2t")]
    return relative(lengths, [np.linalg.norm(P["hip"]), *links], np.abs(joints) + lengths.max())


@law("contact_points contact_dynamics mass_matrix bias_force", VALUE_LIMIT, only="contact")
def the_ground_accelerates_by_its_generalised_force(model: Model, s: Case) -> Errors:
    """H v_dot + C = [0; tau] + J^T f, relative to cond(H).

    A column of J is the change of the points' velocities by one entry of v.
    """
    s = sunk(model, s)
    v_dot, _, forces = model.contact_dynamics(s.q, s.v, s.tau, bristles(model), *legs(model))
    H, C = (x.astype(float) for x in (model.mass_matrix(s.q), model.bias_force(s.q, s.v)))
    units = np.concatenate([[np.zeros(model.nv)], np.eye(model.nv)])
    speeds = model.contact_points(s.q, units, *legs(model))[1].astype(float)
    load = np.einsum("ika,ka->i", speeds[1:] - speeds[0], forces.astype(float))
    size, scale = np.abs(load) + np.abs(C), np.sqrt(np.diag(H))
    residual = H @ v_dot + C - load - np.concatenate([np.zeros(TORSO_NV), s.tau])
    return relative(residual / scale, 0, size / scale) / sensitivity(model, s.q)


@law("contact_rates contact_points contact_dynamics", VALUE_LIMIT, only="contact")
def simulations_ask_what_users_do(model: Model, s: Case) -> Errors:
    """Heights equal those of the points, accelerations and forces those of contact_dynamics.

    The ground's power is that of its forces on the moving points.
    """
    s = sunk(model, s)
    arguments = (s.q, s.v, s.tau, bristles(model), *legs(model))
    v_dot, rates, forces, heights, powers = model.kernel("contact_rates")(*arguments)
    positions, speeds = model.contact_points(s.q, s.v, *legs(model))
    expected = model.contact_dynamics(*arguments)
    # the legs' drives balance the power of the forces on moving legs
    still = model.contact_points(s.q, s.v, *(x * (np.arange(8) < 4) for x in legs(model)))[1]
    work = [float((forces * each).sum(dtype=float)) for each in (speeds, still - speeds)]
    scale = np.abs(forces * np.abs(speeds).max(initial=1)).sum(dtype=float)
    return {
        "heights": relative(heights[:, 0], positions[:, 2], np.abs(positions).max()),
        "rises": relative(heights[:, 1], speeds[:, 2], np.abs(speeds).max()),
        "v_dot": relative(v_dot, expected[0], expected[0]) / sensitivity(model, s.q),
        "bristle_rates": relative(rates, expected[1], np.abs(expected[1]).max()),
        "forces": relative(forces, expected[2], np.abs(expected[2]).max()),
        "powers": relative(powers, work, scale),
    }


@law("contact_points contact_dynamics", 8, only="contact")
def the_ground_never_pulls_nor_holds_by_more_than_friction(model: Model, s: Case) -> Errors:
    """f_n is not below 0, and the horizontal force not above mu f_n."""
    s, P = sunk(model, s), model.parameters
    _, _, forces = model.contact_dynamics(s.q, s.v, s.tau, bristles(model), *legs(model))

    # the paper's law bounds each axis, the others the length
    sides, limit = forces[:, :2].astype(float), P["mu"] * forces[:, 2].astype(float)
    boxed = model.manifest["scene"]["friction"] == "paper"
    size = np.abs(sides).max(axis=1) if boxed else np.linalg.norm(sides, axis=1)
    excess, pull = np.maximum(size - limit, 0), np.maximum(-limit, 0)
    return relative(excess + pull, 0, size + np.finfo(float).tiny)
