"""What a problem may ask for: damping, objectives, bounds, goals, paths, and the ground."""

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import angle_deg, from_angles
from serpentail.planning.nlp.coordinates import Attitude
from serpentail.planning.nlp.node import PARAMETERS, _point, variables_of
from serpentail.planning.nlp.start import shared_of
from serpentail.planning.result.full_state import com_at_start, full_state
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import AGAIN, DURATION, integrated, planned, rat, start

COARSE = {"tolerance": None, "intervals": 8}
SOFT = st.Bounds(angle=np.pi / 3, torque=0.005)
LEGS = st.Legs.fixed(3.6, -0.3)
FEET = 6  # points of the feet, which come first


def bend(point):
    return casadi.sumsqr(point.tail) + 1e-3 * casadi.sumsqr(point.torque / 1e-3)


def late(point):
    weight = point.parameters["torso_mass"] / 0.10572
    return weight * casadi.sumsqr(point.torque / 1e-3) * casadi.exp(-point.time / 0.05)


def early(point):
    return casadi.sumsqr(point.torque / 1e-3) * casadi.exp(point.time / 0.05)


def first_rate(point):
    return point.tail_rate[0]


def least_rate(plan):
    return plan.curve.at(plan.curve.ends)["tail_rate"][1:, 0].min()


def test_damping_is_part_of_the_motion():
    plan = planned(damping=1e-4, guess=planned())
    q, _ = integrated(rat(), plan)
    assert plan.success
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), plan.trajectory.attitude[-1]) < 0.011


def test_plans_of_least_time_are_shorter_straight_and_at_their_bounds():
    """From passive flight: a plan of least effort comes before."""
    settings = {"start": start(rat()), "duration": (0.1, DURATION), "bounds": SOFT, "track": False}
    plan, calm = (st.plan(rat(), objective=name, **settings) for name in ("time", "effort"))
    assert plan.success and plan.duration < 0.95 * calm.duration
    assert plan.report["objective"] == plan.duration
    assert np.abs(plan.trajectory.tau).max() > 0.9 * 0.005
    ends = plan.curve.ends
    middles = plan.torque((ends[:-1] + ends[1:]) / 2)
    outer = [plan.torque(ends[:-1] + s * np.diff(ends)) for s in (0.1, 0.9)]
    np.testing.assert_allclose(middles, sum(outer) / 2, atol=1e-8)


def test_energy_plans_from_passive_flight_are_true():
    """|power| has a kink: its rounding is lowered from round to round."""
    settings = {"start": start(rat(), 2), "duration": (0.3, 0.5), "track": False}
    plans = [
        st.plan(rat(), bounds=st.Bounds(angle=np.pi / 3), objective=objective, **settings)
        for objective in ("energy", "effort")
    ]
    assert all(plan.success for plan in plans)
    energy = plans[0].report["energy_J"]
    assert energy < 0.95 * plans[1].report["energy_J"]
    assert plans[0].report["objective"] == pytest.approx(energy, rel=0.2)


def test_rate_bounds_hold_at_the_nodes():
    """Half the rate that the plan would like."""
    given = AGAIN | COARSE | {"goal": st.Goal(torso_rate=None), "guess": planned(**COARSE)}
    given |= {"bounds": st.Bounds(angle=np.pi / 3, rate=2.5)}
    plan = st.plan(rat(), start=start(rat()), **given)
    assert plan.report["converged"]
    assert 2.45 < np.abs(plan.curve.at(plan.curve.ends)["tail_rate"]).max() <= 2.5 + 1e-6


def test_torques_are_one_polynomial_in_a_control_interval():
    """However fine the mesh of the states is."""
    for objective, degree in (("effort", 2), ("time", 1)):
        plan = planned(objective=objective, controls=4, intervals=16, tolerance=None)
        assert plan.report["converged"] and plan.mesh.intervals == 16
        for k in range(4):
            times = DURATION * (k + np.linspace(0.01, 0.99, 30)) / 4
            torques = plan.torque(times)[:, 0]
            fit = np.polyval(np.polyfit(times - times[0], torques, degree), times - times[0])
            np.testing.assert_allclose(fit, torques, atol=1e-7, err_msg=objective)


def test_goals_of_the_tail_and_of_a_whole_attitude():
    wanted = from_angles(np.array([0.1, -0.05, 0.2]))
    goal = st.Goal(attitude=wanted, torso_rate=None, tail=(0.1, None), tail_rate=(None, 0.0))
    for coordinates in ("quaternion", "euler"):
        given = AGAIN | COARSE | {"start": start(rat()), "attitude": coordinates}
        plan = st.plan(rat(), goal=goal, **given)
        end = plan.trajectory
        with row(coordinates):
            assert plan.report["converged"] and angle_deg(end.attitude[-1], wanted) < 1e-5
            assert end.tail[-1, 0] == pytest.approx(0.1, abs=1e-7)
            assert end.v[-1, 7] == pytest.approx(0, abs=1e-6)


def test_effort_counts_rates_as_torques_of_a_damper():
    fine = {"tolerance": None, "intervals": 20}
    # Of several optima, which one is found from afar hangs on rounding: compare two of one valley.
    for plan in (planned(**fine), planned(**fine, smoothing=0.0, guess=planned(**fine))):
        flight, c = plan.trajectory, plan.problem.smoothing
        integrand = np.sum(flight.tau**2 + (c * flight.v[:, 6:]) ** 2, axis=1)
        total = np.trapezoid(integrand, flight.t)
        assert plan.report["objective"] == pytest.approx(total, rel=1e-2)
    assert plan.report["objective"] == pytest.approx(plan.report["effort"], rel=1e-12)
    assert plan.report["effort"] < planned(**fine).report["effort"]


def test_own_objectives_see_tail_time_and_parameters():
    def bent(plan):
        return np.trapezoid(np.sum(plan.trajectory.tail**2, axis=1), plan.trajectory.t)

    rate = (first_rate, -4.0, 9.0)
    plan = planned(objective=bend, path=(rate,), **COARSE)
    assert plan.report["converged"] and least_rate(plan) >= -4.0 - 1e-5
    assert bent(plan) < bent(planned(**COARSE))
    times = np.linspace(0, DURATION, 400)
    spent = [
        np.square(planned(objective=f, **COARSE).torque(times)).sum(axis=1) for f in (late, early)
    ]
    (first, second), (third, fourth) = ((x[:200].sum(), x[200:].sum()) for x in spent)
    assert first < second and third > fourth


def test_path_constraints_of_several_sizes_keep_their_own_bounds():
    """Two bends between wide limits, then one rate's least: as with that rate alone."""
    rate = (first_rate, -4.0, 9.0)
    both = planned(path=((lambda point: point.tail, -50.0, 50.0), rate), **COARSE)
    alone = planned(path=(rate,), **COARSE)
    for plan in (both, alone):
        assert plan.report["converged"] and least_rate(plan) >= -4.0 - 1e-5
    assert both.report["objective"] == pytest.approx(alone.report["objective"], rel=1e-4)
    assert both.report["bound_excess"] == pytest.approx(alone.report["bound_excess"], abs=0.02)


def test_a_path_keeps_the_tip_behind_a_wall():
    free = planned(**COARSE)
    wall = rat().tail_points(free.trajectory.q)[:, -1, 1].min() + 0.005
    path = ((lambda point: point.tip[1], wall, np.inf),)
    plan = planned(path=path, guess=free, intervals=8, tolerance=0.1)
    assert plan.success
    assert rat().tail_points(plan.trajectory.q)[:, -1, 1].min() >= wall * (1 + 1e-3)


def test_points_are_the_models():
    """What paths see; of a scaled quaternion, too: a solver's iterates have any norm."""
    names = ("duration", "time", "center_of_mass", "position", "height", "tail_points", "tip")
    model, coordinates, times = rat(), Attitude("quaternion"), np.linspace(0, DURATION, 7)
    for formulation in ("airborne", "translation-free", "full"):
        plan = planned(formulation=formulation, **COARSE)
        variables = variables_of(formulation, coordinates, 2, np.ones(2))
        zeta = casadi.SX.sym("zeta", 1 + sum(variables.sizes()))
        p = casadi.SX.sym("p", PARAMETERS + 1)
        point = _point(shared_of(model, zeta, p, variables), zeta, p, variables, coordinates)
        function = casadi.Function("point", [zeta, p], [getattr(point, name) for name in names])

        blocks, state = plan.curve.at(times), plan.start
        q, v = full_state(model, state, coordinates, times, blocks)
        com = com_at_start(model, state)
        units = variables.units | {"attitude": 1 / 1.7, "torque": 1.0}
        parts = [name for name, _ in (*variables.states, *variables.algebraic)]
        columns = [blocks[name] / units[name] for name in [*parts, "torque"]]
        unknowns = np.column_stack([np.full(7, DURATION), *columns])
        known = np.concatenate([np.zeros(3), *com, [0.0]])
        given = np.column_stack([np.tile(known, (7, 1)), times / DURATION])
        found = [function(*pair) for pair in zip(unknowns, given, strict=True)]
        duration, time, center, position, height, points, tip = (
            np.array([np.array(each[k]) for each in found]).squeeze() for k in range(len(names))
        )
        fall = model.momentum(q, v)[0][0] / (0.10572 + 0.00351) * times[:, None]
        fall[:, 2] -= 9.8 * times**2 / 2
        tail = model.tail_points(q)
        with row(formulation):
            np.testing.assert_allclose(duration, DURATION, rtol=1e-12)
            np.testing.assert_allclose(time, times, atol=1e-12)
            np.testing.assert_allclose(position, q[:, :3], atol=1e-9)
            np.testing.assert_allclose(height, q[:, 2], atol=1e-9)
            np.testing.assert_allclose(points, tail, atol=1e-9)
            np.testing.assert_allclose(tip, tail[:, -1], atol=1e-9)
            np.testing.assert_allclose(center - com[0], fall, atol=1e-5)


# Models that may touch the ground: as their twins without contacts do.


def footed(height, up=2.4, **settings):
    """The model with feet, and the settings of a plan from a height."""
    model = zoo.model("feet_tail")
    q, v = start(model)
    q[2], v[2] = height, up
    goal = st.Goal(torso_rate=None)
    return model, {"start": (q, v), "duration": 0.3, "goal": goal, "intervals": 10} | settings


def heights(model, plan, first=0):
    """Heights (K,) of the lowest point, or of the lowest from the first on."""
    q, v = plan.trajectory.q, plan.trajectory.v
    legs = np.append(LEGS.curve.at(0.0)[0], np.zeros(4))
    return model.contact_points(q, v, np.tile(legs, (len(q), 1)))[0][:, first:, 2].min(axis=1)


def test_a_flight_is_that_of_the_twin_without_contacts():
    model, settings = footed(0.01)  # in the ground after some ms
    one, other = (st.plan(each, **settings) for each in (rat(), model))
    assert one.success and other.success
    for name in ("effort", "energy_J", "peak_power_W", "duration_s"):
        assert other.report[name] == pytest.approx(one.report[name], rel=1e-5), name
    np.testing.assert_allclose(other.trajectory.q, one.trajectory.q, atol=1e-6)
    np.testing.assert_allclose(other.trajectory.energy, one.trajectory.energy, atol=1e-6)
    assert other.report["open_loop_attitude_error_deg"] <= 0.01
    tracked = one.report["tracked_attitude_error_deg"]
    assert other.report["tracked_attitude_error_deg"] == pytest.approx(tracked, abs=1e-4)


def test_paths_and_clearance_keep_points_above_the_ground():
    """Where the plan without them goes below; the feet, which land, have no clearance."""

    def above(point):  # 1 m at the start, which may be low, to nothing at half the time
        ramp = 0.5 * (1 - 2 * point.time / 0.3 + abs(1 - 2 * point.time / 0.3))
        return point.contact_points[:, 2] + ramp

    model, settings = footed(0.15, track=False)
    free = st.plan(model, **settings)
    late = slice(len(free.trajectory.t) // 2, None)
    floor = heights(model, free)[late].min() + 0.002
    plan = st.plan(model, path=((above, floor, np.inf),), legs=LEGS, guess=free, **settings)
    assert plan.success and heights(model, plan)[late].min() >= floor - 1e-4

    model, settings = footed(0.3, 0.93, track=False)
    free = st.plan(model, **settings)
    least = heights(model, free, FEET)[0] - 0.001
    assert free.success and heights(model, free, FEET).min() < least - 0.002
    plan = st.plan(model, clearance=least, guess=free, **settings)
    assert plan.success and heights(model, plan, FEET).min() >= least - 1e-4


def test_points_of_contact_are_refused_where_they_cannot_be():
    model, settings = footed(0.05)
    path = ((lambda point: point.contact_points[:, 2], 0.0, np.inf),)
    for words, body, changes in (
        ("contact_points: give the plan `legs`", model, {"path": path}),
        ("legs: value 3", model, {"legs": 3}),
        ("no points of tail or torso", rat(), {"clearance": 0.01}),
        ("clearance: value -0.01", model, {"clearance": -0.01}),
        ("clearance: value 0.1: .* lowest point", model, {"clearance": 0.1}),
    ):
        with row(words), pytest.raises(st.PlanningError, match=words):
            st.plan(body, **settings | changes)
