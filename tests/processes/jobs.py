"""What a process or thread may be asked for, each as the digest of all numbers that come out."""

import hashlib

import numpy as np

import serpentail as st

STATES = 2400  # more than both threads take, and enough for vectors
AGAIN = {"duration": 0.4, "bounds": st.Bounds(angle=np.pi / 3), "tolerance": None, "track": False}


def start(model):
    """Return q and v of a rat thrown up, pitched, and turning about all axes."""
    q, v = np.full(model.nq, 0.1), np.zeros(model.nv)
    q[:7] = 0, 0, 0.3, np.cos(0.4), np.sin(0.4), 0, 0
    v[:6] = 0, -0.3, 2.4, 1, -2, 1.5
    return q, v


def _digest(*arrays) -> str:
    return hashlib.sha256(b"".join(np.array(a, float).tobytes() for a in arrays)).hexdigest()


def _starts(model, count):
    random = np.random.default_rng(7)
    q, v = start(model)
    q, v = np.tile(q, (count, 1)), np.tile(v, (count, 1))
    return q + 0.01 * random.normal(size=q.shape), v + 0.1 * random.normal(size=v.shape)


def batch(model) -> str:
    """Evaluate states that threads share, one by one and in lanes."""
    q, v = _starts(model, STATES)
    tau = np.zeros(model.nv - 6)
    one_by_one = model.energy(q, v)
    return _digest(model.forward_dynamics(q, v, tau), model.mass_matrix(q), *one_by_one)


def simulate(model) -> str:
    """Make a single run."""
    flight = st.simulate(model, *start(model), t_span=0.1)
    return _digest(flight.q, flight.v)


def rollouts(model) -> str:
    """Make runs that threads take up in turn."""
    found = st.simulate(model, *_starts(model, 12), t_span=0.1, output_step=0.02)
    return _digest(found.q, found.v, found.kinetic)


def casadi(model) -> str:
    """Evaluate symbolic and compiled functions of CasADi."""
    q, v = start(model)
    tau = np.zeros(model.nv - 6)
    symbolic = model.casadi.forward_dynamics(q, v, tau)
    external = model.casadi.external("forward_dynamics", 2)
    derivative = external.jacobian()
    values = (q, v, tau, model.casadi.parameter_vector)
    blocks = derivative(*values, external(*values))
    return _digest(symbolic, external(*values), *map(np.array, blocks))


def plan(model) -> str:
    """Plan a motion: IPOPT, its linear algebra, and the truth of its end.

    After a batch: from then on nodes are evaluated in lanes, whose last digits are their own.
    """
    batch(model)
    found = st.plan(model, start=start(model), intervals=2, **AGAIN)
    assert found.report["converged"], found.report
    return _digest(found.solution.w, found.trajectory.q)


JOBS = {job.__name__: job for job in (batch, simulate, rollouts, casadi, plan)}


def done(model: st.Model, name: str) -> str:
    """Return the digest of a job, or what it raised."""
    try:
        return JOBS[name](model)
    except Exception as error:
        return repr(error)
