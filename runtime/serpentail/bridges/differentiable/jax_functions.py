"""A model's functions for JAX; they work inside jit, vmap, jvp, grad and scan."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION, TAIL_Q

from ...basics.errors import StateError
from ...model.model import Model
from .functions import JACOBIANS, DifferentiableFunctions
from .jax_calls import TARGET, library, registered
from .runs import DifferentiableRun

Array = Any  # a jax.Array, or anything that JAX converts to one


class JaxFunctions(DifferentiableFunctions):
    """Functions of q (..., nq), v (..., nv) and more on JAX arrays, with exact derivatives.

    They use the model's parameters. A state that the model refuses gives nan: JAX's functions raise
    no errors.
    """

    namespace = jnp

    def __init__(self, model: Model):
        library()  # what XLA calls is compiled here, not while JAX traces
        super().__init__(model)
        self._functions: dict[str, Callable[..., Array]] = {}

    def _evaluated(self, function: str, arrays: list[Array]) -> Array:
        """Return the output of a function, which has derivatives and is made once."""
        if function not in self._functions:
            self._functions[function] = self._with_derivatives(function)
        return self._functions[function](*arrays)

    def _with_derivatives(self, name: str) -> Callable[..., Array]:
        """Return a function whose derivative is the product of its Jacobians with tangents."""
        self.model.kernel(name)  # ModelError where the scene left it out

        @jax.custom_jvp
        def function(*arrays: Array) -> Array:
            return self._call(name, arrays)[0]

        @function.defjvp
        def derivative(primals: Any, tangents: Any) -> tuple[Array, Array]:
            self.model.need(*(each for each, _ in JACOBIANS[name]))
            jacobians = [
                matrix
                for each, inputs in JACOBIANS[name]
                for matrix in self._call(each, primals[:inputs])
            ]
            by_q = tangents[0] if self.model.fixed else _tangent(primals[0], tangents[0])
            parts = zip(jacobians, [by_q, *tangents[1:]], strict=True)
            change = sum(jnp.einsum("...ij,...j->...i", matrix, part) for matrix, part in parts)
            return function(*primals), change

        return function

    def _call(self, name: str, arrays: Any) -> list[Array]:
        """Return the outputs of a C function."""
        lead, dtype = arrays[0].shape[:-1], self.model.parameter_vector.dtype
        shapes = [(*lead, *shape) for shape in self.model.kernel(name).out_shapes]
        call = jax.ffi.ffi_call(
            TARGET,
            [jax.ShapeDtypeStruct(shape, dtype) for shape in shapes],
            vmap_method="broadcast_all",
        )
        return call(*arrays, name=registered(self.model, name))

    def _ended(self, run: DifferentiableRun, numbers: list[Array]) -> tuple[Array, Array]:
        """Return q and v at the end of a run of numbers, which have gradients."""

        def called(function: Callable[..., Any], like: list[Array], *given: Array) -> Any:
            shapes = tuple(jax.ShapeDtypeStruct(x.shape, x.dtype) for x in like)
            return jax.pure_callback(function, shapes, *given, vmap_method="sequential")

        end = jax.custom_vjp(lambda *given: called(run.end, numbers[:2], *given))
        end.defvjp(
            lambda *given: (end(*given), given),
            lambda given, weights: called(run.gradient, given, *weights, *given),
        )
        return end(*numbers)

    def _array(self, function: str, field: str, value: Array) -> Array:
        """Return an argument as an array of the model's type; StateError if it cannot be one."""
        dtype = self.model.parameter_vector.dtype
        if dtype == np.float64 and not jax.config.jax_enable_x64:
            raise StateError(
                f"{function}: JAX computes with 32 bits, {self.model.name} with 64: call "
                'jax.config.update("jax_enable_x64", True) before any array is made'
            )
        array = jnp.asarray(value)
        if array.dtype.kind not in "fiu":
            raise StateError(f"{function}: {field}: type {array.dtype}: needs real numbers")
        return array.astype(dtype)


def _tangent(q: Array, dq: Array) -> Array:
    """Return the tangent (..., nv) of q that corresponds to a change dq (..., nq)."""
    w, x = q[..., 3:4], q[..., 4:7]
    dw, dx = dq[..., 3:4], dq[..., 4:7]
    square = jnp.sum(q[..., QUATERNION] ** 2, axis=-1, keepdims=True)
    turn = 2 * (w * dx - dw * x - jnp.cross(x, dx)) / square
    return jnp.concatenate([dq[..., POSITION], turn, dq[..., TAIL_Q]], axis=-1)
