"""Reads a scene from the text or the table of a file, or tells what is wrong with it."""

from collections.abc import Mapping

import pytest

from serpentail_codegen.scene.parse import load_scene, parse_scene
from serpentail_codegen.scene.problems import Problem, SceneError
from serpentail_codegen.scene.scene import Scene
from tests.support.rows import row


@pytest.fixture
def read(tmp_path):
    """Return a function from a scene file, as text, bytes or table, to its Scene."""

    def read_one(source: str | bytes | Mapping) -> Scene:
        if isinstance(source, Mapping):
            return parse_scene(source, "rat")
        path = tmp_path / "rat.toml"
        path.write_bytes(source if isinstance(source, bytes) else source.encode())
        return load_scene(path)

    return read_one


@pytest.fixture
def refuse(read):
    """Return a function from a wrong scene file to its problems, by field."""

    def problems(source: str | Mapping) -> dict[str, Problem]:
        with pytest.raises(SceneError) as caught:
            read(source)
        lines = str(caught.value).splitlines()
        fields = [problem.field for problem in caught.value.problems]
        assert [line.split(": ")[0] for line in lines] == fields
        return {problem.field: problem for problem in caught.value.problems}

    return problems


@pytest.fixture
def refuse_rows(refuse):
    """Return a function that checks a table: (scene file, its wrong field, what to name).  It is
    the only wrong one, or one among others.
    """

    def check(rows, alone=True):
        for source, field, name in rows:
            with row(str(source)[-100:], field):
                problems = refuse(source)
                assert name in problems[field].remedy, problems
                assert set(problems) == {field} or not alone, problems

    return check
