"""Figs. 7 and 8, the comparison of tails (Sect. 4.1): the tail swings, the torso yaws."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st
from examples.paper.figures import draw_figure_8

STEPS = 400
FULL_TURN = np.arctan(np.pi / 2)  # rad, COM direction of an arc bent by pi
SHOWN = 4  # links of the tail in Fig. 8a, the one that differs most
THIN = (0.0, 0.0, 0.0)  # kg m^2: links are lines, like the continuum
FUNCTIONS = ["mass_matrix", "tail_points", "energy", "momentum"]
LINKS = (2, 3, 4, 5, 6, 8, 16, 32, 64)
HEIGHT = 0.1  # m, of B on the page
MOST_BEND = 1.5 * np.pi  # rad, more than any tail needs for it


def com_directions(steps: int = STEPS) -> np.ndarray:
    """Return the tail COM's direction theta_com (steps + 1,), rad, at equal times: 0 to atan(pi /
    2), a cubic.
    """
    s = np.linspace(0, 1, steps + 1)
    return FULL_TURN * (3 * s**2 - 2 * s**3)


def arc_direction(bend: np.ndarray) -> np.ndarray:
    """Return theta_com (rad) of an arc bent by `bend` (rad), Eq. 49."""
    return np.arctan2(bend - np.sin(bend), 1 - np.cos(bend))


def chain_direction(bend: np.ndarray, links: int) -> np.ndarray:
    """Return theta_com (rad) of equal links that are bent by `bend` (rad) in all, each by bend /
    n.
    """
    angles = np.multiply.outer(bend, np.arange(1, links + 1) / links)
    reach = (
        links + 0.5 - np.arange(1, links + 1)
    )  # weight of each link's bend: half for the link itself, one for each link after it
    return np.arctan2(np.sin(angles) @ reach, np.cos(angles) @ reach)


def bend_towards(direction: Callable, targets: np.ndarray) -> np.ndarray:
    """Return the bends (rad) at which the COM has the target directions (rad), by bisection."""
    low, high = np.zeros_like(targets), np.full_like(targets, MOST_BEND)
    for _ in range(60):
        middle = (low + high) / 2
        short = direction(middle) < targets
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return (low + high) / 2


def angles_of(model: st.Model) -> np.ndarray:
    """Return the yaw coordinates (STEPS + 1,), rad, of Sect. 4.1's motion of a tail of one
    segment.
    """
    if model.links is None:
        return bend_towards(arc_direction, com_directions())
    links = model.links
    return bend_towards(lambda bend: chain_direction(bend, links), com_directions()) / links


def torso_swung(model: st.Model) -> np.ndarray:
    """Return the configurations (STEPS + 1, nq) of Sect. 4.1's motion; B stays where it is drawn.

    Zero momentum is H_bb v_b + H_bt q_t_dot = 0 (upper rows of Eq. 1): only the path matters, not
    its timing.
    """
    angles = angles_of(model)
    q = np.zeros((len(angles) - 1, model.nq))
    q[:, 3], q[:, 8] = 1.0, (angles[1:] + angles[:-1]) / 2
    H = model.mass_matrix(q)
    turns = -np.linalg.solve(H[:, :6, :6], H[:, :6, 7:8])[:, 3:, 0] * np.diff(angles)[:, None]
    attitude = [Rotation.identity()]
    for turn in turns:
        attitude.append(attitude[-1] * Rotation.from_rotvec(turn))
    q = np.zeros((len(angles), model.nq))
    q[:, 2], q[:, 8] = HEIGHT, angles
    q[:, 3:7] = [rotation.as_quat(scalar_first=True) for rotation in attitude]
    return q


def yaw_motion(model: st.Model) -> np.ndarray:
    """Return the torso's yaw phi_z (STEPS + 1,), deg, in Sect. 4.1's motion."""
    return np.degrees(st.pitch_roll_yaw(torso_swung(model))[:, 2])


def swing(folder: Path) -> dict:
    """Draw Fig. 8 and write its page; return the values of Figs. 7 and 8."""
    arc, *chains = (built(links) for links in (None, *LINKS))
    end, rows = yaw_motion(arc)[-1], []
    for links, model in zip(LINKS, chains, strict=True):
        thin = yaw_motion(model.with_parameters(link_inertia=THIN))[-1] - end
        row = {"links": links, "difference": yaw_motion(model)[-1] - end, "thin_difference": thin}
        rows.append(row)
    shown = chains[LINKS.index(SHOWN)]
    study = {"articulated": rows, "time": np.linspace(0, 1, STEPS + 1)}
    study |= {"continuum": yaw_motion(arc), "shown": yaw_motion(shown)}
    draw_figure_8(study, folder / "fig8.png")
    st.view([as_motion(arc), as_motion(shown)], folder / "fig8.html")

    sizes = {row["links"]: abs(row["difference"]) for row in rows}
    most, apart = max(sizes, key=sizes.__getitem__), com_directions() - seen_directions(shown)
    full = np.degrees(arc_direction(angles_of(arc)[-1]))
    return {
        "fig7": {"direction": float(full), "same": bool(np.abs(apart).max() < np.radians(1e-6))},
        "fig8": {"most": sizes[most], "links": most, "tends": bool(sizes[64] < sizes[most] / 5)},
    }


def built(links: int | None) -> st.Model:
    """Return a tail of one segment with what this comparison takes; a continuum for no links."""
    tail = {"tail": "articulated", "links": links} if links else {"tail": "continuum"}
    return st.build(segments=1, functions=FUNCTIONS, **tail)


def seen_directions(model: st.Model) -> np.ndarray:
    """Return where the COM of a tail of links is seen from its mount (STEPS + 1,), rad."""
    q = np.zeros((STEPS + 1, model.nq))
    q[:, 3], q[:, 8] = 1.0, angles_of(model)
    joints = model.tail_points(q)
    com = ((joints[:, 1:] + joints[:, :-1]) / 2).mean(axis=1) - joints[:, 0]
    return np.arctan2(com[:, 0], -com[:, 1])


def as_motion(model: st.Model) -> st.Trajectory:
    """Return the swing as a motion of 1 s that stands still at each sample."""
    q = torso_swung(model)
    v, tau = np.zeros((len(q), model.nv)), np.zeros((len(q), model.nu))
    told = (*model.energy(q, v), *model.momentum(q, v))
    return st.Trajectory(np.linspace(0, 1, len(q)), q, v, tau, *told, model=model)
