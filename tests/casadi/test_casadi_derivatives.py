"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import re
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES
from tests.casadi.test_casadi_target import Model
from tests.references.parameters import random_states
from tests.support import collocation
from tests.support.models import model_folder

PARTS = sorted(
    {part for name, orders in EXACT_DERIVATIVES.items() for part in (name, *orders[0], *orders[1])}
)
BY_PARAMETERS = [f"{name}_parameter_derivatives" for name in EXACT_DERIVATIVES]
TAILS = {"m1_n3": (1, 3), "m3_n4": (3, 4), "arcs1": (1, None), "arcs2": (2, None)}
LAST = {"inverse_dynamics": "v_dot", "forward_dynamics": "tau"}
KINDS = ("random", "straight", "folded")
ROUNDING = {"jac": 1e-12, "adj1": 1e-12, "jac_adj1": 1e-12}
every_function = pytest.mark.parametrize("name", EXACT_DERIVATIVES)
every_kind = pytest.mark.parametrize("kind", ROUNDING)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=() if name in ("m1_n3", "arcs1") else pytest.mark.slow)
        for name in TAILS
    ],
)
def model(request):
    """A model with all derivatives but those with respect to parameters."""
    return Model(*TAILS[request.param], functions=PARTS)


@pytest.fixture(scope="module")
def small():
    """A model with first derivatives with respect to parameters."""
    return Model(1, 3, functions=[*PARTS, *BY_PARAMETERS])


def inputs(model, name, state):
    """The inputs of a function at one state, parameters included."""
    q, v, v_dot, tau = state
    found = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "parameters": model.vector}
    return {key: found[key] for key in ("q", "v", LAST[name], "parameters")}


def states(model):
    """States by name: each kind of tail, one at rest, one whose quaternion has another norm."""
    rows = {
        kind: [x[0].copy() for x in random_states(model.scene.segments, 3, 1, kind)]
        for kind in KINDS
    }
    rows["still"] = [x.copy() for x in rows["random"]]
    rows["still"][1][:] = 0
    rows["long"] = [x.copy() for x in rows["random"]]
    rows["long"][0][3:7] *= 1.7
    return rows


def pair(model, name, kind):
    """A derivative of the compiled function, and of the SX function."""
    return [
        collocation.derivatives(f)[kind]
        for f in (model.external(name), model.module.function(name))
    ]


@every_kind
@every_function
def test_ports_are_those_that_casadi_gives_its_own_functions(model, name, kind):
    compiled, symbolic = pair(model, name, kind)
    assert compiled.name_in() == symbolic.name_in() and compiled.name_out() == symbolic.name_out()
    assert [compiled.size_in(k) for k in compiled.name_in()] == [
        symbolic.size_in(k) for k in symbolic.name_in()
    ]
    assert [compiled.size_out(k) for k in compiled.name_out()] == [
        symbolic.size_out(k) for k in symbolic.name_out()
    ]


@every_kind
@every_function
def test_derivatives_are_those_of_the_symbolic_function(model, name, kind):
    compiled, symbolic = pair(model, name, kind)
    for label, state in states(model).items():
        at = inputs(model, name, state)
        expected = collocation.blocks(symbolic, at)
        for block, found in collocation.blocks(compiled, at).items():
            assert collocation.difference(found, expected[block]) <= ROUNDING[kind], (label, block)


def dense(sparsity):
    """A sparsity pattern as an array of truth values."""
    return np.array(casadi.DM(sparsity, 1).full(), bool)


@every_kind
@every_function
def test_sparsity_is_that_of_the_numbers(model, name, kind):
    """Neither an entry too few (CasADi's own pattern bounds them from above, numbers from below)
    nor one too many.
    """
    compiled, symbolic = pair(model, name, kind)
    seen = {}
    for state in zip(*random_states(model.scene.segments, 5, 4, "random"), strict=True):
        for block, found in collocation.blocks(symbolic, inputs(model, name, state)).items():
            values = np.abs(found.full())
            seen[block] = seen.get(block, False) | (values > 1e-14 * np.max(values, initial=0))
    for block, numbers in seen.items():
        if kind == "adj1":  # CasADi asks for dense gradients
            assert compiled.sparsity_out(block).is_dense()
        else:
            pattern = dense(compiled.sparsity_out(block))
            np.testing.assert_array_equal(pattern, numbers, block)
            assert not np.any(pattern & ~dense(symbolic.sparsity_out(block)))


@every_function
def test_graphs_see_the_sparsity(model, name):
    """The Hessian of a graph with a call in it has the pattern of the call's blocks."""
    f = model.external(name)
    arguments = [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()[:3]]
    weights, x = casadi.MX.sym("weights", f.size1_out(0)), casadi.veccat(*arguments)
    total = casadi.dot(weights, f(*arguments, model.vector))
    jacobian, hessian = casadi.jacobian(f(*arguments, model.vector), x), casadi.hessian(total, x)[0]
    second = collocation.derivatives(f)["jac_adj1"]
    keys = f.name_in()[:3]
    rows = [casadi.horzcat(*(second.sparsity_out(f"jac_adj_{a}_{b}") for b in keys)) for a in keys]
    assert hessian.sparsity() == casadi.vertcat(*rows)
    first = f.jacobian()
    assert jacobian.sparsity() == casadi.horzcat(
        *(first.sparsity_out(f"jac_{f.name_out(0)}_{b}") for b in keys)
    )


@every_function
def test_map_differentiates_each_state(model, name):
    f, count = model.external(name), 3
    rows = random_states(model.scene.segments, 9, count, "random")
    at = [inputs(model, name, state) for state in zip(*rows, strict=True)]
    symbols = [casadi.MX.sym(key, f.size1_in(key), count) for key in f.name_in()[:3]]
    mapped = f.map(count)(*symbols, casadi.repmat(model.vector, 1, count))
    of_v = casadi.Function("of_v", symbols, [casadi.jacobian(mapped, symbols[1])])
    found = of_v(*(np.column_stack([state[key] for state in at]) for key in f.name_in()[:3]))
    first = f.jacobian()
    one = [collocation.blocks(first, state)[f"jac_{f.name_out(0)}_v"] for state in at]
    assert collocation.difference(found, casadi.diagcat(*one)) <= 1e-15
    assert found.nnz() == sum(block.nnz() for block in one)


# Optimisation.


def checked(f, parameters, folder):
    """What IPOPT says when it compares derivatives with differences."""
    text = folder / "ipopt.txt"
    options = {
        "derivative_test": "second-order",
        "derivative_test_perturbation": 1e-7,
        "output_file": str(text),
    }
    options |= {
        "point_perturbation_radius": 0.1,
        "nlp_scaling_method": "none",
        "file_print_level": 4,
        "max_iter": 0,
    }
    collocation.plan(f, parameters, nodes=2, **options)
    return text.read_text()


@every_function
def test_ipopt_finds_no_error_in_the_derivatives(model, name, tmp_path):
    report = checked(model.external(name), model.vector, tmp_path)
    assert "No errors detected by derivative checker" in report


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("inverse_dynamics", "real s = 2.0 /", "real s = 2.02 /"),  # by the quaternion
        ("forward_dynamics", "+= a * dv[", "+= 1.1 * a * dv["),  # second ones, by q and v
    ],
)
def test_ipopt_would_find_an_error_in_the_derivatives(small, tmp_path, name, right, wrong):
    host = small.folder / "src" / f"{small.name}_host.c"
    text = host.read_text().replace(right, wrong)
    assert text != host.read_text()
    (tmp_path / host.name).write_text(text)
    sources = [small.folder / "src" / f"{small.name}.c", tmp_path / host.name]
    flags = ["-std=c99", "-fPIC", "-shared", "-I", small.folder / "include"]
    subprocess.run(["gcc", *flags, *sources, "-o", tmp_path / "wrong.so", "-lm"], check=True)
    f = casadi.external(f"{small.name}_casadi_{name}", str(tmp_path / "wrong.so"))
    assert re.search(r"Derivative checker detected +\d+ error", checked(f, small.vector, tmp_path))


@every_function
def test_plan_is_that_of_the_symbolic_function(small, name):
    found, expected = (
        collocation.plan(f, small.vector)
        for f in (small.external(name), small.module.function(name))
    )
    assert found.success and expected.success
    assert found.iter_count == expected.iter_count
    assert found.value == pytest.approx(expected.value, rel=1e-12)
    assert collocation.difference(found.x, expected.x) < 1e-9


# Parameters.


@every_function
def test_first_derivatives_by_parameters(small, name):
    at = inputs(small, name, states(small)["random"]) | {
        f"out_{small.external(name).name_out(0)}": 0
    }
    assert small.external(name).is_diff_in() == [True] * 4
    for kind, block in (
        ("jac", f"jac_{small.external(name).name_out(0)}_parameters"),
        ("adj1", "adj_parameters"),
    ):
        found, expected = (f(**at, **seeds(f))[block] for f in pair(small, name, kind))
        assert collocation.difference(found, expected) < 1e-12


def seeds(f):
    """Weights of an adjoint's outputs."""
    return {
        key: np.cos(np.arange(f.numel_in(key))) for key in f.name_in() if key.startswith("adj_")
    }


@every_function
def test_second_derivatives_by_parameters_are_not_a_number(small, name):
    """There is no C for them: better than a zero that is none."""
    f = small.external(name)
    x = [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()]
    total = casadi.sum1(f(*x))
    at = inputs(small, name, states(small)["random"]).values()
    blocks = [casadi.hessian(total, x[3])[0], casadi.jacobian(casadi.gradient(total, x[0]), x[3])]
    for block in casadi.Function("blocks", x, blocks)(*at):
        assert np.all(np.isnan(block.full()[3 if block.size1() == 9 else 0 :]))
    assert np.all(
        np.isfinite(casadi.Function("of_v", x, [casadi.hessian(total, x[1])[0]])(*at).full())
    )


def test_parameters_without_derivatives_are_declared_so(model):
    for name in EXACT_DERIVATIVES:
        assert model.external(name).is_diff_in() == [True, True, True, False]
        assert model.external(name).reverse(1).is_diff_out() == [True, True, True, False]


def test_other_functions_have_no_derivatives():
    f = Model(1, 1, functions=["energy"]).external("energy")
    with pytest.raises(RuntimeError, match=r"(?i)jacobian"):
        f.jacobian()


def test_baked_parameters_have_no_derivatives():
    f = Model(1, 1, functions=[*PARTS, *BY_PARAMETERS], baked=True).external("forward_dynamics")
    assert f.is_diff_in(3) is False
    assert f.jacobian().nnz_out("jac_v_dot_parameters") == 0


# What a scene has.


@pytest.mark.parametrize(
    ("functions", "kinds"),
    [
        (["forward_dynamics"], []),
        (["forward_dynamics", "forward_dynamics_derivatives"], ["jac_"]),
        (["forward_dynamics", "forward_dynamics_vjp"], ["adj1_"]),
        (["inverse_dynamics", "inverse_dynamics_derivatives"], []),
        (["inverse_dynamics", "inverse_dynamics_derivatives", "mass_matrix"], ["jac_"]),
    ],
)
def test_scene_has_the_derivatives_that_its_functions_allow(functions, kinds):
    folder = model_folder(1, 1, functions=functions)
    text = (folder / "src" / f"{folder.name}_host.c").read_text()
    found = re.findall(rf"^int (\w*?){folder.name}_casadi_(\w+)\(const real \*\*arg.*;", text, re.M)
    assert sorted(found) == sorted(
        [("", name) for name in functions] + [(kind, functions[0]) for kind in kinds]
    )


@pytest.fixture(scope="module")
def loaded():
    """A loaded model with first derivatives of forward dynamics alone."""
    return st.load(
        model_folder(1, 1, functions=["forward_dynamics", "energy", "forward_dynamics_derivatives"])
    )


def test_missing_derivatives_are_named(loaded):
    assert loaded.casadi.external("forward_dynamics", derivatives=1).jacobian().n_out() == 4
    with pytest.raises(
        st.ModelError, match="'forward_dynamics_vjp', 'inverse_dynamics_hessian', 'mass_matrix'"
    ):
        loaded.casadi.external("forward_dynamics", derivatives=2)
    with pytest.raises(st.ModelError, match="energy has no compiled derivatives for CasADi"):
        loaded.casadi.external("energy", derivatives=1)


def test_folded_function_takes_the_parameters_of_the_model(loaded):
    heavy = loaded.with_parameters(torso_mass=1.0)
    f, g = (model.casadi.external("forward_dynamics", folded=True) for model in (loaded, heavy))
    assert f.name_in() == ["q", "v", "tau"] and f.name_out() == ["v_dot"]
    q, v, _, tau = (x[0] for x in random_states(1, 3, 1, "random"))
    np.testing.assert_allclose(
        f(q, v, tau).full().ravel(), loaded.forward_dynamics(q, v, tau), rtol=1e-14
    )
    np.testing.assert_allclose(
        g(q, v, tau).full().ravel(), heavy.forward_dynamics(q, v, tau), rtol=1e-14
    )
    block = f.jacobian()(q=q, v=v, tau=tau)["jac_v_dot_tau"]
    np.testing.assert_allclose(
        block.full(), loaded.forward_dynamics_derivatives(q, v, tau)[2], rtol=1e-12
    )
    assert len(loaded.casadi.external("energy", folded=True)(q, v)) == 2
    symbols = [casadi.MX.sym(key, f.size1_in(key), 3) for key in f.name_in()]
    of_q = casadi.jacobian(f.map(3)(*symbols), symbols[0])
    assert of_q.nnz() == 3 * f.jacobian().nnz_out("jac_v_dot_q")


def test_second_derivatives_that_a_scene_lacks_are_refused(loaded):
    f = loaded.casadi.external("forward_dynamics")
    x = [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()]
    assert casadi.gradient(casadi.sum1(f(*x)), x[0]).size1() == 9
    with pytest.raises(RuntimeError, match="Derivatives cannot be calculated"):
        casadi.hessian(casadi.sum1(f(*x)), x[0])


# Versions.


def oldest():
    """The oldest casadi that this package takes."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    return next(
        re.search(r">=([\d.]+)", need)[1]
        for need in project["dependencies"]
        if need.startswith("casadi")
    )


@pytest.mark.slow
@pytest.mark.parametrize("version", [f"=={oldest()}", ""], ids=["oldest", "newest"])
def test_every_casadi_takes_the_same_library(small, tmp_path, version):
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = [
        python,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        f"casadi{version}",
        "numpy",
    ]
    done = subprocess.run(install, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"pip cannot install casadi{version}: {done.stderr.strip()[-300:]}")
    parameters = ",".join(map(repr, map(float, small.vector.full().ravel())))
    module = [str(small.folder), f"{small.name}_casadi", str(small.library), parameters]
    done = subprocess.run(
        [python, collocation.__file__, *module], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.splitlines()[-1:]) == (
        0,
        [f"casadi {installed(python)}: all agree"],
    ), done
    assert not version or installed(python) == version.removeprefix("==")


def installed(python):
    """The version of casadi that an interpreter finds."""
    return subprocess.run(
        [python, "-c", "import casadi; print(casadi.__version__)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()


# Documents.


def test_example_of_the_document_runs(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "casadi.md").read_text()
    (example,) = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "generated").mkdir()
    (tmp_path / "generated" / "planned").symlink_to(
        model_folder(1, 3, functions=PARTS, name="planned")
    )
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.split()[-1:]) == (0, ["Solve_Succeeded"]), done.stderr
    for name, (first, second) in EXACT_DERIVATIVES.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert re.findall(r"`(\w+)`", row) == [name, *first, *second]
