"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import re
import subprocess

import casadi
import numpy as np
import pytest

from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES

from ...support import collocation
from ..test_casadi_target import Model
from .external_models import BY_PARAMETERS, PARTS, every_function, inputs, pair, states

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
