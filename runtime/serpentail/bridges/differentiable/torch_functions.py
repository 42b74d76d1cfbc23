"""A model's functions as PyTorch operators, which autograd differentiates."""

from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import torch
from torch import Tensor

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_V

from ...basics.errors import StateError
from ...model.model import Model
from .functions import JACOBIANS, DifferentiableFunctions
from .runs import DifferentiableRun

models: WeakValueDictionary[str, Model] = WeakValueDictionary()  # by the keys that operators take


class TorchFunctions(DifferentiableFunctions):
    """Functions of q (..., nq), v (..., nv) and more on CPU tensors, with exact derivatives."""

    namespace = torch

    def __init__(self, model: Model):
        super().__init__(model)
        self._key = f"{model.name}/{id(model)}"
        models[self._key] = model
        self._dtype = torch.from_numpy(np.array(model.parameter_vector)).dtype

    def _array(self, function: str, field: str, value: Tensor) -> Tensor:
        """Return an argument as a tensor of the model's type; StateError if it is none."""
        if not isinstance(value, Tensor) or value.device.type != "cpu":
            raise StateError(f"{function}: {field}: needs a tensor of the CPU")
        if value.is_complex() or value.dtype == torch.bool:
            raise StateError(f"{function}: {field}: type {value.dtype}: needs real numbers")
        return value.to(self._dtype)

    def _ended(self, run: DifferentiableRun, numbers: list[Tensor]) -> tuple[Tensor, Tensor]:
        """Return q and v at the end of a run of numbers, which have gradients."""
        return End.apply(run, *numbers)

    def _evaluated(self, function: str, arrays: list[Tensor]) -> Tensor:
        """Return the output of a function, which has derivatives."""
        return torch.ops.serpentail.function(*arrays, self._key, function)


class End(torch.autograd.Function):
    """The end of a run."""

    @staticmethod
    def forward(ctx: Any, run: DifferentiableRun, *numbers: Tensor) -> tuple[Tensor, ...]:
        """Return q and v."""
        ctx.run = run
        ctx.save_for_backward(*numbers)
        return tuple(map(torch.tensor, run.end(*(x.numpy() for x in numbers))))

    @staticmethod
    def backward(ctx: Any, *weights: Tensor) -> tuple[Tensor | None, ...]:
        """Return gradients by the numbers; the run is made again."""
        arrays = (x.detach().numpy() for x in (*weights, *ctx.saved_tensors))
        return None, *map(torch.tensor, ctx.run.gradient(*arrays))


def _numbers(arrays: tuple[Tensor, ...], key: str, name: str) -> tuple[Tensor, ...]:
    """Return the outputs of a function of the model of a key."""
    lead = arrays[0].shape[:-1]
    rows = [array.reshape(-1, array.shape[-1]).numpy() for array in arrays]
    outputs = models[key].kernel(name)(*rows)
    outputs = outputs if isinstance(outputs, tuple) else (outputs,)
    return tuple(torch.from_numpy(each).reshape(*lead, *each.shape[1:]) for each in outputs)


# operators by their schemas: `custom_op` would check these at each call
FUNCTION, MATRICES = "serpentail::function", "serpentail::jacobians"
ARGUMENTS = "Tensor a, Tensor b, Tensor c, str key, str name"
torch.library.define(FUNCTION, f"({ARGUMENTS}) -> Tensor")
torch.library.define(MATRICES, f"({ARGUMENTS}) -> (Tensor, Tensor, Tensor)")


@torch.library.impl(FUNCTION, "cpu")
def _function(a: Tensor, b: Tensor, c: Tensor, key: str, name: str) -> Tensor:
    """Return the output of a function of three arguments."""
    return _numbers((a, b, c), key, name)[0]


@torch.library.impl(MATRICES, "cpu")
def _jacobians(
    a: Tensor, b: Tensor, c: Tensor, key: str, name: str
) -> tuple[Tensor, Tensor, Tensor]:
    """Return its Jacobians by these; that by q is by its tangent."""
    by_a, by_b, by_c = (
        matrix
        for each, inputs in JACOBIANS[name]
        for matrix in _numbers((a, b, c)[:inputs], key, each)
    )
    return by_a, by_b, by_c


@torch.library.register_fake(FUNCTION)
def _fake_function(a: Tensor, b: Tensor, c: Tensor, key: str, name: str) -> Tensor:
    return b.new_empty(b.shape)


@torch.library.register_fake(MATRICES)
def _fake_jacobians(
    a: Tensor, b: Tensor, c: Tensor, key: str, name: str
) -> tuple[Tensor, Tensor, Tensor]:
    nv = b.shape[-1]
    square = b.new_empty(*b.shape, nv)
    return square, torch.empty_like(square), b.new_empty(*b.shape, c.shape[-1])


def _save(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
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
    by_a = by_tangent if a.shape == b.shape else _by_configuration(a, by_tangent)
    return by_a, by_b, by_c, None, None


def _by_configuration(q: Tensor, gradient: Tensor) -> Tensor:
    """Return the gradient (..., nq) by q from that by its tangent (..., nv)."""
    w, x, turn = q[..., 3:4], q[..., 4:7], gradient[..., OMEGA]
    square = (q[..., QUATERNION] ** 2).sum(-1, keepdim=True)
    by_w = -2 * (turn * x).sum(-1, keepdim=True) / square
    by_x = 2 * (w * turn - torch.linalg.cross(turn, x)) / square
    return torch.cat([gradient[..., POSITION], by_w, by_x, gradient[..., TAIL_V]], dim=-1)


torch.library.register_autograd(FUNCTION, _backward, setup_context=_save)


@torch.library.register_vmap(FUNCTION)
def _vmap(info: Any, in_dims: tuple, a: Tensor, b: Tensor, c: Tensor, *names: str) -> tuple:
    """Take the batch's axis as one more leading axis."""
    moved = [
        array.expand(info.batch_size, *array.shape) if dim is None else array.movedim(dim, 0)
        for array, dim in zip((a, b, c), in_dims[:3], strict=True)
    ]
    return torch.ops.serpentail.function(*moved, *names), 0
