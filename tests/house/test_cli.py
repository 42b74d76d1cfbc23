"""The command line: reports go to stdout, complaints to stderr, and the exit status tells which it
was.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from serpentail import cli
from serpentail.verification import report as verify
from serpentail_codegen.scene.signatures.table import SIGNATURES
from tests.support.models import model_folder
from tests.support.told import besides_progress

MADE = ("mass_matrix", "forward_dynamics", "energy")  # in their order; a rollout calls one


@pytest.fixture(scope="module")
def folder():
    return str(model_folder(1, 1, name="tail", functions=["mass_matrix", "energy", "rollout"]))


@pytest.fixture
def run(capsys):
    """Return a function from arguments to status, stdout and stderr."""

    def invoke(*arguments):
        status = cli.main(list(arguments))
        return status, *capsys.readouterr()

    return invoke


def refused(capsys, *arguments):
    """Status and stderr of arguments that do not parse."""
    with pytest.raises(SystemExit) as caught:
        cli.main(list(arguments))
    out, err = capsys.readouterr()
    assert not out
    return caught.value.code, err


def test_info_is_a_table(run, folder):
    status, out, err = run("info", folder)
    head, *lines = out.splitlines()
    assert (status, besides_progress(err)) == (0, "")
    assert head == "tail: 1 x 1 links, nq 9, nv 8, double"
    rows = [line for line in lines if not line.startswith("    ")]
    assert [row.split()[0] for row in rows] == [*MADE]
    for row in rows:
        _, emission, operations, word = row.split()
        assert emission == "straight" and int(operations) > 10 and word == "operations"
    assert len({line.index(" operations") for line in rows}) == 1


def test_info_has_arguments_with_shapes_and_units_in_columns(run, folder):
    _, out, _ = run("info", folder)
    lines = [line for line in out.splitlines() if line.startswith("    ")]
    words = [re.split("  +", line.strip()) for line in lines]
    assert ["out H", "8 x 8", str(SIGNATURES["mass_matrix"].outputs[0].meaning)] in words
    assert ["in", "q", "9", SIGNATURES["energy"].inputs[0].meaning] in words
    # each last column begins where the others do
    assert len({line.index(last) for line, (*_, last) in zip(lines, words, strict=True)}) == 1
    ports = (p for n in MADE for p in (*SIGNATURES[n].inputs, *SIGNATURES[n].outputs))
    assert [last for *_, last in words] == [port.meaning for port in ports]


def test_no_column_of_info_is_glued_to_the_next(run):
    """The longest name, a form's name and a large number, with spaces in between."""
    place = model_folder(3, 4, functions=["forward_dynamics_derivatives"])
    _, out, _ = run("info", str(place))
    assert re.search(r"^  forward_dynamics_derivatives  \w+ +\d+ operations$", out, re.MULTILINE)


def test_info_as_json(run, folder):
    status, out, err = run("info", folder, "--json", "-")
    report = json.loads(out)
    assert (status, err, out.count("\n")) == (0, "", 1)
    assert {key: report[key] for key in ("name", "real", "segments", "links", "nq", "nv")} == {
        "name": "tail",
        "real": "double",
        "segments": 1,
        "links": 1,
        "nq": 9,
        "nv": 8,
    }
    assert report["parameters"]["tail_mount"] == [0.0, -0.0405, 0.0045]
    assert report["functions"]["energy"]["inputs"] == {"q": [9], "v": [8]}
    assert report["functions"]["energy"]["outputs"] == {"kinetic": [1], "potential": [1]}


def test_verify_finds_nothing_wrong(run, folder):
    status, out, err = run("verify", folder)
    assert (status, besides_progress(err)) == (0, "")
    assert out.startswith("tail: ") and "0 failed" in out and "FAILED" not in out


def test_verify_as_json(run, folder):
    status, out, err = run("verify", folder, "--json", "-")
    report = json.loads(out)
    assert (status, err, out.count("\n")) == (0, "", 1)
    assert report["name"] == "tail" and report["passed"] is True and report["counts"]["failed"] == 0
    assert {check["status"] for check in report["checks"]} == {"passed", "not checked"}


@pytest.mark.parametrize("form", [[], ["--json", "-"]])
def test_failed_check_is_status_1(run, folder, monkeypatch, form):
    found = [
        verify.Check("a law", "It holds.", 2.0, 1.0, "a state"),
        verify.Check("another", "It holds.", 0.0, 1.0),
    ]
    monkeypatch.setattr(verify, "laws", lambda _: found)
    status, out, err = run("verify", folder, *form)
    assert (status, err) == (1, "")
    if form:
        assert json.loads(out)["passed"] is False
    else:
        assert "FAILED" in out


@pytest.mark.parametrize("form", [[], ["--json", "-"]])
@pytest.mark.parametrize("verb", ["info", "verify"])
def test_missing_folder_is_status_2(run, tmp_path, verb, form):
    status, out, err = run(verb, str(tmp_path / "nowhere"), *form)
    assert (status, out) == (2, "")
    assert (
        err.startswith(f"{tmp_path / 'nowhere'} is not a generated folder") and "make model" in err
    )


@pytest.mark.parametrize("folder", ["a" * 5000, "a\0b", "/dev/null", "/dev/zero/a"])
@pytest.mark.parametrize("verb", ["info", "verify"])
def test_a_path_that_is_none_is_one_line(run, verb, folder):
    status, out, err = run(verb, folder)
    assert (status, out) == (2, "") and err.count("\n") == 1 and len(err) < 400


def test_missing_compiler_is_status_2(run, folder, monkeypatch):
    monkeypatch.setenv("CC", "no-such-cc")
    status, out, err = run("info", folder)
    assert (status, out) == (2, "") and "CC='no-such-cc'" in err


def test_wrong_usage_is_status_2(capsys, folder):
    for arguments, words in [
        ([], "required: VERB"),
        (["fly"], "invalid choice: 'fly'"),
        (["info"], "required: model"),
        (["info", folder, "--json", "report.json"], "invalid choice: 'report.json'"),
    ]:
        status, err = refused(capsys, *arguments)
        assert status == 2 and words in err and err.startswith("usage: serpentail")


def test_help_names_every_verb(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    out, err = capsys.readouterr()
    assert caught.value.code == 0 and not err
    assert "info" in out and "verify" in out


@pytest.mark.parametrize(
    "program", [[str(Path(sys.executable).parent / "serpentail")], ["-m", "serpentail.cli"]]
)
def test_installed_program(program, folder, tmp_path):
    command = program if len(program) == 1 else [sys.executable, *program]
    good, bad = (
        subprocess.run(
            [*command, "info", place, "--json", "-"], capture_output=True, text=True, check=False
        )
        for place in (folder, str(tmp_path))
    )
    assert (good.returncode, besides_progress(good.stderr)) == (0, "")
    assert json.loads(good.stdout)["name"] == "tail"
    assert (bad.returncode, bad.stdout) == (2, "") and "is not a generated folder" in bad.stderr
