"""The paper's optimal control of a flight (Sects. 3.1, 3.2), by direct collocation as printed.

The state x has the blocks (p, phi, q_t, p_dot, omega, q_t_dot): position of B (m, world); angles of
R = Rz(phi_z) Rx(phi_x) Ry(phi_y) (rad); tail coordinates (rad); velocity of B (m/s, world); angular
velocity in the torso's axes (rad/s), which the paper equates with phi_dot; rates of the tail
(rad/s).
"""

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np

import serpentail as st
from serpentail.basics.attitude import product
from serpentail.basics.checks import one_of, refusal, whole_number
from serpentail.planning.magnitudes import checked_bounds, checked_duration

# what makes unknowns of the order of 1; of torques: a part of their bounds
UNITS = {"position": 0.1, "angles": 1, "tail": 1, "velocity": 1, "torso_rate": 10, "tail_rate": 10}
TORQUE_UNIT = 0.05
K_DMP = 1e-3  # N m s, of the passive tail (Eq. 47)
SAMPLES = 10  # of the first guess from node to node, so that no turn is missed
MOST_NODES = 2000
SILENT = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
STOPPED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")  # what Ctrl-C becomes in CasADi
SETTINGS = SILENT | {"ipopt.honor_original_bounds": "yes"}


# ---- rules: of states x (n, N) and their rates at nodes of distance h ---------------------------


def trapezoidal(x: ca.MX, rates: ca.MX, h: ca.MX) -> ca.MX:
    """Return the defects of Eqs. 41, 42."""
    return x[:, 1:] - x[:, :-1] - h / 2 * (rates[:, :-1] + rates[:, 1:])


def hermite_simpson(x: ca.MX, rates: ca.MX, h: ca.MX) -> ca.MX:
    """Return the defects of the middles, then of the ends, of intervals of two steps."""
    (left, middle, right), (f, g, e) = ((y[:, :-2:2], y[:, 1::2], y[:, 2::2]) for y in (x, rates))
    between = middle - (left + right) / 2 - h / 4 * (f - e)
    return ca.horzcat(between, right - left - h / 3 * (f + 4 * g + e))


# with the weights of the nodes of an interval in its integral, divided by h
RULES = {
    "trapezoidal": (trapezoidal, (1 / 2, 1 / 2)),
    "hermite-simpson": (hermite_simpson, (1 / 3, 4 / 3, 1 / 3)),
}


def curve(times: np.ndarray, values: np.ndarray, steps: int) -> st.Piecewise:
    """Return polynomials through values (N, k) at times (N,), one for each interval of steps."""
    ends = range(len(times) - steps, len(times) + 1)
    nodes = [values[k:end:steps] for k, end in enumerate(ends)]
    powers = np.linalg.inv(np.vander(times[: steps + 1], increasing=True))
    return st.Piecewise(times[::steps], np.einsum("pn,nik->ikp", powers, nodes))


# ---- dynamics ------------------------------------------------------------------------------------


def places_of(model: st.Model) -> dict[str, slice]:
    """Return where each block is in a state."""
    found, at = {}, 0
    for name in UNITS:
        size = model.layout.nt if name.startswith("tail") else 3
        found[name], at = slice(at, at + size), at + size
    return found


def states_of(motion: st.Trajectory, places: dict[str, slice]) -> np.ndarray:
    """Return the states (K, n) of a motion; its angles count turns."""
    p_dot, omega, rates = np.split(motion.v, [3, 6], axis=1)
    angles = st.pitch_roll_yaw(motion.q, unwrap=True)
    parts = {"position": motion.q[:, :3], "angles": angles, "tail": motion.tail, "velocity": p_dot}
    parts |= {"torso_rate": omega, "tail_rate": rates}
    return np.column_stack([parts[name] for name in places])


def attitude_of_angles() -> ca.Function:
    """Return (phi, omega) -> the quaternion from torso to world, phi_dot."""
    phi, omega = ca.SX.sym("phi", 3), ca.SX.sym("omega", 3)
    c, s = ca.vertsplit(ca.cos(phi / 2)), ca.vertsplit(ca.sin(phi / 2))
    pitch, roll, yaw = [c[0], s[0], 0, 0], [c[1], 0, s[1], 0], [c[2], 0, 0, s[2]]
    # Ry(phi_y) omega = (phi_x_dot, phi_y_dot + sin(phi_x) phi_z_dot, cos(phi_x) phi_z_dot)
    cy, sy = ca.cos(phi[1]), ca.sin(phi[1])
    yaw_rate = (cy * omega[2] - sy * omega[0]) / ca.cos(phi[0])
    roll_rate = omega[1] - ca.sin(phi[0]) * yaw_rate
    rates = ca.vertcat(cy * omega[0] + sy * omega[2], roll_rate, yaw_rate)
    quaternion = ca.vertcat(*product(product(yaw, pitch), roll))
    return ca.Function("attitude", [phi, omega], [quaternion, rates])


def dynamics(model: st.Model, places: dict[str, slice]) -> ca.Function:
    """Return (x, tau) -> x_dot by Eq. 1 without the ground; its derivatives are compiled C."""
    size = max(at.stop for at in places.values())
    x, tau = ca.MX.sym("x", size), ca.MX.sym("tau", model.layout.nt)
    of = {name: x[at] for name, at in places.items()}
    quaternion, phi_dot = attitude_of_angles()(of["angles"], of["torso_rate"])
    q = ca.vertcat(of["position"], quaternion, of["tail"])
    v = ca.vertcat(of["velocity"], of["torso_rate"], of["tail_rate"])
    v_dot = model.casadi.external("forward_dynamics", derivatives=2, folded=True)(q, v, tau)
    rates = {"position": of["velocity"], "angles": phi_dot, "tail": of["tail_rate"]}
    rates |= {"velocity": v_dot[:3], "torso_rate": v_dot[3:6], "tail_rate": v_dot[6:]}
    return ca.Function("x_dot", [x, tau], [ca.vertcat(*(rates[name] for name in places))])


# ---- the program ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class PaperPlan:
    """What the program found, at its nodes.

    start: (q0, v0). times (N,), s. states (N, n); places: of each block in a state. torques (N,
    2m), N m; law: these at all times, for `st.simulate`. most: their bounds (2m,). stats:
    "converged", "status", "iterations", "effort" (N^2 m^2 s), "solve_cpu_s".
    """

    start: tuple[np.ndarray, np.ndarray]
    times: np.ndarray
    states: np.ndarray
    places: dict[str, slice]
    torques: np.ndarray
    law: st.TorqueCurve
    most: np.ndarray
    stats: dict


def paper_plan(
    model: st.Model,
    start: tuple,
    duration: float | tuple[float, float],
    bounds: st.Bounds,
    rule: str = "trapezoidal",
    nodes: int = 59,
    at_rest: bool = True,
    guess: tuple | None = None,
    **options: object,
) -> PaperPlan:
    """Plan torques of least effort that turn the torso upright, as in Sect. 4.2.

    start: (q0, v0). duration: s, or (least, most) if it is free. bounds: of angles and torques.
    rule: "trapezoidal" or "hermite-simpson". nodes: in equal distances. at_rest: the torso does not
    turn at the end. guess: (q0, v0) from which the first guess flies; start by default. options: of
    IPOPT, such as max_wall_time=60.0 (s). PlanningError, StateError or SimulationError if one of
    these is wrong, ModelError if the model is.
    """
    angle, most = limits(model, bounds)
    shortest, longest = checked_duration(model, duration)
    defects, weights = RULES[one_of("rule", rule, RULES, st.PlanningError)]
    N = whole_number("nodes", nodes, st.PlanningError, least=3, most=MOST_NODES)
    steps = len(weights) - 1
    if (N - 1) % steps:
        raise refusal("nodes", nodes, f"an odd number for {rule!r}", st.PlanningError)
    places, unit = places_of(model), TORQUE_UNIT * most
    units = np.concatenate([np.full(at.stop - at.start, UNITS[k]) for k, at in places.items()])
    for field, pair in (("start", start), ("guess", start if guess is None else guess)):
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise refusal(field, pair, "(q0, v0), two arrays", st.PlanningError)
    first, guessed_torques = first_guess(model, start, places, longest, N)
    if guess is not None:
        flown, guessed_torques = first_guess(model, guess, places, longest, N)
        first[1:] = flown[1:]
    low, high = box(first, places, angle, at_rest)

    # decision variables p_d, in units: t_N, states z and torques w at all nodes; Eqs. 40 to 42
    t_N, z, w = ca.MX.sym("t_N"), ca.MX.sym("z", len(units), N), ca.MX.sym("w", len(unit), N)
    h, x, tau = t_N / (N - 1), ca.diag(ca.DM(units)) @ z, ca.diag(ca.DM(unit)) @ w
    z_dot = ca.diag(ca.DM(1 / units)) @ dynamics(model, places).map(N)(x, tau)
    squares = ca.DM((unit / unit.mean()) ** 2).T @ w**2
    parts = [b * ca.sum2(squares[k : N - steps + k : steps]) for k, b in enumerate(weights)]
    nlp = {"x": ca.veccat(t_N, z, w), "f": h * sum(parts), "g": ca.vec(defects(z, z_dot, h))}

    # the paper has fmincon, of MATLAB
    given = SETTINGS | {f"ipopt.{name}": value for name, value in options.items()}
    solver, ones = ca.nlpsol("paper", "ipopt", nlp, given), np.ones(w.numel()) / TORQUE_UNIT
    begun = time.process_time()
    found = solver(
        x0=np.concatenate([[longest], (first / units).ravel(), (guessed_torques / unit).ravel()]),
        lbx=np.concatenate([[shortest], (low / units).ravel(), -ones]),
        ubx=np.concatenate([[longest], (high / units).ravel(), ones]),
        lbg=0,
        ubg=0,
    )
    spent, told = time.process_time() - begun, solver.stats()
    if told["return_status"] in STOPPED:
        raise KeyboardInterrupt
    duration, states, torques = np.split(found["x"].full().ravel(), [1, 1 + z.numel()])
    times = np.linspace(0, duration[0], N)
    states, torques = states.reshape(N, -1) * units, torques.reshape(N, -1) * unit
    stats = {
        "converged": told["success"],
        "status": told["return_status"],
        "iterations": told["iter_count"],
        "effort": float(found["f"] * unit.mean() ** 2),
        "solve_cpu_s": spent,
    }
    law = st.TorqueCurve(curve(times, torques, steps))
    return PaperPlan(start, times, states, places, torques, law, most, stats)


def limits(model: st.Model, bounds: st.Bounds) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest angles and torques (2m,), the only bounds of Sect. 4.2."""
    model.refuse_fixed("paper_plan")
    if model.contacts:
        raise st.ModelError(f"paper_plan: {model.name} has contacts: build it with contacts=[]")
    found = checked_bounds(model, bounds)
    for name in ("rate", "torque_rate"):
        if getattr(found, name) is not None:
            raise refusal(f"bounds.{name}", getattr(bounds, name), "None", st.PlanningError)
    if found.torque is None or not (found.torque > 0).all():
        raise refusal("bounds.torque", bounds.torque, "numbers above 0, in N m", st.PlanningError)
    return np.full(model.layout.nt, np.inf) if found.angle is None else found.angle, found.torque


def first_guess(
    model: st.Model, start: tuple, places: dict[str, slice], duration: float, nodes: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return states and torques at the nodes of a flight whose tail only damps (Sect. 3.2)."""
    step, law = duration / (nodes - 1) / SAMPLES, st.Damping(K_DMP)
    motion = st.simulate(model, *start, controller=law, t_span=duration, output_step=step)
    return states_of(motion, places)[::SAMPLES], motion.tau[::SAMPLES]


def box(
    guess: np.ndarray, places: dict[str, slice], angle: np.ndarray, at_rest: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return least and largest states at the nodes (Eq. 43).

    The end is upright after the whole turns that are nearest to the guess's (Sect. 3.2).
    """
    low = np.full(guess.shape, -np.inf)
    low[:, places["tail"]] = -angle
    high = -low
    if (guess[0] < low[0]).any() or (guess[0] > high[0]).any():
        start, needs = guess[0, places["tail"]], "angles within bounds.angle"
        raise refusal("start", start.tolist(), needs, st.PlanningError)
    low[0] = high[0] = guess[0]
    upright = slice(places["angles"].start, places["angles"].start + 2)
    turns = np.round(guess[-1, upright] / (2 * np.pi))
    low[-1, upright] = high[-1, upright] = 2 * np.pi * turns
    if at_rest:
        low[-1, places["torso_rate"]] = high[-1, places["torso_rate"]] = 0
    return low, high
