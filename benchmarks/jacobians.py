"""Nanoseconds of the Jacobians of v_dot from (q, v, tau), v_dot included, rounds interleaved.

Pinocchio, full chain of 2 m n revolutes: v_dot, computeRNEADerivatives there, G^T (...) G,
Cholesky; as its documentation shows it, and with all that was found to speed it up
(pinocchio_tuned.cpp). CasADi: C of the SX graph of -H^-1 dID, cse, -O2, with the columns of a turn
written by hand; it writes no column that is zero throughout. Differences: of the documented path,
which loses two digits as B is a metre from the origin; the largest of the others.
"""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import DFD, built, by_clang, label, timed_function
from benchmarks.peers import casadi, pinocchio
from benchmarks.timing import States, compared, random_states

PER_PROCESSOR = True
PROCESSES = 3
SIZES = ((1, 3), (3, 4), (6, 6))
ROUNDS, CALLS = 200, 64


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    return [row(folder, size) for size in SIZES]


def row(folder: Path, size: tuple[int, int]) -> dict:
    """Return the times of one tail and its peers."""
    model, states = built(*size, functions=[*casadi.IN_SX, DFD]), random_states(size[0])
    ours = timed_function(model, folder, DFD)
    in_casadi = casadi.in_casadi("by_hand", casadi.jacobians(model), model, folder)
    with ExitStack() as freed:
        chains = pinocchio.chains(freed, model, DFD)
        clang = by_clang(model, folder, DFD)
        peers = {**chains, "CasADi": in_casadi, "serpentail by clang": clang}
        found = compared(ours, peers, states, ROUNDS, CALLS)
        plain, tuned = (
            [of_pinocchio(model, each, states) for each in made.values()]
            for made in chains.values()
        )
    tuned += [of_casadi(model, each, states) for each in in_casadi.values()]
    worst = {"difference of Pinocchio": max(plain), "of the others": max(tuned)}
    return {"model": label(*size)} | found | worst


def of_pinocchio(model: st.Model, peer: pinocchio.PinocchioChain, states: States) -> float:
    """Return the largest difference in the rows of omega and the tail, whose columns are the same
    relative to the torso.
    """
    errors = []
    for state in zip(*states, strict=True):
        both = zip(model.forward_dynamics_derivatives(*state), peer.jacobians(*state), strict=True)
        for (ours, theirs), first in zip(both, (6, 3, 0), strict=True):
            errors.append(difference(ours[3:, first:], theirs[3:, first:]))
    return max(errors)


def of_casadi(model: st.Model, peer: casadi.InCasadi, states: States) -> float:
    """Return the largest difference of all entries that are not zero."""
    nt, errors = model.nv - 6, []
    for state in zip(*states, strict=True):
        dq, dv, dtau = model.forward_dynamics_derivatives(*state)
        rest, turn = peer(*state)
        of_q, of_v, of_tau = np.hsplit(rest, (nt, 2 * nt + 3))
        turn = np.vstack([turn, np.zeros((model.nv - len(turn), 3))])
        pairs = [(dq[:, 3:], np.hstack([turn, of_q])), (dv[:, 3:], of_v), (dtau, of_tau)]
        errors += [difference(*pair) for pair in pairs]
    return max(errors)


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest difference of two blocks, relative to the largest entry."""
    return float(np.abs(a - b).max() / np.abs(a).max())
