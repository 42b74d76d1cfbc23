"""Functions for PyTorch: the model's values, exact gradients, and what PyTorch checks itself.

PyTorch is not in the extra "dev": with libraries for graphics cards it is 5 GB.
"""

import numpy as np
import pytest

import serpentail as st

from ..support import zoo
from ..support.rows import row
from .conftest import FUNCTIONS, REFUSED, arguments, assert_near, jacobians

torch = pytest.importorskip("torch")


@pytest.fixture(scope="session")
def functions(model):
    return st.torch_functions(model)


def tensors(arrays, **options):
    return [torch.tensor(array, **options) for array in arrays]


def test_values_are_the_models(model, functions, states):
    for name in FUNCTIONS:
        function, given = getattr(functions, name), arguments(states, name)
        expected = getattr(model, name)(*given)
        for runs in (1, 3, len(expected)):
            with row(name, runs):
                own = tensors(array[:runs] for array in given)
                assert_near(function(*own), expected[:runs], 1e-12)
                assert_near(torch.vmap(function)(*own), expected[:runs], 1e-12)
        assert_near(function(*tensors(array[0] for array in given)), expected[0], 1e-12)


def test_gradients_are_those_by_differences(model, functions, states):
    weights = np.arange(1.0, 11)
    for name in FUNCTIONS:
        given = [array[2] for array in arguments(states, name)]
        own = tensors(given, requires_grad=True)
        (getattr(functions, name)(*own) @ torch.tensor(weights)).backward()
        for each, jacobian in zip(own, jacobians(getattr(model, name), given), strict=True):
            with row(name, each.shape):
                assert_near(each.grad, weights @ jacobian, 1e-9)


@pytest.mark.slow  # 5 s: they import much of PyTorch
@pytest.mark.filterwarnings("ignore:The .grad attribute:UserWarning")  # what opcheck reads
def test_checks_of_pytorch_pass(functions, states):
    for name in FUNCTIONS:
        given = tensors((a[:2] for a in arguments(states, name)), requires_grad=True)
        scale = 1e-3 if name == "forward_dynamics" else 1.0
        function = getattr(functions, name)
        assert torch.autograd.gradcheck(lambda *x, f=function, s=scale: s * f(*x), given)
        operator = torch.ops.serpentail.function.default
        told = torch.library.opcheck(operator, (*given, functions._key, name))
        assert len(told) == 4 and set(told.values()) == {"SUCCESS"}


def test_x_dot_and_its_derivatives_are_the_models(model, functions, states):
    x, tau = np.hstack(states[:2]), states[2]
    assert_near(functions.x_dot(*tensors((x, tau))), model.x_dot(x, tau), 1e-12)
    given = tuple(tensors((x[3], tau[3])))
    found = torch.autograd.functional.jacobian(functions.x_dot, given)
    for one, other in zip(found, model.x_dot_derivatives(x[3], tau[3]), strict=True):
        assert_near(one, other, 1e-10)


def test_one_state_is_repeated_over_leading_axes(functions, model, states):
    q, v, tau = states
    found = functions.forward_dynamics(*tensors((q[0], v[:12].reshape(3, 4, -1), tau[5])))
    expected = model.forward_dynamics(q[0], v[:12], tau[5])
    assert_near(found, expected.reshape(3, 4, -1), 1e-12)


def test_floats_become_doubles(functions, model, states):
    given = [array.astype(np.float32) for array in states]
    found = functions.forward_dynamics(*tensors(given))
    assert found.dtype == torch.float64
    assert_near(found, model.forward_dynamics(*(a.astype(float) for a in given)), 1e-12)


def test_what_is_wrong_is_named(functions, states):
    whole = dict(zip(("q", "v", "tau"), states, strict=True))
    bad = ({"tau": np.full(4, np.nan)}, r"forward_dynamics: tau\[0\] of state 0: value nan")
    for change, words in [*REFUSED, bad]:
        with row(words), pytest.raises(st.StateError, match=words):
            functions.forward_dynamics(*tensors((whole | change).values()))
    given = tensors(states)
    for other in (states[0], given[0].to("meta")):
        with pytest.raises(st.StateError, match="forward_dynamics: q: needs a tensor of the CPU"):
            functions.forward_dynamics(other, *given[1:])
    with pytest.raises(st.StateError, match="x_dot: x: needs a tensor of shape"):
        functions.x_dot(given[0], given[2])


def test_functions_that_the_scene_left_out_are_named():
    functions = st.torch_functions(zoo.model("bare"))
    given = [np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2)]
    own = tensors(given, requires_grad=True)
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        functions.forward_dynamics(*own).sum().backward()
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        functions.inverse_dynamics(*own)
