"""Phases are one motion, each ends where it says; a kick, a flight planned for the state in which
it begins, and a landing; what cannot be is refused.
"""

import re
from dataclasses import replace
from functools import cache
from math import cos, pi, radians, sin

import numpy as np
import pytest

import serpentail as st
from serpentail.planning.problem import checked_goal
from serpentail.sequence.flight import landing_time
from serpentail_scene.layout import Layout
from tests.support import zoo
from tests.support.rows import row

GAMMA, DELTA = radians(210), radians(-15)
LANDING = {"gamma": radians(230), "delta": radians(-20)}
ANGLES = np.array([*LANDING.values()])
SETTINGS = {"rtol": 1e-6, "output_step": 2e-3}
DAMPING = st.Damping(1e-3)
KICK = {"at": 0.4, "delta": radians(-75), "rate": 70.0}


def rat():
    return zoo.model("ground")


@cache
def settled():
    """Where the kick starts: q, v, stretch of the friction springs."""
    q, legs = np.zeros(9), st.Legs.fixed(GAMMA, DELTA)
    q[2:5] = 0.03, cos(radians(3.5)), sin(radians(3.5))
    acting = {"controller": DAMPING, "legs": legs, "rtol": 1e-5}
    return st.settle(rat(), q, rounds=4, duration=1.0, **acting)


def goal():
    """Pitched by -10 degrees, the tail up and at rest, the torso's rate free."""
    posture = {"attitude": [cos(radians(5)), -sin(radians(5)), 0, 0], "tail": [radians(-20), 0.0]}
    return st.Goal(**posture, torso_rate=None, tail_rate=[0.0, 0.0])


def plan(**changes):
    """Arguments of a plan that lands."""
    bounds = st.Bounds(angle=pi / 3, torque=0.02)
    return {"goal": goal(), "bounds": bounds, "solver": st.Solver(track=False)} | changes


def kick(**changes):
    """The first phase."""
    given = {"duration": 1.0, "until": "airborne", "controller": DAMPING, "moves": [KICK]}
    clear = {} if "until" in changes else {"clearance": 0.01}
    return st.Phase("kick", **given | clear | changes)


def sequence(*phases, **changes):
    """Phases of the rat."""
    legs = {"gamma": GAMMA, "delta": DELTA, "settings": SETTINGS}
    return st.Sequence(rat(), phases, **legs | changes)


def whole(span, **how):
    """The run that kicks, without phases of a sequence."""
    q, v, bristles = settled()
    own = {"controller": DAMPING, "legs": st.Legs.moves(GAMMA, DELTA, [KICK])}
    return st.simulate(rat(), q, v, bristles0=bristles, t_span=span, **own | how)


def test_phases_are_the_motion_that_one_run_makes():
    """What acts is the same, but for where steps end: states, books, events and samples agree."""
    table = st.TorqueTable([0.0, 0.05, 0.1], np.array([[0, 0], [2, 1], [0, 0]]) * 1e-4, 1e-3)
    fall = st.Phase("fall", 0.2, controller=table)
    run = sequence(kick(until=[("take_off", "feet")]), fall).simulate(*settled())
    leaves, motion = run.phases[0].end, run.trajectory
    law = st.Phases([(0.0, DAMPING), (leaves, table)])
    one = whole(leaves + 0.2, controller=law, rtol=1e-8, atol=1e-8)
    ends = [(phase.name, phase.ended_by) for phase in run.phases]
    assert ends == [("kick", "take_off of feet"), ("fall", "duration")]
    assert run.complete and (np.diff(motion.t) > 0).all() and motion.t[-1] == one.t[-1]
    np.testing.assert_allclose(motion.q[-1], one.q[-1], atol=2e-4)
    for name in ("work_J", "impulse_N_s"):
        for of, value in one.info[name].items():
            np.testing.assert_allclose(motion.info[name][of], value, atol=1e-4, err_msg=of)
    kinds, wanted = ([(e["kind"], e["group"]) for e in m.events] for m in (motion, one))
    assert kinds == wanted and motion.info["imbalance"]["relative"] < 1e-4
    acting = (motion.t > leaves) & (motion.t < leaves + 0.1)
    given, t = motion.tau[acting] + 1e-3 * motion.v[acting, 6:], motion.t[acting] - leaves
    wanted = [np.interp(t, table.times, column) for column in np.transpose(table.torques)]
    np.testing.assert_allclose(given, np.transpose(wanted), atol=1e-12)
    assert leaves in motion.t and motion.contact.points.shape[0] == len(motion.t)
    np.testing.assert_array_equal(replace(motion).energy, motion.energy)


def test_legs_of_mass_push_and_rest():
    """Two phases are one run by the same controllers; a warning names the stop of the legs."""
    scene, free = st.scenario("rat_kick"), st.Damping(1e-4)
    start, more = (scene.q0, scene.v0), {"rtol": 1e-9, "output_step": 5e-4}
    bristles = scene.settings["bristles0"]
    phases = [st.Phase("push", 0.18, controller=scene.controller)]
    phases += [st.Phase("rest", "0.1 s", controller=free)]
    run = st.Sequence(scene.model, phases, settings=more).simulate(*start, bristles)
    law, motion = st.Phases([(0.0, scene.controller), (0.18, free)]), run.trajectory
    more |= {"bristles0": bristles, "controller": law, "t_span": 0.28}
    one = st.simulate(scene.model, *start, **more)
    assert run.complete and [phase.end for phase in run.phases] == [0.18, 0.28]
    np.testing.assert_allclose(motion.t, one.t, rtol=1e-15)
    np.testing.assert_allclose(motion.q, one.q, atol=1e-9)
    np.testing.assert_allclose(motion.contact.forces, one.contact.forces, atol=1e-9)
    assert [e["group"] for e in motion.events] == [e["group"] for e in one.events]
    assert 10 < run.phases[0].peak / st.summary(scene.model, one)["body_weight_N"] < 20
    assert any("behind hind_stop_upper" in words for words in motion.warnings)


def test_airborne_is_where_nothing_touches_and_all_is_high():
    run = sequence(kick()).simulate(*settled())
    contact, end = run.trajectory.contact, run.phases[0].end
    assert contact.points[-1, :, 2].min() > 0.01 and contact.forces[-1, :, 2].max() == 0
    assert run.phases[0].ended_by == "airborne" and run.trajectory.events[-1]["time"] < end < 0.5
    earlier = whole(end - 1.0 / 400, **SETTINGS).contact
    assert earlier.points[-1, :, 2].min() < 0.01 or earlier.forces[-1].max() > 0


def test_an_end_that_never_comes_ends_the_motion_and_says_so():
    run = sequence(kick(moves=(), duration=0.1), st.Phase("fly", 0.1)).simulate(*settled())
    assert not run.complete and [phase.name for phase in run.phases] == ["kick"]
    told = str(run.trajectory.warnings)
    assert "'kick'" in told and "clear of the ground" in told and "0.1 s" in told
    until = [("take_off", "feet"), ("take_off", "tail")]
    run = sequence(kick(moves=(), duration=0.1, until=until)).simulate(*settled())
    told = str(run.trajectory.warnings)
    assert not run.complete and "take_off of feet or take_off of tail" in told


def test_an_error_names_its_phase_and_keeps_the_motion():
    wrong = st.Phase("spin", 0.1, controller=lambda t, q, v: [np.nan, 0] if t > 0.05 else [0, 0])
    with pytest.raises(st.SimulationError, match="phase 'spin': the controller gave") as caught:
        sequence(kick(), wrong).simulate(*settled())
    motion = caught.value.trajectory
    assert 0.5 < motion.t[-1] < 0.55 and motion.t[0] == 0


def test_a_flight_without_ground_has_phases_too():
    q, v = np.eye(1, 9, 3)[0], np.array([0, 0, 0, 3.0, 1, 0, 5, 0])
    laws, model = [DAMPING, st.Damping(2e-3)], zoo.model("m1_n3")
    phases = [st.Phase(str(k), 0.1, controller=law) for k, law in enumerate(laws)]
    run = st.Sequence(model, phases, settings={"rtol": 1e-10}).simulate(q, v)
    law = st.Phases([(0.0, laws[0]), (0.1, laws[1])])
    one = st.simulate(model, q, v, controller=law, t_span=0.2, rtol=1e-10)
    np.testing.assert_allclose(run.trajectory.q[-1], one.q[-1], atol=1e-8)
    assert run.trajectory.contact is None and run.complete


def test_a_posture_lands_when_a_fall_in_it_does():
    """A rat that falls in the goal's posture, and does not turn, touches down then."""
    wanted, q, v = checked_goal(goal(), Layout(1)), np.zeros(9), np.zeros(8)
    q[2], q[3:7], q[7:] = 0.4, wanted.attitude, wanted.tail
    how = {"legs": st.Legs.fixed(*ANGLES), "stop_at": [("touch_down", "feet")]}
    for speed in (-1.0, 0.0, 2.0):
        v[2] = speed
        motion = st.simulate(rat(), q, v, t_span=1.0, **how)
        assert motion.events[0]["group"] == "feet"
        time = landing_time(rat(), (q, v), wanted, ANGLES)
        assert time == pytest.approx(motion.events[0]["time"], abs=1e-5), speed
    for height, speed, words in ((0.0, 0.0, "m too low"), (0.01, -9.0, "past")):
        low, v[2] = np.eye(1, 9, 3)[0], speed
        low[2] = height
        with row(words), pytest.raises(st.SimulationError, match=rf"landing: .*{words}"):
            landing_time(rat(), (low, v), wanted, ANGLES)


def test_a_kick_lands_as_planned_and_a_passive_tail_falls_over():
    land = st.Phase("land", 1.0, controller=st.Damping(5e-3))
    moves = [{"before_landing": 0.2, "duration": 0.1} | LANDING]
    right = st.Phase("right", 1.5, until="landing", plan=plan(), moves=moves)
    landed = sequence(kick(), right, land).simulate(*settled())
    found = st.summary(rat(), landed.trajectory)
    assert found["landed"] and found["landing_group"] == "feet" and landed.complete
    assert found["least_upright_landing"] > 0.5 and found["turned_landing_rad"] < 2
    assert found["upright_end"] > 0.9
    check_planned(landed)
    moves = [{"at": 0.45, "duration": 0.1} | LANDING]
    fly = st.Phase("fly", 1.5, until="landing", controller=DAMPING, moves=moves)
    passive = sequence(kick(), fly, land).simulate(*settled())
    found = st.summary(rat(), passive.trajectory)
    assert not (found["landed"] and found["landing_group"] == "feet")
    assert "phase 'land', at t = " in str(passive.trajectory.warnings)


def check_planned(landed):
    """The plan is for the state at the event, and is tracked; legs move before the landing."""
    flight, motion = landed.phases[1], landed.trajectory
    at = int(np.searchsorted(motion.t, flight.begin))
    np.testing.assert_allclose(flight.plan.problem.q0, motion.q[at], rtol=3e-16)  # made a unit
    inside = (motion.t > flight.begin) & (motion.t < flight.end)
    assert flight.plan.success and np.abs(motion.tau[inside]).max() <= 0.02
    ends = flight.begin + flight.plan.duration
    assert flight.end == pytest.approx(ends + 0.003, abs=2e-3)
    pitch = np.degrees(st.pitch_roll_yaw(motion.resample([ends]).q)[0])[0]
    assert (pitch + 180) % 360 - 180 == pytest.approx(-10, abs=0.5)
    assert motion.info["phases"][1]["plan"]["success"]
    legs, lands = motion.contact.legs[:, :2], ends + 0.003
    moved = motion.t[np.abs(legs - legs[-1]).max(axis=1) > 1e-9][-1]
    still = motion.t[np.abs(legs - [GAMMA, KICK["delta"]]).max(axis=1) < 1e-9][-1]
    assert moved == pytest.approx(lands - 0.1, abs=3e-3)
    assert still == pytest.approx(lands - 0.2, abs=3e-3)
    assert legs[0] == pytest.approx([GAMMA, DELTA])


def test_of_several_plans_the_first_true_one_is_taken():
    hopeless = plan(duration=0.05, solver=st.Solver(retries=0), mesh=st.Mesh(rounds=0))
    run = sequence(kick(), st.Phase("right", 0.05, plan=[hopeless, plan()])).simulate(*settled())
    assert run.phases[1].plan.success and run.phases[1].plan.duration > 0.5
    run = sequence(kick(), st.Phase("right", 0.02, plan=hopeless)).simulate(*settled())
    assert not run.phases[1].plan.success
    assert "'right', at t = 0.46 s: no true plan (1 tried)" in str(run.trajectory.warnings)
    wrong = st.Phase("right", 1.0, plan=plan(mesh=st.Mesh(intervals=-3)))
    with pytest.raises(st.PlanningError, match=r"phase 'right': mesh\.intervals: value -3"):
        sequence(kick(), wrong).simulate(*settled())


def test_a_plan_that_fails_is_not_tracked_and_a_torque_that_suffices_is_told():
    """The phase's own controller acts; with the torque of the message there is a plan."""
    once = {"solver": st.Solver(retries=0)}
    weak = [plan(bounds=st.Bounds(angle=pi / 3, torque=each), **once) for each in (4e-3, 8e-3)]
    right = st.Phase("right", 0.02, controller=DAMPING, plan=weak[:1])
    run = sequence(kick(), right).simulate(*settled())
    motion = run.trajectory
    inside = motion.t > run.phases[1].begin
    np.testing.assert_allclose(motion.tau[inside], -1e-3 * motion.v[inside, 6:], atol=1e-12)
    assert "plan[0].bounds.torque: 0.008 N m suffices" in str(motion.warnings)
    right = replace(right, plan=weak)
    assert sequence(kick(), right).simulate(*settled()).phases[1].plan.success


def test_a_fast_landing_and_a_hard_push_warn_once():
    """Each with its number; the shipped kick has a warning of the legs instead."""
    fly = st.Phase("fly", 1.0, until="landing")
    hard = {"at": 0.4, "delta": radians(-75), "duration": 0.02, "shape": "accelerate"}
    for move, pushes in ((hard, 1), (hard | {"duration": 0.04}, 0), (KICK, 0)):
        motion = sequence(kick(moves=[move], clearance=0.0), fly).simulate(*settled()).trajectory
        told, words = st.summary(rat(), motion), motion.warnings
        spins = [each for each in words if each.startswith("touch-down at t = ")]
        rate = np.linalg.norm(told["torso_rate_at_touch_down"])
        with row(move):
            assert len(spins) == 1 and rate > 10 and f"turns at {rate:.3g} rad/s" in spins[0]
            found = [each for each in words if each.startswith("push: ")]
            assert len(found) == pushes
            force = told["peak_ground_force_weights"]
            assert all(f"is {force:.3g} body weights" in each and force > 25 for each in found)


WRONG = [
    ({"name": ""}, "Phase: name: value ''"),
    ({"duration": 0}, "phase 'a': duration: value 0"),
    ({"until": "landed"}, "phase 'a': until: value 'landed'"),
    *(({"until": until}, "until: value") for until in ([("leave", "feet")], [3], [])),
    ({"clearance": 0.1}, "clearance: value 0.1"),
    ({"until": "airborne", "clearance": -1}, "clearance: value -1"),
    ({"controller": 3}, "controller: value 3"),
    ({"controller": st.Phases([(0.0, None)])}, "each of its controllers a phase"),
    ({"plan": 3}, "plan: value 3"),
    ({"plan": {"start": 3}}, "plan.start: value 3"),
    *(({"plan": {key: {}}}, f"plan.{key}: value {{}}") for key in ("free_start", "design")),
    ({"moves": [{"delta": 1.0, "rate": 1.0}]}, "needs at"),
    ({"moves": [{"before_landing": 0.1, "delta": 1.0}]}, "key"),
    ({"moves": [{"att": 0.1}]}, "'at'"),
    ({"moves": 3}, "moves: value 3"),
]


def test_what_is_no_phase_or_no_sequence_is_refused():
    flier, a = zoo.model("m1_n3"), st.Phase("a", 1.0)
    rows = [
        (sequence, "phases: value ()"),
        (lambda: sequence(3), "list of st.Phase"),
        (lambda: st.Sequence(rat(), 3), "list of st.Phase"),
        (lambda: sequence(kick(), kick()), "two are called 'kick'"),
        (lambda: sequence(kick(), gamma=None), "gamma: value None"),
        (lambda: sequence(kick(until=[("take_off", "hands")], clearance=0.0)), "'hands'"),
        (lambda: st.Sequence(flier, [a], gamma=1.0), "has no legs"),
        (lambda: st.Sequence(flier, [kick(moves=())]), "has no contacts"),
        (lambda: st.Sequence(flier, [st.Phase("a", 1.0, moves=[KICK])]), "has no legs"),
        (lambda: sequence(st.Phase("a", 1.0, controller=st.Damping(-1))), "phase 'a': damping"),
        (lambda: st.Tracking(kp=-1), "kp: value -1"),
    ]
    phase = {"name": "a", "duration": 1.0}
    rows += [(lambda c=changes: st.Phase(**phase | c), words) for changes, words in WRONG]
    for make, words in rows:
        with row(words), pytest.raises(st.SimulationError, match=re.escape(words)):
            make()
