"""The front door: make builds what is asked for, once, and says in one line what it cannot do."""

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.makes import away_from_make, stand_in
from tests.support.rows import row

ROOT = Path(__file__).resolve().parents[2]
NAME = "articulated_m1_n1_fc4a05d"  # of these functions
ORDER = ("TAIL=articulated", "M=1", "N=1", "FUNCTIONS=mass_matrix")


@pytest.fixture
def tree(tmp_path):
    """A copy of what make builds from, with a stand-in for .venv that is ready."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy2(ROOT / name, tmp_path)
    for name in ("codegen", "scenes"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    stand_in(tmp_path)
    return tmp_path


@pytest.fixture
def make(tree):
    """Return a function that runs make there, away from a make that runs these tests."""

    def run(*arguments, **more):
        own = {name: value for name, value in away_from_make().items() if name != "CC"}
        own |= {"PYTHONPATH": str(tree / "codegen"), "LC_ALL": "C", "UV": "", **more}
        return subprocess.run(
            ["make", *arguments], cwd=tree, env=own, capture_output=True, text=True, check=False
        )

    return run


def test_options_of_make_are_those_of_the_generator(tree, make):
    options = ("REAL=float", "EMISSION=loops", "BAKED=1", "FUNCTIONS=energy,momentum")
    told = "--real float --emission loops --baked --functions energy,momentum"
    for given, wanted in [
        (("TAIL=continuum", "M=2"), "--tail continuum --segments 2"),
        (options, f"{told} --tail articulated --segments 1 --links 3"),
        (("SCENE=my scenes/it's.toml",), "-- my scenes/it's.toml"),
    ]:
        with row(*given):
            done = make("-n", "model", *given)
            command = done.stdout.split(" && ")[0].replace("$(", " ").replace(")", " ")
            assert done.returncode == 0 and wanted in " ".join(shlex.split(command))
    assert not (tree / "generated").exists()


def test_a_wrong_option_is_one_readable_line_and_nothing_is_made(tree, make):
    for options, words in [
        (["M=0"], r"segments: value 0"),
        (["N=abc"], r"--links: .*'abc'"),
        (["SCENE=--help"], r"scene file: value '--help'"),
    ]:
        with row(*options):
            done = make("model", *options)
            assert done.returncode == 2 and "Traceback" not in done.stderr
            (line,) = (line for line in done.stderr.splitlines() if re.search(words, line))
            assert len(line) < 130 and not list((tree / "generated").glob("[a-z]*"))


@pytest.mark.slow
def test_what_is_there_is_not_made_again_and_what_was_lost_is(tree, make):
    failed = make("model", *ORDER, CC="no-such-cc", SERPENTAIL_CACHE=str(tree / "cache"))
    assert failed.returncode == 2 and "CC='no-such-cc'" in failed.stderr
    first = make("model", *ORDER)
    assert first.returncode == 0 and f"{NAME}: 1 x 1 links" in first.stdout
    folder = tree / "generated" / NAME
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["prefix"] == NAME and manifest["real"] == "double"
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    again = make("model", *ORDER)
    assert re.fullmatch(rf"generated/{NAME}: up to date, \d+\.\d\d s\n", again.stdout)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    readme = (folder / "README.md").read_bytes()
    (folder / "README.md").unlink()
    assert "1 files written" in make("model", *ORDER).stdout
    assert (folder / "README.md").read_bytes() == readme


def test_clean_removes_what_was_made(tree, make):
    kept = ("generated/README.md", "generated/golden_loops/src")  # part of the checkout
    for name in ("generated/x", "generated/.stamps", "output", *kept):
        (tree / name).mkdir(parents=True)
    assert make("clean").returncode == 0
    assert {path.name for path in (tree / "generated").iterdir()} == {"README.md", "golden_loops"}
    assert not (tree / "output").exists() and (tree / "generated/golden_loops/src").is_dir()
