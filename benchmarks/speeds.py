"""Times of making tails and of calls from C, and drifts of flights."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("speeds", __doc__)

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import best
from benchmarks.comparison import compared
from benchmarks.fixtures import Fixture, built, by_clang, fixture, label
from benchmarks.peers import build, pinocchio, timing

ROOT = Path(__file__).resolve().parent.parent
ROUNDS, CALLS = 200, 256
BUILT = """
import ast, json, sys
import serpentail as st
from benchmarks.fixtures import built
ends = {}
with st.progress(lambda now: ends.update({now.stage: now.seconds})):
    model = built(*ast.literal_eval(sys.argv[1]))
text = model.folder / "src" / f"{model.name}.c"
found = {"generate_s": ends["derive"], "compile_s": ends["compile"]}
found |= {"c_bytes": text.stat().st_size}
print(json.dumps(found | {"emission": model.manifest["functions"]["forward_dynamics"]["emission"]}))
"""


def generation(folder: Path) -> list[dict]:
    """Seconds from nothing to a loaded model: a new process generates it, and it is compiled into
    an empty cache.
    """
    rows = []
    for size in ((1, 3), (3, 4), (8, 16), (6, None)):
        begun = time.perf_counter()
        told = subprocess.run(
            [sys.executable, "-c", BUILT, repr(size)],
            env=os.environ | {"SERPENTAIL_CACHE": str(folder / f"empty_{label(*size)}")},
            cwd=ROOT,
            check=True,
            stdout=subprocess.PIPE,
        ).stdout
        total = time.perf_counter() - begun
        rows.append({"model": label(*size)} | json.loads(told) | {"total_s": total})
    return rows


def speed(folder: Path) -> list[dict]:
    """Nanoseconds of one forward dynamics call from C, beside Pinocchio's coupled path, rounds
    interleaved; each peer by the faster of the compilers. Ratios by minima (by medians in
    brackets). Pinocchio: as its documentation shows it; its CRBA with all that was found to speed
    it up; the tied columns summed by own code on its types (pinocchio_chain.cpp). Ours is compiled
    as for its users, and by clang beside that.
    """
    plain, tuned = (
        build.by_each(partial(build.build_library, source, build.CACHE))
        for source in (build.PLAIN, build.TUNED)
    )
    return [speed_row(folder, size, plain, tuned) for size in ((1, 3), (3, 4), (6, 6), (8, 16))]


def speed_row(folder: Path, size: tuple, plain: dict[str, Path], tuned: dict[str, Path]) -> dict:
    """Measure one size; the libraries by compiler."""
    ours, states = fixture(built(*size), folder), timing.random_states(size[0])
    with ExitStack() as freed:
        chains = [pinocchio.chains(freed, made, size, ours) for made in (plain, tuned)]
        errors = [difference(ours, peer, states) for made in chains for peer in made.values()]
        peers = {
            "plain": {by: chain.closure for by, chain in chains[0].items()},
            "tuned": {by: chain.crba_closure for by, chain in chains[1].items()},
            "own": {by: chain.closure for by, chain in chains[1].items()},
        }
        again = by_clang(ours.model, folder, "forward_dynamics")
        row = compared(ours, peers, states, again=again)
    return {"model": label(*size)} | row | {"v_dot_difference": max(errors)}


def difference(ours: Fixture, pinocchio, states) -> float:
    """Largest relative difference of the two results: they compute the same."""
    errors = []
    for q, v, tau in zip(*states, strict=True):
        a, b = ours.model.forward_dynamics(q, v, tau), pinocchio.forward_dynamics(q, v, tau)
        errors.append(np.abs(a - b).max() / np.abs(a).max())
    return max(errors)


def tails(folder: Path) -> list[dict]:
    """Nanoseconds of forward dynamics of a continuum beside an articulated tail of three links a
    segment.
    """
    rows = []
    for m in (1, 3, 6):
        pair = [fixture(built(m, links), folder) for links in (None, 3)]
        states = timing.random_states(m)
        (arcs, _), (links, _) = timing.time_rounds(
            [entry.closure for entry in pair], states, ROUNDS, CALLS
        )
        rows.append(
            {"segments": m, "continuum_ns": arcs, "articulated_ns": links, "ratio": arcs / links}
        )
    return rows


def drift(folder: Path) -> list[dict]:
    """Relative drift of energy and angular momentum in 10 s of undamped flight, RK4 at 0.1 ms, and
    its run time.
    """
    rows = []
    for size in ((1, 3), (3, 4)):
        model = built(*size)
        flight = st.simulate(model, *thrown(model), t_span=10.0, step=1e-4)
        energy, momentum = internal_energy(flight, model), flight.angular_momentum
        rows.append(
            {
                "model": label(*size),
                "energy_drift": float(np.abs(energy - energy[0]).max() / energy[0]),
                "momentum_drift": float(
                    np.abs(momentum - momentum[0]).max() / np.linalg.norm(momentum[0])
                ),
                "quaternion": float(np.abs(np.linalg.norm(flight.attitude, axis=1) - 1).max()),
                "seconds": flight.info["seconds"],
            }
        )
    return rows


def thrown(model) -> tuple[np.ndarray, np.ndarray]:
    """Return a state that spins about all axes with a bent tail."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7::2], q[8::2] = 1.0, 0.4 / model.links, 0.2 / model.links
    v[2], v[3:6] = 2.0, (6.0, 1.0, -2.0)
    return q, v


def internal_energy(flight, model) -> np.ndarray:
    """Kinetic energy minus that of the centre of mass: constant in free flight without torques."""
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    return flight.kinetic - (flight.linear_momentum**2).sum(axis=1) / (2 * mass)


def work_precision(folder: Path) -> list[dict]:
    """Waiting time of the caller against error of 0.58 s of damped flight: RK4, Tsit5 and DOP853 at
    several steps or tolerances.
    """
    model = built(1, 3)
    start = thrown(model)
    settings = [("rk4", {"step": h}) for h in (4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)]
    settings += [("tsit5", {"rtol": r, "atol": r}) for r in (1e-4, 1e-6, 1e-8, 1e-10)]
    settings += [("dop853", {"rtol": r, "atol": r * 1e-2}) for r in (1e-4, 1e-6, 1e-8, 1e-10)]

    def fly(method, options):
        return st.simulate(
            model, *start, controller=st.Damping(1e-4), t_span=0.58, method=method, **options
        )

    exact = fly("dop853", {"rtol": 1e-13, "atol": 1e-15})
    rows = []
    for method, options in settings:
        again = partial(fly, method, options | {"output_step": 0.58 / 5})
        error = np.abs(again().q[-1] - exact.q[-1]).max()
        name, value = next(iter(options.items()))
        milliseconds = best(again, 5) / 1e6
        rows.append(
            {
                "method": method,
                "setting": f"{name} {value:g}",
                "ms": milliseconds,
                "error": float(error),
            }
        )
    return rows
