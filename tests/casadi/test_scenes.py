"""Which derivatives of compiled functions a scene has in CasADi, and what is refused."""

import re
import subprocess
import venv
from pathlib import Path

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail_scene.signatures.table import EXACT_DERIVATIVES
from tests.references.parameters import random_states
from tests.support import slopes, zoo
from tests.support.models import folder_of
from tests.support.rows import row

from .externals import model_of

ROOT = Path(__file__).parents[2]


def test_scene_has_the_derivatives_that_its_functions_allow():
    """The lists of functions are the point."""
    rows = [
        (["forward_dynamics"], []),
        (["forward_dynamics", "forward_dynamics_derivatives"], ["jac_"]),
        (["forward_dynamics", "forward_dynamics_vjp"], ["adj1_"]),
        (["inverse_dynamics", "inverse_dynamics_derivatives"], []),
        (["inverse_dynamics", "inverse_dynamics_derivatives", "mass_matrix"], ["jac_"]),
    ]
    for functions, kinds in rows:
        host = folder_of(zoo.scene("bare", functions=functions)) / "src" / "bare_host.c"
        pattern = r"^int (\w*?)bare_casadi_(\w+)\(const real \*\*arg.*;"
        wanted = [("", name) for name in functions] + [(kind, functions[0]) for kind in kinds]
        with row(functions):
            assert sorted(re.findall(pattern, host.read_text(), re.M)) == sorted(wanted)


@pytest.fixture(scope="module")
def loaded():
    """A model with first derivatives of forward dynamics alone."""
    functions = ["forward_dynamics", "energy", "forward_dynamics_derivatives", "rollout"]
    return st.load(folder_of(zoo.scene("bare", functions=functions)))


def test_missing_derivatives_are_named(loaded):
    external = loaded.casadi.external
    f = external("forward_dynamics", derivatives=1)
    assert f.jacobian().n_out() == 4 and f.is_diff_in() == [True, True, True, False]
    missing = "'forward_dynamics_vjp', 'inverse_dynamics_hessian', 'mass_matrix'"
    rows = [(("forward_dynamics", 2), missing), (("energy", 1), "energy")]
    rows += [
        ((name, n), rf"derivatives: .*{n}")
        for n in (3, -1, 1.5, True, "2")
        for name in ("forward_dynamics", "x_dot")
    ]
    for (name, order), words in rows:
        with row(name, order), pytest.raises(st.ModelError, match=words):
            external(name, derivatives=order)
    for made in (loaded.casadi.symbolic, external, loaded.kernel):
        with pytest.raises(st.ModelError, match=r"'rollout' of bare .*CasADi"):
            made("rollout")
    f = external("forward_dynamics")
    x = [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()]
    assert casadi.gradient(casadi.sum1(f(*x)), x[0]).size1() == 9
    with pytest.raises(RuntimeError, match="Derivatives cannot be calculated"):
        casadi.hessian(casadi.sum1(f(*x)), x[0])


def test_folded_function_takes_the_parameters_of_the_model(loaded):
    heavy = loaded.with_parameters(torso_mass=1.0)
    q, v, _, tau = (x[0] for x in random_states(1, 3, 1, "random"))
    for model in (loaded, heavy):
        f = model.casadi.external("forward_dynamics", folded=True)
        assert f.name_in() == ["q", "v", "tau"] and f.name_out() == ["v_dot"]
        expected = model.forward_dynamics(q, v, tau)
        np.testing.assert_allclose(f(q, v, tau).full().ravel(), expected, rtol=1e-14)
        block = f.jacobian()(q=q, v=v, tau=tau)["jac_v_dot_tau"]
        expected = model.forward_dynamics_derivatives(q, v, tau)[2]
        np.testing.assert_allclose(block.full(), expected, rtol=1e-12)
    assert len(loaded.casadi.external("energy", folded=True)(q, v)) == 2
    symbols = [casadi.MX.sym(key, f.size1_in(key), 3) for key in f.name_in()]
    of_q = casadi.jacobian(f.map(3)(*symbols), symbols[0])
    assert of_q.nnz() == 3 * f.jacobian().nnz_out("jac_v_dot_q")


def test_each_parameter_has_its_name(loaded):
    names, values = loaded.casadi.parameter_names, loaded.casadi.parameter_vector.full().ravel()
    for name, value in zip(names, values, strict=True):
        key, _, k = name.rstrip("]").partition("[")
        whole = loaded.parameters[key]
        assert value == (whole[int(k)] if k else whole), name
    heavier = loaded.parameters["torso_mass"] * 1.01
    changed = loaded.with_parameters(torso_mass=heavier).casadi.parameter_vector.full().ravel()
    assert names[np.flatnonzero(changed != values)[0]] == "torso_mass"


def test_derivatives_of_x_dot_are_those_of_the_symbolic_function():
    """Also second ones where the scene has derivatives by parameters, whose second ones are NaN."""
    model = zoo.model("m1_n3")
    p, (nx, nu) = model.casadi.parameter_vector, (model.nq + model.nv, 2)
    q, v, _, tau = (x[0] for x in random_states(1, 3, 1, "random"))
    folded, free = (model.casadi.external("x_dot", derivatives=2, folded=f) for f in (True, False))
    found = {"hessian": [], "slope": []}
    for kind, f in ((casadi.SX, model.casadi.x_dot), (casadi.MX, folded), (casadi.MX, free)):
        x, u, own = kind.sym("x", nx), kind.sym("u", nu), kind.sym("p", p.numel())
        weighted = casadi.dot(casadi.cos(casadi.DM(range(nx))), f(*(x, u, p)[: f.n_in()]))
        blocks = {"hessian": casadi.hessian(weighted, casadi.vertcat(x, u))[0]}
        if f is not folded:
            blocks["slope"] = casadi.jacobian(f(x, u, own), own)
        for name, block in blocks.items():
            of = casadi.Function(name, [x, u, own], [block])
            found[name].append(of(casadi.vertcat(q, v), tau, p).full())
    for name, (expected, *others) in found.items():
        for other in others:
            most = 1e-12 * np.abs(expected).max()
            np.testing.assert_allclose(other, expected, rtol=1e-9, atol=most, err_msg=name)


# Versions


OLDEST = re.search(r"casadi>=([\d.]+)", (ROOT / "pyproject.toml").read_text())[1]


@pytest.mark.slow
@pytest.mark.parametrize("version", [f"=={OLDEST}", ""], ids=["oldest", "newest"])
def test_every_casadi_takes_the_same_library(tmp_path, version):
    small = model_of("m1_n1")
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = ["pip", "install", "--quiet", "--disable-pip-version-check", f"casadi{version}"]
    done = subprocess.run(
        [python, "-m", *install, "numpy"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        pytest.skip(f"pip cannot install casadi{version}: {done.stderr.strip()[-300:]}")
    parameters = ",".join(map(repr, map(float, small.vector.full().ravel())))
    module = [str(small.folder), f"{small.name}_casadi", str(small.library), parameters]
    command = [python, slopes.__file__, *module]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done
    found = re.fullmatch(r"casadi (\S+): all agree", done.stdout.splitlines()[-1])
    assert found and (not version or found[1] == version.removeprefix("=="))


def test_the_document_has_every_exact_derivative():
    text = (ROOT / "docs" / "casadi.md").read_text()
    for name, (first, second) in EXACT_DERIVATIVES.items():
        line = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert re.findall(r"`(\w+)`", line) == [name, *first, *second]
