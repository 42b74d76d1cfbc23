"""Models of one target alone: what is there evaluates, what is not is refused with the way out.

The zoo's models have both targets.
"""

import casadi
import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.models import folder_of

Q = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2]
STATE = Q, [0.5] * 8, [0.1, 0.2]


@pytest.fixture(scope="module")
def symbolic():
    """The folder of "bare" without C."""
    names = ["forward_dynamics", "rollout"]
    return folder_of(zoo.scene("bare", functions=names, targets=["casadi"]))


@pytest.fixture(scope="module")
def plain():
    """The folder of "bare" without CasADi functions."""
    return folder_of(zoo.scene("bare", targets=["c"]))


def test_a_model_without_c_evaluates_by_casadi(symbolic):
    names = sorted(path.name for path in symbolic.iterdir())
    assert names == ["bare_casadi.py", "manifest.json"]
    model, both = st.load(symbolic, compiled=False), zoo.model("bare")
    assert model.generated == ("forward_dynamics",)
    found = model.casadi.forward_dynamics(*STATE).full()[:, 0]
    np.testing.assert_allclose(found, both.forward_dynamics(*STATE), rtol=1e-12)
    assert isinstance(model.casadi.symbolic("forward_dynamics"), casadi.Function)


def test_a_model_without_c_says_so_where_it_is_needed(symbolic):
    model = st.load(symbolic, compiled=False)
    for call in (
        lambda: st.load(symbolic),
        lambda: model.forward_dynamics(*STATE),
        lambda: model.casadi.external("forward_dynamics"),
        lambda: st.simulate(model, *STATE[:2]),
        lambda: st.plan(model, start=STATE[:2], duration=1.0),
        lambda: model.step(*STATE, 1e-3),
    ):
        with pytest.raises(st.ModelError, match=r"bare was .*compiled=False"):
            call()
    with pytest.raises(st.ModelError, match=r'without C.*"c" to `targets`'):
        st.load(symbolic)


def test_a_model_without_casadi_functions_evaluates_by_its_c(plain):
    assert not list(plain.glob("*.py")) and "_casadi.py" not in (plain / "README.md").read_text()
    model, expected = st.load(plain), zoo.model("bare").forward_dynamics(*STATE)
    np.testing.assert_array_equal(model.forward_dynamics(*STATE), expected)
    compiled = model.casadi.external("forward_dynamics", folded=True)
    np.testing.assert_array_equal(compiled(*STATE).full()[:, 0], expected)
    own = ("external", "nodes", "parameter_names", "parameter_vector", "symbolic")
    assert dir(model.casadi) == [*own]
    for call in (
        lambda: model.casadi.forward_dynamics,
        lambda: model.casadi.symbolic("forward_dynamics"),
    ):
        with pytest.raises(st.ModelError, match=r'without CasADi .*"casadi" to `targets`'):
            call()


def test_a_target_leaves_the_text_of_the_other_alone(plain):
    for path in plain.rglob("*.[ch]"):
        assert path.read_bytes() == (zoo.folder("bare") / path.relative_to(plain)).read_bytes(), (
            path
        )
