"""Planning problems that cannot be posed: the error names field and value, before any solve."""

import json
import re

import numpy as np
import pytest

import serpentail as st
from serpentail.planning.paths_at_start import refuse_violated
from serpentail.planning.settings import PLACES
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.posed import posed
from tests.support.rows import row
from tests.support.tumbling import AGAIN, DURATION, keyed, rat, start

NAN, INF = float("nan"), float("inf")
Goal, Bounds = st.Goal, st.Bounds
RANGE = {"tail_length": (0.08, 0.25)}
VALUES = {"start": 3, "duration": 0, "bounds": 0.02, "goal": 3, "objective": "least"}
VALUES |= {"damping": -1e-3, "smoothing": "none"}
VALUES |= {"path": None, "intervals": 0, "most_intervals": 0}
VALUES |= {"controls": 2.5, "rounds": -1, "multi_start": 0, "retries": True, "seed": -1}
VALUES |= {"tolerance": 0.0, "tail_tolerance": 0.0, "rate_tolerance": "x", "time_limit": 0}
VALUES |= {"guess": 3, "guess_damping": -1, "track": 1, "watch": 3}
VALUES |= {"solver": "no_such", "options": 3}
GOALS = {"attitude": "up", "torso_rate": (0, 0), "tail": ("1", None)}
BOUNDS = {"torque": 0, "angle": (1, 2, 3)}
GONE = ("formulation", "attitude", "rule", "dynamics")
PROBLEM = {
    r"start\[0\]: ": {"start": (np.ones(8), np.zeros(8))},
    r"start\[0\]: .*needs 9 numbers": {"start": (np.ones(10), np.zeros(8))},
    r"start\[1\]\[3\]: value nan": {"start": (np.ones(9), [0, 0, 0, NAN, 0, 0, 0, 0])},
    r"start\[0\]\[3:7\]: .*zero": {"start": (np.zeros(9), np.zeros(8))},
    "duration: value .*least <= most": {"duration": (0.5, 0.2)},
    r"duration: value \(1, 2, 3\)": {"duration": (1, 2, 3)},
    "duration: value 1e.160": {"duration": 1e160},
    'duration: value 580 s: .*"580 ms"': {"duration": 580},
    "duration: value '20 mm': a length": {"duration": "20 mm"},
    "goal: value 'upwright': .*'upright'": {"goal": "upwright"},
    "goal.attitude: ": {"goal": Goal(attitude=(0, 0, 0, 0))},
    "goal.torso_rate: value .*each may be": {"goal": Goal(torso_rate=(0, (1, 2, 3), 0))},
    "goal.torso_rate: value .*least below most": {"goal": Goal(torso_rate=(0, (2, 1), 0))},
    r"goal.torso_rate\[1, 1\]: value inf": {"goal": Goal(torso_rate=(0, (0, INF), 0))},
    r"goal.tail: value \(0.1, None, 0.2\)": {"goal": Goal(tail=(0.1, None, 0.2))},
    r"goal.tail: value array\(1": {"goal": Goal(tail=np.array(1.0))},
    "goal.tail: has masked": {"goal": Goal(tail=np.ma.masked_all(2))},
    "goal.tail_rate: value .*nan": {"goal": Goal(tail_rate=(NAN, None))},
    "goal.tail: entry 0 is 0.9": {"goal": Goal(tail=(0.9, None)), "bounds": Bounds(angle=0.8)},
    "goal.tail_rate: entry 1 is -9": {"goal": Goal(tail_rate=(0, -9)), "bounds": Bounds(rate=8.0)},
    "bounds.torque: value '20 mm'": {"bounds": Bounds(torque="20 mm")},
    "bounds.speed: value 5: .* torque": {"bounds": Bounds(torque=None, speed=5)},
    "bounds.power: value '3 N m'": {"bounds": Bounds(power="3 N m")},
    "bounds.angle: .*beta_1 .* 0.001": {"bounds": Bounds(angle=1e-3)},
    "bounds.rate: .*alpha_1_dot = 5 rad/s, beyond 1": {
        "start": (start(rat())[0], 5 * np.eye(8)[6]),
        "bounds": Bounds(rate=1.0),
    },
    "objective: .*'torqe'.*'torque'": {"objective": lambda p: p.torqe**2},
    r"objective: .*shape \(2, 1\)": {"objective": lambda p: p.torque},
    "objective: value 'least'": {"objective": lambda _: "least"},
    "objective: .*nan, as float": {"objective": lambda p: float(p.torque[0])},
    "objective: .* is nan": {"objective": lambda p: p.tail[0] * NAN + p.torque[0]},
    r"path\[0\]: .* is nan": {"path": [(lambda p: float(p.torque[0]), 0, 1)]},
    r"path\[0\]: value \(3, 0, 1\)": {"path": [(3, 0, 1)]},
    r"path\[0\]: bounds \('0', 1\)": {"path": [(len, "0", 1)]},
    r"path\[0\]: bounds \(1.0, 0.0\)": {"path": [(len, 1, 0)]},
    r"path\[0\]: .*'hight'": {"path": [(lambda p: p.hight, 0, 1)]},
    r"path\[0\]: value None": {"path": [(lambda _: None, 0, 1)]},
    r"path\[0\]: the start has .*entry": {"path": [(lambda p: p.tail, 0.5, 1)]},
    r"path\[0\]: the start has 0.3, ": {"path": [(lambda p: p.position[2], 0, 0.2)]},
    r"path\[1\]: the start": {"path": [(lambda p: p.tail[0], -9, 9), (lambda p: p.time, 0.1, 1)]},
    "degree: value 0": {"degree": 0},
    "degree: value 6": {"degree": 6},  # one too many
    "degree: value 2.0": {"degree": 2.0},
    r"setting: value 'num_nodes': .*mesh=st.Mesh\(intervals=...\)": {"num_nodes": 59},
    r"setting: value 'interval': .*mesh=st.Mesh\(intervals=...\)": {"interval": 20},
    "setting: value 'initial_guess': .*'guess'": {"initial_guess": 3},
    "mesh: value 3: needs st.Mesh": {"mesh": 3},
    "solver.name: value 'ipotp': .*'ipopt'": {"solver": "ipotp"},
    "options: .*'ipopt.no_such'": {"options": {"ipopt.no_such": 1}, "solver": "ipopt"},
    "options: 'max_iter': .*begins with 'fatrop.' or 'ipopt.'": {"options": {"max_iter": 5}},
    "options: 'knitro.x': ": {"options": {"knitro.x": 5}},
    **{f"setting: value {name!r}": {name: "x"} for name in GONE},
}
OPTIONS = {"fatrop.max_itr": 5, "fatrop.max_iter": "5", "fatrop.mu_init": NAN}
FREE_VALUES = {"tail": 0.1, "tail_rate": (1, 0), "velocity": (1, 1)}
FREE = {
    "free_start: value 3": 3,
    "free_start: part: value 'tails': .*'tail'": {"tails": (0, 1)},
    "free_start.position: value .0, 0, 0, 0.": {"position": ((0, 0, 0, 0), 1)},
    "free_start.torso_rate: value inf": {"torso_rate": (0, INF)},
    "bounds.angle: the start has alpha_1 =": {"tail": (1.2, 1.3)},
}
SMALL, LARGE = (1e-5, 1e-5, 1e-5), (1e-5, 1e-5, 3e-5)
DESIGN_VALUES = {"tail_length": 0.1, "tail_mass": (0.2, 0.1), "torso_mass": (0.2, 0.2)}
DESIGNS = {
    "design: value 3": 3,
    "design.tail_lenght: .*'tail_length'": {"tail_lenght": (0.1, 0.2)},
    "design.tail_mass: value -0.1": {"tail_mass": (-0.1, 0.1)},
    "design.tail_mass: value nan": {"tail_mass": (0.1, NAN)},
    "design.tail_mass: value '1 m'": {"tail_mass": ("1 m", "2 m")},
    r"design.torso_inertia: value \(1e-05, 1e-05, 3e-05\)": {"torso_inertia": (SMALL, LARGE)},
    "design.link_inertia: value 1e-08": {"link_inertia": (1e-8, 1e-7)},
    "link_radius and link_inertia": {"link_radius": (1, 2), "link_inertia": (SMALL, [2e-5] * 3)},
}
STOPS = {
    r"start: alpha_1 is 1\.": {"start": ([*np.eye(7)[3], 1.5, 0, 0, 0], np.zeros(10))},
    r"goal\.tail: beta_1 is -1\.2": {"goal": Goal(tail=[0.0, -1.2, 0, 0])},
    "duration: value -1": {"goal": Goal(tail=[0.0, None, 0, 0]), "duration": -1},
    "free_start.tail: beta_1": {"free_start": {"tail": (-1.5, 0.1)}},
    "design.tail_stop_lower": {"design": {"tail_stop_lower": (-1.0, -0.5)}},
}


def refused(words, model=None, ask=keyed, **changes):
    model = model or rat()
    given = {"start": start(model), "duration": DURATION} | changes
    with row(words), pytest.raises(st.PlanningError, match=words):
        ask(model, **given)


def test_what_is_wrong_is_named():
    for name, value in VALUES.items():
        place = ".".join(PLACES.get(name, (name,)))
        refused(re.escape(f"{place}: value {value!r}"), **{name: value})
    for name, value in GOALS.items():
        refused(re.escape(f"goal.{name}: value {value!r}"), goal=Goal(**{name: value}))
    for name, value in BOUNDS.items():
        refused(re.escape(f"bounds.{name}: value {value!r}"), bounds=Bounds(**{name: value}))
    for words, changes in PROBLEM.items():
        refused(words, **changes)
    for name, value in OPTIONS.items():
        refused(f"'{name}'|{name}: value {value!r}", options={name: value})


MESH = {"degree": 5, "intervals": 7, "most_intervals": 8, "controls": 6, "rounds": 2}
SOLVER = {"options": {"ipopt.tol": 1}, "time_limit": 1.5, "multi_start": 2, "retries": 0}
SOLVER |= {"seed": 3, "track": False, "watch": print}
NEAR = {"tolerance": 0.5, "tail_tolerance": None, "rate_tolerance": 2, "through_torso": True}
OLD = (  # keywords of earlier versions, and their new place
    (MESH, "mesh", st.Mesh(**MESH)),
    (SOLVER, "solver", st.Solver(**SOLVER | {"time_limit": "1500 ms"})),
    (NEAR, "tolerances", st.Tolerances("0.5 deg", None, "2 rad/s", True)),
    ({"guess_damping": 2.0}, "guess", st.Guess(damping="2 N m s")),
)


def test_old_keywords_are_fields_of_objects_with_one_note_each():
    def asked(**settings):
        return posed(rat(), st.plan, start=start(rat()), duration=DURATION, **settings)[1]

    for given, home, made in OLD:
        with row(home), pytest.warns(DeprecationWarning) as notes:
            old = asked(**given)
        assert old == asked(**{home: made}) != asked()
        place = rf"{home}=st\.{type(made).__name__}\(\w+=\.\.\.\)"
        for name, note in zip(given, notes, strict=True):
            with row(name), pytest.warns(DeprecationWarning):
                assert re.fullmatch(f"{name}= is now {place}", str(note.message))
                assert note.filename.endswith("posed.py")  # which calls plan
                words = f"{name}: value .*: beside {home}: "
                refused(words, ask=st.plan, **{name: given[name], home: made})
    with pytest.warns(DeprecationWarning):  # beside a name and a motion, which are no objects
        old = asked(solver="ipopt", track=False, guess=None, guess_damping=1e-4)
    assert old.solver == st.Solver("ipopt", track=False) and old.guess.damping == 1e-4


def test_wrong_ranges_are_named():
    bounds = Bounds(angle=np.pi / 3)
    for name, value in FREE_VALUES.items():
        refused(re.escape(f"free_start.{name}: value {value!r}"), free_start={name: value})
    for words, ranges in FREE.items():
        refused(words, free_start=ranges, bounds=bounds)
    for name, value in DESIGN_VALUES.items():
        refused(re.escape(f"design.{name}: value {value!r}"), design={name: value})
    for words, ranges in DESIGNS.items():
        refused(words, design=ranges)
    for words, changes in STOPS.items():
        refused(words, zoo.model("elastic"), **changes)


def test_parameters_that_do_nothing_are_refused_and_errors_of_the_users_own_are_not():
    model = zoo.model("ground_m1_n1")  # a plan flies: parameters of contacts do nothing
    name = next(name for name in model.parameters if name.startswith("K_"))
    value, upright = model.parameters[name], np.r_[0, 0, 1, 1, np.zeros(model.nq - 4)]
    given = {"start": (upright, 5 * np.eye(model.nv)[3]), "duration": DURATION}
    with pytest.raises(st.PlanningError, match=f"design: value '{name}'"):
        keyed(model, design={name: (value, 2 * value)}, **given)
    with pytest.raises(AttributeError, match="'NoneType' object has no attribute 'torque'"):
        keyed(model, objective=lambda p: None.torque, **given)


def test_path_constraints_that_a_start_may_meet_are_not_refused():
    """Torques and a free duration are not known there, nor are free starts."""
    (q, v), model = start(rat()), rat()

    def check(path, **more):
        given = {"start": (q, v), "duration": (0.1, 0.5), "path": path} | more
        refuse_violated(model, posed(model, **given)[0])

    path = [(lambda p: p.torque, -1e-4, 0.02), (lambda p: p.duration, 0.3, 0.4)]
    path += [(lambda p: p.tail[0], q[7] - 1e-7, 3.0), (lambda p: p.tail_rate[0], -np.inf, 1e3)]
    check(path)
    path = [(lambda p: p.tail[0], q[7] + 0.01, 3.0)]
    check(path, free_start={"tail": (q[7:] - 0.1, q[7:] + 0.1)})
    with pytest.raises(st.PlanningError, match=r"path\[0\]: the start has"):
        check(path)


def test_bounds_and_durations_may_have_units_and_slips_of_units_give_a_warning():
    def asked(duration, bounds, model=None):
        model = model or rat()
        return posed(model, start=start(model), duration=duration, bounds=bounds)[0]

    numbers = asked(0.4, Bounds(angle=np.pi / 3, torque=(0.02, 0.01), rate=np.radians(500)))
    texts = asked("400 ms", Bounds("60 deg", "500 deg/s", ["20 mN m", "10 N mm"]))
    assert numbers.duration == texts.duration == (0.4, 0.4)
    for name in ("angle", "rate", "torque"):
        wanted = getattr(numbers.bounds, name)
        np.testing.assert_allclose(getattr(texts.bounds, name), wanted, rtol=1e-15)
    for words, duration, bounds in (
        ('duration: value 6 s: .*"6 ms"', 6.0, Bounds()),
        ('torque: value 20 N m: .*did you mean "20 mN m"', 0.4, Bounds(torque=20)),
        ('angle: value 60 rad: .*"60 deg"', 0.4, Bounds(angle=60)),
    ):
        with row(words), pytest.warns(st.UnusualSize, match=words):
            asked(duration, bounds)
    asked(5.0, Bounds(angle=1e3, torque=None))  # the longest fall; nobody means 1000 degrees
    weightless = rat().with_parameters(gravity=0.0)
    assert asked(580.0, Bounds(torque=None), weightless).duration == (580, 580)


def test_models_that_lack_functions_are_refused():
    """A scene without derivatives takes the symbolic dynamics."""
    names = ["mass_matrix", "inverse_dynamics", "forward_dynamics", "rollout", "energy", "momentum"]
    model = st.load(model_folder(1, 1, functions=names))  # the list of functions is the point
    given = AGAIN | {"start": start(model), "intervals": 4, "track": True}
    plan, whole = (keyed(each, **given).report for each in (model, zoo.model("m1_n1")))
    assert plan["dynamics"] == "symbolic" and plan["converged"]
    assert plan["objective"] == pytest.approx(whole["objective"], rel=1e-6)
    for name, most in (("tracked_tail_error_rad", 1e-4), ("tracked_attitude_error_deg", 1e-3)):
        assert plan[name] == pytest.approx(whole[name], abs=most), name  # whose PFL is compiled
    given["track"] = False
    plan = keyed(model, **given)
    path = ((lambda point: point.tip, 0, 1),)
    for body, error, words, changes in (
        (zoo.model("bare"), st.ModelError, "'mass_matrix'", {}),
        (zoo.model("fixed"), st.ModelError, "fixed", {}),
        (model, st.PlanningError, "'tip'", {"path": path}),
    ):
        with row(words), pytest.raises(error, match=words):
            keyed(body, **given | changes)
    with pytest.raises(st.ModelError, match="without 'airborne_rates', 'airborne_rates_deriv"):
        st.Mpc(model, plan)


def test_goal_that_cannot_be_reached_is_flagged():
    q, v = start(rat())
    v[3] = 60.0  # rad/s, far too fast for the time and torques given
    settings = {"retries": 0, "options": {"fatrop.max_iter": 60}, "duration": 0.1}
    settings["bounds"] = Bounds(angle=np.pi / 3, torque=1e-4)
    plan = keyed(rat(), start=(q, v), **settings)
    assert not plan.success and not plan.report["converged"]
    assert plan.report["status"] != "Solve_Succeeded"
    json.dumps(plan.report, allow_nan=False)
