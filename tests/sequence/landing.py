"""The kick that lands, for tests: its model, its phases, and where it starts."""

from functools import cache
from math import cos, pi, radians, sin
from pathlib import Path

import numpy as np

import serpentail as st
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of

SCENE = Path(__file__).parents[2] / "scenes" / "kick_and_land.toml"
GAMMA, DELTA = radians(210), radians(-15)
LANDING = {"gamma": radians(230), "delta": radians(-20)}
SETTINGS = {"rtol": 1e-6, "output_step": 2e-3}
DAMPING = st.Damping(1e-3)
KICK = {"at": 0.4, "delta": radians(-75), "rate": 70.0}


@cache
def folder():
    """The generated folder of the scene."""
    return folder_of(load_scene(SCENE))


@cache
def rat():
    """The model."""
    return st.load(folder()).with_parameters(mu=1.0)


@cache
def settled():
    """Where the kick starts: q, v, stretch of the friction springs."""
    q, legs = np.zeros(rat().nq), st.Legs.fixed(GAMMA, DELTA)
    pitch = radians(7)
    q[2:5] = 0.03, cos(pitch / 2), sin(pitch / 2)
    acting = {"controller": DAMPING, "legs": legs, "rtol": 1e-5}
    return st.settle(rat(), q, rounds=4, duration=1.0, **acting)


def goal(pitch_deg=-10.0):
    """Pitched, the tail up and at rest, the torso's rate free."""
    half = radians(pitch_deg) / 2
    tail = [radians(-20), 0.0]
    attitude = [cos(half), sin(half), 0.0, 0.0]
    return st.Goal(attitude=attitude, torso_rate=None, tail=tail, tail_rate=[0.0, 0.0])


def plan(**changes):
    """Arguments of a plan that lands."""
    bounds = st.Bounds(angle=pi / 3, torque=0.02)
    return {"goal": goal(), "bounds": bounds, "track": False} | changes


def kick(**changes):
    """The first phase."""
    given = {"duration": 1.0, "until": "airborne", "controller": DAMPING, "moves": [KICK]}
    clear = {} if "until" in changes else {"clearance": 0.01}
    return st.Phase("kick", **given | clear | changes)


def sequence(*phases, model=None, **changes):
    """Phases of the rat."""
    legs = {"gamma": GAMMA, "delta": DELTA, "settings": SETTINGS}
    return st.Sequence(model or rat(), phases, **legs | changes)
