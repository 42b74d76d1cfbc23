"""Plans that choose parameters of the model and parts of their start: the best of many ordinary
plans, and true.
"""

from functools import cache

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail.basics.attitude import angle_deg, pitch_roll_yaw
from serpentail.planning.design import checked_design
from serpentail.planning.program.body import BodyFunctions
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import AGAIN, integrated, keyed, rat, start

RANGE, RATES = (0.08, 0.25), 6.0  # m, rad/s
LENGTH = {"design": {"tail_length": RANGE}}
FREE = {"free_start": {"tail": (-0.5, 0.5), "tail_rate": (-RATES, RATES)}}
SETTINGS = {"tolerance": 0.01, "intervals": 12}  # of plans that are true enough


@cache
def planned() -> st.Plan:
    return keyed(rat(), start=start(rat()), **AGAIN, intervals=12)


def again(model=None, **settings) -> st.Plan:
    given = AGAIN | {"start": start(rat()), "guess": planned()} | settings
    return keyed(model or rat(), **given)


def ordinary(plan, **parameters):
    found = again(rat().with_parameters(**parameters), start=plan.start, guess=plan)
    assert found.report["converged"]
    return found.report["objective"]


@cache
def chosen() -> st.Plan:
    return again(**LENGTH, **SETTINGS)


@cache
def freed() -> st.Plan:
    return again(guess=None, multi_start=2, **FREE, **SETTINGS)


def test_parameters_follow_as_in_the_model():
    own = zoo.model("own_links")
    for model, values in (
        (rat(), {"tail_length": 0.12, "tail_mass": 0.005}),
        (rat(), {"torso_inertia": (6e-5, 4e-5, 7e-5), "torso_mass": 0.2}),
        (rat(), {"link_radius": 0.004, "tail_mount": (0.001, -0.03, 0.0)}),
        (rat(), {"link_inertia": (5e-6, 1e-8, 6e-6), "gravity": 3.7}),
        (own, {"link_masses": 1.2 * np.array(own.parameters["link_masses"])}),
    ):
        ranges = {name: (value, 1.1 * np.abs(value)) for name, value in values.items()}
        numbers = np.concatenate([np.atleast_1d(x) for x in values.values()])
        body = BodyFunctions(model, checked_design(model, ranges), ca.SX(numbers))
        wanted = model.with_parameters(**values)
        vector, masses = np.array(ca.DM(body.vector)), ca.DM(body.parameters["tail_mass"])
        with row(*values):
            np.testing.assert_allclose(vector, np.array(wanted.casadi.parameter_vector), rtol=1e-14)
            assert float(masses) == pytest.approx(wanted.parameters["tail_mass"])
            assert float(body.parameters["tail_length"]) == wanted.parameters["tail_length"]


def test_plans_are_true_for_what_they_chose():
    for plan in (chosen(), freed()):
        q, v = integrated(plan.model, plan)
        end = plan.trajectory
        assert plan.success
        assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), end.attitude[-1]) < 0.011
        np.testing.assert_allclose(v[3:], end.v[-1, 3:], atol=0.01)
    plan, length = chosen(), chosen().design["tail_length"]
    assert RANGE[0] < length < RANGE[1] and plan.report["design"] == plan.design
    assert plan.model.parameters["tail_length"] == length
    assert f"design: tail_length {length:.4f}" in repr(plan)

    plan, (q0, v0), given = freed(), freed().start, start(rat())
    assert plan.report["start"] == {"tail": q0[7:].tolist(), "tail_rate": v0[6:].tolist()}
    assert (np.abs(q0[7:]) <= 0.5).all() and (np.abs(v0[6:]) <= RATES).all()
    np.testing.assert_array_equal(q0[:7], given[0][:7])
    np.testing.assert_array_equal(v0[:6], given[1][:6])
    wanted, usual = (rat().momentum(*each)[1] for each in (plan.start, given))
    assert np.linalg.norm(wanted - usual) > 1e-3 * np.linalg.norm(usual)
    np.testing.assert_allclose(plan.trajectory.angular_momentum - wanted, 0, atol=1e-12)


@pytest.mark.slow
def test_no_ordinary_plan_is_better():
    """Plans by compiled C, one for each of several lengths, and of several rates at the start, on
    the same mesh; the vertex of the parabola through three of them is what was chosen.
    """
    (q, v), plan = start(rat()), chosen()
    free = again(free_start={"tail_rate": ((-RATES, v[7]), (RATES, v[7]))})

    def of_rate(rate):
        own = np.where(np.arange(8) == 6, rate, v)
        return again(start=(q, own), guess=free).report["objective"]

    length, rate = plan.design["tail_length"], free.start[1][6]
    assert free.report["converged"] and abs(rate) < RATES - 0.5
    for each, function, found, step, ends in (
        (plan, lambda x: ordinary(plan, tail_length=x), length, 0.02 * length, RANGE),
        (free, of_rate, rate, 0.2, (-RATES, RATES)),
    ):
        best = each.report["objective"]
        assert function(found) == pytest.approx(best, rel=1e-6)
        near = [function(found + way * step) for way in (-1, 1)]
        assert min(near) > best * (1 + 1e-6)
        assert min(map(function, np.linspace(*ends, 4))) > best * (1 - 1e-6)
        vertex = found + step / 2 * (near[0] - near[1]) / (near[0] + near[1] - 2 * best)
        assert vertex == pytest.approx(found, abs=0.1 * step)
    slope = plan.report["design_slopes"]["tail_length"]
    assert abs(slope) < 1e-4 * plan.report["objective"] / length
    # At a bound the multiplier is the derivative of the least effort by the length.
    for ends, at in (((0.08, 0.12), 0.12), ((0.22, 0.25), 0.22)):
        bound, h = again(design={"tail_length": ends}, guess=plan), 1e-3 * at
        assert bound.report["converged"] and bound.design["tail_length"] == pytest.approx(at)
        low, high = (ordinary(bound, tail_length=at + step) for step in (-h, h))
        slope = bound.report["design_slopes"]["tail_length"]
        assert slope == pytest.approx((high - low) / (2 * h), rel=1e-3)


def test_a_total_is_kept_and_no_other_choice_is_better():
    """Of the mount, y + z + x; each plan with other numbers of the same sum costs more."""
    mount = np.array(rat().parameters["tail_mount"])
    given = {"design": {"tail_mount": (mount - 0.01, mount + 0.01)}}
    for total, solver in ((mount.sum(), "fatrop"), (f"{1e3 * mount.sum() - 5:.17g} mm", "ipopt")):
        plan = again(design_totals={"tail_mount": total}, solver=solver, **given)
        found = np.array(plan.design["tail_mount"])
        kept = mount.sum() - 0.005 * (solver == "ipopt")
        assert plan.report["converged"] and found.sum() == pytest.approx(kept, abs=1e-8)
        best = plan.report["objective"]
        assert ordinary(plan, tail_mount=found) == pytest.approx(best, rel=1e-6)
        for way in np.array([[1, -1, 0], [0, 1, -1], [-1, 0, 1]]) * 1e-3:
            others = (found + sign * way for sign in (-1, 1))
            inside = [o for o in others if (np.abs(o - mount) <= 0.01 + 1e-9).all()]
            assert all(ordinary(plan, tail_mount=o) > best * (1 - 1e-6) for o in inside)


def test_totals_that_cannot_be_are_refused():
    pair = {"design": {"tail_mount": ((-0.01,) * 3, (0.01,) * 3), "tail_length": RANGE}}
    for name, value, field in (
        *(("tail_mount", x, "tail_mount: value") for x in (0.031, -0.04, "3 kg", "a", None)),
        *((name, 0.1, name) for name in ("tail_length", "torso_inertia", "tail")),
    ):
        with row(name, value), pytest.raises(st.PlanningError, match=f"design_totals.{field}"):
            again(design_totals={name: value}, **pair)
    with pytest.raises(st.PlanningError, match=r"design_totals: value 0\.1"):
        again(design_totals=0.1, **pair)


def test_attitude_torso_rate_and_position_may_be_free():
    """Upright at the end is easier from a start that is nearly upright."""
    free = {"attitude": ((0.2, 0, 0), (0.9, 0, 0)), "torso_rate": (-1, 1)}
    plan = again(free_start=free, guess=None)
    v0, angles = plan.start[1], pitch_roll_yaw(plan.start[0])
    assert plan.report["converged"] and 0.2 <= angles[0] + 1e-12 < 0.9
    np.testing.assert_allclose(angles[1:], 0, atol=1e-9)
    assert (np.abs(v0[3:6]) <= 1).all()
    q, _ = integrated(rat(), plan)
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), plan.trajectory.attitude[-1]) < 0.1

    # the lowest throw begins at the floor, though no node of Radau's rule is at the start
    floor = 0.32
    plan = again(
        path=((lambda point: point.height, floor, np.inf),),
        objective=lambda point: ca.sumsqr(point.torque / 1e-3) + 100 * point.height,
        free_start={"position": ((0, 0, 0.2), (0, 0, 0.5))},
    )
    assert plan.report["converged"] and plan.start[0][2] == pytest.approx(floor, rel=1e-6)
    assert plan.trajectory.q[:, 2].min() >= floor * (1 - 1e-3)


def test_both_at_once_and_again():
    """Start and length; the plan of both is a guess for the next, for IPOPT, too."""
    plan = again(guess=freed(), **FREE, **LENGTH)
    cost, length = plan.report["objective"], plan.design["tail_length"]
    assert plan.report["converged"] and cost < freed().report["objective"]
    known = again(rat().with_parameters(**plan.design), start=plan.start, guess=plan)
    assert known.report["objective"] == pytest.approx(cost, rel=1e-6)
    other = again(solver="ipopt", guess=plan, **FREE, **LENGTH)
    assert other.report["converged"]
    assert other.report["objective"] == pytest.approx(cost, rel=1e-6)
    assert other.design["tail_length"] == pytest.approx(length, rel=1e-3)
    np.testing.assert_allclose(other.start[1], plan.start[1], atol=0.01)
