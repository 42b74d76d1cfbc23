"""Predictive control: its steps against CasADi and SciPy, its clock, its effect."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail import MpcFlag
from serpentail.basics.attitude import quaternion_rate
from serpentail.planning.result.truth import planned_torques
from tests.support import zoo
from tests.support.predictive import TORQUE, Reference, correction_of, plan_of
from tests.support.rows import row
from tests.support.tumbling import DURATION, rat, start


@pytest.fixture(scope="module")
def plan():
    return plan_of(1)


def disturbed(size: float = 1.0, seed: int = 1):
    q, v = start(rat(), seed)
    q[7:] += 0.05 * size
    v[3:6] += size * np.array([0.3, -0.2, 0.4])
    v[6:] += 0.2 * size
    return q, v


REST, TAIL = {"goal": st.Goal()}, {"goal": st.Goal("upright", None, (0.1, None), (None, 0.0))}
NO_ANGLE = st.Bounds(angle=None)
TICKS = [
    ({}, 0.003, 1.0, True, {}),
    ({}, 0.003, 8.0, True, {}),
    (REST | {"bounds": NO_ANGLE}, 0.103, 0.1, False, {"intervals": 2}),
    (TAIL | {"damping": 1e-4}, 0.311, 0.1, True, {"intervals": 4}),
    ({}, 0.053, 0.1, True, {"horizon": 0.15}),
    ({}, 0.307, 0.1, True, {"horizon": 0.15}),  # of which 0.1 s are left
]


def test_a_tick_is_the_gauss_newton_step_of_casadi_and_scipy():
    for task, t, size, bound, settings in TICKS:
        shared = {"intervals": 3, "step": 0.021, "iterations": 1}
        mpc = st.Mpc(rat(), plan_of(0, **task), **shared | settings)
        q, v = disturbed(size, 0)
        end = min(t + settings.get("horizon", 1.0), DURATION)
        reference = Reference(mpc, t, q, v, end)
        wanted = reference.step(np.zeros(reference.N * 2))
        with row(task, t, size):
            assert mpc.tick(t, q, v)
            found = correction_of(mpc)
            assert bool(mpc.info["set_changes"]) == bound
            np.testing.assert_allclose(found, wanted, atol=1e-8 * TORQUE)
            tail, slopes, most = reference.largest(np.zeros(reference.N * 2))
            assert (np.abs(tail + slopes @ found) <= most * (1 + 1e-9)).all()


def test_bounds_of_angles_and_rates_are_kept_and_flags_tell_where_not():
    """A push that the goal answers with large angles; the predicted motion by CasADi."""
    plan, free = plan_of(0, bounds=st.Bounds(angle=1.1, rate=40.0)), NO_ANGLE
    settings = {"intervals": 4, "step": 0.011, "iterations": 4}
    q, v = disturbed(1.0, 0)
    for bounds, held in ((None, True), (st.Bounds(angle=0.9, rate=25.0), True), (free, False)):
        mpc = st.Mpc(rat(), plan, bounds=bounds, **settings)
        assert mpc.tick(0.003, q, v)
        reference = Reference(mpc, 0.003, q, v, DURATION)
        tail = np.array(reference.tail(correction_of(mpc))[0]).reshape(-1, 4)
        given = plan.problem.bounds if bounds is None else bounds
        most = (
            np.array([1.1, 40.0])
            if not held
            else np.array([np.max(given.angle), np.max(given.rate)])
        )
        within = np.abs(tail).reshape(-1, 2, 2).max(axis=(0, 2)) <= 1.003 * most
        flags = MpcFlag(mpc.info["flags"][0])
        with row(bounds, flags):
            assert within.all() == held
            assert MpcFlag.SECOND in flags and MpcFlag.BOUND not in flags
    q[7:] = 1.2  # it is beyond its bound
    mpc = st.Mpc(rat(), plan, **settings)
    assert mpc.tick(0.003, q, v) and MpcFlag.BOUND in MpcFlag(mpc.info["flags"][0])


def test_a_tick_takes_another_step_while_the_end_is_far_off():
    plan = plan_of(0)
    near, far = start(rat(), 0), disturbed(1.0, 0)
    for (q, v), most, steps in ((near, 5, 1), (far, 1, 1), (far, 2, 2), (far, 30, None)):
        mpc = st.Mpc(rat(), plan, iterations=most)
        assert mpc.tick(0.0, q, v)
        taken, flags = mpc.info["steps"], MpcFlag(mpc.info["flags"][0])
        assert taken == steps or (steps is None and 2 < taken < 30)
        assert (MpcFlag.SECOND in flags) == (taken > 1)
        off = mpc._own.run.state.off * 1e-3  # rad
        assert (MpcFlag.MISS in flags) == (off > np.radians(1)) == (taken == most)


def test_floats_compute_what_doubles_do():
    single = zoo.model("single_ground")
    for t, size, settings in (
        (0.0, 0.3, {}),
        (0.0, 0.3, {"delay": 5e-3}),
        (0.053, 0.1, {"horizon": 0.15}),
        (0.307, 0.1, {"horizon": 0.15}),
    ):
        mpcs = [st.Mpc(model, plan_of(0), **settings) for model in (rat(), single)]
        times = t + 0.01 + np.arange(8) * (DURATION - t - 0.01) / 8
        with row(t, size, settings):
            assert all(mpc.tick(t, *disturbed(size, 0)) for mpc in mpcs)
            double, float_ = (np.array([mpc.torque(at) for at in times]) for mpc in mpcs)
            np.testing.assert_allclose(float_, double, atol=0.05 * TORQUE)
            assert mpcs[0].info["flags"] == mpcs[1].info["flags"]
    q, v = start(rat(), 0)
    alone, legs = {"t_span": DURATION}, st.Legs.fixed(3.6, -0.3)
    flights = [
        st.simulate(rat(), q, v, controller=st.Mpc(rat(), plan_of(0)), **alone),
        st.simulate(single, q, v, controller=st.Mpc(single, plan_of(0)), legs=legs, **alone),
    ]
    np.testing.assert_allclose(flights[1].q[-1], flights[0].q[-1], atol=2e-3)
    assert flights[1].info["mpc"]["ticks"] == 40 and flights[1].info["mpc"]["failed"] == 0


def test_ticks_measure_the_state_at_their_times(plan):
    """Whatever a method tries in between: as one tick after another, by hand. A phase has a clock
    of its own.
    """
    inertia = 1.15 * np.array(rat().parameters["torso_inertia"])
    body, mpc = rat().with_parameters(torso_inertia=inertia), st.Mpc(rat(), plan, rate=40)

    def slope(t, y):
        q, v = y[: body.nq], y[body.nq :]
        tau = mpc.torque(t) - mpc.plan.problem.damping * v[6:]
        q_dot = np.concatenate([v[:3], quaternion_rate(q[3:7], v[3:6]), v[6:]])
        return np.concatenate([q_dot, body.forward_dynamics(q, v, tau)])

    y = np.concatenate(start(rat(), 1))
    for k in range(4):
        mpc.tick(k / 40, *np.split(y, [body.nq]))
        ends = (k / 40, np.nextafter((k + 1) / 40, 0))
        y = solve_ivp(slope, ends, y, "DOP853", rtol=1e-10, atol=1e-12, max_step=2e-3).y[:, -1]
    q, v = np.split(y, [body.nq])
    for method in ("tsit5", "dop853", "rk4"):
        for law, span in ((mpc, 0.1), (st.Phases([(0.1, mpc)]), (0.1, 0.2))):
            settings = {"controller": law, "method": method, "t_span": span}
            motion = st.simulate(body, *start(rat(), 1), **settings)
            with row(method, span):
                np.testing.assert_allclose(motion.q[-1, 3:], q[3:], atol=2e-6)
                np.testing.assert_allclose(motion.v[-1, 3:], v[3:], atol=2e-5)
                assert motion.info["mpc"]["ticks"] == 4 and motion.info["mpc"]["failed"] == 0
                assert np.abs(motion.tau).max() <= TORQUE


def test_torques_act_after_the_delay_on_what_is_foretold(plan):
    """The correction is the one that a tick without delay computes where the body will be."""
    late, prompt = st.Mpc(rat(), plan, delay=8e-3), st.Mpc(rat(), plan)
    q, v = disturbed()
    assert late.tick(0.1, q, v)
    np.testing.assert_allclose(late.torque(0.1079), plan.torque(0.1079)[0], atol=1e-12)
    law = st.TorqueCurve(planned_torques(plan.curve))
    motion = st.simulate(rat(), q, v, controller=st.Phases([(0.0, law)]), t_span=(0.1, 0.108))
    assert prompt.tick(0.108, motion.q[-1], motion.v[-1])
    for t in (0.108001, 0.2, 0.39):
        assert np.abs(prompt.torque(t) - plan.torque(t)).max() > 1e-5
        np.testing.assert_allclose(late.torque(t), prompt.torque(t), atol=1e-8)


def test_runs_that_share_a_controller_have_memories_of_their_own(plan):
    q, v = start(rat(), 1)
    turns = v + np.outer([0.0, 0.4, -0.8], np.eye(len(v))[3])
    mpc = st.Mpc(rat(), plan)
    settings = {"controller": mpc, "t_span": 0.2, "method": "tsit5", "output_step": 0.01}
    runs = st.simulate(rat(), q, turns, threads=2, **settings)
    for k, own in enumerate(turns):
        alone = st.simulate(rat(), q, own, **settings)
        np.testing.assert_array_equal(runs.q[k], alone.q)
        assert runs[k].info["mpc"]["ticks"] == 20
    assert np.abs(runs.tau[0] - runs.tau[1]).max() > 1e-4 and mpc.info["ticks"] == 0


def test_a_tick_that_fails_is_counted_and_changes_nothing(plan):
    q, v = disturbed()
    for wrong in (np.nan, np.inf, 1e200):
        mpc = st.Mpc(rat(), plan)
        assert mpc.tick(0.0, q, v)
        before = mpc.torque(0.2)
        assert not mpc.tick(0.01, q, np.where(np.arange(len(v)) == 4, wrong, v))
        assert not mpc.tick(0.01, np.where(np.arange(len(q)) == 3, wrong, q), v)
        assert not mpc.tick(0.01, 0 * q, v)
        np.testing.assert_array_equal(mpc.torque(0.2), before)
        assert mpc.info["ticks"] == 4 and mpc.info["failed"] == 3
        assert all(MpcFlag.KEPT in MpcFlag(flags) for flags in mpc.info["flags"][1:])
        mpc.begin()
        assert mpc.info["ticks"] == mpc.info["failed"] == 0
        np.testing.assert_allclose(mpc.torque(0.2), plan.torque(0.2)[0], rtol=1e-12)
    mpc = st.Mpc(rat(), plan, rate=50)  # called by hand it ticks by its clock
    for t in (0.0, 0.001, 0.0199, 0.02, 0.021, 0.3795, 0.3801, 0.39, 0.45):
        tau = mpc(t, q, v)
    assert mpc.info["ticks"] == 3  # none in the last 20 ms
    np.testing.assert_array_equal(tau, 0 * tau)


def test_wrong_settings_are_refused(plan, tmp_path):
    values = {"rate": 0, "horizon": -1, "intervals": 0, "iterations": True, "delay": 0.02}
    values |= {"rest": 0.4, "step": 1e-9}
    for words, settings in {
        **{f"{name}: value {value!r}": {name: value} for name, value in values.items()},
        "rate: value 1000000000.0: needs at most 2.5e": {"rate": 1e9},
        "intervals: value 101": {"intervals": 101},
        "delay: value -0.001": {"delay": -1e-3},
        "rest: value 0.395": {"rest": 0.395, "delay": 5e-3},
        "'intervalls'.*'intervals'": {"intervalls": 3},
        "bounds: value 3": {"bounds": 3},
        "bounds.angle: value -1": {"bounds": st.Bounds(angle=-1)},
        "ignore_path: value 1": {"ignore_path": 1},
    }.items():
        with row(words), pytest.raises(st.PlanningError, match=words):
            st.Mpc(rat(), plan, **settings)
    high = replace(plan, problem=replace(plan.problem, path=((len, 0.0, 1.0),)))
    with pytest.raises(st.PlanningError, match=r"1 constraints of path .* ignore_path=True"):
        st.Mpc(rat(), high)
    assert st.Mpc(rat(), high, ignore_path=True).tick(0.0, *start(rat(), 1))
    mpc = st.Mpc(rat(), plan, intervals=100, delay=0.01)
    with pytest.raises(st.PlanningError, match=r"write_c: folder: value 3"):
        mpc.write_c(3)
    with pytest.raises(OSError, match="is not a folder"):
        mpc.write_c(mpc.write_c(tmp_path / "made" / "here")[0])
    first, again = (st.Mpc(rat(), plan).write_c(tmp_path / name) for name in "ab")
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]


def test_models_and_plans_that_do_not_fit_are_refused(plan):
    longer = zoo.model("m2_n2")
    for words, model, planned in (
        ("plan: value", rat(), plan.trajectory),
        ("2 tail coordinates, the model 4", longer, plan),
        ("compiled=False", st.load(zoo.folder("m1_n3"), compiled=False), plan),
    ):
        with row(words), pytest.raises(st.PlanningError, match=words):
            st.Mpc(model, planned)
    mpc, legs = st.Mpc(rat(), plan), st.Legs.fixed(3.6, -0.3)
    with pytest.raises(st.SimulationError, match="q: value"):
        mpc(0.0, np.zeros(3), np.zeros(8))
    upright, alone = np.r_[np.zeros(3), 1, np.zeros(7)], {"controller": mpc, "t_span": 0.01}
    with pytest.raises(st.SimulationError, match="tail coordinates: value 4"):
        st.simulate(longer, upright, np.zeros(10), **alone)
    with pytest.raises(st.SimulationError, match=r"Mpc: .* float, the controller's .* double"):
        st.simulate(zoo.model("single_ground"), upright[:9], np.zeros(8), legs=legs, **alone)


def test_a_phase_of_a_sequence_is_controlled_predictively():
    right = {"duration": 0.3, "goal": st.Goal(torso_rate=None), "bounds": NO_ANGLE}
    right |= {"mesh": st.Mesh(intervals=11), "tolerances": st.Tolerances(attitude=None)}
    right["solver"] = st.Solver(track=False)
    tracking = st.Tracking(mpc={"rate": 50, "intervals": 4})
    phases = [st.Phase("fall", 0.05), st.Phase("right", 0.3, plan=right, tracking=tracking)]
    run = st.Sequence(rat(), [*phases, st.Phase("after", 0.01)]).simulate(*start(rat(), 1))
    mpc = st.Mpc(rat(), run.phases[1].plan, rate=50, intervals=4)
    alone = st.simulate(rat(), mpc.plan.problem.q0, mpc.plan.problem.v0, controller=mpc, t_span=0.3)
    end = np.abs(run.trajectory.t - 0.35).argmin()
    np.testing.assert_allclose(run.trajectory.q[end], alone.q[-1], atol=1e-4)
    assert run.trajectory.info["mpc"] == alone.info["mpc"] and alone.info["mpc"]["ticks"] == 15
    with pytest.raises(st.SimulationError, match="Tracking: mpc: value 3"):
        st.Tracking(mpc=3)
