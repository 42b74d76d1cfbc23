"""A model as CasADi functions, of operations that CasADi knows or of the compiled C."""

import textwrap
from types import ModuleType
from typing import TYPE_CHECKING, Any

import casadi

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_V, VELOCITY

from ..basics.checks import whole_number
from ..basics.errors import ModelError
from .lazy import lazy_property
from .parameters import flat, flat_names
from .state_space import RATE

if TYPE_CHECKING:
    from .model import Model

# Graphs then see the calls inside. A function that is called as a whole would be differentiated by
# all its inputs, and second derivatives by parameters, which the compiled C lacks, are NaN.
INLINED = {"always_inline": True}


class RateOfState(casadi.Function):
    """x_dot of x, u and p; without p, of the model's own parameters."""

    def __init__(self, function: casadi.Function, parameters: casadi.DM):
        super().__init__(function)
        self.parameters = parameters

    def __call__(self, *inputs: Any, **named: Any) -> Any:
        """Evaluate, or make an expression."""
        if named:
            return super().__call__(**{"p": self.parameters} | named)
        return super().__call__(*inputs, *[self.parameters] * (len(inputs) == 2))


class CasadiFunctions:
    """A model's functions for CasADi; each attribute is a ``casadi.Function`` with its parameters.

    ``model.casadi.energy`` takes ``q`` and ``v`` and is built once, when it is first used.

    Parameters
    ----------
    model : Model
        The model; its scene must have the target "casadi", except for ``external``.
    """

    def __init__(self, model: "Model"):
        self._model = model

    @property
    def _module(self) -> ModuleType:
        """The generated module; ModelError if the scene did not ask for it."""
        if not self._has_module:
            raise ModelError(
                f'{self._model.name} was generated without CasADi functions: add "casadi" to '
                "`targets` of the scene, then generate it again, or take compiled ones, "
                "external(name)"
            )
        return self._model.checked.casadi_module

    @property
    def _has_module(self) -> bool:
        """Whether the scene asked for CasADi."""
        return "casadi" in self._model.manifest["scene"]["targets"]

    def __getattr__(self, name: str) -> casadi.Function:
        if name.startswith("_"):
            raise AttributeError(name)
        values = {
            p["name"]: self._model.parameters[p["name"]]
            for p in self._model.manifest["parameters"]
            if p["in_struct"]
        }
        known = self._symbolic(name)  # before the module, which it may replace
        function = self._module.function(known, values)
        setattr(self, name, function)
        return function

    @lazy_property
    def x_dot(self) -> RateOfState:
        """Time derivative of the state x = (q, v), as SX operations.

        Inputs: x (nq + nv), u (2m) torques (N m), p parameters such as ``parameter_vector``; a
        call without p takes the model's. See ``Model.x_dot``. ``external("x_dot")`` is the same
        function of the compiled C.
        """
        function = self._x_dot(self.symbolic("forward_dynamics"), casadi.SX)
        return RateOfState(function, self.parameter_vector)

    def _x_dot(self, forward_dynamics: casadi.Function, kind: Any) -> casadi.Function:
        """Return x_dot of a function of q, v, tau and parameters; SX or MX."""
        layout, options = self._model.layout, INLINED if kind is casadi.MX else {}
        sizes = {"x": layout.nq + layout.nv, "u": layout.nt, "p": self.parameter_vector.numel()}
        x, u, p = inputs = [kind.sym(name, size) for name, size in sizes.items()]
        q, v = casadi.vertsplit(x, [0, layout.nq, sizes["x"]])
        if layout.fixed:
            rates = casadi.vertcat(v, forward_dynamics(q, v, u, p))
            return casadi.Function("x_dot", inputs, [rates], [*sizes], ["x_dot"], options)
        quaternion, omega = q[QUATERNION], v[OMEGA]
        scalar, vector = quaternion[0], quaternion[1:]
        turning = casadi.vertcat(
            -casadi.dot(vector, omega), scalar * omega + casadi.cross(vector, omega)
        )
        restoring = RATE * (1 - casadi.sumsqr(quaternion)) * quaternion
        v_dot = forward_dynamics(q, v, u, p)
        x_dot = casadi.vertcat(v[VELOCITY], turning / 2 + restoring, v[TAIL_V], v_dot)
        return casadi.Function("x_dot", inputs, [x_dot], [*sizes], ["x_dot"], options)

    def __repr__(self) -> str:
        names = ", ".join(self._model.manifest["functions"])
        lines = textwrap.wrap(names, 90, max_lines=4, placeholder=" ...")
        kinds = "SX and compiled" if self._has_module else "compiled alone"
        head = f"<CasadiFunctions of {self._model.name}, {kinds}:"
        return "\n  ".join([head, *lines]) + ">"

    def __dir__(self) -> list[str]:
        symbolic = [*self._module.SIGNATURES] if self._has_module else []
        if "forward_dynamics" in symbolic:
            symbolic.append("x_dot")
        return [*symbolic, "symbolic", "external", "parameter_names", "parameter_vector"]

    @property
    def parameter_vector(self) -> casadi.DM:
        """The model's parameters in the order that ``symbolic`` and ``external`` functions take."""
        return casadi.DM(flat(self._model.manifest, self._model.parameters))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """The name of each number of ``parameter_vector``, such as "link_masses[0]"."""
        return flat_names(self._model.manifest)

    def symbolic(self, name: str) -> casadi.Function:
        """Return a function of SX operations whose last input is the parameter vector.

        Parameters
        ----------
        name : str
            Name of a function of the scene.

        Returns
        -------
        casadi.Function
            Its inputs have the names of the method's arguments, then the parameters.

        Raises
        ------
        ModelError
            The scene left the function or the target "casadi" out, or the function has no SX form.
        """
        known = self._symbolic(name)
        return self._module.function(known)

    def external(self, name: str, derivatives: int = 0, folded: bool = False) -> casadi.Function:
        """Return the compiled C as a CasADi function whose last input is the parameter vector.

        Parameters
        ----------
        name : str
            Name of a function of the scene, or "x_dot".
        derivatives : {0, 1, 2}, default 0
            Check now that the scene has the functions that exact derivatives of this order need.
            With 0, CasADi reports a missing one when it differentiates. Derivatives with respect to
            parameters are of first order and need ``<name>_parameter_derivatives`` in the scene.
        folded : bool, default False
            Use the model's parameters in place of the last input. Do so before ``map`` and in
            functions of your own: there, missing second derivatives by parameters make others NaN.

        Returns
        -------
        casadi.Function
            The function.

        Raises
        ------
        ModelError
            The model computes with float, was loaded with ``compiled=False``, or lacks a function.
        """
        order = whole_number("derivatives", derivatives, ModelError, least=0, most=2)
        prefix = self._model.manifest["prefix"]
        if self._model.manifest["real"] != "double":
            raise ModelError(
                f"{prefix} is a {self._model.manifest['real']} model: casadi.external needs real = "
                '"double"'
            )
        if self._model.library is None:
            raise ModelError(f"{prefix} was loaded with compiled=False: load it again to use its C")
        if name == "x_dot":
            function = self._x_dot(self.external("forward_dynamics", order), casadi.MX)
        else:
            self._check(self._known(name), order)
            function = casadi.external(f"{prefix}_casadi_{name}", self._model.library._name)
        if not folded:
            return function
        return self._folded(name, function)

    def _folded(self, name: str, function: casadi.Function) -> casadi.Function:
        """Return the function with the model's parameters in place of its last input."""
        names = function.name_in()[:-1]
        inputs = [casadi.MX.sym(key, function.sparsity_in(key)) for key in names]
        outputs = list(function.call([*inputs, casadi.MX(self.parameter_vector)]))
        return casadi.Function(name, inputs, outputs, names, function.name_out(), INLINED)

    def _symbolic(self, name: str) -> str:
        """Return the name if the function has SX operations; ModelError otherwise."""
        if self._known(name) not in self._module.SIGNATURES:
            remedy = (
                "differentiate the function by CasADi, or take the compiled one, "
                f'external("{name}")'
            )
            raise ModelError(f"{self._model.name} has no SX operations of {name}: {remedy}")
        return name

    def _check(self, name: str, derivatives: int) -> None:
        """Raise ModelError if the scene lacks a function that derivatives of this order need."""
        functions = self._model.manifest["functions"]
        orders = functions[name]["exact_derivatives"]
        if derivatives and not orders:
            raise ModelError(f"{name} has no compiled derivatives for CasADi: use casadi.symbolic")
        wanted = [part for order in orders[:derivatives] for part in order]
        self._model.need(*dict.fromkeys(wanted))

    def _known(self, name: str) -> str:
        """Return the name if the scene has the function; ModelError otherwise."""
        self._model.need(name)
        if name not in self._model.manifest["functions"]:
            raise self._model.without(name)
        return name
