"""Functions for PyTorch: the model's values, exact gradients, and what PyTorch checks itself."""

import re

import numpy as np
import pytest

import serpentail as st

from ..support.models import model_folder
from .conftest import RUNS, assert_near, by_differences

FUNCTIONS = ("forward_dynamics", "inverse_dynamics")
every_function = pytest.mark.parametrize("name", FUNCTIONS)


@pytest.fixture(scope="session")
def functions(model, torch):
    return st.torch_functions(model)


def arguments(states, name):
    q, v, tau = states
    return (q, v, tau if name == "forward_dynamics" else 3 * np.roll(v, 1, axis=0))


def tensors(torch, arrays, **options):
    return [torch.tensor(array, **options) for array in arrays]


@every_function
@pytest.mark.parametrize("runs", [1, 3, RUNS])
def test_values_are_the_models(torch, model, functions, states, name, runs):
    given = [array[:runs] for array in arguments(states, name)]
    expected, function = getattr(model, name)(*given), getattr(functions, name)
    assert_near(function(*tensors(torch, given)), expected, 1e-12)
    assert_near(torch.vmap(function)(*tensors(torch, given)), expected, 1e-12)
    assert_near(function(*tensors(torch, (array[0] for array in given))), expected[0], 1e-12)


@every_function
def test_gradients_are_those_by_differences(torch, model, functions, states, name):
    given, weights = [array[2] for array in arguments(states, name)], np.arange(1.0, 11)
    own = tensors(torch, given, requires_grad=True)
    (getattr(functions, name)(*own) @ torch.tensor(weights)).backward()
    for k in range(3):
        jacobian = by_differences(
            lambda x, k=k: getattr(model, name)(*given[:k], x, *given[k + 1 :]), given[k]
        )
        assert_near(own[k].grad, weights @ jacobian, 1e-9)


@pytest.mark.filterwarnings("ignore:The .grad attribute:UserWarning")  # what opcheck reads
@every_function
def test_checks_of_pytorch_pass(torch, functions, states, name):
    given = tensors(torch, (a[:2] for a in arguments(states, name)), requires_grad=True)
    scale = 1e-3 if name == "forward_dynamics" else 1.0
    assert torch.autograd.gradcheck(lambda *x: scale * getattr(functions, name)(*x), given)
    operator = torch.ops.serpentail.function.default
    told = torch.library.opcheck(operator, (*given, functions._key, name))
    assert len(told) == 4 and set(told.values()) == {"SUCCESS"}


def test_x_dot_and_its_derivatives_are_the_models(torch, model, functions, states):
    x, tau = np.hstack(states[:2]), states[2]
    assert_near(functions.x_dot(*tensors(torch, (x, tau))), model.x_dot(x, tau), 1e-12)
    given = tuple(tensors(torch, (x[3], tau[3])))
    found = torch.autograd.functional.jacobian(functions.x_dot, given)
    for one, other in zip(found, model.x_dot_derivatives(x[3], tau[3]), strict=True):
        assert_near(one, other, 1e-10)


def test_one_state_is_repeated_over_leading_axes(torch, functions, model, states):
    q, v, tau = states
    found = functions.forward_dynamics(*tensors(torch, (q[0], v[:12].reshape(3, 4, -1), tau[5])))
    for k in range(12):
        assert_near(found[k // 4, k % 4], model.forward_dynamics(q[0], v[k], tau[5]), 1e-12)


def test_floats_become_doubles(torch, functions, model, states):
    given = [array.astype(np.float32) for array in states]
    found = functions.forward_dynamics(*tensors(torch, given))
    assert found.dtype == torch.float64
    assert_near(found, model.forward_dynamics(*(a.astype(float) for a in given)), 1e-12)


@pytest.mark.parametrize(
    "changed, line",
    [
        ({"q": np.zeros(10)}, "forward_dynamics: q has shape (10,), not (..., 11)"),
        ({"v": np.zeros((5, 10))}, "leading axes differ ((21, 11), (5, 10), (21, 4)): give one"),
        ({"tau": np.zeros(4, complex)}, "forward_dynamics: tau: type torch.complex128: needs real"),
        ({"tau": np.full(4, np.nan)}, "forward_dynamics: tau[0] of state 0: value nan"),
    ],
)
def test_what_is_wrong_is_named(torch, functions, states, changed, line):
    given = dict(zip(("q", "v", "tau"), states, strict=True)) | changed
    with pytest.raises(st.StateError, match=re.escape(line)):
        functions.forward_dynamics(*tensors(torch, given.values()))


def test_what_is_no_tensor_of_the_cpu_is_refused(torch, functions, states):
    given = tensors(torch, states)
    for other in (states[0], given[0].to("meta")):
        with pytest.raises(st.StateError, match="forward_dynamics: q: needs a tensor of the CPU"):
            functions.forward_dynamics(other, *given[1:])
    with pytest.raises(st.StateError, match="x_dot: x: needs a tensor of shape"):
        functions.x_dot(given[0], given[2])


def test_functions_that_the_scene_left_out_are_named(torch):
    functions = st.torch_functions(st.load(model_folder(1, 1, functions=["forward_dynamics"])))
    given = [np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2)]
    own = tensors(torch, given, requires_grad=True)
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        functions.forward_dynamics(*own).sum().backward()
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        functions.inverse_dynamics(*own)
