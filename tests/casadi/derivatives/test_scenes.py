"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import re
import subprocess
import tomllib
import venv
from pathlib import Path

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES

from ...references.parameters import random_states
from ...support import collocation
from ...support.models import model_folder
from .external_models import BY_PARAMETERS, PARTS

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


def test_each_parameter_has_its_name(loaded):
    names, values = loaded.casadi.parameter_names, loaded.casadi.parameter_vector.full().ravel()
    assert len(names) == len(values)
    for name, value in zip(names, values, strict=True):
        key, _, k = name.rstrip("]").partition("[")
        whole = loaded.parameters[key]
        assert value == (whole[int(k)] if k else whole)
    heavier = loaded.parameters["torso_mass"] * 1.01
    changed = loaded.with_parameters(torso_mass=heavier).casadi.parameter_vector.full().ravel()
    assert names[np.flatnonzero(changed != values)[0]] == "torso_mass"


@pytest.mark.parametrize("order", [3, -1, 1.5, True, "2"])
def test_order_of_derivatives_is_checked(loaded, order):
    for name in ("forward_dynamics", "x_dot"):
        with pytest.raises(st.ModelError, match=r"derivatives: value .*: needs a whole number"):
            loaded.casadi.external(name, derivatives=order)


def test_what_only_simulations_call_is_no_casadi_function():
    model = st.load(model_folder(1, 1, functions=["forward_dynamics", "energy", "rollout"]))
    for made in (model.casadi.symbolic, model.casadi.external, model.kernel):
        with pytest.raises(st.ModelError, match=r"'rollout' of .* no form for CasADi"):
            made("rollout")


@pytest.mark.parametrize("folded", [True, False])
def test_second_derivatives_of_x_dot_are_those_of_the_symbolic_function(folded):
    """Also where the scene has derivatives by parameters, whose second ones are NaN."""
    model = st.load(model_folder(1, 3, functions=[*PARTS, *BY_PARAMETERS]))
    p, (nx, nu) = model.casadi.parameter_vector, (model.nq + model.nv, 2)
    compiled = model.casadi.external("x_dot", derivatives=2, folded=folded)
    q, v, _, tau = (x[0] for x in random_states(1, 3, 1, "random"))
    found = []
    for kind, f in ((casadi.MX, compiled), (casadi.SX, model.casadi.x_dot)):
        x, u = kind.sym("x", nx), kind.sym("u", nu)
        y = f(*(x, u, p)[: f.n_in()])
        weighted = casadi.dot(casadi.cos(casadi.DM(range(nx))), y)
        of = casadi.hessian(weighted, casadi.vertcat(x, u))[0]
        found.append(casadi.Function("of", [x, u], [of])(casadi.vertcat(q, v), tau).full())
    np.testing.assert_allclose(*found, rtol=1e-9, atol=1e-12 * np.abs(found[1]).max())
    if not folded:
        inputs = casadi.MX.sym("x", nx), casadi.MX.sym("u", nu), casadi.MX.sym("p", p.numel())
        slope = casadi.Function("slope", inputs, [casadi.jacobian(compiled(*inputs), inputs[2])])
        symbols = model.casadi.x_dot.sx_in()
        own = casadi.jacobian(model.casadi.x_dot(*symbols), symbols[2])
        expected = casadi.Function("slope", symbols, [own])
        at = casadi.vertcat(q, v), tau, p
        found, expected = slope(*at).full(), expected(*at).full()
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


def test_second_derivatives_that_a_scene_lacks_are_refused(loaded):
    f = loaded.casadi.external("forward_dynamics")
    x = [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()]
    assert casadi.gradient(casadi.sum1(f(*x)), x[0]).size1() == 9
    with pytest.raises(RuntimeError, match="Derivatives cannot be calculated"):
        casadi.hessian(casadi.sum1(f(*x)), x[0])


# Versions.


def oldest():
    """The oldest casadi that this package takes."""
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    return next(
        re.search(r">=([\d.]+)", need)[1]
        for need in project["optional-dependencies"]["plan"]
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


def test_the_document_has_every_exact_derivative():
    text = (Path(__file__).parents[3] / "docs" / "casadi.md").read_text()
    for name, (first, second) in EXACT_DERIVATIVES.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert re.findall(r"`(\w+)`", row) == [name, *first, *second]
