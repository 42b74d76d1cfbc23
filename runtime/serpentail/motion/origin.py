"""What a motion says of the model that made it."""

from typing import Any

from ..model.model import Model
from ..model.parameters import json_ready


def origin(model: Model) -> dict[str, Any]:
    """Return name, hashes and parameters of a model, ready for JSON."""
    return {
        "model": model.name,
        "content_hash": model.manifest["content_hash"],
        "manifest_hash": model.checked.manifest_hash,
        "parameters": json_ready(model.parameters),
    }
