"""Reads a scene from text, or tells what is wrong with it."""

import pytest

from serpentail_codegen.scene.parse import load_scene
from serpentail_codegen.scene.problems import Problem, SceneError
from serpentail_codegen.scene.scene import Scene


@pytest.fixture
def read(tmp_path):
    """Return a function from the text (or bytes) of a scene file to its Scene."""

    def read_text(text: str | bytes) -> Scene:
        path = tmp_path / "rat.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_scene(path)

    return read_text


@pytest.fixture
def refuse(read):
    """Return a function from the text of a wrong scene file to its problems, by field."""

    def problems(text: str) -> dict[str, Problem]:
        with pytest.raises(SceneError) as caught:
            read(text)
        lines = str(caught.value).splitlines()
        assert [line.split(": ")[0] for line in lines] == [
            problem.field for problem in caught.value.problems
        ]
        return {problem.field: problem for problem in caught.value.problems}

    return problems
