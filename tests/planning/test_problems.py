"""What a problem may ask for: damping, objectives, bounds, goals, paths, and the ground; and which
goals the conserved angular momentum forbids.
"""

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail.basics.attitude import angle_deg, from_angles, rotation_matrix
from serpentail.planning.momentum import refuse_impossible
from serpentail.planning.problem import checked_goal
from serpentail.planning.program.build import plan_program, with_room
from serpentail.planning.result.excess import path_values
from serpentail.planning.result.full_state import com_at_start, full_state
from tests.support import zoo
from tests.support.posed import posed
from tests.support.rows import row
from tests.support.tumbling import AGAIN, DURATION, integrated, keyed, planned, rat, start

COARSE = {"tolerance": None, "intervals": 8}
LEGS = st.Legs.fixed(3.6, -0.3)
FEET = 6  # points of the feet, which come first


def test_attitudes_have_any_norm_and_equal_limits_have_room_between_them():
    attitude, limits = np.array([0.5, -0.1, 0.7, 0.5]), np.array([[0.5, -np.inf], [0.5, 2.0]])
    for factor in (1e-200, 0.3, 4.0, 1e200):
        found = checked_goal(st.Goal(factor * attitude), rat().layout).attitude
        np.testing.assert_allclose(found, attitude, rtol=1e-15)
    (least, below), (most, above) = with_room(limits)
    assert 0.499 < least < 0.5 < most < 0.501 and (below, above) == (-np.inf, 2.0)


def test_damping_is_part_of_the_motion():
    plan = planned(damping=1e-4, guess=planned())
    q, _ = integrated(rat(), plan)
    assert plan.success
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), plan.trajectory.attitude[-1]) < 0.011


def test_plans_of_least_time_and_energy_from_passive_flight():
    settings = {"start": start(rat()), "duration": (0.1, DURATION), "track": False}
    settings["bounds"] = st.Bounds(angle=np.pi / 3, torque=0.005)
    plan, calm = (keyed(rat(), objective=name, **settings) for name in ("time", "effort"))
    assert plan.success and plan.duration < 0.95 * calm.duration
    assert plan.report["objective"] == plan.duration
    assert np.abs(plan.trajectory.tau).max() > 0.9 * 0.005
    ends = plan.curve.ends
    middles = plan.torque((ends[:-1] + ends[1:]) / 2)
    outer = [plan.torque(ends[:-1] + s * np.diff(ends)) for s in (0.1, 0.9)]
    np.testing.assert_allclose(middles, sum(outer) / 2, atol=1e-8)  # straight

    # |power| has a kink: its rounding is lowered from round to round
    settings |= {"start": start(rat(), 2), "duration": (0.3, 0.5), "intervals": 36}
    settings["bounds"] = st.Bounds(angle=np.pi / 3)
    plan, calm = (keyed(rat(), objective=name, **settings) for name in ("energy", "effort"))
    assert plan.success and calm.success
    energy = plan.report["energy_J"]
    assert energy < 0.95 * calm.report["energy_J"]
    assert plan.report["objective"] == pytest.approx(energy, rel=0.2)


def test_rate_bounds_hold_at_the_nodes():
    given = AGAIN | COARSE | {"goal": st.Goal(torso_rate=None), "guess": planned(**COARSE)}
    given |= {"bounds": st.Bounds(angle=np.pi / 3, rate=2.5)}
    plan = keyed(rat(), start=start(rat()), **given)
    assert plan.report["converged"]
    assert 2.45 < np.abs(plan.curve.at(plan.curve.ends)["tail_rate"]).max() <= 2.5 + 1e-6


def test_goals_of_the_tail_and_of_a_whole_attitude():
    wanted = from_angles(np.array([0.1, -0.05, 0.2]))
    goal = st.Goal(attitude=wanted, torso_rate=None, tail=(0.1, None), tail_rate=(None, 0.0))
    plan = keyed(rat(), goal=goal, **AGAIN | COARSE | {"start": start(rat())})
    end = plan.trajectory
    assert plan.report["converged"] and angle_deg(end.attitude[-1], wanted) < 1e-5
    assert end.tail[-1, 0] == pytest.approx(0.1, abs=1e-7)
    assert end.v[-1, 7] == pytest.approx(0, abs=1e-6)


def test_effort_counts_rates_as_torques_of_a_damper():
    fine = {"tolerance": None, "intervals": 20}
    # Of several optima, which one is found from afar hangs on rounding: compare two of one valley.
    smooth = planned(**fine)
    for plan in (smooth, planned(**fine, smoothing=0.0, guess=smooth)):
        flight, c = plan.trajectory, plan.problem.smoothing
        integrand = np.sum(flight.tau**2 + (c * flight.v[:, 6:]) ** 2, axis=1)
        total = np.trapezoid(integrand, flight.t)
        assert plan.report["objective"] == pytest.approx(total, rel=1e-2)
    assert plan.report["objective"] == pytest.approx(plan.report["effort"], rel=1e-12)
    assert plan.report["effort"] < smooth.report["effort"]


def test_own_objectives_see_tail_time_and_parameters():
    def effort(point):
        return casadi.sumsqr(point.torque / 1e-3)

    def bend(point):
        return casadi.sumsqr(point.tail) + 1e-3 * effort(point)

    def late(point, sign=-1):
        weight = point.parameters["torso_mass"] / 0.10572
        return weight * effort(point) * casadi.exp(sign * point.time / 0.05)

    def bent(plan):
        return np.trapezoid(np.sum(plan.trajectory.tail**2, axis=1), plan.trajectory.t)

    assert bent(planned(objective=bend, **COARSE)) < bent(planned(**COARSE))
    for objective, sign in ((late, 1), (lambda point: late(point, 1), -1)):
        spent = planned(objective=objective, **COARSE).torque(np.linspace(0, DURATION, 400)) ** 2
        assert sign * (spent[200:].sum() - spent[:200].sum()) > 0, sign


def test_path_constraints_of_several_sizes_keep_their_own_bounds():
    """Two bends between wide limits, then one rate's least: as with that rate alone."""
    rate = (lambda point: point.tail_rate[0], -4.0, 9.0)
    both = planned(path=((lambda point: point.tail, -50.0, 50.0), rate), **COARSE)
    alone = planned(path=(rate,), **COARSE)
    for plan in (both, alone):
        rates = plan.curve.at(plan.curve.ends)["tail_rate"][1:, 0]
        assert plan.report["converged"] and rates.min() >= -4.0 - 1e-5
    assert both.report["objective"] == pytest.approx(alone.report["objective"], rel=1e-4)
    assert both.report["bound_excess"] == pytest.approx(alone.report["bound_excess"], abs=0.02)


POINT = ("duration", "time", "torso_rate", "drift", "center_of_mass")
POINT += ("position", "height", "tail_points", "tip")  # what paths see, with their torques


def seen(point):
    parts = [getattr(point, name) for name in POINT]
    return casadi.vertcat(*(casadi.vec(casadi.SX(part).T) for part in (*parts, point.torque)))


@pytest.mark.parametrize(
    "free",
    [
        {},
        {"design": {"tail_length": (0.08, 0.25)}},
        {"free_start": {"tail": (-0.5, 0.5), "velocity": (-3, 3), "position": (-1, 1)}},
    ],
)
def test_points_are_the_models(free):
    """Of a scaled quaternion, too: a solver's iterates have any norm."""
    few = COARSE | {"duration": DURATION, "path": ((seen, -500.0, 500.0),), "track": False}
    plan = keyed(rat(), start=start(rat()), **few | free)
    program = plan_program(rat(), plan.problem, plan.mesh, plan.rule, 0.0)
    model, state, times = plan.model, plan.start, np.linspace(0, DURATION, 7)
    blocks = plan.curve.at(times)
    q, v = full_state(model, state, times, blocks)
    scaled = blocks | {"attitude": 1.7 * blocks["attitude"]}
    found = path_values(program, plan.solution.samples, times, scaled, state)

    masses, com = model.parameters, com_at_start(model, state)
    fall = model.momentum(q, v)[0] / (masses["torso_mass"] + masses["tail_mass"])
    flown = com[0] + com[1] * times[:, None] - np.outer(9.8 * times**2 / 2, [0, 0, 1])
    own = np.einsum("kji,kj->ki", rotation_matrix(q[:, 3:7]), v[:, :3] - fall)
    tail = model.tail_points(q)
    wanted = (np.full(7, DURATION), times, v[:, 3:6], own, flown)
    wanted += (q[:, :3], q[:, 2], tail, tail[:, -1], blocks["torque"])
    columns = [np.reshape(part, (7, -1)) for part in wanted]
    parts = np.split(found, np.cumsum([part.shape[1] for part in columns])[:-1], axis=1)
    assert plan.report["converged"]
    for name, ours, models in zip((*POINT, "torque"), parts, columns, strict=True):
        with row(name):
            np.testing.assert_allclose(ours, models, atol=1e-9)


def test_goals_that_the_conserved_momentum_forbids_are_refused_and_no_others():
    """Rates of torso and tail that carry the momentum, by a solution of their own."""

    def asked(goal, name="m1_n3", **bounds):
        model = zoo.model(name)
        given = {"start": start(model), "goal": goal, "bounds": st.Bounds(**bounds)}
        refuse_impossible(model, posed(model, duration=DURATION, **given)[0])

    (q, v), goal = start(rat()), st.Goal(tail_rate=(0.0, 0.0))
    with pytest.raises(st.PlanningError, match="torso and tail at rest"):
        keyed(rat(), start=(q, v), goal=goal, duration=DURATION)
    few = AGAIN | {"intervals": 6}
    assert keyed(rat(), start=(q, 0 * v), goal=goal, **few).report["converged"]

    model, random, tilted = rat(), np.random.default_rng(3), (0.8, 0.6, 0.0, 0.0)
    h = model.momentum(*start(model))[1]
    for attitude, R in (("upright", np.eye(3)), (tilted, rotation_matrix(np.array(tilted)))):
        for _ in range(3):
            tail, tail_rate = random.uniform(-0.5, 0.5, 2), random.uniform(-30, 30, 2)
            H = model.mass_matrix(np.concatenate([[0, 0, 0, 1, 0, 0, 0], tail]))
            rhs = np.concatenate([np.zeros(3), R.T @ h]) - H[:6, 6:] @ tail_rate
            omega = np.linalg.solve(H[:6, :6], rhs)[3:]
            goal = {"attitude": attitude, "torso_rate": omega, "tail": tail}
            asked(st.Goal(**goal))
            asked(st.Goal(**goal, tail_rate=tail_rate))
            asked(st.Goal(**goal), rate=31.0)
            with pytest.raises(st.PlanningError, match=r"cannot carry .*% of the angular momentum"):
                asked(st.Goal(**goal | {"torso_rate": 1.5 * omega}, tail_rate=tail_rate))
            with pytest.raises(st.PlanningError, match="within their bounds"):
                asked(st.Goal(**goal), rate=0.5 * np.abs(tail_rate).min())

    # one segment cannot carry any momentum, but two can: two rates, three equations
    goal = {"attitude": (1.0, 0.0, 0.0, 0.0), "torso_rate": (0.0, 0.0, 0.0)}
    with pytest.raises(st.PlanningError, match="tail rates within their bounds cannot carry"):
        asked(st.Goal(**goal, tail=(0.1, 0.2)))
    asked(st.Goal(**goal, tail=(0.1, 0.2, 0.3, -0.2)), "m2_n2")
    asked(st.Goal(**goal))


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


def test_a_flight_of_a_model_with_feet_is_that_of_its_twin_without_contacts():
    model, settings = footed(0.01)  # in the ground after some ms
    one, other = (keyed(each, **settings) for each in (rat(), model))
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
    free = keyed(model, **settings)
    late = slice(len(free.trajectory.t) // 2, None)
    floor = heights(model, free)[late].min() + 0.002
    plan = keyed(model, path=((above, floor, np.inf),), legs=LEGS, guess=free, **settings)
    assert plan.success and heights(model, plan)[late].min() >= floor - 1e-4

    model, settings = footed(0.3, 0.93, track=False)
    free = keyed(model, **settings)
    least = heights(model, free, FEET)[0] - 0.001
    assert free.success and heights(model, free, FEET).min() < least - 0.002
    plan = keyed(model, clearance=least, guess=free, **settings)
    assert plan.success and heights(model, plan, FEET).min() >= least - 1e-4

    model, settings = footed(0.05)  # where the points cannot be, they are refused
    path = ((lambda point: point.contact_points[:, 2], 0.0, np.inf),)
    for words, body, changes in (
        ("contact_points: give the plan `legs`", model, {"path": path}),
        ("legs: value 3", model, {"legs": 3}),
        ("no points of tail or torso", rat(), {"clearance": 0.01}),
        ("clearance: value -0.01", model, {"clearance": -0.01}),
        ("clearance: value 0.1: .* lowest point", model, {"clearance": 0.1}),
    ):
        with row(words), pytest.raises(st.PlanningError, match=words):
            keyed(body, **settings | changes)
