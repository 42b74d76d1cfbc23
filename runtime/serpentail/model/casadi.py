"""CasADi functions of a model: built from its generated module, or wrapping its compiled C."""

import importlib.util
from functools import cached_property
from types import ModuleType

import casadi

from ..errors import ModelError
from .parameters import flat

# compiled functions that first and second derivatives of an external one are made of
DERIVATIVES = {
    "inverse_dynamics": (
        ("inverse_dynamics_derivatives", "mass_matrix"),
        ("inverse_dynamics_vjp", "inverse_dynamics_hessian"),
    ),
    "forward_dynamics": (
        ("forward_dynamics_derivatives",),
        ("forward_dynamics_vjp", "inverse_dynamics_hessian", "mass_matrix"),
    ),
}


class CasadiFunctions:
    """Attribute access builds a ``casadi.Function`` once; ``symbolic`` and ``external`` take
    parameters as an input.
    """

    def __init__(self, model):
        self._model = model

    @cached_property
    def _module(self) -> ModuleType:
        """The generated module; ModelError where the scene did not ask for it."""
        if not self._has_module:
            raise ModelError(
                f'{self._model.name} was generated without CasADi functions: add "casadi" to '
                "`targets` of the scene, then generate it again, or take compiled ones, "
                "external(name)"
            )
        return _imported(self._model)

    @property
    def _has_module(self) -> bool:
        return "casadi" in self._model.manifest["scene"]["targets"]

    def __getattr__(self, name: str) -> casadi.Function:
        if name.startswith("_"):
            raise AttributeError(name)
        values = {
            p["name"]: self._model.parameters[p["name"]]
            for p in self._model.manifest["parameters"]
            if p["in_struct"]
        }
        function = self._module.function(self._symbolic(name), values)
        setattr(self, name, function)
        return function

    def __dir__(self) -> list[str]:
        symbolic = self._module.SIGNATURES if self._has_module else ()
        return [*symbolic, "symbolic", "external", "parameter_vector"]

    @property
    def parameter_vector(self) -> casadi.DM:
        """The model's parameters, in the order that ``symbolic`` and ``external`` functions take
        them.
        """
        return casadi.DM(flat(self._model.manifest, self._model.parameters))

    def symbolic(self, name: str) -> casadi.Function:
        """Return a function of SX operations whose last input is the parameter vector."""
        return self._module.function(self._symbolic(name))

    def external(self, name: str, derivatives: int = 0, folded: bool = False) -> casadi.Function:
        """Return the compiled C as a function whose last input is the parameter vector (double
        models only).

        derivatives: 1 or 2 raises ModelError here where the scene lacks what exact derivatives of
        that order are made
        of; else CasADi raises when it differentiates.  Those with respect to parameters need
        ``<name>_parameter_derivatives`` in the scene, and are first ones.
        folded: take the model's parameters instead of an input.
        """
        prefix = self._model.manifest["prefix"]
        if self._model.manifest["real"] != "double":
            raise ModelError(
                f"{prefix} is a {self._model.manifest['real']} model: casadi.external needs real = "
                '"double"'
            )
        if self._model.library is None:
            raise ModelError(f"{prefix} was loaded with compiled=False: load it again to use its C")
        self._check(self._known(name), derivatives)
        function = casadi.external(f"{prefix}_casadi_{name}", self._model.library._name)
        if not folded:
            return function
        inputs = [casadi.MX.sym(key, function.size1_in(key)) for key in function.name_in()[:-1]]
        outputs = function(*inputs, self.parameter_vector)
        outputs = outputs if isinstance(outputs, tuple) else (outputs,)
        ports = (function.name_in()[:-1], function.name_out())
        return casadi.Function(
            name, inputs, outputs, *ports, {"always_inline": True}
        )  # graphs then see the blocks

    def _symbolic(self, name: str) -> str:
        if self._known(name) not in self._module.SIGNATURES:
            remedy = (
                "differentiate the function by CasADi, or take the compiled one, "
                f'external("{name}")'
            )
            raise ModelError(f"{self._model.name} has no SX operations of {name}: {remedy}")
        return name

    def _check(self, name: str, derivatives: int) -> None:
        """Raise ModelError where a scene lacks what derivatives of this order are made of."""
        if derivatives and name not in DERIVATIVES:
            has = " and ".join(DERIVATIVES)
            raise ModelError(
                f"{name}: only {has} have compiled derivatives for CasADi: use casadi.symbolic"
            )
        wanted = [part for order in DERIVATIVES.get(name, ())[:derivatives] for part in order]
        lacking = [
            part for part in dict.fromkeys(wanted) if part not in self._model.manifest["functions"]
        ]
        if lacking:
            raise self._model.without(*lacking)

    def _known(self, name: str) -> str:
        if name not in self._model.manifest["functions"]:
            raise self._model.without(name)
        return name


def _imported(model) -> ModuleType:
    name = f"{model.name}_casadi"
    spec = importlib.util.spec_from_file_location(name, model.folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
