"""Gains along a plan: against least squares over simulated steps, their ticks, where they hold."""

import ctypes
import pickle
import subprocess
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.planning.gains.riccati import ANGLE, RATE, TURN, TURN_RATE
from serpentail.planning.result.truth import planned_torques
from tests.support import zoo
from tests.support.predictive import TORQUE, plan_of
from tests.support.rows import row
from tests.support.tumbling import rat, start

PUSH = np.array([0.6, -0.4, 0.7, 1.0, -1.0])  # rad/s, of torso and tail


@pytest.fixture(scope="module")
def plan():
    return plan_of(1, intervals=12, tolerance=0.01)


def moved(q, v, e):
    """The states that errors e (.., 10) make of a state."""
    turns = Rotation.from_quat(np.roll(q[3:7], -1)) * Rotation.from_rotvec(e[:, :3])
    qs, vs = np.tile(q, (len(e), 1)), np.tile(v, (len(e), 1))
    qs[:, 3:7] = np.roll(turns.as_quat(), 1, axis=1)
    qs[:, 7:] += e[:, 6:8]
    return qs, vs + np.column_stack([0 * e[:, :3], e[:, 3:6], e[:, 8:]])


def errors(q, v, q0, v0):
    """Errors (.., 10) of states (.., size) from others: twice the vector part, by SciPy."""
    was, now = (Rotation.from_quat(np.roll(x[..., 3:7], -1, axis=-1)) for x in (q0, q))
    vector = (was.inv() * now).as_rotvec()
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    vector = vector * np.sinc(angle / 2 / np.pi)  # 2 sin(angle / 2) / angle
    parts = [vector, (v - v0)[..., 3:6], (q - q0)[..., 7:], (v - v0)[..., 6:]]
    return np.concatenate(parts, axis=-1)


def tilt(q):
    """The angle (deg) between the torso's and the world's z axis."""
    up = Rotation.from_quat(np.roll(q[3:7], -1)).apply([0, 0, 1])
    return np.degrees(np.arctan2(np.hypot(*up[:2]), up[2]))


def at(plan, t):
    """The planned state at times (K,), by a cubic spline through the samples."""
    motion = plan.trajectory.resample(np.atleast_1d(t))
    return motion.q, motion.v


def linear_step(plan, t, end, small=1e-4):
    """The slopes of the errors at a step's end by those at its begin, and by torques (10, 12)."""
    changes = small * np.vstack([np.eye(12), -np.eye(12)])
    q, v = at(plan, [t, end])
    qs, vs = moved(q[0], v[0], changes[:, :10])
    laws = []
    for change in changes[:, 10:] * TORQUE:
        torques = planned_torques(plan.curve)
        torques.coefficients[:, :, 0] += change
        laws.append(st.TorqueCurve(torques, plan.problem.damping))
    settings = {"controller": laws, "rtol": 1e-11, "output_step": end - t}
    runs = st.simulate(rat(), qs, vs, t_span=(t, end), **settings)
    found = errors(runs.q[:, -1], runs.v[:, -1], q[1], v[1])
    return ((found[:12] - found[12:]) / (2 * small)).T


def residuals(plan):
    """Weighed slopes (.., 10) of what the goal wants to be zero, by the error at the end."""
    goal, small, (q, v) = plan.problem.goal, 1e-6, at(plan, plan.duration)
    both = [moved(q[0], v[0], sign * small * np.eye(10)) for sign in (1, -1)]

    def wanted(q, v):
        found = [2 * q[:, 4:6] / TURN]
        found += [] if goal.torso_rate is None else [(v[:, 3:6] - goal.torso_rate) / TURN_RATE]
        parts = (q[:, 7:], goal.tail, ANGLE), (v[:, 6:], goal.tail_rate, RATE)
        for values, given, unit in parts:
            if given is not None:
                found.append(((values - given) / unit)[:, np.isfinite(given)])
        return np.column_stack(found)

    return ((wanted(*both[0]) - wanted(*both[1])) / (2 * small)).T


def test_gains_solve_the_least_squares_over_simulated_steps():
    """Of all torques from a step to the end, as one problem, the first ones are K e."""
    tail = st.Goal("upright", None, (0.1, None), (None, 0.0))
    for goal, damping in ((st.Goal(), 0.0), (tail, 1e-4)):
        plan = plan_of(0, goal=goal, damping=damping, intervals=24, solver="fatrop")
        gains = st.Gains(plan, rate=60, knots=1000)
        times = np.append(gains.times, plan.duration)
        steps = [linear_step(plan, *pair) for pair in pairwise(times)]
        R, smooth = 1 / TORQUE**2 / plan.duration, plan.problem.smoothing
        for first in (0, len(steps) // 2, len(steps) - 2):
            width = 10 + 2 * (len(steps) - first)  # the error at first, then all torques
            e, rows = np.eye(10, width), []
            for i, step in enumerate(steps[first:]):
                own = np.eye(2, width, 10 + 2 * i)
                h = times[first + i + 1] - times[first + i]
                rows += [np.sqrt(h * R) * own, np.sqrt(h * R) * smooth * e[8:]]
                e = step[:, :10] @ e + step[:, 10:] @ own / TORQUE
            J = np.vstack([*rows, residuals(plan) @ e])
            torques, *_ = np.linalg.lstsq(J[:, 10:], -J[:, :10], rcond=None)
            K, least = gains.K[first], J[:, :10] + J[:, 10:] @ torques
            with row(goal, first):
                np.testing.assert_allclose(K, torques[:2], atol=5e-3 * np.abs(K).max())
                e = np.random.default_rng(first).normal(size=10)
                i, j = np.tril_indices(10)
                found = gains.tables["costs"][first] @ (e[i] * e[j])
                assert found == pytest.approx(np.sum((least @ e) ** 2), rel=1e-2)


def test_a_tick_adds_the_gains_times_the_error_within_the_bounds(plan):
    gains = st.Gains(plan, within=None)
    assert gains.K.shape == (len(gains.times), 2, 10) and len(gains.times) <= 40
    assert gains.times[0] == 0 and gains.times[-1] > 0.4 - 2e-3  # where gains grow fastest
    for t in (0.0, 0.0123, 0.2, 0.39, 0.3995):
        q, v = (x[0] for x in at(plan, t))
        for size in (0.0, 0.01, 3.0):
            qs, vs = moved(q, v, size * np.array([[0.3, -0.2, 0.4, 1, 2, 3, 0.2, 0.1, 4, 5]]))
            e = errors(qs[0], vs[0], q, v)
            knot = np.flatnonzero(gains.times <= t + 1e-12)[-1]
            wanted = plan.torque(min(t + 5e-4, 0.4))[0] + gains.K[knot] @ e
            for sign in (1, -1):  # of a quaternion, which is the same attitude
                qs[0, 3:7] *= sign
                with row(t, size, sign):
                    off = 1e-3 * np.abs(gains.K[knot]).max()  # the spline's
                    bounded = np.clip(wanted, -TORQUE, TORQUE)
                    np.testing.assert_allclose(gains(t, qs[0], vs[0]), bounded, atol=off)
                    np.testing.assert_allclose(gains.error([t], qs, vs)[0], e, atol=1e-3)
            # what is no state leaves the plan's torques
            for wrong in (np.full(9, np.nan), np.full(9, np.inf), np.zeros(9), 2 * qs[0]):
                alone = np.clip(plan.torque(min(t + 5e-4, 0.4))[0], -TORQUE, TORQUE)
                np.testing.assert_allclose(gains(t, wrong, vs[0]), alone, atol=1e-12)
    for t in (0.4, 1.0, np.nan):
        np.testing.assert_array_equal(gains(t, q, v), 0)


def test_runs_tick_at_their_rate_on_the_clock_of_their_phase(plan):
    """As the same gains called by ``Sampled``; a body with damping keeps it."""
    for law, rate in ((plan.gains, 1000), (st.Gains(plan, rate=130, within=None), 130)):
        q, v = start(rat(), 1)
        v[3:] += PUSH
        settings = {"t_span": 0.45, "method": "dop853"}
        own = st.simulate(rat(), q, v, controller=law, **settings)
        again = st.simulate(rat(), q, v, controller=st.Sampled(law, rate=rate), **settings)
        np.testing.assert_allclose(own.q, again.q, atol=1e-8)
        assert own.info["gains"]["ticks"] == np.ceil(0.4 * rate)
        later = st.Phases([(0.1, law)])
        moved_on = st.simulate(rat(), q, v, controller=later, t_span=(0.1, 0.55), method="dop853")
        np.testing.assert_allclose(moved_on.q[-1], own.q[-1], atol=1e-7)
    damped = st.Gains(plan_of(1, damping=1e-4), within=None)
    motion = st.simulate(rat(), q, v, controller=damped, t_span=0.5, output_step=0.5)
    end = motion.q[-1], motion.v[-1]
    for torques in (motion.tau[-1], damped(0.5, *end)):  # after the plan's end
        np.testing.assert_allclose(torques, -1e-4 * end[1][6:], rtol=1e-9)


def test_flights_that_end_wrong_are_flagged_and_most_others_are_not(plan):
    """Of another body too, from pushes that were not measured."""
    measured, random = plan.gains.validity, np.random.default_rng(7)
    wrong = measured.errors > 3
    assert wrong.any() and measured.push == measured.pushes[: np.argmax(wrong)].max() > 1
    heavy = rat().with_parameters(tail_mass=1.15 * rat().parameters["tail_mass"])
    for body, most, flags in (
        (rat(), measured.push, (0, 12)),
        (rat(), 6, (20, 60)),
        (heavy, 6, (20, 60)),
    ):
        q, v = start(rat(), 1)
        turns = v + random.uniform(0, most, (60, 1)) * np.eye(8)[random.integers(3, 6, 60)]
        runs = st.simulate(body, q, turns, controller=plan.gains, t_span=0.4)
        tilts = np.array([tilt(run.q[-1]) for run in runs])
        flagged = np.array([run.info["gains"]["beyond"] > 0 for run in runs])
        with row(body.parameters["tail_mass"], most):
            assert (tilts[~flagged] < 3).all() and flags[0] <= flagged.sum() <= flags[1]
    free = st.Gains(plan, within=None)
    run = st.simulate(rat(), q, v + 20, controller=free, t_span=0.4)
    assert run.info["gains"]["beyond"] == 0 < run.info["gains"]["saturated"]
    anyhow = st.Gains(plan_of(1, goal=st.Goal(None, None, tail=(0.1, None))), flights=4)
    assert not anyhow.validity.errors.any() and anyhow.validity.push == anyhow.validity.pushes[-1]


def test_gains_right_bodies_that_their_plan_does_not(plan):
    q, v = start(rat(), 1)
    for name in ("tail_mass", "torso_inertia", "tail_length"):
        changed = {name: 1.15 * np.asarray(rat().parameters[name])}
        body, tilts = rat().with_parameters(**changed), []
        for law in (st.TorqueCurve(planned_torques(plan.curve)), plan.gains):
            end = st.simulate(body, q, v, controller=law, t_span=0.4).q[-1]
            tilts.append(tilt(end))
        with row(name):
            assert tilts[1] < 0.5 and tilts[0] > 2


def test_written_c_makes_the_same_torques(plan, tmp_path):
    gains = plan.gains
    q, v = (x[0] for x in at(plan, 0.1))
    for real, kind, digits in (("double", ctypes.c_double, 1e-15), ("float", ctypes.c_float, 1e-6)):
        folder = tmp_path / real
        _, code = gains.write_c(folder, real)
        made = folder / "gains.so"
        strict = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"]
        command = ["gcc", *strict, "-O2", "-shared", "-fPIC", str(code), "-o", str(made)]
        subprocess.run(command, check=True)
        library, name = ctypes.CDLL(str(made)), f"{rat().name}_gains"
        table = ctypes.addressof(ctypes.c_int.in_dll(library, f"{name}_plan"))
        state = (ctypes.c_long * 8)()
        memory, tau = (kind * 12)(), (kind * 2)()
        begin, tick = (getattr(library, f"{name}_{part}") for part in ("begin", "tick"))
        begin.argtypes = (ctypes.c_void_p,) * 3
        tick.argtypes = (ctypes.c_void_p, kind, *(ctypes.c_void_p,) * 3)
        begin(state, table, memory)
        for size, told in ((0.0, 0), (0.3, 0), (10.0, 6), (np.nan, 1)):
            pushed = v + size * np.append(np.zeros(3), PUSH)
            with row(real, size):
                assert tick(state, 0.1, (kind * 9)(*q), (kind * 8)(*pushed), tau) == told
                wanted = gains(0.1, q, np.nan_to_num(pushed, nan=1e300))
                np.testing.assert_allclose([*tau], wanted, atol=digits)
        assert [*state[2:6]] == [4, 1, 1, 1]  # ticks, failed, saturated, beyond


def test_what_has_no_gains_is_refused(plan, tmp_path):
    longer = zoo.model("m2_n2")
    for words, planned, settings in (
        ("plan: value", plan.trajectory, {}),
        ("2 tail coordinates, the model 4", plan, {"model": longer}),
        ("float: needs double", plan, {"model": zoo.model("single")}),
        ("compiled=False", plan, {"model": st.load(zoo.folder("m1_n3"), compiled=False)}),
        ("model: value None", pickle.loads(pickle.dumps(plan)), {}),
        ("rate: value 0", plan, {"rate": 0}),
        ("rate: value 1000000000.0", plan, {"rate": 1e9}),
        ("knots: value 0", plan, {"knots": 0}),
        ("within: value -1", plan, {"within": -1}),
        ("flights: value 0", plan, {"flights": 0}),
        ("seed: value -1", plan, {"seed": -1}),
    ):
        with row(words), pytest.raises(st.PlanningError, match=words):
            st.Gains(planned, **settings)
    assert plan.gains is plan.gains
    again = st.Gains(pickle.loads(pickle.dumps(plan)), model=rat())
    np.testing.assert_allclose(again.K, plan.gains.K, rtol=1e-9)
    with pytest.raises(st.SimulationError, match="q: value"):
        plan.gains(0.0, np.zeros(3), np.zeros(8))
    upright = np.r_[np.zeros(3), 1, np.zeros(7)]
    with pytest.raises(st.SimulationError, match="tail coordinates: value 4"):
        st.simulate(longer, upright, np.zeros(10), controller=plan.gains)
    for settings in ({"folder": 3}, {"folder": tmp_path, "real": "half"}):
        with pytest.raises(st.PlanningError, match="write_c: "):
            plan.gains.write_c(**settings)
