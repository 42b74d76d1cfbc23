"""A model's functions for JAX; they work inside jit, vmap, jvp, grad and scan."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, VELOCITY

from ...basics.errors import StateError
from ...model.model import Model
from ...model.state_space import RATE
from .jax_calls import TARGET, entered, library
from .rules import RULES, Rule

Array = Any  # a jax.Array, or anything that JAX converts to one


class JaxFunctions:
    """Functions of q (..., nq), v (..., nv) and more on JAX arrays, with exact derivatives.

    They use the model's parameters. A state that the model refuses gives nan: JAX's functions raise
    no errors.
    """

    def __init__(self, model: Model):
        library()  # what XLA calls is compiled here, not while JAX traces
        self.model = model
        self._made: dict[str, Callable[..., Array]] = {}

    def forward_dynamics(self, q: Array, v: Array, tau: Array) -> Array:
        """v_dot (..., nv) for joint torques tau (..., 2m); see ``Model.forward_dynamics``."""
        return self._function("forward_dynamics")(*self._checked("forward_dynamics", q, v, tau))

    def inverse_dynamics(self, q: Array, v: Array, v_dot: Array) -> Array:
        """H v_dot + C (..., nv); see ``Model.inverse_dynamics``."""
        return self._function("inverse_dynamics")(*self._checked("inverse_dynamics", q, v, v_dot))

    def x_dot(self, x: Array, u: Array) -> Array:
        """Time derivative (..., nq + nv) of x = (q, v) under torques u; see ``Model.x_dot``."""
        x, nq = jnp.asarray(x), self.model.nq
        if x.shape[-1:] != (nq + self.model.nv,):
            raise StateError(f"x_dot: x has shape {x.shape}, not (..., {nq + self.model.nv})")
        q, v, u = self._checked("forward_dynamics", x[..., :nq], x[..., nq:], u)
        rates = v if self.model.fixed else _q_dot(q, v)
        return jnp.concatenate([rates, self._function("forward_dynamics")(q, v, u)], axis=-1)

    def _function(self, name: str) -> Callable[..., Array]:
        """Return a function with its derivatives; it is made once."""
        if name not in self._made:
            self._made[name] = self._with_derivatives(name, RULES[name])
        return self._made[name]

    def _with_derivatives(self, name: str, rule: Rule) -> Callable[..., Array]:
        """Return a function whose derivative is the product of its Jacobians with tangents."""
        self.model.kernel(name)  # ModelError where the scene left it out

        @jax.custom_jvp
        def function(*arrays: Array) -> Array:
            return self._call(name, arrays)[0]

        @function.defjvp
        def derivative(primals: Any, tangents: Any) -> tuple[Array, Array]:
            jacobians = [
                matrix
                for each, inputs in rule.jacobians
                for matrix in self._call(each, primals[:inputs])
            ]
            moved = [tangents[0] if self.model.fixed else _turned(primals[0], tangents[0])]
            parts = zip(jacobians, [*moved, *tangents[1:]], strict=True)
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
        return call(*arrays, name=entered(self.model, name))

    def _checked(self, name: str, *values: Array) -> list[Array]:
        """Return arguments as arrays with the same leading axes."""
        kernel, dtype = self.model.kernel(name), self.model.parameter_vector.dtype
        if dtype == np.float64 and not jax.config.jax_enable_x64:
            raise StateError(
                f"{name}: JAX computes with 32 bits, {self.model.name} with 64: call "
                'jax.config.update("jax_enable_x64", True) before any array is made'
            )
        arrays = []
        for each, (size,), value in zip(kernel.names, kernel.shapes, values, strict=True):
            array = jnp.asarray(value)
            if array.dtype.kind not in "fiu":
                raise StateError(f"{name}: {each}: type {array.dtype}: needs real numbers")
            if array.shape[-1:] != (size,):
                raise StateError(f"{name}: {each} has shape {array.shape}, not (..., {size})")
            arrays.append(array.astype(dtype))
        try:
            lead = jnp.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            shapes = ", ".join(str(array.shape) for array in arrays)
            raise StateError(f"{name}: leading axes differ ({shapes}): give one") from None
        return [jnp.broadcast_to(array, (*lead, array.shape[-1])) for array in arrays]


def _turned(q: Array, dq: Array) -> Array:
    """Return the tangent (..., nv) of q that corresponds to a change dq (..., nq)."""
    w, x = q[..., 3:4], q[..., 4:7]
    dw, dx = dq[..., 3:4], dq[..., 4:7]
    square = jnp.sum(q[..., QUATERNION] ** 2, axis=-1, keepdims=True)
    turn = 2 * (w * dx - dw * x - jnp.cross(x, dx)) / square
    return jnp.concatenate([dq[..., POSITION], turn, dq[..., TAIL_Q]], axis=-1)


def _q_dot(q: Array, v: Array) -> Array:
    """Return dq/dt (..., nq), as ``serpentail.model.state_space`` does."""
    w, x, omega = q[..., 3:4], q[..., 4:7], v[..., OMEGA]
    scalar = -jnp.sum(x * omega, axis=-1, keepdims=True)
    turning = jnp.concatenate([scalar, w * omega + jnp.cross(x, omega)], axis=-1) / 2
    norm = 1 - jnp.sum(q[..., QUATERNION] ** 2, axis=-1, keepdims=True)
    turning = turning + RATE * norm * q[..., QUATERNION]
    return jnp.concatenate([v[..., VELOCITY], turning, v[..., TAIL_V]], axis=-1)
