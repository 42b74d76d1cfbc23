"""An empty cache, and a folder where models come and go."""

import pytest


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def folder(tmp_path):
    """Where models called tail come and go."""
    return tmp_path / "tail"
