"""The compiled functions of a model by name, and the errors about those that it lacks."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from ..basics.errors import ModelError, StateError
from .kernel import Kernel
from .memory import Out


class CompiledFunctions(dict[str, Kernel]):
    """Compiled functions by name; ModelError about one that the model lacks.

    compiled: whether the model was loaded with its C.
    """

    def __init__(self, manifest: Mapping[str, Any], compiled: bool):
        super().__init__()
        self.manifest, self.compiled = manifest, compiled

    def __missing__(self, name: str) -> Kernel:
        if self.compiled:
            raise absent(self.manifest, name)
        raise ModelError(
            f"{self.manifest['prefix']} was loaded with compiled=False: only model.casadi can "
            "evaluate; load it again"
        )

    def with_legs(
        self, name: str, legs: ArrayLike | None, arrays: tuple[ArrayLike, ...], out: Out
    ) -> Any:
        """Call a function that takes legs last if the model has feet."""
        kernel, model = self[name], self.manifest["prefix"]
        feet = any(entry["group"] == "feet" for entry in self.manifest["contacts"])
        if feet and legs is None:
            raise StateError(f"{model} has feet: give legs, 4 angles (rad) and 4 rates (rad/s)")
        if legs is None:
            return kernel.at(arrays, out)
        if feet:
            return kernel.at((*arrays, legs), out)
        raise StateError(
            f'{model} has no feet, but legs were given: leave them out, or add "feet" to `contacts`'
        )


def generated_functions(manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of all functions that were generated, also of those that only C calls."""
    return tuple(manifest["functions"] | manifest.get("work", {}))


def absent(manifest: Mapping[str, Any], *names: str) -> ModelError:
    """Return the error about functions that a model was generated without."""
    model, scene = manifest["prefix"], manifest["scene"]
    inner = sorted(set(names) & set(scene["functions"]))
    if inner and "c" not in scene["targets"]:
        return without_c(manifest)
    if inner:
        return ModelError(
            f"{', '.join(map(repr, inner))} of {model} is C that runs simulations, with no form "
            "for CasADi or single calls: use st.simulate, or CasADi's own integrators with "
            "forward_dynamics"
        )
    return ModelError(
        f"{model} was generated without {', '.join(map(repr, names))} (it has "
        f"{', '.join(generated_functions(manifest))}): add it to `functions` of the scene, then "
        "generate it again"
    )


def without_c(manifest: Mapping[str, Any]) -> ModelError:
    """Return the error about a model that was generated without C."""
    return ModelError(
        f"{manifest['prefix']} was generated without C: load it with compiled=False for "
        'model.casadi, or add "c" to `targets` of the scene, then generate it again'
    )
