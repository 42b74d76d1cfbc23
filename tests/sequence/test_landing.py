"""A kick, a flight planned for the state in which it begins, and a landing."""

import numpy as np
import pytest

import serpentail as st
from serpentail.planning.problem import checked_goal
from serpentail.sequence.ballistic import landing_time

from .landing import DAMPING, DELTA, GAMMA, LANDING, goal, kick, plan, rat, sequence, settled

ANGLES = np.array([*LANDING.values()])


@pytest.mark.parametrize("speed", [-1.0, 0.0, 2.0])
def test_a_posture_lands_when_a_fall_in_it_does(speed):
    """A rat that falls in the goal's posture, and does not turn, touches down then."""
    model, wanted = rat(), checked_goal(goal(), rat().layout.nt)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2], q[3:7], q[7:], v[2] = 0.4, wanted.attitude, wanted.tail, speed
    time = landing_time(model, (q, v), wanted, ANGLES)
    motion = st.simulate(
        model, q, v, legs=st.Legs.fixed(*ANGLES), t_span=1.0, stop_at=[("touch_down", "feet")]
    )
    assert motion.events[0]["group"] == "feet"
    assert time == pytest.approx(motion.events[0]["time"], abs=1e-5)


def test_what_never_comes_down_so_far_is_refused():
    model, wanted = rat(), checked_goal(goal(), rat().layout.nt)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3] = 1.0
    with pytest.raises(st.SimulationError, match=r"landing: the centre of mass is .* m too low"):
        landing_time(model, (q, v), wanted, ANGLES)
    q[2], v[2] = 0.05, -9.0
    with pytest.raises(st.SimulationError, match="landing: "):
        landing_time(model, (q - 0.04 * np.eye(len(q))[2], v), wanted, ANGLES)


@pytest.fixture(scope="module")
def landed():
    moves = [{"before_landing": 0.2, "duration": 0.1} | LANDING]
    right = st.Phase("right", 1.5, until="landing", plan=plan(), moves=moves)
    land = st.Phase("land", 1.0, controller=st.Damping(5e-3))
    return sequence(kick(), right, land).simulate(*settled())


def test_the_kick_lands_on_its_feet(landed):
    found = st.summary(rat(), landed.trajectory)
    assert found["landed"] and found["landing_group"] == "feet" and landed.complete
    assert found["least_upright_landing"] > 0.5 and found["turned_landing_rad"] < 2
    assert found["upright_end"] > 0.9


def test_the_plan_is_for_the_state_at_the_event_and_is_tracked(landed):
    flight, motion = landed.phases[1], landed.trajectory
    at = int(np.searchsorted(motion.t, flight.begin))
    np.testing.assert_array_equal(flight.plan.problem.q0, motion.q[at])
    inside = (motion.t > flight.begin) & (motion.t < flight.end)
    assert flight.plan.success and np.abs(motion.tau[inside]).max() <= 0.02
    ends = flight.begin + flight.plan.duration
    assert flight.end == pytest.approx(ends + 0.003, abs=2e-3)
    pitch = np.degrees(st.pitch_roll_yaw(motion.resample([ends]).q)[0])[0]
    assert (pitch + 180) % 360 - 180 == pytest.approx(-10, abs=0.5)
    assert motion.info["phases"][1]["plan"]["success"]


def test_legs_move_before_the_landing(landed):
    flight, motion = landed.phases[1], landed.trajectory
    legs, lands = motion.contact.legs[:, :2], flight.begin + flight.plan.duration + 0.003
    moved = motion.t[np.abs(legs - legs[-1]).max(axis=1) > 1e-9][-1]
    still = motion.t[np.abs(legs - [GAMMA, np.radians(-75)]).max(axis=1) < 1e-9][-1]
    assert moved == pytest.approx(lands - 0.1, abs=3e-3)
    assert still == pytest.approx(lands - 0.2, abs=3e-3)
    assert legs[0] == pytest.approx([GAMMA, DELTA])


def test_the_passive_tail_falls_over():
    moves = [{"at": 0.45, "duration": 0.1} | LANDING]
    fly = st.Phase("fly", 1.5, until="landing", controller=DAMPING, moves=moves)
    run = sequence(kick(), fly, st.Phase("land", 1.0, controller=st.Damping(5e-3))).simulate(
        *settled()
    )
    found = st.summary(rat(), run.trajectory)
    assert not (found["landed"] and found["landing_group"] == "feet")


def test_of_several_plans_the_first_true_one_is_taken():
    hopeless = plan(duration=0.05, retries=0, rounds=0)
    wanted = plan()
    right = st.Phase("right", 0.05, plan=[hopeless, wanted])
    run = sequence(kick(), right).simulate(*settled())
    assert run.phases[1].plan.success and run.phases[1].plan.duration > 0.5
    run = sequence(kick(), st.Phase("right", 0.02, plan=hopeless)).simulate(*settled())
    assert not run.phases[1].plan.success
    assert "the plan of phase 'right' did not succeed: see its report" in run.trajectory.warnings


def test_a_plan_that_cannot_be_names_its_phase():
    wrong = st.Phase("right", 1.0, plan=plan(intervals=-3))
    with pytest.raises(st.PlanningError, match="phase 'right': intervals: value -3"):
        sequence(kick(), wrong).simulate(*settled())
