"""Kicks of random animals with planned flights, and the same with a passive tail."""

import json
from dataclasses import dataclass
from functools import partial
from math import cos, pi, radians, sin
from pathlib import Path

import numpy as np

import serpentail as st
from examples.front import ROOT
from examples.studies.landing_judged import LANDING, SETTINGS, judged, model_of
from examples.studies.landing_jumps import FLIGHTS, OPTIONS, PUSHES, jump, told
from examples.studies.parts import Part, digest, made

KICKS, SEED, SPREAD = 20, 11, 0.1
VARIED = ("torso_mass", "torso_inertia", "tail_mass", "tail_length")
PITCHES = (-50.0, -30.0, -10.0, 10.0, 20.0)  # deg, at the landing: where the one wanted is not true
TORQUE = 0.02  # N m
GAMMA, DELTA = radians(210), radians(-15)
QUICK = st.Solver(track=False, retries=2, time_limit=60.0)
KICK = {"at": 0.4, "delta": radians(-75), "rate": 70.0}
SOURCES = ("codegen", "runtime", "examples/studies")


@dataclass(frozen=True)
class Tail:
    """A tail of the study: its description, the bound of a coordinate (rad), and its goal (deg)."""

    options: dict
    angle: float
    goal: float


TAILS = {
    "articulated_1x3": Tail({"tail": "articulated", "segments": 1, "links": 3}, pi / 3, -20.0),
    "continuum_2": Tail({"tail": "continuum", "segments": 2}, 2 * pi / 3, -30.0),
}


def kick(tail: Tail, number: int) -> dict:
    """Return the outcome for one animal, with a planned flight and with a passive tail."""
    random, model = np.random.default_rng([SEED, number]), model_of(tail.options)
    factors = {name: random.uniform(1 - SPREAD, 1 + SPREAD) for name in VARIED}
    changes = {
        name: (np.asarray(model.parameters[name]) * factor).tolist()
        for name, factor in factors.items()
    }
    mu, pitch = random.uniform(0.5, 1.0), random.uniform(-50.0, 20.0)
    model = model.with_parameters(**changes, mu=mu)
    start = settled(model)
    found = {"mu": mu, "pitch_deg": pitch, "factors": factors}
    for name, flight in (("planned", planned(tail, pitch)), ("passive", passive())):
        phases = [crouch(), flight, st.Phase("land", 1.0, controller=st.Damping(5e-3))]
        run = st.Sequence(model, phases, GAMMA, DELTA, SETTINGS).simulate(*start)
        found[name] = judged(model, run)
    return found


def settled(model: st.Model) -> tuple:
    """Return the start of the kick: at rest on feet, torso and tail."""
    q, half = np.zeros(model.nq), radians(7) / 2
    q[2:5] = 0.03, cos(half), sin(half)
    acting = {"controller": st.Damping(1e-3), "legs": st.Legs.fixed(GAMMA, DELTA)}
    return st.settle(model, q, rounds=4, duration=1.0, rtol=SETTINGS["rtol"], **acting)


def crouch() -> st.Phase:
    """Return the phase of the kick, until the animal is clear of the ground."""
    clear = {"until": "airborne", "clearance": 0.01}
    return st.Phase("kick", 1.0, controller=st.Damping(1e-3), moves=[KICK], **clear)


def planned(tail: Tail, pitch: float) -> st.Phase:
    """Return a flight that is planned to end at this pitch (deg), or at one near it."""
    pitches = [pitch, *sorted(PITCHES, key=lambda other: abs(other - pitch))]
    bounds = st.Bounds(angle=tail.angle, torque=TORQUE)
    plans = [{"goal": goal(tail, each), "bounds": bounds, "solver": QUICK} for each in pitches]
    moves = [{"before_landing": 0.2} | LANDING]
    return st.Phase("right", 1.5, until="landing", plan=plans, moves=moves)


def goal(tail: Tail, pitch: float) -> st.Goal:
    """Return the goal of a landing at a pitch (deg): the tail up and at rest."""
    half, segments = radians(pitch) / 2, tail.options["segments"]
    return st.Goal(
        attitude=[cos(half), sin(half), 0.0, 0.0],
        torso_rate=None,
        tail=[radians(tail.goal), 0.0] * segments,
        tail_rate=[0.0, 0.0] * segments,
    )


def passive() -> st.Phase:
    """Return a flight with a passive tail."""
    moves = [{"at": 0.45} | LANDING]
    return st.Phase("fly", 1.5, until="landing", controller=st.Damping(1e-3), moves=moves)


def study(folder: Path) -> None:
    """Make all kicks and jumps (of landing_jumps), write summary.json and print two tables."""
    of = {"program": digest(*(ROOT / source for source in SOURCES))}
    for options in (*(tail.options for tail in TAILS.values()), OPTIONS):
        model_of(options)
    parts = {
        f"{name}_{number}": Part(partial(kick, tail, number), of | {"kick": number})
        for name, tail in TAILS.items()
        for number in range(KICKS)
    }
    parts |= {
        f"jump_{push}_{flight}": Part(partial(jump, push, flight), of | {"jump": [push, flight]})
        for push in PUSHES
        for flight in FLIGHTS
    }
    found = made("landing", folder / "parts", parts)
    (folder / "summary.json").write_text(json.dumps(found, indent=1) + "\n")
    print("| tail | planned | passive |\n|---|---|---|")
    for name in TAILS:
        rows = [found[f"{name}_{number}"] for number in range(KICKS)]
        counts = (sum(row[how]["lands"] for row in rows) for how in ("planned", "passive"))
        print(f"| {name} | " + " | ".join(f"{count} of {KICKS}" for count in counts) + " |")
    print("| push | " + " | ".join(FLIGHTS) + " |\n|---|" + "---|" * len(FLIGHTS))
    for push in PUSHES:
        words = (told(found[f"jump_{push}_{flight}"]) for flight in FLIGHTS)
        print(f"| {push} rad | " + " | ".join(words) + " |")
