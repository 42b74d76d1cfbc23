"""Every block of every document runs as pasted, or says why it does not; the table of functions
that a scene needs is what the runtime asks for.
"""

import ast
import doctest
import inspect
import re
import subprocess
import tomllib
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from serpentail.differentiable.rules import RULES
from serpentail.exporting.fmu import FLYING, TOUCHING
from serpentail.identification import identify
from serpentail.planning import best
from serpentail.planning.condensed import node
from serpentail.planning.predictive import settings
from serpentail_codegen.scene.signatures.table import ALL, EXACT_DERIVATIVES
from tests.docs.running import PAGES, blocks, run_page
from tests.support import zoo
from tests.support.rows import row

RUN = ("python", "sh", "toml", "c", "cpp", "cmake")  # languages whose blocks do something here
SHOWN = ("text", "json", "html")  # output, formulas
QUICK = {"autodiff", "contact", "continuum_forms", "learning", "python"}
NEEDS = {"autodiff": ["jax"], "export": ["pinocchio"], "viewing": ["imageio_ffmpeg", "viser"]}
NEEDS |= {"recipes": ["fmpy"]}
RUNNING = [
    pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])
    for name, path in PAGES.items()
    if any(block.language in RUN and not block.reason for block in blocks(path))
]


def test_every_block_says_what_it_is_or_why_it_is_not_run():
    for block in (block for path in PAGES.values() for block in blocks(path)):
        with row(block):
            assert block.language in (*RUN, *SHOWN) or block.reason
            assert block.language not in ("c", "cpp") or block.name or block.reason
            assert not block.reason or len(block.reason.split()) > 2
            if block.reason and block.language == "python":
                ast.parse(block.text)
            elif block.reason and block.language == "toml":
                tomllib.loads(block.text)


@pytest.mark.parametrize("name", RUNNING)
def test_the_blocks_of_a_page_run(name, tmp_path):
    for library in NEEDS.get(name, []):
        pytest.importorskip(library)
    ran = run_page(PAGES[name], tmp_path)
    for check in TOLD.get(name, []):
        check(ran)


def of_c(ran):
    model = st.load(ran.folder / "generated" / "articulated_m3_n4")
    q = np.array([0, 0, 0, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0])
    v_dot = model.forward_dynamics(q, np.zeros(model.nv), np.array([1e-3, 0, 0, 0, 0, 0]))
    line = f"status 0, p_ddot_z = {v_dot[2]:g} m/s^2, alpha_1_ddot = {v_dot[6]:g} rad/s^2\n"
    assert ran.printed.count(line) == 2  # by the page's command, and without warnings


def of_planning(ran):
    good, error, _ = ran.printed.split()[:3]
    assert good == "True" and float(error) <= 0.01


def of_sweeps(ran):
    text = PAGES["sweeps"].read_text(encoding="utf-8")
    first, second = ran.printed.splitlines()
    assert first == re.search(r"print\(study.status\(\)\)  # (.*)", text)[1] and float(second) > 0
    assert {path.name for path in ran.folder.iterdir()} >= {"study.db", "run.html"}


def of_getting_started(ran):
    tilts = re.findall(r"^(\S+) degrees of tilt at the end", ran.printed, re.MULTILINE)
    planned, passive = map(float, tilts[-2:])
    assert planned < 0.1 and passive > 90


def of_casadi(ran):
    assert ran.printed.count("Solve_Succeeded") == 3


def of_python(ran):
    numbers = re.search(r"C = \[(.*?)\]", ran.printed, re.DOTALL)[1].split()
    assert np.abs(np.array(numbers, float)).max() < 1e-12


def of_flight(ran):
    (height,) = re.findall(r"after 0.5 s: height (\S+) m", ran.printed)
    fallen = 0.3 + 2 * 0.5 - 9.8 / 2 * 0.5**2
    assert float(height) == pytest.approx(fallen, abs=0.1)  # of B, not of the centre of mass
    assert {"flight.html", "leap.html"} <= {path.name for path in ran.folder.iterdir()}


def of_demo(ran):
    """The demo writes its files, and its flights lose what is damped."""
    demo = ran.folder / "output" / "demo"
    for scene in ("kangaroo_rat_m1_n3", "kangaroo_rat_m3_n4"):
        flight = st.Trajectory.load(demo / f"{scene}.npz")
        damped = simpson(-np.sum(flight.tau * flight.v[:, 6:], axis=1), x=flight.t)
        assert flight.energy[0] - flight.energy[-1] == pytest.approx(damped, rel=1e-3)
    assert len([*demo.glob("*.png")]) >= 6 and (demo / "righting.gif").exists()
    assert "0.00 deg with the planned tail" in ran.printed
    drifts = re.findall(r"constant to (\S+),", ran.printed)
    differences = re.findall(r"differ by (\S+) at most", ran.printed)
    assert len(drifts) == 4
    assert max(map(float, drifts)) < 1e-9 and max(map(float, differences)) < 1e-8


def of_recipes(ran):
    """Code of CasADi, a unit and plain C come to what the model does."""
    model, casadi, block, flown = (ran.names[x] for x in ("model", "casadi", "block", "flown"))
    q, v = np.array([0, 0, 0.34, 0.9, 0.3, -0.2, 0.1, 0.2, 0.1]), np.arange(8.0) - 3.5
    q[3:7] /= np.linalg.norm(q[3:7])
    x, u = np.concatenate([q, v]), np.array([1e-3, -2e-3])
    with chdir(ran.folder):
        words = "cc -shared -fPIC f.c -L. -lrat -Wl,-rpath,$ORIGIN -lm -o g.so"  # as for acados
        subprocess.run(words.split(), check=True)
        for rates in (ran.names["compiled"], casadi.external("f", "./g.so")):
            np.testing.assert_allclose(rates(x, u), model.x_dot(x, u)[:, None], rtol=1e-12)
        jacobians = casadi.external("f_jac", "./f.so")(x, u)
        for found, one in zip(jacobians, model.x_dot_derivatives(x, u), strict=True):
            np.testing.assert_allclose(found, one, rtol=0, atol=1e-9 * np.abs(one).max())
        printed = np.loadtxt("v_dot.txt")
        assert "rat_casadi_forward_dynamics(" in Path("f.c").read_text()
    wanted = model.forward_dynamics(block["q"], block["v"], block["tau"])
    assert ran.names["status"] == 0
    for found in (block["v_dot"], printed):
        np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-12)
    law, q, v = st.TorqueTable([0.0, 1.0], [[1e-3, 0.0]] * 2), np.eye(9)[3], 5 * np.eye(8)[3]
    q[2] = 2.0
    motion = st.simulate(model, q, v, controller=law, t_span=0.2)
    for k in range(9):
        assert flown[f"q[{k + 1}]"][-1] == pytest.approx(motion.q[-1, k], abs=1e-6)


TOLD = {
    "README": [of_c, of_python, of_flight, of_demo],
    "c": [of_c],
    "casadi": [of_casadi],
    "getting_started": [of_getting_started],
    "planning": [of_planning],
    "python": [of_python],
    "recipes": [of_recipes],
    "sweeps": [of_sweeps],
}


def test_examples_of_docstrings_run():
    found, finder = [], doctest.DocTestFinder(recurse=False)
    for name in st.__all__:
        thing = getattr(st, name)
        members = [n for n in dir(thing) if n[0] != "_"] if inspect.isclass(thing) else []
        for each in [thing, *(inspect.getattr_static(thing, n) for n in members)]:
            if ">>>" in (inspect.getdoc(each) or ""):
                found += finder.find(getattr(each, "__func__", each), name, globs={})
    assert len(found) > 5
    for each in found:
        with row(each.name):
            assert doctest.DocTestRunner().run(each).failed == 0


def test_figures_of_the_readme_are_those_of_the_benchmarks():
    readme = PAGES["README"].read_text(encoding="utf-8")
    table = readme.split("## How fast, how accurate")[1].split("## ")[0]
    rows = re.findall(r"^\| (?!what|---)(.*) \|$", table, re.MULTILINE)
    measured = PAGES["benchmarks"].read_text(encoding="utf-8")
    assert rows
    for text in rows:
        for number in re.findall(r"(?<![\w.-])\d[\d.e-]*(?:x| us| ms)?(?![\w.])", text):
            assert number.removesuffix(" us") in measured, (text, number)


# Functions that a scene needs.

FIRST, SECOND = EXACT_DERIVATIVES["forward_dynamics"]
ALL_DERIVATIVES = {part for orders in EXACT_DERIVATIVES.values() for o in orders for part in o}
OF_RULES = {name for rule in RULES.values() for name, _ in rule.jacobians}
NEEDED = {
    "`st.plan`": set(best.NEEDED),
    "`st.plan`, up to seven times as fast": ALL_DERIVATIVES - set(best.NEEDED),
    '`st.plan(..., solver="fatrop")`': set(node.FUNCTIONS.values()),
    "`st.Mpc`": set(settings.NEEDED.values()),
    "`st.identify`": {*identify.FUNCTIONS, "forward_dynamics_parameter_derivatives"},
    '`casadi.external("x_dot", derivatives=1)`': {"forward_dynamics", *FIRST},
    '`casadi.external("x_dot", derivatives=2)`': set(SECOND) - set(FIRST),
    "`st.jax_functions`, `st.torch_functions`": {*RULES, *OF_RULES},
    "[an FMU](export.md)": {*FLYING, *TOUCHING},
}


def test_the_table_of_functions_that_a_scene_needs_is_what_the_runtime_asks_for():
    """Of simulations, what their errors name: a model with next to nothing is told all it lacks."""
    section = PAGES["models"].read_text(encoding="utf-8").partition("## Which functions")[2]
    section = section.partition("\n## ")[0]
    _, *table = [line.strip("|").split("|") for line in section.splitlines() if line[:2] == "| "]
    rows = {purpose.strip(): {*re.findall(r"`(\w+)`", names)} & {*ALL} for purpose, names in table}
    model = zoo.model("bare")
    q, v = np.eye(model.nq)[3], np.zeros(model.nv)
    for purpose, at_times, call in [
        ("`st.simulate`", "implicit", lambda: st.simulate(model, q, v)),
        ("`model.step`, `st.environment`", "implicit", lambda: model.step(q, v, [0, 0], 1e-3)),
        ("`st.Pfl`", "pfl", lambda: st.Pfl(model, ([0.0, 1.0], np.zeros((2, 2))))),
    ]:
        with row(purpose), pytest.raises(st.ModelError) as caught:
            call()
        named = re.findall(r"'(\w+)'", str(caught.value).partition("(it has")[0])
        assert rows.pop(purpose) - {*model.generated} == {*named, at_times}, purpose
    assert rows == NEEDED
