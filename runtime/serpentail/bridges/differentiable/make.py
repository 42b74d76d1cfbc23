"""``jax_functions`` and ``torch_functions``: functions of a model with exact derivatives."""

from typing import TYPE_CHECKING

from ...basics.errors import ModelError
from ...basics.extras import needed
from ...model.checked import checked_model
from ...model.model import Model

if TYPE_CHECKING:
    from .jax_functions import JaxFunctions
    from .torch_functions import TorchFunctions


def jax_functions(model: Model) -> "JaxFunctions":
    """Return functions of a model for JAX, with exact derivatives.

    They are ``forward_dynamics``, ``inverse_dynamics`` and ``x_dot``, run on the CPU, and work
    inside jit, vmap, jvp, grad and scan. ``simulate`` makes a run, with gradients of its end.

    Parameters
    ----------
    model : Model
        The model. Derivatives need "forward_dynamics_derivatives"; those of inverse dynamics
        need "inverse_dynamics_derivatives" and "mass_matrix".

    Returns
    -------
    JaxFunctions
        The functions; they take arrays with any leading axes. States that the model refuses give
        nan, because JAX's functions raise no errors.

    Raises
    ------
    ExtraMissing
        JAX is not installed; it comes with the extra "jax".
    CompileFailed
        No C++ compiler works.
    ModelError, StateError
        When a function is called: the scene left it out; a shape or type is wrong, or JAX
        computes with 32 bits.

    Examples
    --------
    >>> functions = st.jax_functions(model)  # doctest: +SKIP
    >>> jax.grad(lambda tau: functions.forward_dynamics(q, v, tau)[3])(tau)  # doctest: +SKIP
    """
    checked_model(model, ModelError)
    needed("jax", "jax")
    from .jax_functions import JaxFunctions

    return JaxFunctions(model)


def torch_functions(model: Model) -> "TorchFunctions":
    """Return functions of a model for PyTorch, with exact derivatives.

    They are ``forward_dynamics``, ``inverse_dynamics`` and ``x_dot``: custom operators on CPU
    tensors, which autograd differentiates; and ``simulate``, with gradients of the end of a run.

    Parameters
    ----------
    model : Model
        As of ``jax_functions``.

    Returns
    -------
    TorchFunctions
        The functions; they take tensors with any leading axes.

    Raises
    ------
    ExtraMissing
        PyTorch is not installed; it comes with the extra "torch".
    ModelError, StateError
        When a function is called: the scene left it out; a shape or type is wrong, or a value is
        not finite.
    """
    checked_model(model, ModelError)
    needed("torch", "torch")
    from .torch_functions import TorchFunctions

    return TorchFunctions(model)
