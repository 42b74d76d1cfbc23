"""``jax_functions`` and ``torch_functions``: a model's functions for tools that differentiate."""

from typing import TYPE_CHECKING

from ..checks import shown
from ..errors import ModelError
from ..extras import needed
from ..model.model import Model

if TYPE_CHECKING:
    from .jax_functions import JaxFunctions
    from .torch_functions import TorchFunctions


def jax_functions(model: Model) -> "JaxFunctions":
    """Return ``forward_dynamics``, ``inverse_dynamics`` and ``x_dot`` of a model for JAX.

    They take arrays of any leading shape, bear jit, vmap, jvp, grad and scan, and run on the CPU in
    lanes and threads.  Derivatives are exact, of ``forward_dynamics_derivatives``, or of
    ``inverse_dynamics_derivatives`` and ``mass_matrix``, which the scene must ask for then.
    Raises ExtraMissing without the extra "jax", CompileFailed without a C++ compiler, and when a
    function is called ModelError (the scene left it out), StateError (shapes, types, 32 bits).
    """
    _refuse_others(model)
    needed("jax", "jax")
    from .jax_functions import JaxFunctions

    return JaxFunctions(model)


def torch_functions(model: Model) -> "TorchFunctions":
    """Return the same for PyTorch: custom operators on the CPU, which autograd differentiates.

    Raises ExtraMissing without the extra "torch"; errors else as of ``jax_functions``, and
    StateError of values that are not finite.
    """
    _refuse_others(model)
    needed("torch", "torch")
    from .torch_functions import TorchFunctions

    return TorchFunctions(model)


def _refuse_others(model: object) -> None:
    """ModelError about what is no model."""
    if not isinstance(model, Model):
        raise ModelError(f"model: value {shown(model)}: needs a model, as st.load returns it")
