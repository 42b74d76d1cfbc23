"""The compiled functions of a model by name, and the errors about those that it lacks."""

from collections.abc import Mapping
from ctypes import CDLL
from typing import TYPE_CHECKING, Any
from weakref import ref

from numpy.typing import ArrayLike

from serpentail_scene.signatures.table import ALL

from ..basics.checks import did_you_mean
from ..basics.errors import ModelError, StateError
from .kernel import Kernel
from .library import BatchLibrary
from .manifest import CheckedFolder
from .memory import Out

if TYPE_CHECKING:
    from .model import Model


class CompiledFunctions(dict[str, Kernel]):
    """Compiled functions by name, and the code that they are part of.

    One that is missing is added to the model, which then has other ones of these; ModelError if
    that cannot be. library: None of a model that was loaded without its C.
    """

    def __init__(
        self, model: "Model", checked: CheckedFolder, library: CDLL | None, batches: BatchLibrary
    ):
        super().__init__()
        self.model, self.checked, self.library, self.batches = ref(model), checked, library, batches
        self.manifest = checked.manifest
        if library is not None:
            for name in self.manifest["functions"]:
                self[name] = Kernel(library, batches, self.manifest, name, model.parameter_vector)

    def __missing__(self, name: str) -> Kernel:
        model = self.model()
        if self.library is None:
            raise ModelError(
                f"{self.manifest['prefix']} was loaded with compiled=False: only model.casadi can "
                "evaluate; load it again"
            )
        if model is None or name in generated_functions(self.manifest):  # C alone calls it
            raise absent(self.manifest, name)
        model.need(name)
        return model.kernels[name]

    def with_legs(self, name: str, legs: ArrayLike | None, *arrays: ArrayLike, out: Out) -> Any:
        """Call a function that takes legs last if the model has feet, or how prescribed joints
        move.
        """
        kernel, model = self[name], self.manifest["prefix"]
        if "given" in kernel.names:
            return kernel(*arrays, *(() if legs is None else (legs,)), out=out)
        feet = any(entry["group"] == "feet" for entry in self.manifest["contacts"])
        if feet and legs is None:
            raise StateError(f"{model} has feet: give legs, 4 angles (rad) and 4 rates (rad/s)")
        if legs is None:
            return kernel(*arrays, out=out)
        if feet:
            return kernel(*arrays, legs, out=out)
        raise StateError(
            f'{model} has no feet, but legs were given: leave them out, or add "feet" to `contacts`'
        )


def generated_functions(manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of all functions that were generated, also of those that only C calls."""
    scene = manifest["scene"]
    in_c = manifest["work"] | dict.fromkeys(scene["functions"]) if "c" in scene["targets"] else {}
    return tuple(manifest["functions"] | in_c)


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
    remedy = f'add it to `functions` of the scene, as "+{names[0]}" beside the usual ones'
    unknown = next((name for name in names if name not in ALL), None)
    if unknown is not None:
        remedy = did_you_mean(unknown, ALL) or f"{model} cannot have {unknown!r}"
    return ModelError(
        f"{model} was generated without {', '.join(map(repr, names))} (it has "
        f"{', '.join(generated_functions(manifest))}): {remedy}"
    )


def without_c(manifest: Mapping[str, Any]) -> ModelError:
    """Return the error about a model that was generated without C."""
    return ModelError(
        f"{manifest['prefix']} was generated without C: load it with compiled=False for "
        'model.casadi, or add "c" to `targets` of the scene, then generate it again'
    )
