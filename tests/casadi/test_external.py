"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import re
import subprocess

import casadi
import numpy as np
import pytest

from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES
from tests.references.parameters import random_states
from tests.support import collocation, zoo
from tests.support.rows import row

from .externals import LAST, model_of

DERIVED = ("jac", "adj1", "jac_adj1")
every_model = pytest.mark.parametrize(
    "tail",
    ["m1_n3", "arcs1", *(pytest.param(n, marks=pytest.mark.slow) for n in ("m3_n4", "arcs2"))],
)


def ports(f):
    """Names and sizes of the inputs and outputs of a function."""
    inputs = [(key, f.size_in(key)) for key in f.name_in()]
    return inputs, [(key, f.size_out(key)) for key in f.name_out()]


@every_model
def test_derivatives_are_those_of_the_symbolic_function(tail):
    """Their ports are those that CasADi gives its own functions."""
    model = model_of(tail)
    for name in LAST:
        for kind in DERIVED:
            compiled, symbolic = model.pair(name, kind)
            with row(name, kind):
                assert ports(compiled) == ports(symbolic)
            for label, state in model.states().items():
                at = model.inputs(name, state)
                expected = collocation.blocks(symbolic, at)
                for block, found in collocation.blocks(compiled, at).items():
                    with row(name, kind, label, block):
                        assert collocation.difference(found, expected[block]) <= 1e-12


def dense(sparsity):
    """A sparsity pattern as an array of truth values."""
    return np.array(casadi.DM(sparsity, 1).full(), bool)


@every_model
def test_sparsity_is_that_of_the_numbers(tail):
    """Neither an entry too few (CasADi's own pattern bounds them from above, numbers from below)
    nor one too many; graphs see it, too.
    """
    model = model_of(tail)
    states = list(zip(*random_states(model.scene.segments, 5, 4, "random"), strict=True))
    for name in LAST:
        for kind in DERIVED:
            (compiled, symbolic), seen = model.pair(name, kind), {}
            for state in states:
                found = collocation.blocks(symbolic, model.inputs(name, state))
                for block, values in found.items():
                    sizes = np.abs(values.full())
                    numbers = sizes > 1e-14 * np.max(sizes, initial=0)
                    seen[block] = seen.get(block, False) | numbers
            for block, numbers in seen.items():
                pattern = dense(compiled.sparsity_out(block))
                with row(name, kind, block):
                    if kind == "adj1":  # CasADi asks for dense gradients
                        assert pattern.all()
                    else:
                        np.testing.assert_array_equal(pattern, numbers)
                        assert not np.any(pattern & ~dense(symbolic.sparsity_out(block)))
        with row(name):
            assert_graphs_see_the_sparsity(model, name)


def assert_graphs_see_the_sparsity(model, name):
    """The Hessian of a graph with a call in it has the pattern of the call's blocks."""
    f, keys = model.external(name), ("q", "v", LAST[name])
    arguments = [casadi.MX.sym(key, f.size1_in(key)) for key in keys]
    weights, x = casadi.MX.sym("weights", f.size1_out(0)), casadi.veccat(*arguments)
    y = f(*arguments, model.vector)
    jacobian, hessian = casadi.jacobian(y, x), casadi.hessian(casadi.dot(weights, y), x)[0]
    second, first = collocation.derivatives(f)["jac_adj1"], f.jacobian()
    rows = [casadi.horzcat(*(second.sparsity_out(f"jac_adj_{a}_{b}") for b in keys)) for a in keys]
    assert hessian.sparsity() == casadi.vertcat(*rows)
    blocks = (first.sparsity_out(f"jac_{f.name_out(0)}_{b}") for b in keys)
    assert jacobian.sparsity() == casadi.horzcat(*blocks)


def test_map_differentiates_each_state():
    model, count = model_of("m1_n3"), 3
    for name in LAST:
        f, keys = model.external(name), ("q", "v", LAST[name])
        states = zip(*random_states(model.scene.segments, 9, count, "random"), strict=True)
        at = [model.inputs(name, state) for state in states]
        symbols = [casadi.MX.sym(key, f.size1_in(key), count) for key in keys]
        mapped = f.map(count)(*symbols, casadi.repmat(model.vector, 1, count))
        of_v = casadi.Function("of_v", symbols, [casadi.jacobian(mapped, symbols[1])])
        found = of_v(*(np.column_stack([state[key] for state in at]) for key in keys))
        first = f.jacobian()
        one = [collocation.blocks(first, state)[f"jac_{f.name_out(0)}_v"] for state in at]
        with row(name):
            assert collocation.difference(found, casadi.diagcat(*one)) <= 1e-15
            assert found.nnz() == sum(block.nnz() for block in one)


# Optimisation


def checked(f, parameters, folder):
    """What IPOPT says when it compares derivatives with differences."""
    text = folder / "ipopt.txt"
    options = {"derivative_test": "second-order", "derivative_test_perturbation": 1e-7}
    options |= {"point_perturbation_radius": 0.1, "nlp_scaling_method": "none", "max_iter": 0}
    options |= {"output_file": str(text), "file_print_level": 4}
    collocation.plan(f, parameters, nodes=2, **options)
    return text.read_text()


@every_model
def test_ipopt_finds_no_error_in_the_derivatives(tail, tmp_path):
    model = model_of(tail)
    for name in LAST:
        with row(name):
            report = checked(model.external(name), model.vector, tmp_path)
            assert "No errors detected by derivative checker" in report


def test_ipopt_would_find_an_error_in_the_derivatives(tmp_path):
    model = model_of("m1_n1")
    host = model.folder / "src" / f"{model.name}_host.c"
    flags = ["-std=c99", "-fPIC", "-shared", "-I", model.folder / "include"]
    for name, right, wrong in (
        ("inverse_dynamics", "real s = 2.0 /", "real s = 2.02 /"),  # by the quaternion
        ("forward_dynamics", "+= a * dv[", "+= 1.1 * a * dv["),  # second ones, by q and v
    ):
        text, library = host.read_text().replace(right, wrong), tmp_path / f"{name}.so"
        assert text != host.read_text()
        (tmp_path / host.name).write_text(text)
        sources = [model.folder / "src" / f"{model.name}.c", tmp_path / host.name]
        subprocess.run(["gcc", *flags, *sources, "-o", library, "-lm"], check=True)
        f = casadi.external(f"{model.name}_casadi_{name}", str(library))
        report = checked(f, model.vector, tmp_path)
        with row(name):
            assert re.search(r"Derivative checker detected +\d+ error", report)


def test_plan_is_that_of_the_symbolic_function():
    model = model_of("m1_n3")
    for name in LAST:
        both = (model.external(name), model.module.function(name))
        found, expected = (collocation.plan(f, model.vector) for f in both)
        with row(name):
            assert found.success and expected.success
            assert found.iter_count == expected.iter_count
            assert found.value == pytest.approx(expected.value, rel=1e-12)
            assert collocation.difference(found.x, expected.x) < 1e-9


# Parameters


def test_first_derivatives_by_parameters_are_exact_and_second_ones_no_number():
    """There is no C for the second ones: better than a zero that is none."""
    model = model_of("m1_n3")
    for name in LAST:
        f, at = model.external(name), model.inputs(name, model.states()["random"])
        out, x = f.name_out(0), [casadi.MX.sym(key, f.size1_in(key)) for key in f.name_in()]
        assert f.is_diff_in() == [True] * 4
        for kind, block in (("jac", f"jac_{out}_parameters"), ("adj1", "adj_parameters")):
            blocks = []
            for g in model.pair(name, kind):
                seeds = [key for key in g.name_in() if key.startswith("adj_")]
                seeds = {key: np.cos(np.arange(g.numel_in(key))) for key in seeds}
                blocks.append(g(**at, **{f"out_{out}": 0}, **seeds)[block])
            with row(name, kind):
                assert collocation.difference(*blocks) < 1e-12
        total = casadi.sum1(f(*x))
        mixed = casadi.jacobian(casadi.gradient(total, x[0]), x[3])
        second = [casadi.hessian(total, x[3])[0], mixed, casadi.hessian(total, x[1])[0]]
        twice, mixed, of_v = casadi.Function("blocks", x, second)(*at.values())
        with row(name):
            assert np.all(np.isnan(twice.full())) and np.all(np.isnan(mixed.full()[3:]))
            assert np.all(np.isfinite(of_v.full()))


def test_baked_parameters_have_no_derivatives():
    f = model_of("baked").external("forward_dynamics")
    assert f.is_diff_in(3) is False
    assert f.jacobian().nnz_out("jac_v_dot_parameters") == 0


def test_functions_without_exact_derivatives_have_none():
    assert LAST.keys() == EXACT_DERIVATIVES.keys()
    f = zoo.model("m1_n1").casadi.external("energy")
    with pytest.raises(RuntimeError, match=r"(?i)jacobian"):
        f.jacobian()
