"""Plans of trees of chains: true in flight, bounded and aimed by names, without torques of passive
coordinates; what they lack is refused.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail import PlanningError
from serpentail.planning.magnitudes import checked_bounds
from serpentail.planning.problem import checked_goal
from serpentail.scenes.plan import plan_arguments, planned
from tests.support import zoo
from tests.support.rows import row
from tests.support.scenes import SCENES
from tests.support.tumbling import integrated, start

FIN = {"kind": "articulated", "drive": "passive", "stiffness": 1e-4, "damping": 3e-6}
FIN |= {"segments": 1, "links": 1, "length": "17.6 mm", "mass": "0.19 g", "link_radius": "2 mm"}
FIN |= {"pair": True, "mount": "4.2, -20, 0 mm", "mount_angles": [0, 0, "90 deg"]}
WEAK = {"tail": 2e-3, "fin": 1e-3}
BOUNDS = st.Bounds(angle={"tail": "40 deg", "fin": "20 deg"}, torque=WEAK)


@cache
def finned():
    return st.build("gecko", chain={"fin": FIN}, purpose=["plan"])


def upside_down(model):
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[5], q[7:9] = 1, 0.1
    return q, v


@pytest.mark.slow  # it makes its model
def test_passive_coordinates_move_without_torques():
    model = finned()
    for solver in ("fatrop", "ipopt"):
        asked = {"start": upside_down(model), "duration": 0.2, "bounds": BOUNDS, "solver": solver}
        plan = st.plan(model, **asked)
        with row(solver):
            assert plan.success and plan.report["tracked_attitude_error_deg"] is None
            assert np.abs(plan.trajectory.tau).max(axis=0)[:2].min() > 1e-5
            assert not plan.trajectory.tau[:, 2:].any()
            assert 1e-2 < np.abs(plan.trajectory.q[:, 9:]).max() < np.radians(20) * 1.001
            q, v = integrated(model, plan)
            assert st.pitch_roll_yaw(q)[:2] == pytest.approx([0, 0], abs=np.radians(0.01))
            np.testing.assert_allclose(v[3:], plan.trajectory.v[-1, 3:], atol=1e-2)


@pytest.mark.slow  # it makes its model
def test_a_plan_of_limbs_ends_as_it_is_asked_by_name():
    model, wanted = zoo.model("limbs"), {"leg_knee": 0.1, "arm": [0, None, 0.2]}
    goal = st.Goal(chains=wanted, chain_rates={"leg": 0}, torso_rate=None)
    bounds = st.Bounds(torque={"tail": 5e-3, "leg": "2 mN m", "arm": 1e-3})
    plan = st.plan(model, start=start(model), duration=0.4, goal=goal, bounds=bounds)
    assert plan.success
    q, v = integrated(model, plan)
    assert st.pitch_roll_yaw(q)[:2] == pytest.approx([0, 0], abs=np.radians(0.01))
    assert q[[11, 14, 15, 17]] == pytest.approx([0.1, 0.1, 0, 0.2], abs=2e-3)
    assert v[8:14] == pytest.approx(0, abs=0.1)
    most = np.repeat([5e-3, 2e-3, 1e-3], [2, 6, 3])
    assert (np.abs(plan.trajectory.tau) <= most * (1 + 1e-6)).all()


def test_names_are_those_of_chains_pairs_and_joints():
    model = zoo.model("limbs")  # tail of 2, legs of swing, hip, knee, arm of turn, lift, wheel
    half = np.pi / np.repeat(model.joints_each, model.layout.widths)
    for given, places, values in (
        ({"tail": 0.3}, [0, 1], 0.3),
        ({"leg": 1, "leg_left_hip": 0.5}, range(2, 8), [1, 1, 1, 1, 0.5, 1]),
        ({"leg_right": [1, 2, 3], "arm_lift": "30 deg"}, [2, 3, 4, 9], [1, 2, 3, np.pi / 6]),
        ({"leg_knee": 0.2, "beta_1": 0.1}, [4, 7, 1], [0.2, 0.2, 0.1]),
    ):
        expected = half.copy()
        expected[places] = values
        with row(given):
            np.testing.assert_allclose(checked_bounds(model, st.Bounds(given)).angle, expected)
    found = checked_goal(st.Goal(chains={"leg_hip": 0.4}), model.layout).tail
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(found)), [3, 6])


@pytest.mark.slow  # it makes its model
def test_what_plans_of_trees_lack_is_refused():
    model = finned()
    of_motors = checked_bounds(model, st.Bounds(rate=2.0, torque={"fin": 0.01}))
    assert of_motors.rate.tolist() == [2, 2, *4 * [np.inf]]
    assert of_motors.torque.tolist() == [0.02, 0.02, *4 * [0.01]]
    for words, asked in {
        "damping: .*fin_right_alpha_1": {"damping": 1e-5},
        "bounds.torque_rate: .*fin_right_alpha_1": {"bounds": st.Bounds(torque_rate=1.0)},
        "bounds.torque_rate: value": {"bounds": st.Bounds(torque_rate={"tail": 1.0})},
        "bounds.torque: key: value 'fon'": {"bounds": st.Bounds(torque={"fon": 0.01})},
        "bounds.angle.fin: value": {"bounds": st.Bounds(angle={"fin": (1, 2, 3)})},
        "goal.chains: key: value 'knee'": {"goal": st.Goal(chains={"knee": 1.0})},
        "goal.chains.fin: value": {"goal": st.Goal(chains={"fin": [1.0, 2.0, 3.0]})},
        "goal.chains: value .*goal.tail": {"goal": st.Goal(chains={"fin": 0}, tail=[0.0] * 6)},
        "goal.chain_rates: value 3": {"goal": st.Goal(chain_rates=3)},
        "design: .*fin_right": {"design": {"tail_mass": (1e-4, 1e-3)}},
        "free_start: .*fin_right": {"free_start": {"tail": (-1, 1)}},
        "clearance: .*fin_right": {"clearance": 0.1},
        "legs: .*fin_right": {"legs": st.Legs.fixed(3.6, -0.3)},
    }.items():
        with row(words), pytest.raises(PlanningError, match=words):
            st.plan(model, **{"start": upside_down(model), "duration": 0.2} | asked)
    plan = st.plan(model, start=upside_down(model), duration=0.2, bounds=BOUNDS)
    for words, call in {"Gains": lambda: plan.gains, "Mpc": lambda: st.Mpc(model, plan)}.items():
        with row(words), pytest.raises(PlanningError, match=f"{words}: .*fin_right"):
            call()


def test_scenes_name_chains():
    table, size = {"start": {"q": [0], "v": [0]}, "duration": 0.2}, {"kg": 8.0, "m": 2.0, "s": 1.0}
    table |= {"bounds": {"angle": {"hind_hip": "90 deg", "tail": ["1 deg", 2]}, "torque": "1 mN m"}}
    table |= {"goal": {"chains": {"hind": ["free", "180 deg"]}}}
    found = plan_arguments(table, size)
    bounds, goal = found["bounds"], found["goal"]
    assert bounds.angle == {"hind_hip": np.pi / 2, "tail": [np.pi / 180, 2]}
    assert bounds.torque == 0.032 and goal.chains == {"hind": (None, np.pi)}
    sized = plan_arguments(table | {"bounds": {"torque": {"hind": "1 mN m"}}}, size)
    assert sized["bounds"].torque == {"hind": 0.032}


@pytest.mark.slow  # it makes the model of the scene
def test_a_gecko_rights_itself_by_its_tail_and_its_legs():
    plan = planned("gecko_legs_righting")
    assert plan.success
    how = {"method": "dp8", "rtol": 1e-10, "atol": 1e-12, "t_span": plan.duration}
    motion = st.simulate(plan.model, *plan.start, controller=plan.controller, **how)
    assert st.summary(plan.model, motion)["tilt_end_deg"] < 0.01
    assert motion.q[-1, 9:] == pytest.approx(0, abs=1e-3)
    assert np.abs(motion.q[:, 9:]).max() < np.radians(30) * 1.002


@pytest.mark.slow  # it makes its model
def test_a_phase_plans_the_flight_of_a_tree_to_its_landing(tmp_path):
    text = (SCENES / "gecko_legs_righting.toml").read_text()
    model, plan = text[: text.index("[plan]")], text[text.index("[plan.goal]") :]
    start = "[simulate.start]\nheight = 1\nroll = '180 deg'\n"
    phase = "[[phase]]\nname = 'air'\nduration = 0.5\n[phase.plan]\nsmoothing = 1e-6\n"
    words = ["contacts = ['torso']\n", model, start, phase, plan.replace("[plan", "[phase.plan")]
    (tmp_path / "gecko.toml").write_text("".join(words))
    motion = st.scenario(tmp_path / "gecko.toml").simulate(output_step=1e-4)
    told, touch = motion.info["phases"][0]["plan"], motion.events[0]["time"]
    assert told["success"] and touch - 0.01 < told["duration_s"] < touch
    q = motion.at(told["duration_s"]).q
    assert st.pitch_roll_yaw(q)[:2] == pytest.approx([0, 0], abs=np.radians(0.5))
    assert q[15:] == pytest.approx(0, abs=0.02)
