"""Refuses what is no model, where one belongs."""

from ..basics.checks import refusal
from .model import Model


def checked_model(model: object, error: type[Exception]) -> Model:
    """Return a model; the error about anything else says where a model is."""
    if not isinstance(model, Model):
        own = "such as its .model" if isinstance(getattr(model, "model", 0), Model) else ""
        raise refusal("model", model, f"a Model, {own or 'as st.build or st.load gives'}", error)
    return model
