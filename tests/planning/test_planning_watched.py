"""A search that is watched tells the plan of each round, and finds what it finds unwatched."""

import numpy as np
import pytest

import serpentail as st
from tests.support.tumbling import planned


def test_the_plan_of_each_round_comes():
    plans = []
    found = planned(watch=plans.append)
    assert len(plans) == found.report["rounds"] > 1
    assert [plan.report["rounds"] for plan in plans] == [k + 1 for k in range(len(plans))]
    sizes = [plan.mesh.intervals for plan in plans]
    assert sizes == sorted(set(sizes)) and sizes[0] == 12
    (same,) = [plan for plan in plans if plan.mesh.intervals == found.mesh.intervals]
    assert np.array_equal(same.trajectory.q, found.trajectory.q)
    errors = [plan.report["open_loop_attitude_error_deg"] for plan in plans]
    assert errors[-1] < errors[0]
    assert np.array_equal(planned().trajectory.q, found.trajectory.q)


def test_what_it_raises_ends_the_search():
    def refuse(plan):
        raise ArithmeticError("no more")

    with pytest.raises(ArithmeticError, match="no more"):
        planned(watch=refuse)


def test_what_cannot_be_called_is_refused():
    with pytest.raises(st.PlanningError, match="watch: value 3: needs a function"):
        planned(watch=3)
