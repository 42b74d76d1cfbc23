"""A model's functions as PyTorch operators, which autograd differentiates."""

from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import torch
from torch import Tensor

from serpentail_scene.layout import OMEGA, POSITION, TAIL_V, VELOCITY

from ...basics.errors import StateError
from ...model.model import Model
from ...model.state_space import RATE
from .rules import RULES

models: WeakValueDictionary[str, Model] = WeakValueDictionary()  # by the keys that operators take


class TorchFunctions:
    """Functions of q (..., nq), v (..., nv) and more on CPU tensors, with exact derivatives."""

    def __init__(self, model: Model):
        self.model, self._key = model, f"{model.name}/{id(model)}"
        models[self._key] = model
        self._dtype = torch.from_numpy(np.array(model.parameter_vector)).dtype

    def forward_dynamics(self, q: Tensor, v: Tensor, tau: Tensor) -> Tensor:
        """v_dot (..., nv) for joint torques tau (..., 2m); see ``Model.forward_dynamics``."""
        return self._evaluated("forward_dynamics", q, v, tau)

    def inverse_dynamics(self, q: Tensor, v: Tensor, v_dot: Tensor) -> Tensor:
        """H v_dot + C (..., nv); see ``Model.inverse_dynamics``."""
        return self._evaluated("inverse_dynamics", q, v, v_dot)

    def x_dot(self, x: Tensor, u: Tensor) -> Tensor:
        """Time derivative (..., nq + nv) of x = (q, v) under torques u; see ``Model.x_dot``."""
        nq, width = self.model.nq, self.model.nq + self.model.nv
        if not isinstance(x, Tensor) or x.shape[-1:] != (width,):
            raise StateError(f"x_dot: x: needs a tensor of shape (..., {width})")
        q, v = x[..., :nq], x[..., nq:]
        v_dot = self._evaluated("forward_dynamics", q, v, u)
        rates = v if self.model.fixed else _q_dot(q, v)
        return torch.cat([rates.expand(*v_dot.shape[:-1], nq).to(v_dot.dtype), v_dot], dim=-1)

    def _evaluated(self, name: str, *values: Tensor) -> Tensor:
        """Return the output for arguments of any leading axes."""
        kernel = self.model.kernel(name)
        arrays = []
        for each, (size,), value in zip(kernel.names, kernel.shapes, values, strict=True):
            if not isinstance(value, Tensor) or value.device.type != "cpu":
                raise StateError(f"{name}: {each}: needs a tensor of the CPU")
            if value.is_complex() or value.dtype == torch.bool:
                raise StateError(f"{name}: {each}: type {value.dtype}: needs real numbers")
            if value.shape[-1:] != (size,):
                raise StateError(
                    f"{name}: {each} has shape {tuple(value.shape)}, not (..., {size})"
                )
            arrays.append(value.to(self._dtype))
        if len({array.shape[:-1] for array in arrays}) > 1:
            arrays = _alike(name, arrays)
        return torch.ops.serpentail.function(*arrays, self._key, name)


def _alike(name: str, arrays: list[Tensor]) -> list[Tensor]:
    """Return arrays with the same leading axes."""
    try:
        lead = torch.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except RuntimeError:
        shapes = ", ".join(str(tuple(array.shape)) for array in arrays)
        raise StateError(f"{name}: leading axes differ ({shapes}): give one") from None
    return [array.expand(*lead, array.shape[-1]) for array in arrays]


def _numbers(arrays: tuple[Tensor, ...], key: str, name: str) -> tuple[Tensor, ...]:
    """Return the outputs of a function of the model of a key."""
    lead = arrays[0].shape[:-1]
    rows = [array.reshape(-1, array.shape[-1]).numpy() for array in arrays]
    found = models[key].kernel(name)(*rows)
    outputs = found if isinstance(found, tuple) else (found,)
    return tuple(torch.from_numpy(each).reshape(*lead, *each.shape[1:]) for each in outputs)


# operators by their schemas: `custom_op` would check these at each call
FUNCTION, JACOBIANS = "serpentail::function", "serpentail::jacobians"
ARGUMENTS = "Tensor a, Tensor b, Tensor c, str key, str name"
torch.library.define(FUNCTION, f"({ARGUMENTS}) -> Tensor")
torch.library.define(JACOBIANS, f"({ARGUMENTS}) -> (Tensor, Tensor, Tensor)")


@torch.library.impl(FUNCTION, "cpu")
def _function(a: Tensor, b: Tensor, c: Tensor, key: str, name: str) -> Tensor:
    """Return the output of a function of three arguments."""
    return _numbers((a, b, c), key, name)[0]


@torch.library.impl(JACOBIANS, "cpu")
def _jacobians(
    a: Tensor, b: Tensor, c: Tensor, key: str, name: str
) -> tuple[Tensor, Tensor, Tensor]:
    """Return its Jacobians by these; that by q is by its tangent."""
    found = [
        matrix
        for each, inputs in RULES[name].jacobians
        for matrix in _numbers((a, b, c)[:inputs], key, each)
    ]
    return found[0], found[1], found[2]


@torch.library.register_fake(FUNCTION)
def _fake_function(a: Tensor, b: Tensor, c: Tensor, key: str, name: str) -> Tensor:
    return b.new_empty(b.shape)


@torch.library.register_fake(JACOBIANS)
def _fake_jacobians(
    a: Tensor, b: Tensor, c: Tensor, key: str, name: str
) -> tuple[Tensor, Tensor, Tensor]:
    nv = b.shape[-1]
    square = b.new_empty(*b.shape, nv)
    return square, torch.empty_like(square), b.new_empty(*b.shape, c.shape[-1])


def _kept(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
    """Save what the derivative needs."""
    ctx.save_for_backward(*inputs[:3])
    ctx.key, ctx.name = inputs[3:]


def _backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
    """Return gradients by the arguments."""
    a, b, c = ctx.saved_tensors
    matrices = torch.ops.serpentail.jacobians(a, b, c, ctx.key, ctx.name)
    by_tangent, by_b, by_c = (
        torch.einsum("...i,...ij->...j", gradient, matrix) for matrix in matrices
    )
    by_a = by_tangent if a.shape == b.shape else _of_configuration(a, by_tangent)
    return by_a, by_b, by_c, None, None


def _of_configuration(q: Tensor, gradient: Tensor) -> Tensor:
    """Return the gradient (..., nq) by q from that by its tangent (..., nv)."""
    w, x, turn = q[..., 3:4], q[..., 4:7], gradient[..., OMEGA]
    square = (q[..., 3:7] ** 2).sum(-1, keepdim=True)
    by_w = -2 * (turn * x).sum(-1, keepdim=True) / square
    by_x = 2 * (w * turn - torch.linalg.cross(turn, x)) / square
    return torch.cat([gradient[..., POSITION], by_w, by_x, gradient[..., TAIL_V]], dim=-1)


torch.library.register_autograd(FUNCTION, _backward, setup_context=_kept)


@torch.library.register_vmap(FUNCTION)
def _vmap(info: Any, in_dims: tuple, a: Tensor, b: Tensor, c: Tensor, *names: str) -> tuple:
    """Take the batch's axis as one more leading axis."""
    moved = [
        array.expand(info.batch_size, *array.shape) if dim is None else array.movedim(dim, 0)
        for array, dim in zip((a, b, c), in_dims[:3], strict=True)
    ]
    return torch.ops.serpentail.function(*moved, *names), 0


def _q_dot(q: Tensor, v: Tensor) -> Tensor:
    """Return dq/dt (..., nq), as ``serpentail.model.state_space`` does."""
    quaternion, omega = q[..., 3:7], v[..., OMEGA]
    w, x = q[..., 3:4], q[..., 4:7]
    scalar = -(x * omega).sum(-1, keepdim=True)
    turning = torch.cat([scalar, w * omega + torch.linalg.cross(x, omega)], dim=-1) / 2
    norm = 1 - (quaternion**2).sum(-1, keepdim=True)
    return torch.cat([v[..., VELOCITY], turning + RATE * norm * quaternion, v[..., TAIL_V]], dim=-1)
