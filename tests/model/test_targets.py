"""Models of one target alone: what is there evaluates, what is not is refused with the way out."""

import casadi
import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder

FUNCTIONS = ["mass_matrix", "inverse_dynamics", "forward_dynamics", "energy", "momentum"]
Q = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2]


@pytest.fixture(scope="module")
def both():
    """A model of both targets."""
    return st.load(model_folder(1, 1, functions=FUNCTIONS))


@pytest.fixture(scope="module")
def symbolic():
    """The folder of a model without C."""
    return model_folder(
        1, 1, name="symbolic", functions=[*FUNCTIONS, "rollout"], targets=["casadi"]
    )


@pytest.fixture(scope="module")
def plain():
    """The folder of a model without CasADi functions."""
    return model_folder(1, 1, name="plain", functions=FUNCTIONS, targets=["c"])


def test_a_model_without_c_evaluates_by_casadi(symbolic, both):
    assert sorted(path.name for path in symbolic.iterdir()) == [
        "manifest.json",
        "symbolic_casadi.py",
    ]
    model = st.load(symbolic, compiled=False)
    assert model.generated == tuple(FUNCTIONS)
    np.testing.assert_allclose(model.casadi.mass_matrix(Q), both.mass_matrix(Q), rtol=1e-12)
    assert isinstance(model.casadi.symbolic("forward_dynamics"), casadi.Function)


def test_a_model_without_c_is_not_loaded_compiled(symbolic):
    with pytest.raises(st.ModelError) as caught:
        st.load(symbolic)
    assert str(caught.value) == (
        "symbolic was generated without C: load it with compiled=False for model.casadi, or add "
        '"c" to `targets` of the scene, then generate it again'
    )


@pytest.mark.parametrize(
    "call",
    [
        lambda model: model.mass_matrix(Q),
        lambda model: model.casadi.external("mass_matrix"),
        lambda model: st.simulate(model, Q, [0] * 8),
        lambda model: st.plan(model, start=(Q, [0] * 8), duration=1.0),
    ],
    ids=["function", "external", "simulate", "plan"],
)
def test_what_needs_c_says_so(symbolic, call):
    with pytest.raises(st.ModelError, match="with compiled=False"):
        call(st.load(symbolic, compiled=False))


def test_a_model_without_casadi_functions_evaluates_by_its_c(plain, both):
    assert not list(plain.glob("*.py")) and "_casadi.py" not in (plain / "README.md").read_text()
    model = st.load(plain)
    np.testing.assert_array_equal(model.mass_matrix(Q), both.mass_matrix(Q))
    compiled = model.casadi.external("mass_matrix", folded=True)
    np.testing.assert_array_equal(compiled(Q), both.mass_matrix(Q))
    assert dir(model.casadi) == [
        *("external", "nodes", "parameter_names", "parameter_vector", "symbolic")
    ]


@pytest.mark.parametrize(
    "call",
    [lambda functions: functions.mass_matrix, lambda functions: functions.symbolic("mass_matrix")],
    ids=["attribute", "symbolic"],
)
def test_casadi_functions_that_were_not_asked_for_are_refused(plain, call):
    with pytest.raises(st.ModelError) as caught:
        call(st.load(plain).casadi)
    assert str(caught.value) == (
        'plain was generated without CasADi functions: add "casadi" to `targets` of the scene, '
        "then generate it again, or take compiled ones, external(name)"
    )


def test_a_target_leaves_the_text_of_the_other_alone(plain, symbolic):
    both = model_folder(1, 1, name="plain", functions=FUNCTIONS)
    for path in plain.rglob("*.[ch]"):
        assert path.read_bytes() == (both / path.relative_to(plain)).read_bytes(), path
