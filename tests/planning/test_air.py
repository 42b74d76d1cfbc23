"""Plans of models with air: true in air, and what knows no air refuses it."""

import numpy as np
import pytest

import serpentail as st
from serpentail import PlanningError
from tests.support.rows import row

KICK = np.array([0, 0, 0.34, np.cos(1.9), np.sin(1.9), 0, 0, -0.558, 0])
SPIN = np.array([0, -0.3, 2.39, 26.2, 0, 0, 4.7, 0])
TASK = {
    "start": (KICK, SPIN),
    "goal": st.Goal(torso_rate=None),
    "duration": 0.58,
    "bounds": st.Bounds(angle=np.pi / 3, torque=0.02),
}


@pytest.fixture(scope="module")
def model():
    drag = {"torso_drag": (5e-4, 3e-4, 6e-4), "wind": (0.5, -0.3, 0.2)}
    return st.build("righting_m1_n3", air_density=1.2, **drag)


@pytest.fixture(scope="module", params=["fatrop", pytest.param("ipopt", marks=pytest.mark.slow)])
def plan(request, model):
    return st.plan(model, **TASK, solver=request.param)


def flown(model, plan):
    how = {"method": "dp8", "rtol": 1e-10, "atol": 1e-12, "t_span": plan.duration}
    return st.simulate(model, KICK, SPIN, controller=plan.controller, **how)


def test_a_plan_with_air_is_true_in_air(model, plan):
    assert plan.success
    motion = flown(model, plan)
    found = st.summary(model, motion)
    assert found["tilt_end_deg"] < 0.01
    np.testing.assert_allclose(plan.trajectory.q[-1, :3], motion.q[-1, :3], atol=2e-4)
    np.testing.assert_allclose(plan.trajectory.v[-1], motion.v[-1], atol=2e-2)
    weight = np.array([0, 0, found["body_weight_N"]]) * plan.duration
    gained = motion.linear_momentum[-1] - motion.linear_momentum[0] + weight
    np.testing.assert_allclose(found["impulse_N_s"]["air"], gained, atol=1e-9)


def test_a_plan_without_air_is_wrong_in_air(model):
    """The finding that made plans know of the air: see docs/scenes.md."""
    plain = st.build("righting_m1_n3")
    plan = st.plan(plain, **TASK)
    assert plan.success
    still = model.with_parameters(wind=(0, 0, 0), torso_drag=(0, 0, 0))
    for coefficient, tilt in ((1.1, 100.0), (0.3, 27.4)):
        own = still.with_parameters(tail_drag=(coefficient, 0.0))
        with row(coefficient):
            assert st.summary(own, flown(own, plan))["tilt_end_deg"] == pytest.approx(tilt, abs=0.5)


def test_what_knows_no_air_refuses_it(model, plan):
    for words, call in (
        ("design", lambda: st.plan(model, **TASK, design={"tail_length": (0.1, 0.2)})),
        ("free_start", lambda: st.plan(model, **TASK, free_start={"tail": (-0.5, 0.5)})),
        ("Mpc", lambda: st.Mpc(model, plan)),
        ("Gains", lambda: st.Gains(plan)),
        ("position", lambda: st.plan(model, **TASK, path=[(lambda p: p.position, -1, 1)])),
    ):
        with row(words), pytest.raises(PlanningError, match=words):
            call()
