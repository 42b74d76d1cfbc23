"""Differences between float and double models, per quantity and along flights."""

import numpy as np

import serpentail as st
from checks.stress.figure import Figure
from checks.stress.subjects import label, state, subject
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error

EPS32 = float(np.finfo(np.float32).eps)
ROUNDINGS = 64  # of one quantity, in units of eps
PER_CONDITION = 25  # of v_dot over cond(H), in units of eps: 5e-15 in double
FLIGHT = {"t_span": 0.6, "method": "rk4", "step": 1e-3, "output_step": 0.01}


def measured() -> list[Figure]:
    """Return the largest differences of H, C, energy, momentum and v_dot, and of flights of 0.6
    s.
    """
    rng, found = np.random.default_rng(8), []
    for size in ((1, 3), (3, 4), (1, None), (3, None)):
        single, double = (subject(*size, real) for real in ("float", "double"))
        cases = [state(double, rng, rng.uniform(-1, 1, double.model.nv - 6)) for _ in range(5)]
        cases = [tuple(np.float32(x).astype(float) for x in case) for case in cases]
        rows = [differences(single.model, double.model, case) for case in cases]
        for name in rows[0]:
            limit = (PER_CONDITION if name == "v_dot / cond(H)" else ROUNDINGS) * EPS32
            found.append(Figure(f"{label(*size)}: {name}", max(row[name] for row in rows), limit))
        found.append(flight(size, single.model, double.model, cases[0]))
    return found


def differences(single: st.Model, double: st.Model, case) -> dict[str, float]:
    """Return differences without units."""
    q, v, tau = case
    H = double.mass_matrix(q)
    v_dot = block_error(single.forward_dynamics(q, v, tau), double.forward_dynamics(q, v, tau))
    return {
        "H": mass_matrix_error(single.mass_matrix(q), H),
        "C": block_error(single.bias_force(q, v), double.bias_force(q, v)),
        "kinetic energy": relative(single.energy(q, v)[0], double.energy(q, v)[0]),
        "linear momentum": relative(single.momentum(q, v)[0], double.momentum(q, v)[0]),
        "angular momentum": relative(single.momentum(q, v)[1], double.momentum(q, v)[1]),
        "v_dot / cond(H)": v_dot / equilibrated_condition(H),
    }


def relative(x, reference) -> float:
    """Return max|x - reference| / max|reference|."""
    return float(np.max(np.abs(np.subtract(x, reference, dtype=float))) / np.max(np.abs(reference)))


def flight(size, single: st.Model, double: st.Model, case) -> Figure:
    """Return the largest difference of the torso's attitude and the tail's angles over 0.6 s of
    damped flight.
    """
    q, v, _ = case
    q[7:] *= 0.3
    motions = [
        st.simulate(model, q, v, controller=st.Damping(1e-5), **FLIGHT)
        for model in (single, double)
    ]
    apart = np.abs(motions[0].q[:, 3:] - motions[1].q[:, 3:]).max()
    return Figure(f"{label(*size)}: q over 0.6 s of flight, rad", float(apart), 5e-3)
