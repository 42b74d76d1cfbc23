"""The golden models of generated/: two tiny packages that are part of the checkout.

A review sees in them what a change of the generator does to its output.  ``make golden`` accepts
what the generator emits now.
"""

import difflib
import shutil
import subprocess
from pathlib import Path

import pytest

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

GENERATED = Path(__file__).parents[2] / "generated"
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


def emit(name, root):
    """Generate a golden model; return its folder."""
    options = dict(MODELS[name])
    generate(scene_for("articulated", *options.pop("size"), name=name, **options), root)
    return root / name


def texts(folder):
    """Every file below a folder by its name there; none where the folder is missing."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes().decode()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "build" not in path.relative_to(folder).parts
    }


def differences(name, before, after):
    """Unified differences of two folders' texts, files missing on either side included."""
    lines = []
    for file in sorted(before.keys() | after.keys()):
        pair = (some.get(file, "").splitlines(keepends=True) for some in (before, after))
        lines += difflib.unified_diff(*pair, f"generated/{name}/{file}", f"emitted/{name}/{file}")
    return [line.rstrip("\n") for line in lines]


def accept(folder, emitted):
    """Put an emitted folder in a golden one's place."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(emitted, folder)


def report(lines):
    """What a failure shows."""
    rest = len(lines) - LONGEST_REPORT
    head = "the generator emits other text than generated/ holds; `make golden` accepts it:"
    return "\n".join([head, *lines[:LONGEST_REPORT], *([f"... {rest} lines more"] * (rest > 0))])


@pytest.mark.parametrize("name", MODELS)
def test_generator_emits_the_golden_bytes(name, tmp_path, request):
    emitted = emit(name, tmp_path)
    if request.config.getoption("--update-golden"):
        accept(GENERATED / name, emitted)
    lines = differences(name, texts(GENERATED / name), texts(emitted))
    if lines:
        pytest.fail(report(lines), pytrace=False)


def test_checkout_holds_a_readme_and_the_golden_models_only():
    command = ["git", "ls-files", "--", "generated"]
    listed = subprocess.run(
        command, cwd=GENERATED.parent, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip(f"this is no checkout: {listed.stderr.strip()}")
    files = [Path(name) for name in listed.stdout.split()]
    assert {path.parts[1] for path in files} == {"README.md", *MODELS}
    assert sum((GENERATED.parent / path).stat().st_size for path in files) < 400_000


@pytest.mark.parametrize("name", MODELS)
def test_golden_package_builds_without_python(name, tmp_path):
    folder = tmp_path / name
    shutil.copytree(GENERATED / name, folder)
    bare = {"PATH": "/usr/bin:/bin", "LC_ALL": "C"}
    command = ["make", "-s", "all", "example"]
    done = subprocess.run(
        command, cwd=folder, env=bare, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    printed = subprocess.run([folder / "build" / "example"], capture_output=True, check=False)
    assert printed.returncode == 0


def test_every_difference_is_shown(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, files in (
        (before, {"src/a.c": "one\ntwo\n", "b.h": "three\n"}),
        (after, {"src/a.c": "one\n2\n", "c.py": "four\n"}),
    ):
        for file, text in files.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text)
    shown = report(differences("a", texts(before), texts(after))).splitlines()
    assert {"--- generated/a/src/a.c", "-two", "+2", "-three", "+four"} <= set(shown)
    accept(before, after)
    assert differences("a", texts(before), texts(after)) == []
    long = report([f"+{k}" for k in range(LONGEST_REPORT + 7)])
    assert long.endswith("... 7 lines more")
