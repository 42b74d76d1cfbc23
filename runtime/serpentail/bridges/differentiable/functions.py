"""What the functions for JAX and for PyTorch have in common: their arguments and x_dot."""

from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_V, VELOCITY

from ...basics.checks import one_of
from ...basics.errors import SimulationError, StateError
from ...model.model import Model
from ...model.state import SPAN
from ...model.state_space import RATE
from .runs import DifferentiableRun

# the functions of a model that compute the Jacobians of a function by its arguments in order, and
# how many of the arguments each of them takes; that by q is by its tangent
JACOBIANS = {
    "forward_dynamics": (("forward_dynamics_derivatives", 3),),
    "inverse_dynamics": (("inverse_dynamics_derivatives", 3), ("mass_matrix", 1)),
}
MADE = ("legs", "controller")  # settings that may be made of numbers


class DifferentiableFunctions:
    """Functions of q (..., nq), v (..., nv) and more, with exact derivatives.

    They use the model's parameters.
    """

    namespace: ModuleType  # jax.numpy or torch

    def __init__(self, model: Model):
        self.model = model

    def forward_dynamics(self, q: Any, v: Any, tau: Any) -> Any:
        """v_dot (..., nv) for joint torques tau (..., 2m); see ``Model.forward_dynamics``."""
        return self._evaluated("forward_dynamics", self._checked("forward_dynamics", q, v, tau))

    def inverse_dynamics(self, q: Any, v: Any, v_dot: Any) -> Any:
        """H v_dot + C (..., nv); see ``Model.inverse_dynamics``."""
        return self._evaluated("inverse_dynamics", self._checked("inverse_dynamics", q, v, v_dot))

    def x_dot(self, x: Any, u: Any) -> Any:
        """Time derivative (..., nq + nv) of x = (q, v) under torques u; see ``Model.x_dot``."""
        x, nq, width = self._array("x_dot", "x", x), self.model.nq, self.model.nq + self.model.nv
        if x.shape[-1:] != (width,):
            raise StateError(f"x_dot: x has shape {tuple(x.shape)}, not (..., {width})")
        q, v, u = self._checked("forward_dynamics", x[..., :nq], x[..., nq:], u)
        rates = v if self.model.fixed else self._q_dot(q, v)
        v_dot = self._evaluated("forward_dynamics", [q, v, u])
        return self.namespace.concatenate([rates, v_dot], axis=-1)

    def simulate(
        self,
        q0: Any,
        v0: Any,
        t_span: Any = SPAN,
        *,
        parameters: Mapping[str, Any] | None = None,
        on_doubt: str = "nan",
        **settings: Any,
    ) -> tuple[Any, Any]:
        """q (nq,) and v (nv,) at the end of a run, which have gradients.

        Errors are those of ``st.simulate`` and ``Trajectory.vjp``, when it is made; JAX wraps them.

        Parameters
        ----------
        q0, v0, t_span, **settings
            As of ``st.simulate``. ``legs`` and ``controller`` may be pairs of a function, and the
            numbers (n,) that it makes them of: then these have gradients, too.
        parameters : mapping, optional
            Parameters of the model that have other values, with gradients.
        on_doubt : str, default "nan"
            What gradients are where none exists: "nan", or the "value" of one side.
        """
        one_of("on_doubt", on_doubt, ("nan", "value"), SimulationError)
        pairs = {n: settings.pop(n) for n in MADE if isinstance(settings.get(n), tuple)}
        ways = dict.fromkeys(parameters or {}) | {name: make for name, (make, _) in pairs.items()}
        given = {"q0": q0, "v0": v0, **(parameters or {})} | {n: x for n, (_, x) in pairs.items()}
        arrays = {name: self._array("simulate", name, x) for name, x in given.items()}
        for name, size in {"q0": self.model.nq, "v0": self.model.nv}.items():
            if (shape := tuple(arrays[name].shape)) != (size,):
                raise StateError(
                    f"simulate: {name} has shape {shape}, not ({size},): map over rows"
                )
        run = DifferentiableRun(self.model, t_span, ways, settings, on_doubt == "nan")
        return self._ended(run, [*arrays.values()])

    def _ended(self, run: DifferentiableRun, numbers: list[Any]) -> tuple[Any, Any]:
        """Return q and v at the end of a run of numbers, which have gradients."""
        raise NotImplementedError

    def _array(self, function: str, field: str, value: Any) -> Any:
        """Return an argument as an array of the model's type; StateError if it cannot be one."""
        raise NotImplementedError

    def _evaluated(self, function: str, arrays: list[Any]) -> Any:
        """Return the output of a function, which has derivatives."""
        raise NotImplementedError

    def _checked(self, function: str, *values: Any) -> list[Any]:
        """Return arguments as arrays with the same leading axes."""
        kernel = self.model.kernel(function)
        arrays = []
        for field, (size,), value in zip(kernel.names, kernel.shapes, values, strict=True):
            array = self._array(function, field, value)
            if array.shape[-1:] != (size,):
                raise StateError(
                    f"{function}: {field} has shape {tuple(array.shape)}, not (..., {size})"
                )
            arrays.append(array)
        leads = [tuple(array.shape[:-1]) for array in arrays]
        if len(set(leads)) == 1:
            return arrays
        try:
            lead = numpy.broadcast_shapes(*leads)
        except ValueError:
            shapes = ", ".join(str(tuple(array.shape)) for array in arrays)
            raise StateError(f"{function}: leading axes differ ({shapes}): give one") from None
        return [self.namespace.broadcast_to(array, (*lead, array.shape[-1])) for array in arrays]

    def _q_dot(self, q: Any, v: Any) -> Any:
        """Return dq/dt (..., nq), as ``serpentail.model.state_space`` does."""
        w, x, omega = q[..., 3:4], q[..., 4:7], v[..., OMEGA]
        scalar = -(x * omega).sum(-1)[..., None]
        vector = w * omega + self.namespace.cross(x, omega, axis=-1)
        turning = self.namespace.concatenate([scalar, vector], axis=-1) / 2
        norm = 1 - (q[..., QUATERNION] ** 2).sum(-1)[..., None]
        turning = turning + RATE * norm * q[..., QUATERNION]
        return self.namespace.concatenate([v[..., VELOCITY], turning, v[..., TAIL_V]], axis=-1)
