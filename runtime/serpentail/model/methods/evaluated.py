"""What each group of methods needs of a model: compiled functions by name."""

import ctypes
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from serpentail_scene.layout import Layout

from ...basics.errors import ModelError
from ..kernel import Kernel
from ..lazy import kept

Array = NDArray[Any]  # of doubles, or of floats if the scene asks for them


def without_c(manifest: Mapping[str, Any]) -> ModelError:
    """Return the error about a model that was generated without C."""
    return ModelError(
        f"{manifest['prefix']} was generated without C: load it with compiled=False for "
        'model.casadi, or add "c" to `targets` of the scene, then generate it again'
    )


class Evaluated:
    """A model as its methods see it: its sizes and its compiled functions."""

    name: str
    manifest: dict[str, Any]
    contacts: dict[str, int]
    layout: Layout
    fixed: bool
    library: ctypes.CDLL | None
    kernels: dict[str, Kernel]

    @kept
    def generated(self) -> tuple[str, ...]:
        """Names of all functions that were generated, also of those that only C calls."""
        return tuple(self.manifest["functions"] | self.manifest.get("work", {}))

    def kernel(self, name: str) -> Kernel:
        """Return a compiled function by name.

        Parameters
        ----------
        name : str
            Name of a function of the scene, such as "mass_matrix".

        Returns
        -------
        Kernel
            The function; it takes and returns arrays as the method of that name does.

        Raises
        ------
        ModelError
            The scene left the function out, or the model was loaded with ``compiled=False``.
        """
        kernel = self.kernels.get(name)
        if kernel is None and self.library is None:
            raise ModelError(
                f"{self.name} was loaded with compiled=False: only model.casadi can evaluate; "
                "load it again"
            )
        if kernel is None:
            raise self.without(name)
        return kernel

    def refuse_fixed(self, what: str) -> None:
        """Raise ModelError if the base is fixed: ``what`` needs a free torso."""
        if self.fixed:
            raise ModelError(
                f"{what}: {self.name} has a fixed base, which neither flies nor lands: generate it "
                'again with base = "free"'
            )

    def without(self, *names: str) -> ModelError:
        """Return the ModelError about functions that the model was generated without."""
        inner = sorted(set(names) & set(self.manifest["scene"]["functions"]))
        if inner and "c" not in self.manifest["scene"]["targets"]:
            return without_c(self.manifest)
        if inner:
            return ModelError(
                f"{', '.join(map(repr, inner))} of {self.name} is C that runs simulations, with no "
                "form for CasADi or single calls: use st.simulate, or CasADi's own integrators "
                "with forward_dynamics"
            )
        has = ", ".join(self.generated)
        return ModelError(
            f"{self.name} was generated without {', '.join(map(repr, names))} (it has {has}): add "
            "it to `functions` of the scene, then generate it again"
        )
