"""Many threads share one model: each result must equal that of a single thread."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import serpentail as st
from checks.stress import drops
from checks.stress.figure import Figure

THREADS, JOBS = 8, 64


def job(model: st.Model, seed: int) -> np.ndarray:
    """Return the results of one seed: calls, a batch, a call with other parameters, and a drop."""
    rng = np.random.default_rng(seed)
    q, v = drops.start(model, rng)
    tau, other = np.zeros(model.nv - 6), model.with_parameters(gravity=rng.uniform(0, 20))
    batch = model.bias_force(np.stack([q] * 5), v).ravel()
    settings = {"legs": st.Legs.fixed(3.6, -0.3), "t_span": 0.05, "output_step": 0.01}
    motion = st.simulate(other, q, v, **settings)
    return np.concatenate(
        [model.mass_matrix(q).ravel(), batch, other.forward_dynamics(q, v, tau), motion.q.ravel()]
    )


def measured() -> list[Figure]:
    """Return how many results differ in some bit while other threads get refusals, and how many
    states with NaN are not refused.
    """
    model = drops.falling(1, 3)
    alone = [job(model, seed) for seed in range(JOBS)]
    with ThreadPoolExecutor(THREADS) as pool:
        refusals = [pool.submit(model.mass_matrix, np.full(model.nq, np.nan)) for _ in range(JOBS)]
        together = list(pool.map(lambda seed: job(model, seed), range(JOBS)))
    differing = sum(not np.array_equal(a, b) for a, b in zip(alone, together, strict=True))
    harmed = sum(not isinstance(refusal.exception(), st.StateError) for refusal in refusals)
    return [
        Figure(f"{JOBS} jobs in {THREADS} threads: results that differ in a bit", differing, 0),
        Figure(f"{JOBS} states with NaN: not refused", harmed, 0),
    ]
