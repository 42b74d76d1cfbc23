"""Jumps of a tail of three segments from feet and tail, with a stronger and a weaker push than the
scene's.

The flight is planned, passive, held straight, or controlled by the scene's reference, which does
not depend on the result of the jump.
"""

from math import cos, pi, radians, sin

import numpy as np

import serpentail as st
from examples.studies.landing_judged import LANDING, SETTINGS, judged, model_of

OPTIONS = {"tail": "articulated", "segments": 3, "links": 4}
PUSHES = (1.3, 1.6, 1.75, 1.9)  # rad: the second segment's bend as it pushes; 1.6 is the scene's
FLIGHTS = ("planned", "passive", "held", "blind")
PITCHES = (-20.0, -30.0, -10.0)  # deg, at the landing: the first whose plan is true
TORQUE, ANGLE, STOWED = 0.02, pi / 3, 0.12  # N m, rad, s
GAMMA, DELTA = radians(210), radians(-40)
PUSH = {"at": 0.4, "delta": radians(-90), "rate": 70.0}
TIMES = (0.40, 0.44, 0.46, 0.56)  # s
GAINS = {"kp": 4e4, "kd": 400.0}  # 1/s^2, 1/s
SOFT = {"kp": 2500.0, "kd": 100.0, "torque": TORQUE}
STRAIGHT = ([0.0, 1.0], np.zeros((2, 6)))  # s, rad


def jump(push: float, flight: str) -> dict:
    """Return the outcome of a jump."""
    model = model_of(OPTIONS).with_parameters(mu=0.5)
    law = st.Pfl(model, reference(push), **GAINS)
    leap = st.Phase("jump", 1.0, until="airborne", clearance=0.01, controller=law, moves=[PUSH])
    phases = [leap, *flown(model, flight, law), st.Phase("land", 1.0, controller=st.Damping(2e-2))]
    run = st.Sequence(model, phases, GAMMA, DELTA, SETTINGS).simulate(*settled(model))
    return judged(model, run)


def reference(push: float) -> st.Reference:
    """Return the scene's reference, with this bend (rad) of its push."""
    bends = [[-0.5, 1.1, -0.7], [-0.6, push, 1.9], [-0.6, push, 1.9], [-0.7, 0.4, 1.2]]
    angles = np.zeros((len(TIMES), 6))
    angles[:, ::2] = np.array(bends) / OPTIONS["links"]
    return st.Reference(TIMES, angles)


def settled(model: st.Model) -> tuple:
    """Return the start of the jump: at rest on feet and tail, with the tail in its first shape."""
    q, half = np.zeros(model.nq), radians(25) / 2
    law = st.Pfl(model, reference(PUSHES[0]), **GAINS)
    q[2:5], q[7:] = (0.1, cos(half), sin(half)), law.curve.at(0.0)[0]
    legs = st.Legs.fixed(GAMMA, DELTA)
    return st.settle(model, q, duration=1.5, rtol=SETTINGS["rtol"], controller=law, legs=legs)


def flown(model: st.Model, flight: str, law: st.Pfl) -> list[st.Phase]:
    """Return the phases from the state clear of the ground to touch-down."""
    if flight == "planned":
        stow = st.Phase("stow", STOWED, controller=st.Pfl(model, STRAIGHT, **SOFT))
        moves = [{"before_landing": 0.2} | LANDING]
        plans = [plan_to(pitch) for pitch in PITCHES]
        return [stow, st.Phase("right", 1.5, until="landing", plan=plans, moves=moves)]
    laws = {
        "passive": st.Damping(1e-3),
        "held": st.Pfl(model, STRAIGHT, **GAINS, torque=TORQUE),
        "blind": law.later(-PUSH["at"] - 0.03),  # it left the ground 30 ms into the push
    }
    moves = [{"at": 0.3} | LANDING]
    return [st.Phase("fly", 1.5, until="landing", controller=laws[flight], moves=moves)]


def plan_to(pitch: float) -> dict:
    """Return the arguments of a plan to a pitch (deg), with the tail straight and at rest."""
    half = radians(pitch) / 2
    goal = st.Goal(
        attitude=[cos(half), sin(half), 0.0, 0.0],
        torso_rate=None,
        tail=np.zeros(6),
        tail_rate=np.zeros(6),
    )
    bounds = st.Bounds(angle=ANGLE, torque=TORQUE)
    return {"goal": goal, "bounds": bounds, "solver": st.Solver(time_limit=120.0, track=False)}


def told(found: dict) -> str:
    """Return a cell of the study's table."""
    if found["lands"]:
        return "lands"
    return f"{found['landing_group']} first" if found["landing_group"] != "feet" else "falls"
