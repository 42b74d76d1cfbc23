"""Plans that choose parameters of the model: the best of many ordinary plans, and true."""

import json
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.attitude import angle_deg
from serpentail.planning.design import checked_design
from serpentail.planning.nlp.body import Body
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.mesh import uniform
from serpentail.planning.nlp.rules import collocation_rule
from serpentail.planning.nlp.transcription import transcription_of
from serpentail.scenes.plan import arguments_for
from tests.support.models import model_folder
from tests.support.own_tails import folder_of_tables
from tests.support.tumbling import AGAIN, DURATION, integrated, planned, rat, start

RANGE = (0.08, 0.25)
FREE = {"tail": ((-0.4, -0.1), (0.4, 0.2)), "tail_rate": (-8, 8), "torso_rate": (-4, 4)}


def ordinary(plan, objective="effort", **parameters):
    """The least objective of an ordinary plan on a plan's mesh, for other parameters."""
    settings = AGAIN | {"start": plan.start, "guess": plan, "objective": objective}
    found = st.plan(rat().with_parameters(**parameters), **settings)
    assert found.report["converged"]
    return found.report["objective"]


def designed(**settings):
    """A plan that chooses the tail's length, from the plan of the rat's own."""
    usual = AGAIN | {"start": start(rat()), "design": {"tail_length": RANGE}}
    return st.plan(rat(), **usual | settings)


@pytest.fixture(scope="module")
def chosen() -> st.Plan:
    """The tail length of least effort, on a mesh that is fine enough."""
    model, bounds = rat(), st.Bounds(angle=np.pi / 3)
    settings = {"bounds": bounds, "track": False, "guess": planned()}
    return st.plan(
        model, start=start(model), duration=DURATION, design={"tail_length": RANGE}, **settings
    )


@pytest.mark.parametrize(
    "values",
    [
        {"tail_length": 0.12, "tail_mass": 0.005},
        {"torso_inertia": (6e-5, 4e-5, 7e-5), "torso_mass": 0.2},
        {"link_radius": 0.004, "tail_mount": (0.001, -0.03, 0.0)},
        {"link_inertia": (5e-6, 1e-8, 6e-6), "gravity": 3.7},
    ],
)
def test_parameters_follow_as_in_the_model(values):
    model = rat()
    ranges = {name: (value, 1.1 * np.abs(value)) for name, value in values.items()}
    design = checked_design(model, ranges)
    symbols = ca.SX.sym("design", design.size)
    vector = ca.Function("vector", [symbols], [Body(model, design, symbols).vector])
    found = np.array(vector(np.concatenate([np.atleast_1d(x) for x in values.values()])))
    wanted = np.array(model.with_parameters(**values).casadi.parameter_vector)
    np.testing.assert_allclose(found, wanted, rtol=1e-14)


def test_totals_follow_from_links():
    """Mass and length of a tail whose links have their own."""
    cone = {"length": 0.2, "radii": [0.004, 0.001], "density": 1000.0}
    table = {"kind": "articulated", "segments": 1, "links": 3, "taper": cone}
    folder = folder_of_tables(table, {}, functions=["mass_matrix"])
    model = st.load(folder, compiled=False)
    masses = 1.2 * np.array(model.parameters["link_masses"])
    design = checked_design(model, {"link_masses": (0.5 * masses, 2 * masses)})
    body = Body(model, design, ca.SX(masses))
    own = model.with_parameters(link_masses=masses)
    assert float(ca.DM(body.parameters["tail_mass"])) == pytest.approx(own.parameters["tail_mass"])
    assert body.parameters["tail_length"] == own.parameters["tail_length"]
    vector = np.array(ca.DM(body.vector))
    np.testing.assert_allclose(vector, np.array(own.casadi.parameter_vector), rtol=1e-14)


@pytest.mark.parametrize(
    ("formulation", "attitude"),
    [("airborne", "quaternion"), ("translation-free", "quaternion"), ("full", "euler")],
)
@pytest.mark.parametrize("rule", ["radau", "trapezoidal"])
def test_derivatives_are_casadis(formulation, attitude, rule):
    """Those of the program, by CasADi's differentiation of its objective and constraints."""
    model = rat(exact=False)
    path = ((lambda point: point.tip[2] - point.parameters["tail_length"] * point.time, -1, 1),)
    free = FREE | ({"attitude": (-0.1, 1)} if attitude == "euler" else {})
    plan = st.plan(
        model,
        start=start(model),
        duration=(0.3, DURATION),
        design={"tail_length": RANGE, "torso_inertia": ((6e-5, 3.6e-5, 7e-5), (7e-5, 4e-5, 8e-5))},
        free_start=free,
        path=path,
        objective=lambda point: ca.sumsqr(point.torque) * point.parameters["torso_inertia"][1],
        formulation=formulation,
        attitude=attitude,
        rule=rule,
        intervals=2,
        options={"ipopt.max_iter": 0},
        multi_start=1,
        retries=0,
        tolerance=None,
        track=False,
    )
    problem, found = plan.problem, plan.solution
    equations = equations_of_motion(model, design=problem.design)
    nlp = transcription_of(model, problem, uniform(2), collocation_rule(rule, None), equations)
    w, p, lam_f, lam_g = (nlp.functions["hess_lag"].mx_in(k) for k in range(4))
    f, g = nlp.functions["nlp"](w, p)
    total = lam_f * f + ca.dot(lam_g, g)
    wanted = ca.Function(
        "wanted",
        [w, p, lam_f, lam_g],
        [ca.gradient(f, w), ca.jacobian(g, w), ca.triu(ca.hessian(total, w)[0])],
    )
    random = np.random.default_rng(1)
    point = found.w + random.uniform(-0.05, 0.05, found.w.size)
    parameters, multipliers = np.r_[np.zeros(9), 1.0], random.normal(size=nlp.rows)
    gradient, jacobian, hessian = wanted(point, parameters, 0.7, multipliers)
    own = [
        nlp.functions["grad_f"](point, parameters)[1],
        nlp.functions["jac_g"](point, parameters)[1],
        nlp.functions["hess_lag"](point, parameters, 0.7, multipliers),
    ]
    for ours, casadis in zip(own, (gradient, jacobian, hessian), strict=True):
        scale = np.abs(casadis.full()).max()
        np.testing.assert_allclose(ours.full(), casadis.full(), atol=1e-10 * scale, rtol=1e-9)
    assert np.abs(jacobian.full()[:, 1]).max() > 0  # the length's column


def test_a_range_of_no_width_is_no_choice():
    length = rat().parameters["tail_length"]
    plan, narrow = planned(), (length, length * (1 + 1e-12))
    again = st.plan(rat(), start=plan.start, guess=plan, **AGAIN)
    same = designed(design={"tail_length": narrow}, guess=plan)
    assert same.report["objective"] == pytest.approx(again.report["objective"], rel=1e-7)
    times = np.linspace(0, DURATION, 50)
    np.testing.assert_allclose(same.torque(times), again.torque(times), atol=1e-7)


def test_the_plan_is_true_for_the_found_model(chosen):
    length = chosen.design["tail_length"]
    assert chosen.success and RANGE[0] < length < RANGE[1]
    assert chosen.report["design"] == chosen.design
    assert chosen.model.parameters["tail_length"] == length
    q, v = integrated(rat().with_parameters(**chosen.design), chosen)
    end = chosen.trajectory
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), end.attitude[-1]) < 0.011
    np.testing.assert_allclose(v[3:], end.v[-1, 3:], atol=0.01)
    wrong, _ = integrated(rat(), chosen)  # the model's own tail does something else
    assert angle_deg(wrong[3:7] / np.linalg.norm(wrong[3:7]), end.attitude[-1]) > 1


def test_no_ordinary_plan_is_better(chosen):
    """Plans by compiled C, one for each of several lengths, on the same mesh."""
    best, length = chosen.report["objective"], chosen.design["tail_length"]
    assert ordinary(chosen, tail_length=length) == pytest.approx(best, rel=1e-6)
    near = [ordinary(chosen, tail_length=length * (1 + part)) for part in (-0.02, 0.02)]
    assert min(near) > best * (1 + 1e-6)
    far = [ordinary(chosen, tail_length=x) for x in np.linspace(*RANGE, 6)]
    assert min(far) > best * (1 - 1e-6)
    # the vertex of the parabola through three plans
    bend = near[0] + near[1] - 2 * best
    vertex = length * (1 + 0.02 * (near[0] - near[1]) / (2 * bend))
    assert vertex == pytest.approx(length, rel=1e-3)
    assert abs(chosen.report["design_slopes"]["tail_length"]) < 1e-4 * best / length


@pytest.mark.parametrize(("ends", "at"), [((0.08, 0.12), 1), ((0.22, 0.25), 0)])
def test_slopes_are_those_of_ordinary_plans(chosen, ends, at):
    """At a bound the multiplier is the derivative of the least effort by the length."""
    plan = designed(design={"tail_length": ends}, guess=chosen)
    assert plan.report["converged"] and plan.design["tail_length"] == pytest.approx(ends[at])
    h = 1e-3 * ends[at]
    values = [ordinary(plan, tail_length=ends[at] + step) for step in (-h, h)]
    slope = (values[1] - values[0]) / (2 * h)
    assert plan.report["design_slopes"]["tail_length"] == pytest.approx(slope, rel=1e-3)


def test_a_price_shortens_the_tail(chosen):
    """The objective may count a parameter, and h follows from it: two numbers at once."""
    unit = 1e-3

    def priced(point):
        effort = ca.sumsqr(point.torque / unit) + ca.sumsqr(3e-4 * point.tail_rate / unit)
        return effort + 40 * point.parameters["tail_length"] / point.duration

    design = {"tail_length": RANGE, "tail_mass": (0.003, 0.005)}
    plan = designed(objective=priced, guess=chosen, design=design)
    assert plan.report["converged"]
    assert plan.design["tail_length"] < chosen.design["tail_length"] - 0.005
    model = rat().with_parameters(**plan.design)
    found, wanted = plan.trajectory, model.momentum(*plan.start)[1]
    kept = np.tile(wanted, (len(found.t), 1))
    np.testing.assert_allclose(found.angular_momentum, kept, rtol=1e-6)


@pytest.mark.parametrize("formulation", ["translation-free", "full"])
def test_formulations_choose_the_same(chosen, formulation):
    plan = designed(formulation=formulation, guess=chosen)
    assert plan.report["converged"]
    assert plan.design["tail_length"] == pytest.approx(chosen.design["tail_length"], rel=1e-3)
    assert plan.report["objective"] == pytest.approx(chosen.report["objective"], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["energy", "time"])
def test_other_objectives_choose_too(objective):
    """From passive flight, with several guesses; no ordinary plan from there is better."""
    model, bounds = rat(), st.Bounds(angle=np.pi / 3, torque=0.005)
    duration = (0.1, DURATION) if objective == "time" else DURATION
    settings = {"bounds": bounds, "duration": duration, "objective": objective, "track": False}
    plan = st.plan(
        model, start=start(model), multi_start=2, design={"tail_length": RANGE}, **settings
    )
    assert plan.success
    for length in (plan.design["tail_length"], *RANGE):
        again = st.plan(
            model.with_parameters(tail_length=length),
            start=plan.start,
            guess=plan,
            **settings | {"tolerance": None},
        )
        assert again.report["objective"] > plan.report["objective"] * (1 - 1e-3)


@pytest.mark.parametrize(
    ("design", "words"),
    [
        (3, "design: value 3: needs a mapping of parameters, such as {'tail_length'"),
        ({"tail_lenght": RANGE}, "design.tail_lenght: no such parameter; did you mean 'tail_len"),
        ({"tail_length": 0.1}, "design.tail_length: value 0.1: needs (least, most)"),
        ({"tail_length": (0.2, 0.1)}, "design.tail_length: value (0.2, 0.1): needs least below mo"),
        ({"tail_length": (0.2, 0.2)}, "needs least below most"),
        ({"tail_mass": (-0.1, 0.1)}, "design.tail_mass: value -0.1: needs a finite number (kg), a"),
        ({"tail_mass": (0.1, float("nan"))}, "design.tail_mass: value nan"),
        ({"tail_mass": ("1 m", "2 m")}, "design.tail_mass: value '1 m'"),
        (
            {"torso_inertia": ((1e-5, 1e-5, 1e-5), (1e-5, 1e-5, 3e-5))},
            "design.torso_inertia: value (1e-05, 1e-05, 3e-05): needs",
        ),
        (
            {"link_radius": (1e-3, 2e-3), "link_inertia": (1e-8, 1e-7)},
            "design.link_inertia: value 1e-08: needs 3 finite numbers",
        ),
        (
            {"link_radius": (1e-3, 2e-3), "link_inertia": ([1e-8] * 3, [1e-7] * 3)},
            "design: parameters: link_radius and link_inertia: give one of them, not both",
        ),
    ],
)
def test_wrong_designs_are_refused(design, words):
    with pytest.raises(st.PlanningError) as caught:
        st.plan(rat(), start=start(rat()), duration=DURATION, design=design)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"solver": "fatrop"}, "solver: value 'fatrop': design is given: it takes known"),
        ({"dynamics": "compiled"}, "dynamics: value 'compiled': compiled C takes the parameters"),
    ],
)
def test_what_takes_known_parameters_says_so(settings, words):
    with pytest.raises(st.PlanningError, match=words):
        st.plan(
            rat(), start=start(rat()), duration=DURATION, design={"tail_length": RANGE}, **settings
        )


def test_parameters_that_do_nothing_are_refused():
    """Those of contacts: a plan flies."""
    model = st.load(model_folder(1, 2, contacts=["torso"]))
    name = next(name for name in model.parameters if name.startswith("K_"))
    value = model.parameters[name]
    with pytest.raises(st.PlanningError, match=f"design: value '{name}': nothing in this plan"):
        q, v = np.r_[0, 0, 1, 1, np.zeros(model.nq - 4)], np.zeros(model.nv)
        v[3] = 5
        st.plan(model, start=(q, v), duration=DURATION, design={name: (value, 2 * value)})


SCENE = """
[plan]
duration = 0.4
intervals = 8
design.tail_length = ["16 cm", 0.24]
free_start.tail = [[-0.2, "-5 deg"], [0.2, 0.1]]
"""


def test_command_line_takes_both(tmp_path, capsys):
    model = rat()
    q, v = start(model)
    (tmp_path / "own.toml").write_text(
        f"{SCENE}start.q = {q.tolist()}\nstart.v = {v.tolist()}\nbounds.angle = 1.0\n"
    )
    saved, folder = tmp_path / "own.npz", str(model.folder)
    given = [str(tmp_path / "own.toml"), "--folder", folder, "--json", "-", "--save", str(saved)]
    assert cli.main(["plan", *given]) == 0
    report, motion = json.loads(capsys.readouterr().out), st.Trajectory.load(saved)
    length = report["design"]["tail_length"]
    assert report["success"] and 0.16 <= length <= 0.24
    assert motion.info["parameters"]["tail_length"] == length
    assert report["start"]["tail"] == pytest.approx(motion.q[0, 7:], abs=1e-6)
    assert set(report["design_slopes"]) == {"tail_length"}


def test_a_scaled_scene_scales_its_ranges():
    """By the parameter's unit: an inertia is a mass times a square of a length."""
    manifest = rat().manifest | {"size": {"kg": 8.0, "m": 2.0, "s": 1.0}}
    body = SimpleNamespace(manifest=manifest)
    table = {"start": {"q": [0], "v": [0]}, "duration": 1}
    inertias = [[1e-5, 1e-5, 1e-5], ["20 g mm^2", 1e-5, 1e-5]]
    table["design"] = {"tail_length": ["10 cm", 0.2], "torso_inertia": inertias, "tale": 3}
    found = arguments_for(body, table)["design"]
    np.testing.assert_allclose(found["tail_length"], [0.2, 0.4])
    np.testing.assert_allclose(found["torso_inertia"], [[32e-5] * 3, [64e-8, 32e-5, 32e-5]])
    assert found["tale"] == 3
