"""Functions for JAX and PyTorch: the model's values, exact derivatives, and what is refused."""

import sys

import numpy as np
import pytest

import serpentail as st

from ..support import zoo
from ..support.rows import row
from .tools import FUNCTIONS, RUNS, TOOLS, arguments, assert_near, by_differences, states


@pytest.fixture(scope="module", params=TOOLS)
def tool(request):
    return TOOLS[request.param]()


@pytest.fixture(scope="module")
def functions(tool):
    return tool.functions(zoo.model("m2_n2"))


def test_values_are_the_models(tool, functions):
    """Of one state, of few, and of batches that are made in lanes and threads."""
    for name in FUNCTIONS:
        function, given = getattr(functions, name), arguments(name)
        expected = getattr(zoo.model("m2_n2"), name)(*given)
        assert_near(function(*tool.arrays(array[0] for array in given)), expected[0], 1e-12)
        for runs in (1, 3, RUNS):
            with row(name, runs):
                few = tool.arrays(array[:runs] for array in given)
                for found in (function, tool.map(function)):
                    assert_near(found(*few), expected[:runs], 1e-12)
        many = tool.arrays(np.tile(array, (200, 1)) for array in given)
        assert_near(function(*many), np.tile(expected, (200, 1)), 1e-12)


def test_derivatives_are_those_by_differences(tool, functions):
    """The quaternion is not kept at norm 1: a change along it changes nothing."""
    for name in FUNCTIONS:
        model, given = getattr(zoo.model("m2_n2"), name), [array[2] for array in arguments(name)]
        found = tool.jacobians(getattr(functions, name), given)
        for k, each in enumerate(found):
            with row(name, k):
                expected = by_differences(
                    lambda x, k=k, model=model, given=given: model(*given[:k], x, *given[k + 1 :]),
                    given[k],
                )
                assert_near(each, expected, 1e-9)
        by_q = np.asarray(found[0])
        assert np.abs(by_q[:, 3:7] @ given[0][3:7]).max() < 1e-12 * np.abs(by_q).max()


def test_x_dot_and_its_derivatives_are_the_models(tool, functions):
    q, v, tau = states()
    for name, x, u in (("m2_n2", np.hstack([q, v]), tau), ("fixed", 0.1 * v[:, :8], tau)):
        with row(name):
            model = zoo.model(name)
            x_dot = functions.x_dot if name == "m2_n2" else tool.functions(model).x_dot
            assert_near(x_dot(*tool.arrays((x, u))), model.x_dot(x, u), 1e-12)
            found = tool.jacobians(x_dot, (x[3], u[3]))
            for one, other in zip(found, model.x_dot_derivatives(x[3], u[3]), strict=True):
                assert_near(one, other, 1e-10)


def test_one_state_is_repeated_over_leading_axes(tool, functions):
    q, v, tau = states()
    given = tool.arrays((q[0], v[:12].reshape(3, 4, -1), tau[5]))
    expected = zoo.model("m2_n2").forward_dynamics(q[0], v[:12], tau[5]).reshape(3, 4, -1)
    assert_near(functions.forward_dynamics(*given), expected, 1e-12)


REFUSED = [
    ({"q": np.zeros(10)}, r"forward_dynamics: q has shape \(10,\), not \(\.\.\., 11\)"),
    ({"v": np.zeros((5, 10))}, r"leading axes differ \(\(21, 11\), \(5, 10\), \(21, 4\)\)"),
    ({"tau": 0.0}, r"forward_dynamics: tau has shape \(\), not \(\.\.\., 4\)"),
    ({"tau": np.zeros(4, complex)}, r"forward_dynamics: tau: type .*complex128"),
    ({"tau": np.zeros(4, bool)}, r"forward_dynamics: tau: type .*bool"),
]


def test_what_is_wrong_is_named(tool, functions):
    whole = dict(zip(("q", "v", "tau"), states(), strict=True))
    for change, words in REFUSED:
        with row(words), pytest.raises(st.StateError, match=words):
            functions.forward_dynamics(*tool.arrays((whole | change).values()))
    with pytest.raises(st.StateError, match=r"x_dot: x.* shape"):
        functions.x_dot(*tool.arrays((np.zeros(5), np.zeros(4))))


def test_functions_that_the_scene_left_out_are_named(tool):
    functions = tool.functions(zoo.model("bare"))
    q, v, tau = np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2)
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        tool.jacobians(functions.forward_dynamics, (q, v, tau))
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        functions.inverse_dynamics(*tool.arrays((q, v, v)))


def test_without_a_model_or_the_library_that_is_named(monkeypatch):
    for name, each in TOOLS.items():
        with pytest.raises(st.ModelError, match="model: value 'rat'"):
            each.functions("rat")
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{name}\]"'):
            each.functions(zoo.model("bare"))


# PyTorch alone


@pytest.mark.slow  # 5 s: PyTorch's checks import much of it
@pytest.mark.filterwarnings("ignore:The .grad attribute:UserWarning")  # what opcheck reads
def test_checks_of_pytorch_pass():
    tool = TOOLS["torch"]()
    functions, torch = tool.functions(zoo.model("m2_n2")), tool.torch
    for name in FUNCTIONS:
        given = tool.arrays((a[:2] for a in arguments(name)), requires_grad=True)
        function, scale = getattr(functions, name), 1e-3 if name == "forward_dynamics" else 1.0
        assert torch.autograd.gradcheck(lambda *x, f=function, s=scale: s * f(*x), given)
        operator = torch.ops.serpentail.function.default
        told = torch.library.opcheck(operator, (*given, functions._key, name))
        assert len(told) == 4 and set(told.values()) == {"SUCCESS"}


def test_tensors_of_pytorch():
    """Floats become doubles; other things than tensors of the CPU are refused, as is nan."""
    tool = TOOLS["torch"]()
    functions, singles = tool.functions(zoo.model("m2_n2")), [np.float32(a) for a in states()]
    found = functions.forward_dynamics(*tool.arrays(singles))
    assert found.dtype == tool.torch.float64
    expected = zoo.model("m2_n2").forward_dynamics(*(a.astype(float) for a in singles))
    assert_near(found, expected, 1e-12)
    q, v, tau = tool.arrays(states())
    for other in (states()[0], q.to("meta")):
        with pytest.raises(st.StateError, match="forward_dynamics: q: needs a tensor of the CPU"):
            functions.forward_dynamics(other, v, tau)
    with pytest.raises(st.StateError, match=r"forward_dynamics: tau\[0\] of state 0: value nan"):
        functions.forward_dynamics(q, v, np.nan * tau[0])
