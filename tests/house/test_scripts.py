"""Every script answers `--help` at once and refuses what it does not know, without any work."""

import ast
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("benchmarks", "embedded", "examples", "mutants", "stress")
HEAVY = ("casadi", "matplotlib", "numpy", "scipy", "serpentail_codegen.pipeline", "sympy")
# Runs each module of the words as a program with some arguments, in a process that this one forks:
# it prints its status, and the heavy packages that it has loaded.
EACH = """
import argparse, contextlib, dataclasses, io, os, pathlib, runpy, subprocess, sys
count = int(sys.argv[1])
for name in sys.argv[2 + count:]:
    if os.fork() == 0:
        sys.argv, text, status = [name, *sys.argv[2:2 + count]], io.StringIO(), None
        with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
            try:
                runpy.run_module(name, run_name="__main__", alter_sys=True)
            except SystemExit as end:
                status = end.code
        found = [x for x in HEAVY if x in sys.modules] + ["usage"] * ("usage:" in text.getvalue())
        print(name, status, *found, flush=True)
        os._exit(0)
    os.wait()
"""


def guarded(path: Path) -> bool:
    """Tell whether a module does something where it is run."""
    tests = [ast.unparse(n.test) for n in ast.parse(path.read_text()).body if isinstance(n, ast.If)]
    return "__name__ == '__main__'" in tests


def scripts() -> list[str]:
    """The modules that people run: those of tests by the Makefile, which runs the zoo itself."""
    found = [p for f in FOLDERS for p in (ROOT / f).rglob("*.py") if guarded(p)]
    names = [".".join(p.relative_to(ROOT).with_suffix("").parts) for p in found]
    made = (ROOT / "Makefile").read_text()
    names += [word for word in made.split() if word.startswith("tests.")]
    return sorted({*names, "serpentail_codegen", "serpentail.cli"} - {"tests.support.zoo"})


SCRIPTS = scripts()


def run(folder: Path, *words: str | Path) -> subprocess.CompletedProcess:
    """Run Python in an empty folder, in which it finds the scripts."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def answers(folder: Path, *arguments: str, of: list[str] = SCRIPTS) -> dict[str, list[str]]:
    """Status of scripts with some arguments, what heavy they loaded, and "usage" if told."""
    program = f"HEAVY = {HEAVY}\n{EACH}"
    done = run(folder, "-c", program, str(len(arguments)), *arguments, *of)
    assert (done.returncode, done.stderr) == (0, "")
    return {name: rest for name, *rest in map(str.split, done.stdout.splitlines())}


@pytest.mark.parametrize(("words", "status"), [("--help", "0"), ("--nonsense", "2")])
def test_help_and_nonsense_are_answered_without_work(words, status, tmp_path):
    expected = [status, "usage"]
    found = answers(tmp_path, words)
    assert {"examples.studies.contact", "benchmarks.bench", "tests.verification"} <= found.keys()
    assert {name: told for name, told in found.items() if told != expected} == {}
    assert list(tmp_path.iterdir()) == []


def test_streams_and_paths_of_scripts(tmp_path):
    """Help is for stdout, a refusal for stderr; an example runs by its path, too."""
    path = ROOT / "examples" / "demo.py"
    for words in (["-m", "examples.demo"], [path]):
        helped, refused = (run(tmp_path, *words, option) for option in ("--help", "--nonsense"))
        assert (helped.returncode, helped.stderr) == (0, "")
        assert f"usage: {path.name}" in helped.stdout
        assert (refused.returncode, refused.stdout) == (2, "") and "usage:" in refused.stderr
        assert "Traceback" not in refused.stderr


def test_folders_that_cannot_be_used_are_refused_before_work(tmp_path):
    (tmp_path / "file").write_text("")
    writers = [s for s in SCRIPTS if s.startswith(("examples.", "bench"))]
    places = {"not a folder": ["file", "file/below"], "cannot be written to": []}
    if os.geteuid():  # root may write anywhere
        (tmp_path / "locked").mkdir(mode=stat.S_IRUSR)
        places["cannot be written to"].append("locked/below")
    for words, folders in places.items():
        for folder in folders:
            refused = run(tmp_path, "-m", "examples.demo", folder)
            assert refused.returncode == 2 and words in refused.stderr
    found = answers(tmp_path, "file", of=writers)
    assert found == {script: ["2", "usage"] for script in writers}
