"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import casadi
import numpy as np
import pytest

from ...references.parameters import random_states
from ...support import collocation
from .external_models import every_function, inputs, pair, states

ROUNDING = {"jac": 1e-12, "adj1": 1e-12, "jac_adj1": 1e-12}
every_kind = pytest.mark.parametrize("kind", ROUNDING)


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
