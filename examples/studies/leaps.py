"""Jumps of random animals that are made for their landing: ``st.optimise``."""

import json
import time
from functools import partial
from math import cos, pi, radians, sin
from pathlib import Path

import numpy as np

import serpentail as st
from examples.front import ROOT
from examples.studies.landing import DELTA, GAMMA, SOURCES, SPREAD, VARIED, settled
from examples.studies.landing_judged import SETTINGS, model_of
from examples.studies.parts import Part, digest, made

BODIES, SEED, RISES = 20, 12, (0.2, 0.35)
LIMBED, LOWER = 10, (0.08, 0.2)  # bodies with legs of mass, and their rises (m)
LENGTHS, MASSES = np.linspace(0.1, 0.25, 5), np.linspace(2e-3, 10e-3, 6)  # m, kg, of tails
TAIL = {"tail": "articulated", "segments": 1, "links": 3}
LIMITS = {"push": 25.0, "landing": 25.0, "tilt": radians(60), "spin": 4e-4}
# N m, of the scene rat_kick: half of a jerboa's; the signs stretch the legs
STRETCHING = [0, 0, *[-0.0712, 0.0693, -0.0621] * 2]
TORQUES = {"hind_hip": 0.0712, "hind_knee": 0.0693, "hind_ankle": 0.0621}
BONES = ("hind_link_lengths", "hind_link_centers")
CROUCHED = [0, 0, *np.radians([50, -105, 137, 50, -105, 137])]  # rad, the stops of rat_kick
TIME = 1200.0  # s, for a machine with other work: the CPU time is counted
# first guesses by hand: a crouch that puts the body over its feet, or beside them, so that the push
# stays in the cone of friction; a push that grows to its end; legs that yield to rest
CROUCH = {"at": 0.02, "gamma": radians(180), "delta": radians(-35), "duration": 0.07}
PUSH = {"at": 0.16, "gamma": radians(280), "delta": radians(-80), "duration": 0.042}
STRETCH = {"before_landing": 0.12, "gamma": radians(225), "delta": radians(-65), "duration": 0.08}
YIELD = {"at": "touch_down", "gamma": radians(225), "delta": radians(-20), "duration": 0.024}


def leap(model: st.Model, pitch: float = 5.0, torque: float = 0.02) -> st.Sequence:
    """Return the first guess of a jump that lands at a pitch (deg), the tail up and at rest.

    The tail's yaw is held, so that a flight whose attitude is free stays in its plane.
    """
    half = radians(pitch) / 2
    goal = st.Goal([cos(half), sin(half), 0.0, 0.0], None, [radians(-20), 0.0], [0.0, 0.0])
    bounds = st.Bounds(angle=(pi / 3, 1e-3), torque=torque)
    plan = {"goal": goal, "bounds": bounds, "solver": st.Solver(track=False, time_limit=20.0)}
    clear = {"until": "airborne", "clearance": 0.01, "controller": st.Damping(1e-3)}
    pushes = [CROUCH | {"shape": "quintic"}, PUSH | {"shape": "accelerate"}]
    phases = [
        st.Phase("push", 1.0, moves=pushes, **clear),
        st.Phase("flight", 1.5, until="landing", plan=plan, moves=[STRETCH]),
        st.Phase("land", 1.0, controller=st.Damping(5e-3), moves=[YIELD | {"shape": "decelerate"}]),
    ]
    return st.Sequence(model, phases, GAMMA, DELTA, SETTINGS)


def limbed() -> st.Model:
    """Return the rat of rat_kick, with exact derivatives for its plans."""
    return st.build("rat_kick", purpose=["plan"])


def limbed_leap(model: st.Model) -> st.Sequence:
    """Return the first guess of a jump by torques: half of the largest ones push, and half of them
    let the legs yield to the crouch.
    """
    angles = {"tail": pi / 3, "beta_1": 1e-3, "hind": 2.5}
    bounds = st.Bounds(angle=angles, torque={"tail": 0.02} | TORQUES)
    ends = {"tail": [radians(-20), 0.0], "hind": np.radians([20, -45, 55])}
    goal = st.Goal(torso_rate=None, chains=ends, chain_rates={"tail": 0.0, "hind": 0.0})
    plan = {"goal": goal, "bounds": bounds, "solver": st.Solver(track=False, time_limit=20.0)}
    push = st.TorqueTable([0, 0.02, 0.04, 0.05], np.outer([0, 0.5, 0.5, 0], STRETCHING))
    land = st.TorqueTable([0, 0.03, 0.05], np.outer([0.5, 0.5, 0], STRETCHING))
    phases = [
        st.Phase("push", 0.3, "airborne", 0.003, push),
        st.Phase("flight", 1.0, until="landing", plan=plan),
        st.Phase("land", 1.0, controller=land),
    ]
    return st.Sequence(model, phases, settings=SETTINGS)


def found(jump: st.Sequence, start: tuple, rise: float, limits: dict = LIMITS) -> dict:
    """Return what ``optimise`` finds for a jump from a start and a rise (m)."""
    begun = time.process_time()
    best = st.optimise(jump, *start, limits=limits, goal={"rise": rise}, time_limit=TIME)
    numbers = {name: float(value) for name, value in best.report["measures"].items()}
    told = {"success": best.success, "doubts": list(best.doubts), "wanted": rise}
    return told | numbers | {"cpu_s": time.process_time() - begun, "wall_s": best.report["seconds"]}


def body(number: int) -> dict:
    """Return the outcome for one random animal and rise."""
    random, model = np.random.default_rng([SEED, number]), model_of(TAIL)
    changes = {
        name: (np.asarray(model.parameters[name]) * random.uniform(1 - SPREAD, 1 + SPREAD)).tolist()
        for name in VARIED
    }
    model = model.with_parameters(**changes, mu=random.uniform(0.5, 1.0))
    return found(leap(model), settled(model), random.uniform(*RISES))


def legs(number: int) -> dict:
    """Return the outcome for one random animal with legs of mass, and a random rise."""
    random, model = np.random.default_rng([SEED, number]), limbed()
    longer = random.uniform(1 - SPREAD, 1 + SPREAD, 3)
    changes = {name: (longer * model.parameters[name]).tolist() for name in BONES}
    for name in (*VARIED, "hind_link_masses"):
        own = np.asarray(model.parameters[name])
        changes[name] = (own * random.uniform(1 - SPREAD, 1 + SPREAD, own.shape)).tolist()
    model = model.with_parameters(**changes, mu=random.uniform(0.6, 1.0))
    start = st.settle(model, model.state(height=0.035, bend=CROUCHED), duration=0.5)
    limits = LIMITS | {"torque": TORQUES}
    return found(limbed_leap(model), start, random.uniform(*LOWER), limits)


def tail(length: float, mass: float) -> dict:
    """Return the outcome for a tail's length (m) and mass (kg), and a rise of 0.3 m."""
    model = model_of(TAIL).with_parameters(tail_length=length, tail_mass=mass, mu=1.0)
    return found(leap(model), settled(model), 0.3)


def study(folder: Path) -> None:
    """Optimise all jumps, write summary.json and print how many succeed."""
    of = {"program": digest(*(ROOT / source for source in SOURCES))}
    model_of(TAIL), limbed()
    parts = {
        f"body_{number}": Part(partial(body, number), of | {"body": number})
        for number in range(BODIES)
    }
    parts |= {
        f"tail_{1e3 * length:g}_{1e3 * mass:.2g}": Part(
            partial(tail, length, mass), of | {"tail": [length, mass]}
        )
        for length in LENGTHS.tolist()
        for mass in MASSES.tolist()
    }
    parts |= {
        f"legs_{number}": Part(partial(legs, number), of | {"legs": number})
        for number in range(LIMBED)
    }
    results = made("leaps", folder / "parts", parts)
    (folder / "summary.json").write_text(json.dumps(results, indent=1) + "\n")
    print("| jumps | succeed | CPU time, s: median, largest |\n|---|---|---|")
    for kind in ("body", "tail", "legs"):
        rows = [row for name, row in results.items() if name.startswith(kind)]
        count, times = sum(row["success"] for row in rows), [row["cpu_s"] for row in rows]
        print(f"| {kind} | {count} of {len(rows)} | {np.median(times):.0f}, {max(times):.0f} |")
