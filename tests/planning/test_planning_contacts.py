"""Models that may touch the ground plan their flight: as their twins without contacts do."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder
from tests.support.tumbling import FUNCTIONS, rat, start

DURATION = 0.3
SETTINGS = {"duration": DURATION, "goal": st.Goal(torso_rate=None), "intervals": 10}
LEGS = st.Legs.fixed(3.6, -0.3)
FEET = 6  # points of the feet, which come first


@cache
def footed() -> st.Model:
    """The rat of the other tests, with feet and a tail that touch."""
    return st.load(model_folder(1, 3, functions=FUNCTIONS, contacts=["feet", "tail"]))


def test_a_flight_is_that_of_the_twin_without_contacts():
    low = start(rat())
    low[0][2] = 0.01  # in the ground after some ms
    twins = [st.plan(model, start=low, **SETTINGS) for model in (rat(), footed())]
    one, other = (plan.report for plan in twins)
    assert one["success"] and other["success"]
    for name in ("effort", "energy_J", "peak_power_W", "duration_s"):
        assert other[name] == pytest.approx(one[name], rel=1e-5), name
    np.testing.assert_allclose(
        twins[1].trajectory.q, twins[0].trajectory.q, atol=1e-6, err_msg="planned"
    )
    assert other["open_loop_attitude_error_deg"] <= 0.01
    assert other["tracked_attitude_error_deg"] == pytest.approx(
        one["tracked_attitude_error_deg"], abs=1e-4
    )


def test_points_of_contact_stay_above_the_ground():
    """Clearance as a path constraint, where the plan without it goes below."""
    model, low = footed(), start(footed())
    low[0][2] = 0.15
    free = st.plan(model, start=low, **SETTINGS)
    heights = _heights(model, free)
    assert free.success
    floor = heights[len(heights) // 2 :].min() + 0.002

    path = ((lambda point: point.contact_points[:, 2] + _ramp(point), floor, np.inf),)
    plan = st.plan(model, start=low, path=path, legs=LEGS, guess=free, **SETTINGS)
    assert plan.success
    assert _heights(model, plan)[len(heights) // 2 :].min() >= floor - 1e-4


def test_feet_without_legs_have_no_points():
    path = ((lambda point: point.contact_points[:, 2], 0.0, np.inf),)
    with pytest.raises(st.PlanningError, match="contact_points: give the plan `legs`"):
        st.plan(footed(), start=start(footed()), path=path, **SETTINGS)
    with pytest.raises(st.PlanningError, match="legs: value 3: needs Legs"):
        st.plan(footed(), start=start(footed()), legs=3, **SETTINGS)


def _heights(model, plan, first=0):
    """Heights (K,) of the lowest point, or of the lowest from the first on."""
    q, v = plan.trajectory.q, plan.trajectory.v
    legs = np.append(LEGS.curve.at(0.0)[0], np.zeros(4))
    return model.contact_points(q, v, np.tile(legs, (len(q), 1)))[0][:, first:, 2].min(axis=1)


def _ramp(point):
    """1 m at the start, which may be low, to nothing at half the time."""
    return 0.5 * (1 - 2 * point.time / DURATION + abs(1 - 2 * point.time / DURATION))


def test_clearance_keeps_tail_and_torso_above_the_ground():
    """Where the plan without it dips below; the feet, which land, have none."""
    model, low = footed(), start(footed())
    low[0][2], low[1][2] = 0.3, 0.93
    free = st.plan(model, start=low, **SETTINGS)
    heights = _heights(model, free, FEET)
    assert free.success
    least = heights[0] - 0.001
    assert heights.min() < least - 0.002
    plan = st.plan(model, start=low, clearance=least, guess=free, **SETTINGS)
    assert plan.success
    assert _heights(model, plan, FEET).min() >= least - 1e-4


def test_clearance_is_refused_where_it_cannot_be():
    low = start(footed())
    low[0][2] = 0.05
    for model, clearance, words in (
        (rat(), 0.01, "has no points of tail or torso that touch: add 'tail' or 'torso'"),
        (footed(), -0.01, "clearance: value -0.01: needs"),
        (footed(), 0.1, "clearance: value 0.1: at the start the lowest point .* begin later"),
    ):
        with pytest.raises(st.PlanningError, match=words):
            st.plan(model, start=low, clearance=clearance, **SETTINGS)
