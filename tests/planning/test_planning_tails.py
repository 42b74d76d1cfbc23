"""Plans and predictive control of tails that differ: links of their own on a tilted mount, springs,
damping and stops, arcs of their own, and links and arcs in one tail.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import tilt_deg
from serpentail.planning.condensed import fatrop
from serpentail.planning.condensed.stages import stages_of
from serpentail.planning.nlp.bounds import limits
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.solver import solve, solver
from serpentail.planning.nlp.transcription import transcription_of
from serpentail.planning.result.truth import planned_torques
from serpentail_codegen.scene.parse import parse_scene
from tests.support.models import folder_of
from tests.support.tumbling import DURATION, FUNCTIONS, NODE, start

ELASTIC = {"tail_stiffness": 3e-3, "tail_rest": 0.1, "tail_damping": 1e-4}
ELASTIC |= {"tail_stop_lower": -0.9, "tail_stop_upper": 0.9, "tail_stop_stiffness": 0.05}
LINKS = {"links": 3, "link_lengths": "80, 65, 50 mm", "link_masses": "1.6, 1.2, 0.8 g"}
ARCS = [{"length": "115 mm", "mass": "2.2 g"}, {"length": "80 mm", "mass": "1.3 g"}]
BOTH = [
    {"kind": "articulated", "links": 2, "length": "110 mm", "mass": "2.2 g"},
    {"kind": "continuum", "length": "85 mm", "mass": "1.3 g"},
]
TAILS = {
    "links": {
        "kind": "articulated",
        "segments": [LINKS],
        "parameters": {"mount_angles": [0.2, 0.1, -0.3]},
    },
    "elastic": {"kind": "articulated", "segments": 1, "links": 3, "parameters": ELASTIC},
    "arcs": {
        "kind": "continuum",
        "segments": ARCS,
        "parameters": {"mount_angles": [0.2, 0.1, -0.3]},
    },
    "both": {"kind": "mixed", "segments": BOTH, "parameters": {"tail_damping": 1e-4}},
}
SLOW = ("arcs", "both")
EACH = [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in TAILS]
SEED = 0  # of the start


@cache
def model_of(name) -> st.Model:
    """Return the model of a tail, with all that its plans need."""
    functions = [*dict.fromkeys([*NODE, *FUNCTIONS])]
    table = TAILS[name] | {"functions": functions, "emission": "loops"}
    return st.load(folder_of(parse_scene(table, "tail")))


@cache
def planned(name, solver="ipopt") -> st.Plan:
    """Return a plan that rights a tumbling rat with the tail."""
    model = model_of(name)
    return st.plan(
        model,
        start=start(model, SEED),
        duration=DURATION,
        goal=st.Goal(torso_rate=None),
        bounds=st.Bounds(angle=np.pi / 3),
        intervals=10,
        tolerance=None,
        track=False,
        solver=solver,
    )


@pytest.mark.parametrize("name", EACH)
def test_optima_of_stages_are_those_of_ipopt(name):
    """FATROP begins a little away from the optimum of IPOPT, and comes back."""
    near, model = planned(name), model_of(name)
    assert near.report["converged"] and near.report["dynamics"] == "compiled"
    q, v = near.problem.q0, near.problem.v0
    begin = {"attitude": q[3:7], "tail": q[7:], "tail_rate": v[6:]}
    kept = np.concatenate([model.momentum(q, v)[1], np.zeros(7)])
    mesh = replace(near.mesh, guarded=np.ones(near.mesh.intervals, bool))
    nlp = transcription_of(model, near.problem, mesh, near.rule, equations_of_motion(model))
    engine = solver(nlp, "ipopt", {"ipopt.tol": 1e-11}, "close")
    wanted = solve(engine, limits(nlp, begin, np.zeros(3)), near.solution.w, kept)
    assert wanted.success
    w = wanted.w * (1 + 1e-6 * np.random.default_rng(0).normal(size=wanted.w.size))
    stages = stages_of(model, near.problem, near.mesh, near.rule)
    found = fatrop.solve_stages(stages, begin, w, kept, fatrop.engine_of({}, "close"))
    assert found.success, found.status
    assert found.value == pytest.approx(wanted.value, rel=1e-8)
    np.testing.assert_allclose(found.w, wanted.w, atol=1e-4)


@pytest.mark.parametrize("name", EACH)
def test_fatrop_plans_from_passive_flight(name):
    plan = planned(name, "fatrop")
    assert plan.report["converged"], plan.report["status"]
    assert plan.report["open_loop_attitude_error_deg"] < 1.0


@pytest.mark.parametrize("name", EACH)
def test_predictive_control_rights_a_disturbed_body(name):
    model, plan = model_of(name), planned(name)
    q, v = start(model, SEED)
    v[3:6] += 0.1, -0.06, 0.12
    flights = [
        st.simulate(model, q, v, controller=law, t_span=DURATION)
        for law in (st.TorqueCurve(planned_torques(plan.curve)), st.Mpc(model, plan))
    ]
    off, left = (float(tilt_deg(flight.q[-1, 3:7])) for flight in flights)
    assert off > 1.0 > 20 * left
    info = flights[1].info["mpc"]
    assert info["ticks"] == 40 and info["failed"] == 0
