"""The tendons of a model."""

from typing import TYPE_CHECKING

from serpentail_scene.tendons import names_of_tendons

if TYPE_CHECKING:
    from .model import Model


def tendons_of(model: "Model") -> list[str]:
    """Return the names of the tendons that pull a model's tail."""
    return names_of_tendons(model.manifest["scene"].get("tendon", {}))
