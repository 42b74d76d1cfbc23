"""Touches of feet within one long step."""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.controllers.piecewise import Piecewise
from tests.support import zoo
from tests.support.rows import row

LEGS, NAME = st.Legs.fixed(np.radians(210), np.radians(-15)), "ground_m2_n2"


def test_a_touch_in_a_long_step_is_told_to_rounding():
    """A slow fall for 8 s, late on the clock, in one step, on ground that does not press."""
    model = zoo.model(NAME).with_parameters(gravity=5e-3, K_n=1e-18)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:4] = 1, 1
    begin = st.simulate(model, q, v, legs=LEGS, t_span=1e-3).contact.points[0, :, 2].min()
    late = {"t_span": (1e4, 1e4 + 8), "output_step": 8}
    for height in (0.05, 0.07, 0.11):
        q[2] = 1 - begin + height
        run = st.simulate(model, q, v, legs=LEGS, method="rk4", step=8, **late)
        assert run.info["steps"] == 1
        after = run.events[0]["time"] - 1e4
        assert after == pytest.approx(np.sqrt(2 * height / 5e-3), rel=0, abs=1e-11)


def test_a_foot_that_dips_within_a_step_is_seen():
    """Shanks that rested before swing there and back, on a parabola, in one step of a body at
    rest. Steps of a fixed length are not cut: the result says so.
    """
    model, T = zoo.model(NAME).with_parameters(gravity=0), 0.05
    swing = np.zeros((2, 4, 3))
    swing[..., 0] = np.radians([210, -50, 210, -50])
    swing[1, 1::2, 1:] = -0.04 / T, 0.04 / T**2
    legs = st.Legs.fixed(0, 0)
    object.__setattr__(legs, "curve", Piecewise(np.array([-1, 0, T]), swing))  # C takes any degree
    q, v, times = np.zeros(model.nq), np.zeros(model.nv), np.linspace(0, T, 2001)
    q[2:4] = 1, 1
    angles = [np.append(legs.curve.at(t)[0], np.zeros(4)) for t in times]
    feet = np.min([model.contact_points(q, v, each)[0][:6, 2] for each in angles], axis=1)
    dip = feet[0] - feet.min()
    assert dip > 1e-4 and feet[-1] == pytest.approx(feet[0], abs=1e-12)
    q[2] -= feet[0] - dip / 2
    once = {"step": T, "t_span": T, "output_step": T}
    run = st.simulate(model, q, v, legs=legs, method="implicit_euler", **once)
    assert run.info["steps"] == 1
    assert run.info["unfelt"] == 1 and "shorter than a step" in run.warnings[0]
    under, (down, off) = times[feet < feet[0] - dip / 2], run.events
    assert (down["kind"], off["kind"]) == ("touch_down", "take_off")
    assert down["time"] == pytest.approx(under[0], abs=1e-4)
    assert down["time"] < off["time"] < under[-1]  # a point that rises ceases to press before


def test_feet_that_a_far_hip_swings_through_the_ground_within_a_step_are_seen():
    """A ball with short legs turns, on ground that does not press."""
    ball = {"gravity": 0, "K_n": 1e-18, "tail_mass": 1e-6, "torso_inertia": [5e-5] * 3}
    ball |= {name: 1e-6 for name in zoo.model(NAME).parameters if name.startswith("L_")}
    once = {"method": "rk4", "step": 0.04, "t_span": 0.04, "output_step": 0.04, "legs": LEGS}
    along = [[1, 0.1, 0], [0, -1, 0.1], [0, 0.1, -1]]
    for hip in map(np.array, [[1, 1, 0], [0, -1, 1], [1, 0, -1], *along]):
        with row(hip):
            way = hip / np.linalg.norm(hip)
            about, q, v = np.cross(way, [0, 0, -1]), np.zeros(11), np.zeros(10)
            about /= np.linalg.norm(about)
            half = (np.arccos(-way[2]) - 0.2) / 2  # 0.2 rad before the hip points down
            q[2], q[3], q[4:7] = 0.297, np.cos(half), np.sin(half) * about
            v[3:6] = 10 * about
            run = st.simulate(zoo.model(NAME).with_parameters(hip=0.3 * way, **ball), q, v, **once)
            assert run.info["steps"] == 1
            down = next(event for event in run.events if event["group"] == "feet")
            assert down["time"] == pytest.approx((0.2 - np.arccos(0.297 / 0.3)) / 10, abs=1e-4)
