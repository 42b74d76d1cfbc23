"""Points as objectives and path constraints see them are what the model says of the same states."""

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail.planning.nlp.coordinates import attitude
from serpentail.planning.nlp.node import PARAMETERS, _point, variables_of
from serpentail.planning.nlp.start import shared_of
from serpentail.planning.result.full_state import com_at_start, full_state
from tests.support.tumbling import DURATION, planned, rat, start

FORMULATIONS = ["airborne", "translation-free", "full"]
NAMES = ("duration", "time", "center_of_mass", "position", "height", "tail_points", "tip")


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_blocks_are_the_models(formulation):
    """Of a scaled quaternion, too: a solver's iterates have any norm."""
    model, plan = rat(), planned(formulation=formulation, tolerance=None, intervals=8)
    variables = variables_of(formulation, attitude("quaternion"), 2, np.ones(2))
    zeta, p = ca.SX.sym("zeta", 1 + sum(variables.sizes())), ca.SX.sym("p", PARAMETERS + 1)
    shared = shared_of(model, zeta, p, variables)
    point = _point(shared, zeta, p, variables, attitude("quaternion"))
    function = ca.Function("point", [zeta, p], [getattr(point, name) for name in NAMES])

    times, problem = np.linspace(0, DURATION, 7), plan.problem
    blocks = plan.curve.at(times)
    state = (problem.q0, problem.v0)
    q, v = full_state(model, state, attitude("quaternion"), times, blocks)
    points, com = model.tail_points(q), model.momentum(q, v)
    for k, time in enumerate(times):
        names = [name for name, _ in (*variables.states, *variables.algebraic)]
        parts = [blocks[name][k] / variables.units[name] for name in names]
        parts[names.index("attitude")] = 1.7 * parts[names.index("attitude")]
        unknowns = np.concatenate([[DURATION], *parts, blocks["torque"][k]])
        parameters = np.concatenate(
            [np.zeros(3), *com_at_start(model, state), [0.0, time / DURATION]]
        )
        found = dict(zip(NAMES, map(np.array, function(unknowns, parameters)), strict=True))
        assert (found["duration"].item(), found["time"].item()) == pytest.approx((DURATION, time))
        np.testing.assert_allclose(found["position"].ravel(), q[k, :3], atol=1e-9)
        np.testing.assert_allclose(found["height"].ravel(), q[k, 2], atol=1e-9)
        np.testing.assert_allclose(found["tail_points"], points[k], atol=1e-9)
        np.testing.assert_allclose(found["tip"].ravel(), points[k, -1], atol=1e-9)
        offset = found["center_of_mass"].ravel() - com_at_start(model, state)[0]
        fall = com[0][0] / (0.10572 + 0.00351) * time - [0, 0, 9.8 * time**2 / 2]
        np.testing.assert_allclose(offset, fall, atol=1e-5)


def test_a_path_keeps_the_tip_behind_a_wall():
    free = planned(intervals=16)
    wall = rat().tail_points(free.trajectory.q)[:, -1, 1].min() + 0.005
    plan = planned(path=((_tip_y, wall, np.inf),), intervals=16, guess=free)
    assert plan.success
    assert rat().tail_points(plan.trajectory.q)[:, -1, 1].min() >= wall * (1 + 1e-3)


def test_an_objective_may_ask_for_time_and_parameters():
    late = planned(objective=_late, tolerance=None, intervals=8)
    early = planned(objective=_early, tolerance=None, intervals=8)
    times = np.linspace(0, DURATION, 400)
    spent = [np.square(plan.torque(times)).sum(axis=1) for plan in (late, early)]
    halves = [(squares[:200].sum(), squares[200:].sum()) for squares in spent]
    assert halves[0][0] < halves[1][0] and halves[0][1] > halves[1][1]


def test_what_a_scene_left_out_is_not_offered():
    model = rat(exact=False)
    with pytest.raises(
        st.PlanningError, match=r"path.0.: a point has no 'tips', .*did you mean 'tip'"
    ):
        st.plan(model, start=start(model), duration=DURATION, path=((lambda p: p.tips, 0, 1),))


def _tip_y(point):
    return point.tip[1]


def _late(point):
    weight = point.parameters["torso_mass"] / 0.10572
    return weight * ca.sumsqr(point.torque / 1e-3) * ca.exp(-point.time / 0.05)


def _early(point):
    return ca.sumsqr(point.torque / 1e-3) * ca.exp(point.time / 0.05)
