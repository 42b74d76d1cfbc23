"""Plans by FATROP on stages: the optima of a plain program, which shares only the model with them,
and of IPOPT; and tails of many kinds, also under predictive control.
"""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail.basics.attitude import tilt_deg
from serpentail.optimal import fatrop
from serpentail.optimal.rules import collocation_rule
from serpentail.planning.attempts import Attempts
from serpentail.planning.program.build import plan_program
from serpentail.planning.result.truth import planned_torques
from tests.references.flight_program import FlightProblem, solved
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import AGAIN, DURATION, integrated, keyed, rat, start

PROBLEMS = {
    "upright": {},
    "free duration": {"duration": (0.3, 0.5)},
    "any rate": {"goal": st.Goal(torso_rate=None)},
    "any attitude": {"goal": st.Goal(attitude=None)},
    "tail": {"goal": st.Goal(torso_rate=None, tail=(0.1, None), tail_rate=(None, 0.0))},
    "rates": {"bounds": st.Bounds(angle=np.pi / 3, rate=(12.0, 15.0))},
    "no bounds": {"bounds": st.Bounds(angle=None, torque=None)},
    "damping": {"damping": 1e-4},
    "no smoothing": {"smoothing": 0.0},
}
SLOW = pytest.mark.slow
STEEP = st.Bounds(angle=np.pi / 3, torque_rate=0.1)
WITHIN = ((lambda point: point.tail_rate[0], -4.0, 9.0), (lambda point: point.tip, -2.0, 2.0))
RICHER = {
    "range of rates": {"goal": st.Goal(torso_rate=((-3, 3), (-0.5, 0.5), (1, 4)))},
    "path": {"path": WITHIN, "duration": (0.3, 0.5)},
    "torque rates": {"bounds": STEEP},
    "own objective": {
        "objective": lambda point: ca.sumsqr(point.torque / 1e-3) + point.tail[0] ** 2
    },
    "design": {"design": {"tail_length": (0.08, 0.25)}},
    "free start": {"free_start": {"tail": (-0.5, 0.5), "tail_rate": (-6.0, 6.0)}},
    "all": {
        "path": WITHIN,
        "bounds": STEEP,
        "design": {"tail_mass": (0.003, 0.004)},
        "free_start": {"tail": (-0.3, 0.3)},
    },
}


def planned(problem: dict, seed: int = 0, model: st.Model | None = None, **settings) -> st.Plan:
    model = model or rat()
    given = AGAIN | {"solver": "fatrop", "intervals": 12, "start": start(model, seed)}
    return keyed(model, **given | problem | settings)


def turned(seed: int) -> dict:
    """Return a problem whose attitude at the end is given: upright, near where a plan ends."""
    end = planned({"goal": st.Goal(torso_rate=None)}, seed, intervals=8).trajectory.q[-1, 3:7]
    w, z = end[[0, 3]] + 0.05 * np.array([-end[3], end[0]])
    return {"goal": st.Goal(attitude=(w, 0.0, 0.0, z), torso_rate=None)}


def check_optimum(plan: st.Plan) -> None:
    """A plain program, which begins at the plan, ends there."""
    own = plan.problem
    terms = own.goal, own.duration, own.bounds, own.damping, own.smoothing
    wanted = solved(plan.model, FlightProblem(plan.start, *terms), plan)
    assert plan.report["converged"] and plan.report["solver"] == "fatrop"
    assert plan.report["objective"] == pytest.approx(wanted.objective, rel=1e-6)
    assert plan.duration == pytest.approx(wanted.duration, rel=1e-6)
    np.testing.assert_allclose(plan.curve.nodes["torque"], wanted.torques, atol=5e-8)


def test_a_range_of_rates_holds_and_costs_no_more_than_its_middle():
    """Where free rates end outside, the optimum is at an end of the range; a number is a range."""
    free = planned({"goal": st.Goal(torso_rate=None)})
    own = free.trajectory.v[-1, 3:6]
    k = int(np.abs(own).argmax())
    limits = np.array([own - 50, own + 50]).T
    limits[k] = np.sort([0.3 * own[k], 0.6 * own[k]])
    plan = planned({"goal": st.Goal(torso_rate=limits)})
    found = plan.trajectory.v[-1, 3:6]
    assert plan.success and found[k] == pytest.approx(0.6 * own[k], rel=1e-3)
    limits[k] = limits[k].mean()
    asked = [tuple(each) if i != k else each[0] for i, each in enumerate(limits)]
    middle = planned({"goal": st.Goal(torso_rate=asked)})
    assert middle.trajectory.v[-1, 3 + k] == pytest.approx(limits[k, 0], abs=1e-4)
    effort = [each.report["objective"] for each in (free, plan, middle)]
    assert effort[0] < effort[1] < effort[2]


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=SLOW) for k in (1, 2))])
def test_optima_are_those_of_a_plain_program(seed):
    for name, problem in (PROBLEMS | {"given attitude": turned(seed)}).items():
        with row(name):
            check_optimum(planned(problem, seed, intervals=8))


@pytest.mark.parametrize("name", RICHER)
def test_optima_are_those_of_ipopt(name):
    """On the same stages, from a plan that was found from afar."""
    asked, found = RICHER[name], []
    far = planned(asked, intervals=8)
    for solver in ("fatrop", "ipopt"):
        plan = planned(asked, intervals=8, solver=solver, guess=far)
        assert plan.report["converged"] and plan.report["solver"] == solver
        found.append(plan)
    ours, theirs = found
    assert ours.report["objective"] == pytest.approx(theirs.report["objective"], rel=1e-6)
    found, wanted = (each.solution.samples for each in found)
    np.testing.assert_allclose(found.states, wanted.states, atol=1e-4)
    np.testing.assert_allclose(found.constants, wanted.constants, atol=1e-4)


def test_goals_are_met_however_large_an_objective_is():
    for solver in ("fatrop", "ipopt"):
        asked = {"objective": lambda point: 1e6 * ca.sumsqr(point.torque / 1e-3)}
        end = planned(asked, intervals=6, solver=solver).trajectory
        with row(solver):
            np.testing.assert_allclose(end.v[-1, 3:6], 0, atol=1e-6)
            assert tilt_deg(end.q[-1, 3:7]) < 1e-5


@pytest.mark.slow
def test_least_time_and_energy_are_found():
    settings = {"objective": "time", "duration": (0.2, 0.5)}
    plan, other = planned(settings), planned(settings, solver="ipopt")
    assert plan.report["converged"] and other.report["converged"]
    assert plan.report["objective"] <= 1.05 * other.report["objective"]
    near = planned({"objective": "energy"}, solver="ipopt")
    assert planned({"objective": "energy"}, guess=near).report["converged"]


def test_plans_are_true_keep_their_bounds_between_nodes_and_are_guesses():
    fresh = planned({}, tolerance=0.01, track=True)
    report = fresh.report
    assert fresh.success and report["open_loop_attitude_error_deg"] <= 0.01
    assert report["status"] == "Solve_Succeeded" and report["bound_excess"] <= 1e-3
    q, v = integrated(rat(), fresh)
    assert tilt_deg(q[3:7]) <= 0.02 and np.abs(v[3:6]).max() <= 0.1

    fresh = planned({})
    again = planned({}, guess=fresh).report
    assert again["converged"] and again["iterations"] < fresh.report["iterations"]
    assert again["objective"] == pytest.approx(fresh.report["objective"], rel=1e-6)
    assert planned({}, guess=fresh, solver="ipopt").report["converged"]  # takes it, too
    # one without collocation is returned
    program = plan_program(rat(), fresh.problem, fresh.mesh, fresh.rule, 0.0).optimal
    node = replace(program.node, arrays=program.node.arrays | {"momentum": np.full(3, 1e6)})
    found = fatrop.solve(replace(program, node=node), fresh.solution.samples, "close", {})
    assert (found.success, found.status) == (False, "No_Collocation_Of_Guess")
    assert found.samples is fresh.solution.samples


def test_torques_have_a_coarser_mesh_than_states():
    plan = planned({}, controls=4)
    assert plan.report["converged"] and plan.mesh.controls.tolist() == sorted([*range(4)] * 3)
    for k in range(4):
        inside = plan.torque(np.linspace(0.1 * k + 0.001, 0.1 * k + 0.099, 9))
        assert np.abs(np.diff(inside, n=3, axis=0)).max() < 1e-12
    other = planned({}, solver="ipopt", controls=4, guess=plan).report["objective"]
    assert plan.report["objective"] == pytest.approx(other, rel=1e-5)
    plan = planned({}, tolerance=1e-4)
    assert plan.success and plan.report["rounds"] > 1 and plan.mesh.intervals > 12
    assert sorted(set(plan.mesh.controls)) == [*range(12)]


def test_first_meshes_are_finer_for_longer_tails():
    for segments, given, intervals, controls in (
        (1, {}, [12, 144], 12),
        (1, {"intervals": 6}, [6], 6),
        (1, {"most_intervals": 143}, [12], 12),
        (2, {"intervals": 24}, [24], 12),
        (3, {}, [48, 144], 12),
        (4, {"controls": 5}, [20, 60], 5),
        (5, {}, [144], 12),
    ):
        settings = SimpleNamespace(mesh=st.Mesh(**given), guess=st.Guess())
        chains = [SimpleNamespace(segments=slice(0, segments))]
        model = SimpleNamespace(layout=SimpleNamespace(chains=chains))
        meshes = Attempts(model, settings, collocation_rule()).meshes()
        with row(segments, given):
            assert [mesh.intervals for mesh in meshes] == intervals
            assert {mesh.controls[-1] + 1 for mesh in meshes} == {controls}


def test_a_search_whose_plans_are_not_true_begins_again_from_a_finer_mesh():
    found, given = [], {"intervals": None, "rounds": 0, "tolerance": 1e-4}
    coarse = planned({}, **given, most_intervals=100)  # too few for a second mesh
    assert coarse.report["converged"] and not coarse.success and coarse.mesh.intervals == 12
    plan = planned({}, **given, watch=lambda each: found.append(each.mesh.intervals))
    assert plan.success and found == [12, 144]


@pytest.mark.parametrize(
    "name", ["elastic", "arcs2", *(pytest.param(k, marks=SLOW) for k in ("own_links", "mixed"))]
)
def test_tails_of_all_kinds_are_planned_and_controlled(name):
    """Springs and stops; links and arcs of their own on tilted mounts; both."""
    model, goal = zoo.model(name), {"goal": st.Goal(torso_rate=None), "intervals": 10}
    plan = planned(goal, model=model, track=name == "elastic")
    assert plan.report["dynamics"] == "compiled"
    check_optimum(plan)
    assert plan.report["converged"] and plan.report["open_loop_attitude_error_deg"] < 1.0
    assert name != "elastic" or plan.report["tracked_attitude_error_deg"] < 0.5

    q, v = start(model)
    v[3:6] += 0.1, -0.06, 0.12
    flights = [
        st.simulate(model, q, v, controller=law, t_span=DURATION)
        for law in (st.TorqueCurve(planned_torques(plan.curve)), st.Mpc(model, plan))
    ]
    off, left = (float(tilt_deg(flight.q[-1, 3:7])) for flight in flights)
    assert off > max(1.0, 10 * left)
    info = flights[1].info["mpc"]
    # near the end of the flight with arcs no step lowers what is left, which is rounding
    assert info["ticks"] == 40 and info["failed"] <= (3 if name == "arcs2" else 0)
