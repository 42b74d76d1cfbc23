"""Times SoRoMoX (JAX) beside the continuum's forward dynamics."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("peers.soromox", __doc__)

import importlib.util
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.batches import best
from benchmarks.fixtures import Fixture, built, fixture, label
from benchmarks.peers import timing

SIZES = (1, 3, 6)
ROUNDS, CALLS, REPEATS, LOOP = 15, 256, 20, 64
RADIUS = 0.004  # m, of SoRoMoX's rod; ours has none
ABSENT = "SoRoMoX is not installed, and left out: .venv/bin/pip install --editable '.[soromox]'"


def continuum_peer(folder: Path) -> list[dict]:
    """Nanoseconds of a continuum's forward dynamics beside SoRoMoX's, one state, double, rounds
    interleaved. SoRoMoX: floating, constant curvature, bending alone, five Gauss points a segment,
    jax.jit on the CPU; one call from Python, and one inside a compiled loop, where Python costs
    nothing. The models differ: its rod has no torso, and its state derivative includes the rates of
    q. Target: 100x.
    """
    if importlib.util.find_spec("soromox") is None:
        print(ABSENT, file=sys.stderr)
        return [{"left out": ABSENT}]
    return [row(folder, segments) for segments in SIZES]


def row(folder: Path, segments: int) -> dict:
    """Return the figures of one tail."""
    ours, states = fixture(built(segments), folder), timing.random_states(segments)
    call, loop = compiled(robot(ours), states)
    times = []
    for _ in range(ROUNDS):
        single = timing.time_rounds([ours.closure], states, 1, CALLS)[0][0]
        times.append((single, best(call, REPEATS), best(loop, REPEATS) / LOOP))
    least, median = np.min(times, axis=0), np.median(times, axis=0)
    found = {"model": label(segments, None), "ns": least[0]}
    for k, name in enumerate(("SoRoMoX, a call", "in a compiled loop"), 1):
        found[f"{name}, ns"] = least[k]
        found[f"{name}: times slower"] = (
            f"{least[k] / least[0]:.0f}x ({median[k] / median[0]:.0f}x)"
        )
    return found


def robot(ours: Fixture):
    """Return SoRoMoX's floating rod of the model's mass and length, without stiffness."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from soromox.systems.components.links import LinkSpec
    from soromox.systems.pcs.pcs import PCS
    from soromox.systems.pcs.structures import PCSStructure

    p, segments = ours.parameters, ours.model.segments
    link = LinkSpec.circular(
        length=p["tail_length"] / segments,
        density=p["tail_mass"] / (math.pi * RADIUS**2 * p["tail_length"]),
        reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        radius=RADIUS,
        stiffness=np.zeros((6, 6)),
    )
    structure = PCSStructure(
        strain_selector=jax.numpy.array([False, True, True, False, False, False] * segments)
    )
    gravity = jax.numpy.array([0.0, 0.0, -p["gravity"]])
    return PCS.from_links(
        [link] * segments, structure=structure, gravity=gravity, floating_base=True
    )


def compiled(rod, states: timing.States) -> tuple[Callable, Callable]:
    """Return calls of the rod's compiled dynamics: of one state, and of LOOP states one after the
    other.
    """
    import jax

    bends, length = states.q[:LOOP, 7:], float(rod.segment_length[0])
    attitude = states.q[:LOOP, [4, 5, 6, 3]]  # SoRoMoX: (x, y, z, w), then the position
    q = np.hstack([attitude, states.q[:LOOP, :3], bends / length])
    v = np.hstack([states.v[:LOOP, 3:6], states.v[:LOOP, :3], states.v[:LOOP, 6:] / length])
    many = jax.numpy.array(np.hstack([q, v]))
    rate = jax.jit(lambda y: rod.forward_dynamics(0.0, y))
    each = jax.jit(lambda rows: jax.lax.map(lambda y: rod.forward_dynamics(0.0, y), rows))
    if not np.isfinite(each(many)).all():
        raise ValueError("SoRoMoX's state derivative is not finite")
    first = many[0]
    return lambda: rate(first).block_until_ready(), lambda: each(many).block_until_ready()
