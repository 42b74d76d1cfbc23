"""Nanoseconds of one forward dynamics call from C, beside peers, rounds interleaved.

Pinocchio: the full chain of 2 m n joints, reduced, as its documentation shows it, and with all that
was found to speed it up (pinocchio_tuned.cpp). MuJoCo: the same of hinges. CasADi: C of the
generated SX function, -O2. serpentail by clang: ours, which is compiled as for users, by the peers'
clang. Ratio: how many times as long as ours. Difference: largest relative one of the results.
"""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import FD, built, by_clang, label, timed_function
from benchmarks.peers import casadi, mujoco, pinocchio
from benchmarks.timing import compared, random_states

PER_PROCESSOR = True
PROCESSES = 3
SIZES = ((1, 3), (3, 4), (6, 6), (8, 16))
IN_MUJOCO, IN_CASADI = SIZES[:3], SIZES[:2]  # compilers take minutes for longer tails


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    return [row(folder, size) for size in SIZES]


def row(folder: Path, size: tuple[int, int]) -> dict:
    """Return the times of one tail and its peers."""
    model, states = built(*size), random_states(size[0])
    ours = timed_function(model, folder)
    with ExitStack() as freed:
        peers: dict = pinocchio.chains(freed, model, FD)
        errors = [
            difference(model, each, states) for made in peers.values() for each in made.values()
        ]
        if size in IN_MUJOCO:
            peers["MuJoCo"] = mujoco.chains(freed, model, folder)
            errors += [chain.difference(states) for chain in peers["MuJoCo"].values()]
        if size in IN_CASADI:
            peers["CasADi"] = casadi.in_casadi("fd", casadi.acceleration(model), model, folder)
        peers["serpentail by clang"] = by_clang(model, folder, FD)
        found = compared(ours, peers, states)
    return {"model": label(*size)} | found | {"difference": max(errors)}


def difference(model: st.Model, peer: pinocchio.PinocchioChain, states) -> float:
    """Return the largest relative difference of the two results."""
    errors = []
    for state in zip(*states, strict=True):
        a, b = model.forward_dynamics(*state), peer.forward_dynamics(*state)
        errors.append(np.abs(a - b).max() / np.abs(a).max())
    return max(errors)
