"""Laws of contact, tracking and implicit steps: a model and a state go in; the errors of what must
hold come out.
"""

from dataclasses import replace

import numpy as np

from ..model.model import Model
from .errors import relative, sensitivity, worst
from .law import NEAR, Law, fastest, moved, registry, slope
from .states import State

FAR = 10 * NEAR  # a slope divides rounding by its step
SUNK = 3e-3  # m, how deep the lowest point is
LEGS = np.array([3.6, -0.4, 3.7, -0.6, 5.0, -20.0, -8.0, 10.0])
GAINS = np.array([4e4, 400.0])  # 1/s^2, 1/s: Table 1
LAWS: list[Law] = []
law = registry(LAWS)


def legs(model: Model, time: float = 0.0) -> tuple[np.ndarray, ...]:
    """Return the legs at a time, where the model has legs."""
    return (
        (np.concatenate([LEGS[:4] + time * LEGS[4:], LEGS[4:]]),)
        if "feet" in model.contacts
        else ()
    )


def bristles(model: Model) -> np.ndarray:
    """Return stretched friction springs."""
    return 1e-3 * np.sin(np.arange(2 * sum(model.contacts.values())))


def sunk(model: Model, s: State) -> State:
    """Return the state with its lowest point in the ground."""
    positions, _ = model.contact_points(s.q, s.v, *legs(model))
    return replace(s, q=s.q - (positions[:, 2].min() + SUNK) * (np.arange(model.nq) == 2))


@law("pfl", "forward_dynamics", units=NEAR)
def tail_gets_the_accelerations_that_torques_are_for(model: Model, s: State):
    """The torques of partial feedback linearisation give the wanted accelerations, relative to
    cond(H).
    """
    v_dot = model.forward_dynamics(s.q, s.v, model.pfl(s.q, s.v, s.accelerations))
    return relative(v_dot[6:], s.accelerations, v_dot) / sensitivity(model, s.q)


@law("tracked_dynamics", "pfl", "forward_dynamics", units=NEAR)
def tracking_moves_as_its_torques_do(model: Model, s: State):
    """What gives the torques of partial feedback linearisation gives v_dot under them, relative to
    cond(H).
    """
    tau, v_dot = model.kernel("tracked_dynamics")(s.q, s.v, s.accelerations)
    expected = model.forward_dynamics(s.q, s.v, tau)
    torques = model.pfl(s.q, s.v, s.accelerations)
    return {
        "tau": relative(tau, torques, torques),
        "v_dot": relative(v_dot, expected, expected) / sensitivity(model, s.q),
    }


@law("implicit_factor", "implicit_solve", "mass_matrix", units=NEAR)
def implicit_steps_solve_their_system(model: Model, s: State):
    """High up, (1 - w J) k = r with J of damping and gains alone, relative to cond(H)."""
    w, damping, high = (
        1e-3,
        np.linspace(1e-3, 2e-3, model.nv - 6),
        s.q + 100.0 * (np.arange(model.nq) == 2),
    )
    u = (bristles(model),) if model.contacts else ()
    H = model.mass_matrix(s.q).astype(float)
    weight, ground = ([w, 1.0], (*u, *legs(model))) if u else ([w], ())
    factors = model.kernel("implicit_factor")(high, s.v, damping, GAINS, weight, *ground)
    k_q, k_v, *k_u = model.kernel("implicit_solve")(factors, s.dq, s.dv, *u)
    change, load = (k_v.astype(float) - s.dv), np.zeros(model.nv)
    load[6:] = -w * (H[6:, 6:] @ (GAINS @ [k_q[6:], k_v[6:]]) + damping * k_v[6:])
    scale = np.sqrt(np.diag(H))
    relaxed = [u[0] / (1 + w / model.parameters["D_f"])] if u else []
    return {
        "v": relative(H @ change / scale, load / scale) / sensitivity(model, s.q),
        "q": relative(k_q, s.dq + w * k_v.astype(float)),
        "bristles": worst(relative(one, other) for one, other in zip(k_u, relaxed, strict=True)),
    }


@law("contact_points", units=FAR, only="contact")
def velocities_are_the_rates_of_the_points(model: Model, s: State):
    """Points of feet and tail move as they say; the torso's lowest is one point after another."""
    count = sum(n for name, n in model.contacts.items() if name != "torso")
    s = replace(s, q=np.concatenate([0 * s.q[:3], s.q[3:]]))
    rate = fastest(model, s.v) + np.abs(LEGS[4:]).max()

    def positions(time: float) -> np.ndarray:
        return model.contact_points(moved(s.q, s.v, time), s.v, *legs(model, time))[0][
            :count
        ].astype(float)

    change, largest = slope(positions, rate)
    return relative(
        model.contact_points(s.q, s.v, *legs(model))[1][:count],
        change,
        np.abs(change) + rate * largest,
    )


@law("contact_points", units=NEAR, only="contact")
def points_are_carried_by_the_torso(model: Model, s: State):
    """Another place and velocity of B are added to those of every point."""
    move = np.array([0.5, -0.25, 1.0])
    first = model.contact_points(s.q, s.v, *legs(model))
    q, v = s.q + np.pad(move, (0, model.nq - 3)), s.v + np.pad(move, (0, model.nv - 3))
    second = model.contact_points(q, v, *legs(model))
    return worst(relative(b, a + move, np.abs(a) + 1) for a, b in zip(first, second, strict=True))


@law("contact_points", "contact_dynamics", "mass_matrix", "bias_force", units=NEAR, only="contact")
def the_ground_accelerates_by_its_generalised_force(model: Model, s: State):
    """H v_dot + C = [0; tau] + J^T f, where a column of J is what one speed more adds to
    velocities, cond(H) aside.
    """
    s = sunk(model, s)
    v_dot, _, forces = model.contact_dynamics(s.q, s.v, s.tau, bristles(model), *legs(model))
    H, C = (x.astype(float) for x in (model.mass_matrix(s.q), model.bias_force(s.q, s.v)))
    units = np.concatenate([[np.zeros(model.nv)], np.eye(model.nv)])
    speeds = model.contact_points(s.q, units, *legs(model))[1].astype(float)
    load = np.einsum("ika,ka->i", speeds[1:] - speeds[0], forces.astype(float))
    size, scale = np.abs(load) + np.abs(C), np.sqrt(np.diag(H))
    residual = H @ v_dot + C - load - np.concatenate([np.zeros(6), s.tau])
    return relative(residual / scale, 0, size / scale) / sensitivity(model, s.q)


@law("contact_points", "contact_dynamics", units=8, only="contact")
def the_ground_never_pulls_nor_holds_by_more_than_friction(model: Model, s: State):
    """f_n is not below 0, and the horizontal force not above mu f_n."""
    s, P = sunk(model, s), model.parameters
    _, _, forces = model.contact_dynamics(s.q, s.v, s.tau, bristles(model), *legs(model))
    sides, limit = forces[:, :2].astype(float), P["mu"] * forces[:, 2].astype(float)
    boxed = model.manifest["scene"]["friction"] in ("box", "paper")
    size = np.abs(sides).max(axis=1) if boxed else np.linalg.norm(sides, axis=1)
    return relative(
        np.maximum(size - limit, 0) + np.maximum(-limit, 0), 0, size + np.finfo(float).tiny
    )
