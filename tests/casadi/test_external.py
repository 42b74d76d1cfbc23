"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import casadi
import numpy as np
import pytest

from tests.references.parameters import random_states
from tests.support import slopes, zoo
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
                expected = slopes.blocks(symbolic, at)
                for block, found in slopes.blocks(compiled, at).items():
                    with row(name, kind, label, block):
                        assert slopes.difference(found, expected[block]) <= 1e-12


def dense(sparsity):
    """A sparsity pattern as an array of truth values."""
    return np.array(casadi.DM(sparsity, 1).full(), bool)


@every_model
def test_sparsity_is_that_of_the_numbers(tail):
    """Neither an entry too few (CasADi's own pattern bounds them from above, numbers from below)
    nor one too many.
    """
    model = model_of(tail)
    states = list(zip(*random_states(model.scene.segments, 5, 4, "random"), strict=True))
    for name in LAST:
        for kind in DERIVED:
            (compiled, symbolic), seen = model.pair(name, kind), {}
            for state in states:
                found = slopes.blocks(symbolic, model.inputs(name, state))
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
                assert slopes.difference(*blocks) < 1e-12
        total = casadi.sum1(f(*x))
        mixed = casadi.jacobian(casadi.gradient(total, x[0]), x[3])
        second = [casadi.hessian(total, x[3])[0], mixed, casadi.hessian(total, x[1])[0]]
        twice, mixed, of_v = casadi.Function("blocks", x, second)(*at.values())
        with row(name):
            assert np.all(np.isnan(twice.full())) and np.all(np.isnan(mixed.full()[3:]))
            assert np.all(np.isfinite(of_v.full()))


def test_what_has_no_derivatives():
    f = model_of("baked").external("forward_dynamics")
    assert f.is_diff_in(3) is False and f.jacobian().nnz_out("jac_v_dot_parameters") == 0
    with pytest.raises(RuntimeError, match=r"(?i)jacobian"):
        zoo.model("m1_n1").casadi.external("energy").jacobian()
