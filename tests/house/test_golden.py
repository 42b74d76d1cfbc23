"""The golden models of generated/: two tiny packages that are part of the checkout.

A review sees in them what a change of the generator does to its output.  ``make golden`` accepts
what the generator emits now.
"""

import difflib
import shutil
from pathlib import Path

import pytest

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

GENERATED = Path(__file__).parents[2] / "generated"
MODELS = {  # size, emission and functions
    "golden_straight": ((1, 1), "straight", ["mass_matrix", "forward_dynamics"]),
    "golden_loops": ((2, 2), "loops", ["bias_force", "forward_dynamics"]),
}


def texts(folder):
    """Every file below a folder by its name there; none where the folder is missing."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes().decode()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "build" not in path.relative_to(folder).parts
    }


@pytest.mark.parametrize("name", MODELS)
def test_generator_emits_the_golden_bytes(name, tmp_path, request):
    size, emission, functions = MODELS[name]
    made = scene_for("articulated", *size, name=name, emission=emission, functions=functions)
    generate(made, tmp_path)
    if request.config.getoption("--update-golden"):
        shutil.rmtree(GENERATED / name, ignore_errors=True)
        shutil.copytree(tmp_path / name, GENERATED / name)
    golden, emitted, lines = texts(GENERATED / name), texts(tmp_path / name), []
    for file in sorted(golden.keys() | emitted.keys()):
        pair = (some.get(file, "").splitlines(keepends=True) for some in (golden, emitted))
        lines += difflib.unified_diff(*pair, f"generated/{name}/{file}", f"emitted/{name}/{file}")
    if lines:
        head = "the generator emits other text than generated/ holds; `make golden` accepts it:\n"
        pytest.fail("".join([head, *lines[:200]]), pytrace=False)
