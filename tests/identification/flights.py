"""Flights with markers, made without the room that they test: SciPy integrates, points are placed
by SciPy's rotations or lie on the model's own tail points.
"""

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import serpentail as st
from tests.support import zoo

TORSO = {"nose": (0.0, 0.05, 0.015), "left": (-0.025, -0.02, 0.02)}
TORSO |= {"right": (0.025, -0.02, 0.02), "back": (0.0, 0.0, 0.03)}
SPRINGS = {"tail_stiffness": 2e-3, "tail_damping": 5e-5, "tail_rest": 0.0}
SPRINGS |= {"tail_stop_lower": -3.0, "tail_stop_upper": 3.0}  # never reached


@cache
def elastic(name="elastic"):
    """Return a tail whose coordinates have equal springs and dampers, and no stops."""
    return zoo.model(name).with_parameters(**SPRINGS)


def start(model, seed=0):
    rng, nt = np.random.default_rng(seed), model.nq - 7
    quaternion = np.array([1.0, 0, 0, 0]) + 0.2 * rng.standard_normal(4)
    quaternion /= np.linalg.norm(quaternion)
    q = np.concatenate([[0, 0, 0.5], quaternion, 0.25 * rng.standard_normal(nt)])
    turning = [3 * rng.standard_normal(3), 4 * rng.standard_normal(nt)]
    return np.concatenate([q, [0.3, 0.5, 1.5], *turning])


def flown(model, times, x0, torque=None, rtol=1e-10):
    tau = torque or (lambda _t: np.zeros(model.nq - 7))
    how = {"rtol": rtol, "atol": 1e-2 * rtol, "max_step": 0.02, "t_eval": times}
    return solve_ivp(lambda t, x: model.x_dot(x, tau(t)), times[[0, -1]], x0, "DOP853", **how).y.T


def seen(model, states):
    """Return positions (F, M, 3) of the markers: four on the torso, one at each tail point."""
    q = states[:, : model.nq]
    turn = Rotation.from_quat(q[:, [4, 5, 6, 3]])
    torso = [turn.apply(np.array(place)) + q[:, :3] for place in TORSO.values()]
    return np.concatenate([np.stack(torso, axis=1), model.tail_points(q)[:, 1:]], axis=1)


def placed(model):
    points = len(model.tail_points(np.eye(1, model.nq, 3)[0])) - 1
    tail = {f"tail{k}": st.Marker(tail=k / points) for k in range(1, points + 1)}
    return {name: st.Marker(torso=place) for name, place in TORSO.items()} | tail


def tracks(model, times, states, noise=0.0, seed=1, gaps=0.0):
    rng, positions = np.random.default_rng(seed), seen(model, states)
    positions = positions + noise * rng.standard_normal(positions.shape)
    positions[rng.random(positions.shape[:2]) < gaps] = np.nan
    return st.marker_tracks(times, positions, list(placed(model)), unit="m")


def hidden(data, names, frames):
    positions = data.positions.copy()
    for name in names:
        positions[frames, data.names.index(name)] = np.nan
    return st.marker_tracks(data.times, positions, data.names, unit="m")


def scene(markers, *more):
    head = 'kind = "articulated"\nsegments = 1\nlinks = 1\nfunctions = ["energy"]\n'
    rows = "".join(
        f'[[identify.marker]]\nname = "{name}"\n'
        + (f"torso = {list(each.torso)}\n" if each.torso else f"tail = {each.tail}\n")
        for name, each in markers.items()
    )
    return head + "\n".join(more) + "\n" + rows
