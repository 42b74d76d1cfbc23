"""What our models of published animals and robots do in air, and on a load cell: by row."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import serpentail as st
from examples.gallery_data.systems import GRAVITY, HERE, SIDEWAYS, about_x, pitch_deg, swing

WIND = 20.0  # m/s, of the wind tunnel
SPEEDS = (10.0, 20.0, 30.0)  # m/s, of the run
RAISED = 0.2  # s, in which the cheetah's tail swings up by 90 deg
BARE = 0.031  # m, thickness of its tail without fur
SWEEP = np.radians(270)  # of Minitaur's tail
FALL = 0.4  # m, the length of its body
FACTORS = (0.3, 4.0)  # of the tail's mass
SHAPE = np.array([[0.5, 0.2], [0.3, -0.4], [-0.2, 0.5]])  # rad, of each joint of three segments
JOINTS = 4  # of a segment
TIMES = np.linspace(0, 1, 2001)  # s, of the swing on the load cell; shares of other swings
UNEQUAL = 0.05  # by which joints of a segment bend unequally


def eased(share: np.ndarray) -> list[np.ndarray]:
    """The way from 0 to 1 and its two derivatives, at shares (n,) of the time; smooth ends."""
    turn = 2 * np.pi
    s, c = np.sin(turn * share), np.cos(turn * share)
    return [share - s / turn, 1 - c, turn * s]


def wrench(model: st.Model, angles: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment (n, 3) of the tail on a torso that is held, along angles (n, nt) and their
    two derivatives.
    """
    n, nt = angles[0].shape
    torso = np.zeros((n, model.nq - nt))
    torso[:, 3:4] = 1
    rest = np.zeros((n, model.nv - nt))
    v, v_dot = (np.hstack([rest, each]) for each in angles[1:])
    return model.mount_wrench(np.hstack([torso, angles[0]]), v, v_dot)


def cheetah(folder: Path) -> dict[str, float | bool]:
    """A tail across the wind with fur and without; its swing up while the animal runs."""
    furry = st.build(HERE / "cheetah.toml")
    p, tail = furry.parameters, furry.with_parameters(gravity=0.0)

    def drag(width: float) -> float:
        """Drag of a tail across the wind."""
        pose = [np.array([[0, SIDEWAYS]]), np.zeros((1, 2)), np.zeros((1, 2))]
        blown = tail.with_parameters(wind=[0, -WIND, 0], tail_widths=[width, width])
        return float(-wrench(blown, pose)[0][0, 1])

    up = [np.outer(way, [-np.pi / 2, 0]) / RAISED**k for k, way in enumerate(eased(TIMES))]

    def impulse(density: float, speed: float) -> np.ndarray:
        """Angular impulse (n,) of the swing on the body about its centre, up to each moment."""
        running = tail.with_parameters(air_density=density, wind=[0, -speed, 0])
        force, moment = wrench(running, up)
        return np.cumsum(moment[:, 0] + p["tail_mount"][1] * force[:, 2])

    inertia = impulse(0.0, 0.0)
    airs = [abs((impulse(p["air_density"], speed) - inertia)[-1]) for speed in SPEEDS]
    parts = [100 * air / np.abs(inertia).max() for air in airs]
    return {
        "mass": 100 * p["tail_mass"] / (p["tail_mass"] + p["torso_mass"]),
        "fur": drag(p["tail_widths"][0]) / drag(BARE),
        "impulse": bool(all(a < b for a, b in pairwise(parts)) and parts[-1] > 10),
        "share": parts[-1],
    }


def minitaur(folder: Path) -> dict[str, float | bool]:
    """Swings of a drag tail, and of an inertial tail of the same form, that turn the robot by 90
    degrees in its fall.
    """
    robot = st.build(HERE / "minitaur.toml")
    duration = np.sqrt(2 * FALL / GRAVITY)

    def turned(factor: float, density: float) -> st.Trajectory:
        """The swing of a tail with so many times the mass."""
        masses = {
            name: factor * np.array(robot.parameters[name])
            for name in ("link_masses", "link_inertias")
        }
        body = robot.with_parameters(**masses, air_density=density)
        return swing(body, [[SWEEP / 2, 0], [-SWEEP / 2, 0]], duration, about_x(0))

    def enough(density: float) -> float:
        """How many times the tail's mass turns the robot by 90 degrees."""
        return brentq(lambda f: pitch_deg(turned(f, density)) - 90, *FACTORS, xtol=1e-4)

    air = robot.parameters["air_density"]
    drag, inertial = enough(air), enough(0.0)
    motions = {"drag tail": turned(drag, air), "inertial tail": turned(inertial, 0.0)}
    st.view(list(motions.values()), folder / "minitaur.html", names=list(motions))
    return {"turn": bool(drag < inertial), "inertia": 100 * drag / inertial}


def load_cell(folder: Path) -> dict[str, bool]:
    """A tail of three segments swings on a bench; the same with joints of their own."""
    links = {"tail": "articulated", "base": "fixed"}
    bench = st.build(segments=3, links=JOINTS, **links)
    loose = st.build(segments=3 * JOINTS, links=1, **links)
    angles = [np.outer(way, SHAPE.ravel()) for way in eased(TIMES)]
    force, moment = wrench(bench, angles)

    # the changes of the tail's momentum, by differences in time of order 4
    q, v = angles[:2]
    linear, angular = bench.momentum(q, v)
    com = bench.center_of_mass(q, v)[0] - bench.parameters["tail_mount"]
    weight = bench.parameters["tail_mass"] * np.array([0, 0, -bench.parameters["gravity"]])
    pull = weight - rates(linear)
    turn = np.cross(com, weight) - rates(angular + np.cross(com, linear))
    pairs = [(force, pull), (moment, turn)]
    off = max(np.abs(a - b)[2:-2].max() / np.abs(a).max() for a, b in pairs)

    # joints of a segment that bend by more and less, with the same sum
    unequal = 1 + UNEQUAL * np.array([1, -1, 1, -1])
    bent = [np.einsum("nsk,j->nsjk", a.reshape(-1, 3, 2), unequal) for a in angles]
    other = wrench(loose, [a.reshape(len(TIMES), -1) for a in bent])[1]
    return {
        "reads": bool(off < 1e-6),
        "uniform": bool(np.abs(other - moment).max() < UNEQUAL * np.abs(moment).max()),
    }


def rates(values: np.ndarray) -> np.ndarray:
    """Time derivatives of values (n, 3) at TIMES; wrong at the first two and the last two."""
    ahead = [np.roll(values, -k, axis=0) - np.roll(values, k, axis=0) for k in (1, 2)]
    return (8 * ahead[0] - ahead[1]) / (12 * TIMES[1])
