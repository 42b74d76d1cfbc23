"""Libraries that are not installed with serpentail, but with one of its extras."""

from importlib import import_module
from typing import Any

from .errors import ExtraMissing


def needed(module: str, extra: str) -> Any:
    """Return a module; ExtraMissing names the extra that brings it, and the command."""
    try:
        return import_module(module)
    except ImportError as reason:
        raise ExtraMissing(
            f"{module} cannot be imported ({reason}): it comes with the extra {extra!r}, "
            f'pip install "serpentail[{extra}]"'
        ) from reason
