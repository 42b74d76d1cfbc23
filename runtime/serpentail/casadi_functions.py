"""CasADi functions of a model: built from its generated module, or wrapping its compiled C."""

import importlib.util

import casadi

from .errors import ModelError
from .parameters import flat


class CasadiFunctions:
    """Attribute access builds a ``casadi.Function`` once; ``symbolic`` and ``external`` take parameters as an input."""

    def __init__(self, model):
        self._model = model
        self._module = _module(model)

    def __getattr__(self, name: str) -> casadi.Function:
        if name.startswith("_"):
            raise AttributeError(name)
        values = {
            p["name"]: self._model.parameters[p["name"]] for p in self._model.manifest["parameters"] if p["in_struct"]
        }
        function = self._module.function(self._known(name), values)
        setattr(self, name, function)
        return function

    def __dir__(self) -> list[str]:
        return [*self._model.manifest["functions"], "symbolic", "external", "parameter_vector"]

    @property
    def parameter_vector(self) -> casadi.DM:
        """The model's parameters, in the order that ``symbolic`` and ``external`` functions take them."""
        return casadi.DM(flat(self._model.manifest, self._model.parameters))

    def symbolic(self, name: str) -> casadi.Function:
        """Return a function of SX operations whose last input is the parameter vector."""
        return self._module.function(self._known(name))

    def external(self, name: str) -> casadi.Function:
        """Return the compiled C as a function whose last input is the parameter vector (double models only)."""
        prefix = self._model.manifest["prefix"]
        if self._model.manifest["real"] != "double":
            raise ModelError(
                f'{prefix} is a {self._model.manifest["real"]} model: casadi.external needs real = "double"'
            )
        if self._model.library is None:
            raise ModelError(f"{prefix} was loaded with compiled=False: load it again to use its C")
        return casadi.external(f"{prefix}_casadi_{self._known(name)}", self._model.library._name)

    def _known(self, name: str) -> str:
        if name not in self._model.manifest["functions"]:
            raise self._model.without(name)
        return name


def _module(model):
    name = f"{model.name}_casadi"
    spec = importlib.util.spec_from_file_location(name, model.folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
