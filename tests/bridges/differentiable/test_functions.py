"""Functions for JAX and PyTorch: the model's values, exact derivatives, their transformations, and
what is refused.  Neither library is imported before a test needs it.
"""

import sys

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

FUNCTIONS = ("forward_dynamics", "inverse_dynamics")
RUNS = 21


class Jax:
    """Arrays, derivatives and maps of JAX, with 64 bits."""

    functions = staticmethod(st.jax_functions)

    def __init__(self):
        self.jax = pytest.importorskip("jax")
        self.jax.config.update("jax_enable_x64", True)
        self.map = self.jax.vmap

    def arrays(self, values):
        return list(values)

    def jacobians(self, function, given):
        return self.jax.jacrev(function, tuple(range(len(given))))(*given)


class Torch:
    """The same of PyTorch, which "dev" does not bring: with its libraries it is 5 GB."""

    functions = staticmethod(st.torch_functions)

    def __init__(self):
        self.torch = pytest.importorskip("torch")
        self.map = self.torch.vmap

    def arrays(self, values, **options):
        return [self.torch.tensor(value, **options) for value in values]

    def jacobians(self, function, given):
        return self.torch.autograd.functional.jacobian(function, tuple(self.arrays(given)))


TOOLS = {"jax": Jax, "torch": Torch}


def states():
    """q whose quaternions are of any norm, v and tau, RUNS of each."""
    rng = np.random.default_rng(4)
    q, v = 0.4 * rng.normal(size=(RUNS, 11)), rng.normal(size=(RUNS, 10))
    q[:, 3] += 1.5
    return q, v, 1e-3 * rng.normal(size=(RUNS, 4))


def arguments(name):
    """Arguments of a function: its last is tau or v_dot."""
    q, v, tau = states()
    return (q, v, tau if name == "forward_dynamics" else 3 * np.roll(v, 1, axis=0))


def by_differences(function, x, h=1e-3):
    """Jacobian of a function of one vector, by differences of order 4 each way."""
    columns = []
    for unit in np.eye(len(x)) * h:
        values = [np.asarray(function(x + k * unit)) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)


def assert_near(found, expected, digits):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= digits * np.abs(expected).max()


@pytest.fixture(scope="module")
def model():
    return zoo.model("m2_n2")


@pytest.fixture(scope="module", params=TOOLS)
def tool(request):
    return TOOLS[request.param]()


@pytest.fixture(scope="module")
def functions(tool, model):
    return tool.functions(model)


def test_values_are_the_models(tool, functions, model):
    """Of one state, of few, and of batches that are made in lanes and threads."""
    for name in FUNCTIONS:
        function, given = getattr(functions, name), arguments(name)
        expected = getattr(model, name)(*given)
        assert_near(function(*tool.arrays(array[0] for array in given)), expected[0], 1e-12)
        for runs in (1, 3, RUNS):
            with row(name, runs):
                few = tool.arrays(array[:runs] for array in given)
                for found in (function, tool.map(function)):
                    assert_near(found(*few), expected[:runs], 1e-12)
        many = tool.arrays(np.tile(array, (200, 1)) for array in given)
        assert_near(function(*many), np.tile(expected, (200, 1)), 1e-12)
    # one state is repeated over leading axes
    q, v, tau = states()
    found = functions.forward_dynamics(*tool.arrays((q[0], v[:12].reshape(3, 4, -1), tau[5])))
    expected = model.forward_dynamics(q[0], v[:12], tau[5]).reshape(3, 4, -1)
    assert_near(found, expected, 1e-12)


def test_derivatives_are_those_by_differences(tool, functions, model):
    """The quaternion is not kept at norm 1: a change along it changes nothing."""
    for name in FUNCTIONS:
        own, given = getattr(model, name), [array[2] for array in arguments(name)]
        found = tool.jacobians(getattr(functions, name), given)
        for k, each in enumerate(found):
            with row(name, k):
                expected = by_differences(
                    lambda x, k=k, own=own, given=given: own(*given[:k], x, *given[k + 1 :]),
                    given[k],
                )
                assert_near(each, expected, 1e-9)
        by_q = np.asarray(found[0])
        assert np.abs(by_q[:, 3:7] @ given[0][3:7]).max() < 1e-12 * np.abs(by_q).max()


def test_x_dot_and_its_derivatives_are_the_models(tool):
    q, v, tau = states()
    for name, x, u in (("m2_n2", np.hstack([q, v]), tau), ("fixed", 0.1 * v[:, :8], tau)):
        with row(name):
            model = zoo.model(name)
            x_dot = tool.functions(model).x_dot
            assert_near(x_dot(*tool.arrays((x, u))), model.x_dot(x, u), 1e-12)
            found = tool.jacobians(x_dot, (x[3], u[3]))
            for one, other in zip(found, model.x_dot_derivatives(x[3], u[3]), strict=True):
                assert_near(one, other, 1e-10)


def test_what_is_wrong_is_named(tool, functions):
    whole = dict(zip(("q", "v", "tau"), states(), strict=True))
    refused = (
        ({"q": np.zeros(10)}, r"forward_dynamics: q has shape \(10,\), not \(\.\.\., 11\)"),
        ({"v": np.zeros((5, 10))}, r"leading axes differ \(\(21, 11\), \(5, 10\), \(21, 4\)\)"),
        ({"tau": 0.0}, r"forward_dynamics: tau has shape \(\), not \(\.\.\., 4\)"),
        ({"tau": np.zeros(4, complex)}, r"forward_dynamics: tau: type .*complex128"),
        ({"tau": np.zeros(4, bool)}, r"forward_dynamics: tau: type .*bool"),
    )
    for change, words in refused:
        with row(words), pytest.raises(st.StateError, match=words):
            functions.forward_dynamics(*tool.arrays((whole | change).values()))
    with pytest.raises(st.StateError, match=r"x_dot: x.* shape"):
        functions.x_dot(*tool.arrays((np.zeros(5), np.zeros(4))))
    bare, q = tool.functions(zoo.model("bare")), np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0]
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        tool.jacobians(bare.forward_dynamics, (q, np.zeros(8), np.zeros(2)))
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        bare.inverse_dynamics(*tool.arrays((q, np.zeros(8), np.zeros(8))))


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
def test_checks_of_pytorch_pass(model):
    tool = Torch()
    functions, torch = tool.functions(model), tool.torch
    for name in FUNCTIONS:
        given = tool.arrays((a[:2] for a in arguments(name)), requires_grad=True)
        function, scale = getattr(functions, name), 1e-3 if name == "forward_dynamics" else 1.0
        assert torch.autograd.gradcheck(lambda *x, f=function, s=scale: s * f(*x), given)
        operator = torch.ops.serpentail.function.default
        told = torch.library.opcheck(operator, (*given, functions._key, name))
        assert len(told) == 4 and set(told.values()) == {"SUCCESS"}


def test_tensors_of_pytorch(model):
    """Floats become doubles; other things than tensors of the CPU are refused, as is nan."""
    tool, singles = Torch(), [np.float32(a) for a in states()]
    forward_dynamics = tool.functions(model).forward_dynamics
    found, given = forward_dynamics(*tool.arrays(singles)), [a.astype(float) for a in singles]
    assert found.dtype == tool.torch.float64
    assert_near(found, model.forward_dynamics(*given), 1e-12)
    q, v, tau = tool.arrays(states())
    for other in (states()[0], q.to("meta")):
        with pytest.raises(st.StateError, match="forward_dynamics: q: needs a tensor of the CPU"):
            forward_dynamics(other, v, tau)
    with pytest.raises(st.StateError, match=r"forward_dynamics: tau\[0\] of state 0: value nan"):
        forward_dynamics(q, v, np.nan * tau[0])


# JAX alone


@pytest.fixture
def jax():
    """JAX with 64 bits, whatever a test makes of it."""
    library = Jax().jax
    yield library
    library.config.update("jax_enable_x64", True)


def test_transformations_of_jax(jax, model):
    """Gradients of many states are those of each, by jit, vmap and grad, forwards as backwards; a
    flight, in a scan of midpoint steps, is differentiated by all its torques.
    """
    functions, (q, v, tau) = st.jax_functions(model), states()

    def loss(q, v, tau):
        return jax.numpy.sum(jax.numpy.sin(1e-3 * functions.forward_dynamics(q, v, tau)))

    gradient, given = jax.grad(loss, (0, 1, 2)), (q, v, tau)
    ways = (jax.jit(gradient), jax.jit(jax.vmap(gradient)), jax.jacfwd(loss, (0, 1, 2)))
    for one, *others in zip(*(way(*given) for way in ways), strict=True):
        for other in others:
            assert_near(one, other, 1e-12)

    x, h = np.concatenate([q[1], v[1]]), 2e-3
    x[3:7] /= np.linalg.norm(x[3:7])

    def step(x, u):
        return x + h * functions.x_dot(x + h / 2 * functions.x_dot(x, u), u), None

    def end(torques):
        after = jax.lax.scan(step, jax.numpy.asarray(x), torques.reshape(3, 4))[0]
        return after[3:7] @ np.array([1.0, 2.0, 3.0, 4.0])

    flat, torques = jax.jit(end), np.tile(tau[0], 3)
    expected = by_differences(lambda u: flat(u)[None], torques)[0]
    assert_near(jax.jit(jax.grad(flat))(torques), expected, 1e-8)


def test_models_and_states_of_jax(jax, model):
    """Models of other parameters are others, and what a model refuses has nan alone; a model of
    floats computes with floats, and no other does.
    """
    for each in (model, model.with_parameters(tail_mass=0.5 * model.parameters["tail_mass"])):
        found = st.jax_functions(each).forward_dynamics(*states())
        assert_near(found, each.forward_dynamics(*states()), 1e-12)
    functions, (q, v, tau) = st.jax_functions(model), states()
    v[4, 2], q[17, 3:7] = np.nan, 0
    found = np.isnan(np.asarray(functions.forward_dynamics(q, v, tau)))
    for refused in (found.all(axis=1), found.any(axis=1)):
        assert list(refused.nonzero()[0]) == [4, 17]

    single, given = zoo.model("single"), [np.float32(array) for array in states()]
    jax.config.update("jax_enable_x64", False)
    found = st.jax_functions(single).forward_dynamics(*states())
    assert found.dtype == np.float32
    assert_near(found, single.forward_dynamics(*given), 1e-5)
    with pytest.raises(st.StateError, match=r'32 bits, .*update\("jax_enable_x64", True\)'):
        functions.forward_dynamics(*states())


def test_without_a_compiler_of_cpp_that_is_said(jax, monkeypatch):
    from serpentail.bridges.differentiable import jax_calls

    def failing(*_, **__):
        raise st.CompileFailed("cc1plus: not found")

    jax_calls.library.cache_clear()
    monkeypatch.setattr(jax_calls, "SOURCE", jax_calls.SOURCE.with_name("none.cc"))
    monkeypatch.setattr(jax_calls, "compile_library", failing)
    with pytest.raises(st.CompileFailed, match=r"jax_functions: .*C\+\+17.*cc1plus"):
        st.jax_functions(zoo.model("bare"))
