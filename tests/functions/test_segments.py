"""Forward dynamics in every form is exact to rounding, also in long tails and coils."""

import numpy as np
import pytest

import serpentail as st
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row

FUNCTION = "forward_dynamics"
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("straight", "lanes")]
# rad at every joint: turns that lie on one another
COILS = ((0.7, 0.4), (1.5, -0.2))


def states(segments):
    """Names and tuples (q, v, v_dot, tau): random ones and coils."""
    for kind in (*KINDS, "coiled"):
        found = random_states(segments, 11, 2, "random" if kind == "coiled" else kind)
        for k, state in enumerate(zip(*found, strict=True)):
            if kind == "coiled":
                state[0][7:] = np.tile(COILS[k], segments)
            yield f"{kind} {k}", state


def assert_exact(model, exact, name, state, per_condition=5e-15, limit=1.0):
    """Compare v_dot with 40 digits, relative to the condition number of the scaled H."""
    q, v, _, tau = state
    error = block_error(model.forward_dynamics(q, v, tau), exact.forward_dynamics(q, v, tau))
    with row(name):
        assert error <= per_condition * equilibrated_condition(exact.mass_matrix(q))
        assert error <= limit


@pytest.mark.parametrize("name", ["m1_n3", "loops", "segments", "m3_n4", *SLOW])
def test_accelerations_are_exact_to_rounding(name):
    model = zoo.model(name)
    exact = ExactChain(TABLE_1, model.segments, model.links)
    # by segments, no matrix is formed whose condition number counts
    limit = 1e-13 if name == "segments" else 1.0
    for at, state in states(model.segments):
        assert_exact(model, exact, at, state, 1e-14, limit)


@pytest.mark.parametrize("arcs", [5, pytest.param(16, marks=pytest.mark.slow)])
def test_many_arcs_are_exact_too(arcs):
    """The size is the point: lanes that fill no vector, and two vectors."""
    functions = [FUNCTION, f"{FUNCTION}_vjp"]
    model = st.load(model_folder(arcs, None, functions=functions), profile="reproducible")
    assert model.manifest["functions"][FUNCTION]["emission"] == "segments"
    exact = ExactContinuum(dict(TABLE_1), arcs)
    q, v, _, tau = (x[0] for x in random_states(arcs, 11, 1, "random"))
    error = block_error(model.forward_dynamics(q, v, tau), exact.forward_dynamics(q, v, tau))
    assert error <= 1e-13

    # the adjoint product, which needs H beside it, along one direction of the rates
    weights, along, h = np.cos(np.arange(model.nv)), np.sin(np.arange(model.nv)), 1e-5
    ahead, behind = (exact.forward_dynamics(q, v + step * along, tau) for step in (h, -h))
    slope = weights @ np.array(ahead - behind, float) / (2 * h)
    dv = model.forward_dynamics_vjp(q, v, tau, weights)[1]
    assert dv @ along == pytest.approx(slope, rel=1e-7)
    q[-1] = 6.4
    with pytest.raises(st.StateError, match=rf"segment {arcs} .*6\.4"):
        model.forward_dynamics(q, v, tau)
