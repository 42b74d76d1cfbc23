"""The command line and scripts: reports go to stdout, complaints to stderr, and the exit status
tells which; all answer `--help` at once and refuse what they do not know, without any work.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from serpentail.cli import cli
from serpentail.verification import report as verify
from serpentail_scene.signatures.table import SIGNATURES
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run(capsys):
    """Return a function from arguments to status, stdout and stderr."""

    def invoke(*arguments):
        status = cli.main(list(map(str, arguments)))
        return status, *capsys.readouterr()

    return invoke


def test_info_is_a_table_in_columns_or_json(run):
    status, out, err = run("info", zoo.folder("m1_n1"))
    head, *lines = out.splitlines()
    assert (status, besides_progress(err)) == (0, "")
    assert head == "m1_n1: 1 x 1 links, nq 9, nv 8, double"
    functions = [line for line in lines if not line.startswith("    ")]
    names = [line.split()[0] for line in functions]
    assert names == [name for name in SIGNATURES if name in names] and "energy" in names
    assert all(re.fullmatch(r"  \w+ +(straight|loops) +\d+ operations", x) for x in functions)
    assert len({line.index(" operations") for line in functions}) == 1
    ports = [re.split("  +", line.strip()) for line in lines if line.startswith("    ")]
    assert ["out H", "8 x 8", SIGNATURES["mass_matrix"].outputs[0].meaning] in ports
    assert ["in", "q", "9", SIGNATURES["energy"].inputs[0].meaning] in ports
    status, out, err = run("info", zoo.folder("m1_n1"), "--json", "-")
    report = json.loads(out)
    assert (status, err, out.count("\n")) == (0, "", 1)
    wanted = {"name": "m1_n1", "real": "double", "segments": 1, "links": 1, "nq": 9, "nv": 8}
    assert wanted == {k: report[k] for k in wanted}
    assert report["parameters"]["tail_mount"] == [0.0, -0.0405, 0.0045]
    assert report["functions"]["energy"]["inputs"] == {"q": [9], "v": [8]}
    assert report["functions"]["energy"]["outputs"] == {"kinetic": [1], "potential": [1]}


def test_verify_tells_what_failed_by_status_1(run, monkeypatch):
    folder = zoo.folder("bare")
    status, text, words = run("verify", folder)
    assert (status, besides_progress(words)) == (0, "") and "0 failed" in text
    status, out, err = run("verify", folder, "--json", "-")
    found = json.loads(out)
    assert (status, err, out.count("\n"), found["passed"]) == (0, "", 1, True)
    assert {check["status"] for check in found["checks"]} == {"passed", "not checked"}
    broken = verify.Check("a law", "It holds.", 2.0, 1.0, "a state")
    whole = verify.Check("another", "It holds.", 0.0, 1.0)
    monkeypatch.setattr(verify, "laws", lambda _: [broken, whole])
    status, text, _ = run("verify", folder)
    assert status == 1 and "FAILED" in text
    status, out, _ = run("verify", folder, "--json", "-")
    assert status == 1 and json.loads(out)["passed"] is False


def test_no_folder_and_no_compiler_are_one_line_and_status_2(run, tmp_path, monkeypatch):
    nowhere = tmp_path / "nowhere"
    for place, words in [
        (nowhere, r"nowhere.*no.* generated folder.*make model"),
        (tmp_path, "not a generated folder"),
        *((place, "") for place in ("a" * 5000, "a\0b", "/dev/null", "/dev/zero/a")),
    ]:
        for verb in (["info"], ["verify", "--json", "-"]):
            with row(*verb, place):
                status, out, err = run(*verb, place)
                assert (status, out) == (2, "") and err.count("\n") == 1 and len(err) < 400
                assert re.search(words, err)
    monkeypatch.setenv("CC", "no-such-cc")
    status, out, err = run("info", zoo.folder("bare"))
    assert (status, out) == (2, "") and "CC='no-such-cc'" in err


def test_wrong_usage_is_status_2_and_help_names_every_verb(capsys):
    for arguments, words in [
        ([], "VERB"),
        (["fly"], "'fly'"),
        (["info"], "model"),
        (["info", "x", "--json", "report.json"], "'report.json'"),
        (["info", "x", "--nonsense"], "--nonsense"),
    ]:
        with row(*arguments), pytest.raises(SystemExit) as caught:
            cli.main(arguments)
        out, err = capsys.readouterr()
        assert (caught.value.code, out) == (2, "")
        assert words in err and err.startswith("usage: serpentail")
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    out, err = capsys.readouterr()
    assert (caught.value.code, err) == (0, "")
    assert all(verb in out for room in cli.ROOMS.values() for verb in room)


# Scripts.

FOLDERS = ("benchmarks", "checks", "examples")
HEAVY = {"casadi", "matplotlib", "numpy", "scipy", "serpentail_codegen.pipeline", "sympy"}
# Runs each module of the words as a program with an argument, in a process that this one forks: it
# prints its status, and the packages that it has loaded.
EACH = """
import argparse, contextlib, dataclasses, io, os, pathlib, runpy, subprocess, sys
for name in sys.argv[2:]:
    if os.fork() == 0:
        sys.argv, text, status = [name, sys.argv[1]], io.StringIO(), None
        with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
            try:
                runpy.run_module(name, run_name="__main__", alter_sys=True)
            except SystemExit as end:
                status = end.code
        print(name, status, "usage:" in text.getvalue(), *sys.modules, flush=True)
        os._exit(0)
    os.wait()
"""


def scripts():
    """The modules that people run: those of tests by the Makefile, which runs the zoo itself."""
    found = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    found = [path for path in found if '\nif __name__ == "__main__":\n' in path.read_text()]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in found]
    names += re.findall(r"\btests\.\S+", (ROOT / "Makefile").read_text())
    return sorted({*names, "serpentail_codegen", "serpentail"} - {"tests.support.zoo"})


def test_scripts_answer_help_nonsense_and_folders_that_cannot_be_without_work(tmp_path):
    names = scripts()
    assert {"examples.studies.__main__", "benchmarks.__main__", "tests.verification"} <= {*names}
    (tmp_path / "file").write_text("")
    writers = [name for name in names if name.startswith(("examples.", "bench"))]
    for word, of, status in [("--help", names, 0), ("--nonsense", names, 2), ("file", writers, 2)]:
        done = subprocess.run(
            [sys.executable, "-c", EACH, word, *of],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert (done.returncode, done.stderr) == (0, "")
        told = [line.split() for line in done.stdout.splitlines()]
        assert [name for name, *_ in told] == of
        for name, *found in told:
            with row(name, word):
                assert found[:2] == [str(status), "True"] and not HEAVY & {*found}
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
