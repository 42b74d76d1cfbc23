"""What our models of published animals and robots do: a function for each, by row."""

from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import serpentail as st

GRAVITY = 9.8  # m/s^2
TORQUE = 0.2  # N m, of Tailbot's tail: a guess, as in its scene
FLIP = 0.5  # s
REACTION = 0.105  # s, "just over 100 ms"
HERE = Path(__file__).parent
ROLL = 4  # of the torso's velocities in v
SIDEWAYS = np.pi / 2  # rad, pitch of a tail across the body: its yaw then turns it about the body
STEADY = 1e-10  # rtol
MOVED = 0.2  # by how much of its length a bone may be longer or shorter


def swing(model: st.Model, path: list, duration: float, attitude: list) -> st.Trajectory:
    """A flight from rest in which the tail passes pitches and yaws (n, 2), rad, from rest to rest
    in equal times; other chains stay straight. attitude: a quaternion.
    """
    angles = np.zeros((len(path), model.layout.nt))
    angles[:, :2] = path
    times = np.linspace(0, duration, len(path))
    law = st.Pfl(model, st.Reference(times, angles))
    q = np.concatenate([np.zeros(3), attitude, angles[0]])
    span = np.nextafter(duration, 0)  # there the reference ends
    how = {"t_span": span, "output_step": span / 200, "rtol": STEADY}
    return st.simulate(model, q, np.zeros(model.nv), controller=law, **how)


def about_x(angle: float) -> list[float]:
    """The quaternion of a pitch (rad)."""
    return [np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0]


def pitch_deg(motion: st.Trajectory) -> float:
    """The pitch at the end (deg), with turns."""
    return float(np.degrees(st.pitch_roll_yaw(motion.q, unwrap=True)[-1, 0]))


def turn_per_bend(bend: float, robot: st.Model) -> float:
    """How far a torso without angular momentum turns for each turn of its tail: two bodies at a
    pin, in a plane. Distances are from the pin, mu is the reduced mass.
    """
    p = robot.parameters
    masses = np.array([p["torso_mass"], p["tail_mass"]])
    mu, r, length = masses.prod() / masses.sum(), -p["tail_mount"][1], p["link_centers"][0]
    tail = p["link_inertias"][0] + mu * (length**2 + r * length * np.cos(bend))
    body = p["torso_inertia"][0] + mu * (r**2 + r * length * np.cos(bend))
    return -tail / (body + tail)


def template(folder: Path) -> dict[str, bool]:
    """A swing of Tailbot's tail by 2 rad: there, and to and fro."""
    robot = st.build("tailed_robot")
    expected = np.degrees(quad(turn_per_bend, -1, 1, robot, epsabs=1e-12)[0])
    path = [[-1, 0], [1, 0], [-1, 0]]
    there, both = (swing(robot, path[:n], 0.2, about_x(0)) for n in (2, 3))
    return {
        "closed": abs(pitch_deg(there) - expected) < 1e-6,
        "back": abs(pitch_deg(both)) < 1e-6,
    }


def tailbot(folder: Path) -> dict[str, float]:
    """From nose down until level, by a swing of the tail from 2 rad with the motor's torque."""
    robot = st.build("tailed_robot")
    end = brentq(lambda b: quad(turn_per_bend, -2, b, robot)[0] + np.pi / 2, -2, 6)
    path = [[2, 0], [-end, 0]]
    # at any speed the path is the same, and torques go with the square of speed
    slow = swing(robot, path, 1.0, about_x(-np.pi / 2))
    duration = np.sqrt(np.abs(slow.tau).max() / TORQUE)
    fast = swing(robot, path, duration, about_x(-np.pi / 2))
    fast.view(folder / "tailbot.html")
    tail = robot.parameters["tail_mass"]
    return {
        "mass": 1e3 * (robot.parameters["torso_mass"] + tail),
        "tail_mass": 1e3 * tail,
        "fall": GRAVITY * duration**2 / 2 if abs(pitch_deg(fast)) < 1 else np.inf,
    }


def squirrel(folder: Path) -> dict[str, bool]:
    """A planned flip of the robot; a light tail that takes over the body's roll."""
    robot = st.build(HERE / "squirrel.toml")
    q = np.array([0, 0, 0, 0, 0, 1.0, 0, 0.1, 0.1])  # on its back
    bounds = st.Bounds(torque=TORQUE)
    plan = st.plan(robot, start=(q, np.zeros(8)), duration=FLIP, bounds=bounds)
    plan.trajectory.view(folder / "squirrel.html")

    light = robot.parameters["torso_mass"] * 0.03 / 0.97 / robot.parameters["tail_mass"]
    moments = np.array(robot.parameters["link_inertias"]) * light
    masses = {"link_masses": [light * robot.parameters["tail_mass"]], "link_inertias": moments}
    animal = robot.with_parameters(**masses)
    q, v = np.r_[np.zeros(3), 1, np.zeros(3), SIDEWAYS, 0], np.zeros(8)
    v[ROLL] = rate = 4 * np.pi

    def law(_: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        """Keep the tail across the body, and let it take over the roll."""
        return [1e-2 * (SIDEWAYS - q[7]) - 1e-3 * v[6], -1e-3 * v[ROLL]]

    stopped = st.simulate(animal, q, v, controller=law, t_span=1.0)
    st.momentum_shares(animal, stopped).plot(folder / "squirrel_shares.png")
    return {"flip": plan.success, "light": bool(abs(stopped.v[-1, ROLL]) < rate / 20)}


def roll_inertias(model: st.Model) -> tuple[float, float]:
    """Roll inertia (kg m^2) of a gecko with its tail across, and what the tail's turn about the
    body's long axis has of it.
    """
    q, units = np.r_[np.zeros(3), 1, np.zeros(model.nq - 4)], np.eye(model.nv)
    q[7] = SIDEWAYS
    whole, tail = (model.momentum(q, units[k])[1][1] for k in (ROLL, 7))
    return float(whole), float(-tail)


def planar_sweep(p: dict, legs: tuple[str, ...], mass: float) -> float:
    """Sweep (deg) of a tail across the body that turns it by 180 deg, by hand and in a plane, with
    rods as legs. mass: of the tail, or the reduced mass.
    """
    tail, body = p["link_inertias"][0] + mass * p["link_centers"][0] ** 2, p["torso_inertia"][1]
    for leg in legs:
        out = p[f"{leg}_mount"][0] + p[f"{leg}_link_centers"][0]
        body += 2 * (p[f"{leg}_link_inertias"][0] + p[f"{leg}_mass"] * out**2)
    return 180 * (1 + body / tail)


def gecko(folder: Path) -> dict[str, float | bool]:
    """A rigid tail across the body swings about its long axis, with legs and without."""
    legged, bare = st.build("gecko_legs", links=1), st.build("gecko_legs", links=1, chain={})
    p = legged.parameters
    legs = 2 * (p["hind_mass"] + p["fore_mass"])
    (whole, tail), (whole_bare, tail_bare) = roll_inertias(legged), roll_inertias(bare)
    body, sweep, sweep_bare = (
        p["torso_inertia"][1],
        np.pi * whole / tail,
        180 * whole_bare / tail_bare,
    )

    # the axis fixed: the tail's own mass counts; free: the reduced mass, as by hand
    m = p["tail_mass"]
    fixed = tail + m**2 / (p["torso_mass"] + m + legs) * p["link_centers"][0] ** 2
    fixed_bare = tail_bare + m**2 / (p["torso_mass"] + m) * p["link_centers"][0] ** 2
    by_hand = [
        planar_sweep(p, names, m * rest / (rest + m))
        for names, rest in ((("hind", "fore"), p["torso_mass"] + legs), ((), p["torso_mass"]))
    ]

    on_its_back = [0.0, 0.0, 1.0, 0.0]
    path = [[SIDEWAYS, -sweep / 2], [SIDEWAYS, sweep / 2]]
    motion = swing(legged, path, REACTION, on_its_back)
    motion.view(folder / "gecko.html")
    shares = st.momentum_shares(legged, motion)
    upright = st.rotation_matrix(motion.attitude[-1])[2, 2]
    return {
        "legs_mass": 100 * legs / (p["torso_mass"] + p["tail_mass"] + legs),
        "legs_inertia": 100 * (1 - body / (whole - tail)),
        "sweep": float(np.degrees(sweep)),
        "sweep_bare": sweep_bare,
        "fixed": 180 * (1 + (whole - tail) / fixed),
        "fixed_bare": 180 * (1 + (whole_bare - tail_bare) / fixed_bare),
        "reduced": bool(np.allclose(by_hand, [np.degrees(sweep), sweep_bare], rtol=1e-9)),
        "tail": bool(upright > np.cos(np.radians(30))),
        "alone": bool(shares.turns["tail"][-1, 1] > 0.95 * shares.turned[-1, 1] > 0),
        "torque": 1e3 * float(np.abs(motion.tau[:, :2]).max()),
    }


def joints(folder: Path) -> dict[str, float | bool]:
    """Efforts of one turn by tails of one to four joints of two axes, of equal length and mass; the
    best place of the joint between two bones.
    """
    turn = Rotation.from_euler("ZXY", [30, 20, 40], degrees=True).as_quat(scalar_first=True)
    task = {"goal": st.Goal(attitude=turn), "duration": 0.3}
    task["bounds"] = st.Bounds(torque=0.05, angle="90 deg")
    task["tolerances"] = st.Tolerances(attitude=None, through_torso=True)
    task["solver"] = st.Solver(track=False, multi_start=2)
    efforts, motions = [], {}
    for count in range(1, 5):
        rat = st.build(tail="articulated", segments=count, links=1, purpose=["plan"])
        plan = st.plan(rat, start=rat.state(bends=[[0.1, 0.1]] * count), **task)
        efforts.append(plan.report["effort"] if plan.success else np.nan)
        motions[f"{count} joints"] = plan.trajectory
    st.view(list(motions.values()), folder / "joints.html", names=list(motions))
    saved = -np.diff(efforts)

    length, mass = rat.parameters["tail_length"], rat.parameters["tail_mass"]
    bones = [{"links": 1, "length": length / 2, "mass": mass / 2}] * 2
    rat = st.build(tail="articulated", segments=bones, purpose=["plan"])
    start = rat.state(bends=[[0.1, 0.1]] * 2)
    ends = tuple([length / 2 * (1 + moved)] * 2 for moved in (-MOVED, MOVED))
    free = {"design": {"link_lengths": ends}, "design_totals": {"link_lengths": length}}
    free["guess"] = st.plan(rat, start=start, **task)
    best = st.plan(
        rat, start=start, **task | {"solver": st.Solver(track=False, multi_start=3)}, **free
    )
    first, second = best.design["link_lengths"]
    return {
        "help": bool((saved > 0).all()),
        "returns": bool((np.diff(saved) < 0).all()),
        "lengths": first / second if best.success else np.nan,
    }


def yaw(folder: Path) -> dict[str, bool]:
    """A planned yaw of 45 degrees in 0.5 s, from rest to rest and upright."""
    rat = st.build("righting_m1_n3")
    start = rat.state(bends=[[0.3, 0.3]])
    goal = st.Goal(attitude=[np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)])
    bounds = st.Bounds(torque="20 mN m", angle="60 deg")
    solver = st.Solver(track=False, retries=2)
    plan = st.plan(rat, start=start, goal=goal, duration=0.5, bounds=bounds, solver=solver)
    times = np.linspace(0, 0.5, 401)
    motion = plan.trajectory.resample(times)
    motion.view(folder / "yaw.html", model=rat)

    # the tail's centre of mass by that of the animal, both seen from the torso's
    p = rat.parameters
    com = rat.center_of_mass(motion.q, motion.v)[0] - motion.q[:, :3]
    x, y, _ = (com * (p["torso_mass"] + p["tail_mass"]) / p["tail_mass"]).T
    away, swing_rate = np.hypot(x, y), np.abs(np.gradient(np.unwrap(np.arctan2(y, x)), times))
    omega = st.rotation_matrix(motion.attitude) @ motion.v[:, 3:6, None]
    rate, near = np.abs(omega[:, 2, 0]), away < np.median(away)
    parts = st.momentum_shares(rat, motion).momentum
    changes = [np.gradient(parts[name][:, 2], times) for name in ("torso", "tail")]
    return {
        "stepwise": bool(rate[near].mean() < rate[~near].mean() / 2),
        "lever": bool(np.corrcoef(rate, swing_rate * away**2)[0, 1] > 0.99),
        "proportional": bool(abs(np.corrcoef(*changes)[0, 1]) > 0.95),
    }
