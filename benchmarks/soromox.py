"""Nanoseconds of a continuum's forward dynamics beside SoRoMoX's, one state, double, interleaved.

SoRoMoX (JAX): floating, constant curvature, bending alone, five Gauss points a segment, jax.jit on
the CPU; one call from Python, and one inside a compiled loop, where Python costs nothing. The
models differ: its rod has no torso, and its state derivative includes the rates of q.
"""

import importlib.util
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built, label, timed_function
from benchmarks.timing import States, best, random_states, time_rounds

SIZES = (1, 3, 6)
ROUNDS, CALLS, REPEATS, LOOP = 15, 256, 20, 64
RADIUS = 0.004  # m, of SoRoMoX's rod; ours has none
ABSENT = "SoRoMoX is not installed, and left out: .venv/bin/pip install --editable '.[soromox]'"


def measured(folder: Path) -> list[dict]:
    """Return a row for each number of segments; what to install, where SoRoMoX is missing."""
    if importlib.util.find_spec("soromox") is None:
        print(ABSENT, file=sys.stderr)
        return [{"left out": ABSENT}]
    return [row(folder, segments) for segments in SIZES]


def row(folder: Path, segments: int) -> dict:
    """Return the figures of one tail."""
    model, states = built(segments), random_states(segments)
    ours = timed_function(model, folder)
    call, loop = compiled(robot(model), states)
    times = []
    for _ in range(ROUNDS):
        single = time_rounds([ours.closure], states, 1, CALLS)[0]
        times.append((single, best(call, REPEATS), best(loop, REPEATS) / LOOP))
    ns, of_call, in_loop = np.min(times, axis=0)
    found = {"model": label(segments, None), "ns": ns, "SoRoMoX, a call, ns": of_call}
    found |= {"ratio": of_call / ns, "in a compiled loop, ns": in_loop}
    return found | {"ratio in a loop": in_loop / ns}


def robot(model: st.Model):
    """Return SoRoMoX's floating rod of the model's mass and length, without stiffness."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from soromox.systems.components.links import LinkSpec
    from soromox.systems.pcs.pcs import PCS
    from soromox.systems.pcs.structures import PCSStructure

    p, segments = model.parameters, model.segments
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


def compiled(rod, states: States) -> tuple[Callable, Callable]:
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
