"""Dynamics at many nodes as one CasADi function: those of CasADi's own SX operations."""

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail.model.nodes.function import _record
from tests.casadi.externals import LAST
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

COUNTS = (1, 8, 11)  # one, a full group of lanes, and a part of a second one


def arguments(rat: st.Model, name: str, count: int) -> list[np.ndarray]:
    """Inputs at nodes, quaternions of several norms, and weights of the results."""
    random = np.random.default_rng(count)
    q, v = 0.5 * random.normal(size=(rat.nq, count)), random.normal(size=(rat.nv, count))
    q[3:7] += np.array([[1.0], [0.2], [0.0], [0.0]]) * random.uniform(0.5, 2, count)
    last = 1e-2 * random.normal(size=(rat.layout.nt if LAST[name] == "tau" else rat.nv, count))
    return [q, v, last, random.normal(size=(rat.nv, count))]


def results(f: casadi.Function, count: int, *parameters) -> list[casadi.Function]:
    """Value, Jacobian and Hessian of a function of many nodes, with the unknowns of node after
    node.
    """
    kind = casadi.SX if parameters else casadi.MX
    inputs = [kind.sym(f.name_in(k), *f.size_in(k)) for k in range(3)]
    x, mu = casadi.veccat(*inputs), kind.sym("mu", *f.size_out(0))
    y = f(*inputs, *parameters)
    sizes = [f.size1_in(k) for k in range(3)]
    starts = np.cumsum([0, *(size * count for size in sizes)])
    by_node = [
        int(starts[k] + size * node + row)
        for node in range(count)
        for k, size in enumerate(sizes)
        for row in range(size)
    ]
    J = casadi.jacobian(casadi.vec(y), x)[:, by_node]
    H = casadi.hessian(casadi.dot(mu, y), x)[0][by_node, by_node]
    return [casadi.Function("f", [*inputs, mu], [result]) for result in (y, J, H)]


def symbolic(rat: st.Model, name: str) -> list[casadi.Function]:
    """CasADi's own derivatives of SX operations at one node."""
    return results(rat.casadi.symbolic(name), 1, casadi.SX(rat.casadi.parameter_vector))


@pytest.mark.parametrize("tail", ["m1_n1", pytest.param("arcs1", marks=pytest.mark.slow)])
def test_values_and_derivatives_are_those_of_the_symbolic_function(tail):
    rat = zoo.model(tail)
    for name in LAST:
        own = symbolic(rat, name)
        for count in COUNTS:
            given = arguments(rat, name, count)
            compiled = results(rat.casadi.nodes(name, count, folded=True), count)
            for order, (f, g) in enumerate(zip(compiled, own, strict=True)):
                found = f(*given)
                blocks = [g(*(part[:, node] for part in given)) for node in range(count)]
                wanted = casadi.diagcat(*blocks) if order else casadi.horzcat(*blocks)
                largest = np.abs(wanted.full()).max()
                with row(name, count, order):
                    np.testing.assert_allclose(found.full(), wanted.full(), atol=1e-10 * largest)
                    assert found.nnz() <= wanted.nnz()


def test_blocks_are_those_of_the_compiled_function():
    """Exact sparsity: the Jacobian's and the Hessian's are those of ``external``, node by node."""
    rat = zoo.model("m1_n1")
    for name in LAST:
        single = results(rat.casadi.external(name, derivatives=2, folded=True), 1)
        several = results(rat.casadi.nodes(name, 3, folded=True), 3)
        for one, three in zip(single[1:], several[1:], strict=True):
            pattern = one.sparsity_out(0)
            with row(name):
                assert three.sparsity_out(0) == casadi.diagcat(pattern, pattern, pattern)


def test_parameters_are_one_vector_for_all_nodes():
    rat, count = zoo.model("m1_n1"), 3
    for name in LAST:
        q, v, last, _ = arguments(rat, name, count)
        f, single = rat.casadi.nodes(name, count), rat.casadi.symbolic(name)
        assert (f.name_in(), f.name_out()) == (single.name_in(), single.name_out())
        other = 1.1 * rat.casadi.parameter_vector
        wanted = single.map(count)(q, v, last, casadi.repmat(other, 1, count))
        with row(name):
            np.testing.assert_allclose(f(q, v, last, other), wanted, rtol=1e-10, atol=1e-12)


def test_results_do_not_depend_on_the_number_of_threads(monkeypatch):
    rat, count, name = zoo.model("m1_n1"), 303, "forward_dynamics"
    given, found = arguments(rat, name, count), []
    for most in (1, 3):
        monkeypatch.setattr(rat.batch_library, "threads", most)
        assert _record(rat, name, count, 2).kinds[3].threads == most
        hessian = results(rat.casadi.nodes(name, count, folded=True), count)[2]
        found.append(hessian(*given).nonzeros())
    assert found[0] == found[1]


def test_derivatives_of_a_higher_order_than_asked_are_not_there():
    for order in (0, 1):
        f = zoo.model("m1_n1").casadi.nodes("forward_dynamics", 2, derivatives=order, folded=True)
        inputs = [casadi.MX.sym("x", *f.size_in(k)) for k in range(3)]
        y = casadi.sum2(casadi.sum1(f(*inputs)))
        with pytest.raises(RuntimeError):
            casadi.Function("f", inputs, [casadi.hessian(y, inputs[0])[0]])
        if order:  # all but the position of B moves an acceleration
            slope = casadi.Function("f", inputs, [casadi.jacobian(y, inputs[0])])
            assert slope.nnz_out() == 2 * (zoo.model("m1_n1").nq - 3)


def test_a_node_that_gives_no_number_is_an_error_of_the_evaluation():
    rat = zoo.model("m1_n1")
    f = rat.casadi.nodes("forward_dynamics", 9, folded=True)
    q, v, tau, _ = arguments(rat, "forward_dynamics", 9)
    q[3:7, 8] = 0.0
    with pytest.raises(RuntimeError, match="failed"):
        f(q, v, tau)


REFUSED = [
    (("mass_matrix", 3), "name: .*'mass_matrix'"),
    (("forward_dynamics", 0), "count: .*0"),
    (("forward_dynamics", 2.5), r"count: .*2\.5"),
    (("forward_dynamics", 3, 3), "derivatives: .*3"),
]


def test_what_cannot_be_is_refused_and_what_the_scene_lacks_is_named():
    for given, words in REFUSED:
        with row(given), pytest.raises(st.ModelError, match=words):
            zoo.model("m1_n1").casadi.nodes(*given)
    few = ["forward_dynamics", "forward_dynamics_derivatives"]
    rat = st.load(folder_of(zoo.scene("bare", functions=few)))
    with pytest.raises(st.ModelError, match="forward_dynamics_vjp"):
        rat.casadi.nodes("forward_dynamics", 3)
    assert rat.casadi.nodes("forward_dynamics", 3, derivatives=1).n_in() == 4
