"""Golden models: two tiny models as text, so that a review shows what a change of the generator
does to its output.

``make golden`` accepts what the generator emits now.
"""

import difflib
import shutil
from pathlib import Path

import pytest

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

GOLDEN = Path(__file__).parents[1] / "golden"
MODELS = {
    "golden_straight": {
        "size": (1, 1),
        "emission": "straight",
        "functions": ["mass_matrix", "forward_dynamics"],
    },
    "golden_loops": {
        "size": (2, 2),
        "emission": "loops",
        "functions": ["bias_force", "forward_dynamics"],
    },
}
LONGEST_REPORT = 200  # lines of difference that a failure shows


def emitted(name, root):
    """The header, the model and the CasADi module that the generator emits, by their names in the
    golden folder.

    Python is stored as text, so that no tool formats or checks it.
    """
    options = dict(MODELS[name])
    generate(scene_for("articulated", *options.pop("size"), name=name, **options), root)
    files = (f"include/{name}.h", f"src/{name}.c", f"{name}_casadi.py")
    names = [Path(file).name + ".txt" * file.endswith(".py") for file in files]
    return {
        stored: (root / name / file).read_text() for stored, file in zip(names, files, strict=True)
    }


def differences(folder, texts):
    """Unified differences from the golden files to the texts, files missing on either side
    included.
    """
    stored = (
        {path.name: path.read_text() for path in sorted(folder.glob("*"))}
        if folder.is_dir()
        else {}
    )
    lines = []
    for name in sorted(stored.keys() | texts.keys()):
        before, after = (some.get(name, "").splitlines() for some in (stored, texts))
        lines += difflib.unified_diff(
            before, after, f"golden/{name}", f"emitted/{name}", lineterm=""
        )
    return lines


def accept(folder, texts):
    """Make the golden files those texts, and no others."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, text in texts.items():
        (folder / name).write_text(text)


def report(lines):
    """What a failure shows."""
    more = [f"... {len(lines) - LONGEST_REPORT} lines more"] if len(lines) > LONGEST_REPORT else []
    head = "the generator emits other text than tests/golden holds; `make golden` accepts it:"
    return "\n".join([head, *lines[:LONGEST_REPORT], *more])


@pytest.mark.parametrize("name", MODELS)
def test_generator_emits_the_golden_text(name, tmp_path, request):
    texts = emitted(name, tmp_path)
    if request.config.getoption("--update-golden"):
        accept(GOLDEN / name, texts)
    lines = differences(GOLDEN / name, texts)
    if lines:
        pytest.fail(report(lines), pytrace=False)


def test_golden_folder_holds_the_golden_models_only():
    assert {path.name for path in GOLDEN.iterdir()} == set(MODELS)
    assert sum(path.stat().st_size for path in GOLDEN.rglob("*")) < 200_000


def test_every_difference_is_shown(tmp_path):
    texts = {"a.c": "one\ntwo\n", "b.h": "three\n"}
    accept(tmp_path / "golden", texts)
    assert differences(tmp_path / "golden", texts) == []
    shown = report(differences(tmp_path / "golden", {"a.c": "one\n2\n", "c.py": "four\n"}))
    assert all(
        line in shown.splitlines() for line in ("--- golden/a.c", "-two", "+2", "-three", "+four")
    )
    accept(tmp_path / "golden", {"c.py": "four\n"})
    assert [path.name for path in (tmp_path / "golden").iterdir()] == ["c.py"]
    long = report([f"+{k}" for k in range(LONGEST_REPORT + 7)])
    assert long.endswith("... 7 lines more")
