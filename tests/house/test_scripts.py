"""Every script answers `--help` at once and refuses what it does not know, without any work."""

import ast
import os
import resource
import stat
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("benchmarks", "embedded", "examples", "mutants", "stress")
LIMIT = 0.15  # s of processor time
SLOWER = 3  # times, where other processes of the suite share the cores


def guarded(path: Path) -> bool:
    """Tell whether a module does something where it is run."""
    tests = [ast.unparse(n.test) for n in ast.parse(path.read_text()).body if isinstance(n, ast.If)]
    return "__name__ == '__main__'" in tests


def scripts() -> list[str]:
    """The modules that are run by people: those of tests by the Makefile."""
    found = [p for f in FOLDERS for p in (ROOT / f).rglob("*.py") if guarded(p)]
    names = [".".join(p.relative_to(ROOT).with_suffix("").parts) for p in found]
    made = (ROOT / "Makefile").read_text()
    names += [word for word in made.split() if word.startswith("tests.")]
    return sorted({*names, "serpentail_codegen", "serpentail.cli"})


SCRIPTS = scripts()
every_script = pytest.mark.parametrize("script", SCRIPTS)


def run(folder: Path, *words: str) -> subprocess.CompletedProcess:
    """Run a module in an empty folder, in which it finds the others."""
    return subprocess.run(
        [sys.executable, "-m", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_scripts_are_found():
    assert {"examples.demo", "examples.studies.contact", "benchmarks.bench"} <= set(SCRIPTS)
    assert {"mutants.run", "stress.stress", "embedded.check", "tests.verification"} <= set(SCRIPTS)


@every_script
def test_help_and_nonsense_are_answered_at_once_without_work(script, tmp_path):
    times = []
    while not times or (min(times) > SLOWER * LIMIT and len(times) < 3):
        before = spent()
        helped = run(tmp_path, script, "--help")
        times.append(spent() - before)
    assert (helped.returncode, helped.stderr) == (0, "") and "usage:" in helped.stdout
    assert min(times) < SLOWER * LIMIT

    refused = run(tmp_path, script, "--nonsense")
    assert refused.returncode == 2 and "Traceback" not in refused.stderr
    assert refused.stdout == "" and "usage:" in refused.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("script", [s for s in SCRIPTS if s.startswith("examples.")])
def test_examples_run_by_their_paths_too(script, tmp_path):
    path = ROOT.joinpath(*script.split(".")).with_suffix(".py")
    done = subprocess.run(
        [sys.executable, path, "--help"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "") and f"usage: {path.name}" in done.stdout


def spent() -> float:
    """Processor time of all processes that were started here and have ended, of the user's (s)."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


@pytest.mark.parametrize("script", [s for s in SCRIPTS if s.startswith(("examples.", "bench"))])
def test_folders_that_cannot_be_used_are_refused_before_work(script, tmp_path):
    if "where results go" not in run(tmp_path, script, "--help").stdout:
        assert script == "examples.learning"
        return
    (tmp_path / "file").write_text("")
    for folder in ("file", "file/below"):
        refused = run(tmp_path, script, folder)
        assert refused.returncode == 2 and "not a folder" in refused.stderr, refused.stderr
    if os.geteuid():  # root may write anywhere
        (tmp_path / "locked").mkdir(mode=stat.S_IRUSR)
        refused = run(tmp_path, script, "locked/below")
        assert refused.returncode == 2 and "cannot be written to" in refused.stderr
