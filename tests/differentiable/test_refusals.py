"""What needs no library: other things than models, and libraries that are missing."""

import sys

import pytest

import serpentail as st


def test_what_is_no_model_is_refused():
    for make in (st.jax_functions, st.torch_functions):
        with pytest.raises(st.ModelError, match="model: value 'rat'"):
            make("rat")


def test_without_the_library_the_extra_is_named(model, monkeypatch):
    for tool in ("jax", "torch"):
        monkeypatch.setitem(sys.modules, tool, None)
        with pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{tool}\]"'):
            getattr(st, f"{tool}_functions")(model)
