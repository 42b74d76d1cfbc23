"""Models, starts and plans that the righting study and the planning benchmark share."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st

FLIGHT = 0.58  # s, from 0.1 s after the kick until shortly before landing
TORQUE = 0.02  # N m
K_DMP = 1e-3  # N m s, of the passive tail
# 0.1 s after the kick: pitch (rad), velocity (m/s), spin (rad/s), and the whole tail's bend in
# pitch and its rate
HEIGHT, VELOCITY, PITCH, SPIN, BEND, BEND_RATE = (
    0.34,
    (0.0, -0.302, 2.385),
    3.80,
    26.2,
    3 * -0.558,
    3 * 4.70,
)
FUNCTIONS = (
    "mass_matrix,bias_force,inverse_dynamics,forward_dynamics,energy,momentum,tail_points,rollout,"
    "pfl,center_of_mass,"
    # of the nodes of plans
    "airborne_rates,airborne_rates_derivatives,airborne_rates_hessian,"
    # of the paper's program
    "forward_dynamics_derivatives,forward_dynamics_vjp,inverse_dynamics_hessian"
)


@cache
def model(segments: int, links: int | None) -> st.Model:
    """Return a tail with all that plans use; a continuum where links is None."""
    tail = {"tail": "articulated", "links": links} if links else {"tail": "continuum"}
    return st.build(segments=segments, functions=FUNCTIONS.split(","), **tail)


def share(rat: st.Model) -> np.ndarray:
    """The part of the whole tail's pitch bend that each tail coordinate has, (2m,)."""
    return np.tile([1.0, 0.0], rat.segments) / (
        rat.links * rat.segments if rat.links else rat.segments
    )


def kicked(rat: st.Model) -> tuple[np.ndarray, np.ndarray]:
    """Return q0, v0 0.1 s after the kick."""
    q = [0, 0, HEIGHT, np.cos(PITCH / 2), np.sin(PITCH / 2), 0, 0, *BEND * share(rat)]
    return np.array(q), np.array([*VELOCITY, SPIN, 0, 0, *BEND_RATE * share(rat)])


def tumbling(rat: st.Model, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a random start: any pitch, up to 0.3 rad of roll and yaw, 10 to 28 rad/s of pitch and
    6 about others.
    """
    random = np.random.default_rng(seed)
    q, v = kicked(rat)
    roll, yaw = random.uniform(-0.3, 0.3, 2)
    turn = Rotation.from_euler("ZXY", [yaw, random.uniform(0, 2 * np.pi), roll])
    q[3:7] = turn.as_quat(scalar_first=True)
    v[3:6] = random.uniform(10, 28), *random.uniform(-6, 6, 2)
    size = 3 * share(rat).max()
    q[7:], v[6:] = (
        size * random.uniform(-0.6, 0.6, rat.nq - 7),
        size * random.uniform(-5, 5, rat.nq - 7),
    )
    return q, v


def bounds(rat: st.Model, turn: float = np.pi, rate: float | None = None) -> st.Bounds:
    """Return the paper's bounds: joints share a bend of `turn` (rad) of the whole tail; torques
    0.02 N m.
    """
    return st.Bounds(angle=turn * share(rat).max(), rate=rate, torque=TORQUE)


def passive(rat: st.Model, start, duration: float) -> st.Trajectory:
    """Return the flight whose tail only damps (Eq. 47)."""
    return st.simulate(rat, *start, controller=st.Damping(K_DMP), t_span=duration)


def tracked(rat: st.Model, plan: st.Plan) -> st.Trajectory:
    """Return the flight whose tail tracks a plan by PFL (Eq. 46), just before the end, where PFL
    wants it at rest.
    """
    start, law = (plan.problem.q0, plan.problem.v0), st.Pfl(rat, plan)
    end = np.nextafter(plan.duration, 0)
    return st.simulate(rat, *start, controller=law, t_span=end, method="dop853", rtol=1e-8)


def row(plan: st.Plan) -> dict:
    """Return the numbers of a plan that the studies report."""
    names = (
        "converged",
        "success",
        "iterations",
        "rounds",
        "guesses",
        "intervals",
        "duration_s",
        "objective",
        "effort",
    )
    names += (
        "solve_cpu_s",
        "open_loop_attitude_error_deg",
        "tracked_attitude_error_deg",
        "tracked_tail_error_rad",
    )
    names += ("dyn_err", "energy_J", "peak_power_W")
    found = {name: np.nan if plan.report[name] is None else plan.report[name] for name in names}
    return found | {"stopped": plan.report["stopped"]}
