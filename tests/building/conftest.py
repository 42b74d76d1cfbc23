"""A generator that counts."""

import shutil

import pytest

from serpentail.building import generator
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of


@pytest.fixture
def generations(cache, monkeypatch):
    """Return a list that grows by each run of the generator, which makes each text once a day."""
    runs = []

    def generate(scene, output, given):
        runs.append(scene)
        return shutil.copytree(folder_of(load_scene(scene)), output / scene.stem)

    monkeypatch.setattr(generator, "generate", generate)
    return runs
