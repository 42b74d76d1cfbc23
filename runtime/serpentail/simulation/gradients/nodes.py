"""What moves the nodes of a tape: kinks of the force of a point, and breaks of schedules.

The steps between two such nodes keep their shares of the time. That matters: after a touch the
force grows as a root of the depth, and steps that stayed where they are would see its slope wrong.
Where a point touches, ceases to press or begins to slide, a margin changes its sign; there the tape
gets a node before and one after.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from serpentail_scene.layout import QUATERNION

if TYPE_CHECKING:
    from .tape import Tape

BREAK, KINK, LANDING = 1, 2, 3  # as in the generated C
HEIGHT, PRESSING, SLIDING = range(3)  # margins of a point
ASIDE = 1e-3  # of a step: how far from a kink the nodes at its sides are
SHALLOW = 2e-6  # m: a contact that is not deeper is a graze
TRIALS, TOGETHER = 3, 4  # of the search for a kink; decimals of a step that tell two kinks apart


@dataclass(frozen=True, eq=False)
class NodeMoves:
    """What moves each node.

    kinds (nodes,) as in C; ties (nodes, 3 points): weights of margins; sides (nodes, points, 2): of
    each step, positive where a point presses, and where it slides; sunk (nodes,): whether one is in
    the ground. grazes, doubts: in words; with a graze there is no derivative.
    """

    kinds: np.ndarray
    ties: np.ndarray
    sides: np.ndarray
    sunk: np.ndarray
    grazes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def moves_of(tape: "Tape") -> NodeMoves:
    """Return what moves the nodes of a tape, which gets nodes at kinks."""
    points, grazes, doubts = tape.ground.points, [], []
    tied, which, at = np.zeros(0, int), np.zeros(0, int), np.zeros((len(tape.times), 0, 3))
    if points:
        at = margins(tape, tape.times, tape.nodes["states"])
        grazes = [*_grazes(tape, at)]
        tied, which, at = _insert(tape, at)
    times, landed, legs = tape.times, tape.landed_at, tape.ground.legs
    kinds, ties = np.zeros(len(times), np.intc), np.zeros((len(times), 3 * points))
    kinds[np.isin(times, tape.run.actuation.stops)] = BREAK
    kinds[tied], ties[tied, which] = KINK, 1
    if legs is not None and legs.landing is not None and landed <= times[-1]:
        node = np.searchsorted(times, landed)
        kinds[node], ties[node] = KINK, ties[tied[tied <= node].max()]
        kinds[times == landed + legs.landing.times[1]] = LANDING
    kinds[[0, -1]] = 0
    for node in np.flatnonzero(ties.sum(axis=1) > 1):
        ends = " and ".join(str(k // 3) for k in np.flatnonzero(ties[node]))
        doubts.append(
            f"points {ends} change their contact at once, at t = {times[node]:.6g} s: a change "
            "that parts them is followed to 1e-3 only"
        )
    ties /= np.maximum(ties.sum(axis=1), 1)[:, None]
    sides = at[..., PRESSING:].copy()
    sides[:-1] += at[1:, :, PRESSING:]
    sunk = (at[..., HEIGHT] <= 0).sum(axis=1, dtype=np.intc)
    sunk[:-1] += sunk[1:]
    return NodeMoves(kinds, ties, sides, sunk, tuple(grazes), tuple(doubts))


def margins(tape: "Tape", t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the margins (n, points, 3) of states y (n, size) at times t (n,)."""
    nq, n = tape.model.nq, tape.model.nq + tape.model.nv
    state = map(np.ascontiguousarray, (y[:, :nq], y[:, nq:n], y[:, n:]))
    return tape.model.kernel("margins")(*state, *tape.ground.legs_at(t, tape.landed_at))


def _grazes(tape: "Tape", at: np.ndarray) -> list[str]:
    """Return in words where points hardly touch, or pass above the ground closer than is known."""
    found, z = [], at[..., HEIGHT]
    for i, k in np.argwhere((z[:-1] > 0) & (z[1:] <= 0)):
        out = np.flatnonzero(z[i + 1 :, k] > 0)
        deepest = -z[i + 1 : i + 1 + out[0] if len(out) else None, k].min()
        if deepest < SHALLOW:
            found.append(f"point {k} grazes the ground at t = {tape.times[i]:.6g} s")
    record = tape.run.record
    if record.near_error > 0:
        where = f"point {record.near_point} passes {record.near_height:.2g} m above the ground"
        found.append(f"{where} at t = {record.near_time:.6g} s, closer than is known")
    return found


def _insert(tape: "Tape", at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give each kink a node before and one after; returns the first ones, 3 point + margin of each,
    and the margins of all nodes.
    """
    i, which, x = _kinks(tape, at)
    if not len(i):
        return i, which, at
    before, after = (i + np.clip(x + side, 0, 1) for side in (-ASIDE, ASIDE))
    new = np.unique(np.concatenate([before, after]))
    new = new[new != np.floor(new)]
    step = np.floor(new).astype(int)
    y = _between(tape, step, new - step)
    y[:, QUATERNION] /= np.linalg.norm(y[:, QUATERNION], axis=1)[:, None]
    t = tape.times[step] + (new - step) * np.diff(tape.times)[step]
    made = {"times": t[:, None], "untils": tape.nodes["untils"][step], "states": y}
    made |= {"rates": np.nan * y}  # not known
    places = np.concatenate([np.arange(len(tape.times)), new])
    order = np.argsort(places)
    for name, array in tape.nodes.items():
        tape.nodes[name] = np.concatenate([array, made[name]])[order]
    at = np.concatenate([at, margins(tape, t, y)])[order]
    return np.searchsorted(places[order], before), which, at


def _kinks(tape: "Tape", at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return step, 3 point + margin and fraction of the step of each kink: where a point touches,
    and in the ground where it ceases to press, and where it begins to slide or ends.
    """
    inside = (at[:-1, :, HEIGHT] < 0) & (at[1:, :, HEIGHT] < 0)
    found = ((at[:-1] > 0) != (at[1:] > 0)) & inside[..., None]
    found[..., HEIGHT] = (at[:-1, :, HEIGHT] > 0) & (at[1:, :, HEIGHT] <= 0)
    if tape.model.manifest["scene"]["friction"] != "cone":
        found[..., SLIDING] = False
    i, which = np.nonzero(found.reshape(len(found), -1))

    # regula falsi, Illinois
    flat, low, high = at.reshape(len(at), -1), np.zeros(len(i)), np.ones(len(i))
    left, right = flat[i, which], flat[i + 1, which]
    for _ in range(TRIALS if len(i) else 0):
        x = low + (high - low) * left / (left - right)
        t = tape.times[i] + x * (tape.times[i + 1] - tape.times[i])
        values = margins(tape, t, _between(tape, i, x)).reshape(len(i), -1)
        new = values[np.arange(len(i)), which]
        late = (new > 0) == (right > 0)
        low, high = np.where(late, low, x), np.where(late, x, high)
        left, right = np.where(late, left / 2, new), np.where(late, new, right / 2)
    return i, which, np.round(low + (high - low) * left / (left - right), TOGETHER)


def _between(tape: "Tape", i: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return states (n, size) at fractions x (n,) of steps i (n,), by cubics through both ends."""
    y, f, h, x = (
        tape.nodes["states"],
        tape.nodes["rates"],
        np.diff(tape.times)[i][:, None],
        x[:, None],
    )
    early = (1 - x) ** 2 * ((1 + 2 * x) * y[i] + x * h * f[i])
    return early + x**2 * ((3 - 2 * x) * y[i + 1] - (1 - x) * h * f[i + 1])
