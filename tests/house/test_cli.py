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
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress


@pytest.fixture
def run(capsys):
    """Return a function from arguments to status, stdout and stderr."""

    def invoke(*arguments):
        status = cli.main(list(map(str, arguments)))
        return status, *capsys.readouterr()

    return invoke


def test_info_is_a_table_in_columns(run):
    model = zoo.model("m1_n1")
    status, out, err = run("info", model.folder)
    head, *lines = out.splitlines()
    assert (status, besides_progress(err)) == (0, "")
    assert head == "m1_n1: 1 x 1 links, nq 9, nv 8, double"
    functions = [line for line in lines if not line.startswith("    ")]
    names = [line.split()[0] for line in functions]
    assert names == [name for name in SIGNATURES if name in names]
    assert {"mass_matrix", "forward_dynamics_derivatives", "energy"} <= set(names)
    for line in functions:  # no column is glued to the next
        with row(line):
            assert re.fullmatch(r"  \w+ +(straight|loops) +\d+ operations", line)
    assert len({line.index(" operations") for line in functions}) == 1
    ports = [line for line in lines if line.startswith("    ")]
    words = [re.split("  +", line.strip()) for line in ports]
    assert ["out H", "8 x 8", SIGNATURES["mass_matrix"].outputs[0].meaning] in words
    assert ["in", "q", "9", SIGNATURES["energy"].inputs[0].meaning] in words
    # each last column begins where the others do
    assert len({line.index(last) for line, (*_, last) in zip(ports, words, strict=True)}) == 1
    below = lines.index(functions[names.index("energy")]) + 1
    told = [line.split("  ")[-1].strip() for line in lines[below : below + 4]]
    energy = SIGNATURES["energy"]
    assert told == [port.meaning for port in (*energy.inputs, *energy.outputs)]


def test_info_as_json(run):
    status, out, err = run("info", zoo.folder("m1_n1"), "--json", "-")
    report = json.loads(out)
    assert (status, err, out.count("\n")) == (0, "", 1)
    wanted = {"name": "m1_n1", "real": "double", "segments": 1, "links": 1}
    assert wanted | {"nq": 9, "nv": 8} == {k: report[k] for k in (*wanted, "nq", "nv")}
    assert report["parameters"]["tail_mount"] == [0.0, -0.0405, 0.0045]
    assert report["functions"]["energy"]["inputs"] == {"q": [9], "v": [8]}
    assert report["functions"]["energy"]["outputs"] == {"kinetic": [1], "potential": [1]}


def test_verify_finds_nothing_wrong(run):
    status, out, err = run("verify", zoo.folder("bare"))
    assert (status, besides_progress(err)) == (0, "")
    assert "0 failed" in out and "FAILED" not in out
    status, out, err = run("verify", zoo.folder("bare"), "--json", "-")
    report = json.loads(out)
    assert (status, err, out.count("\n")) == (0, "", 1)
    assert report["passed"] is True and report["counts"]["failed"] == 0
    assert {check["status"] for check in report["checks"]} == {"passed", "not checked"}


def test_failed_check_is_status_1(run, monkeypatch):
    found = [
        verify.Check("a law", "It holds.", 2.0, 1.0, "a state"),
        verify.Check("another", "It holds.", 0.0, 1.0),
    ]
    monkeypatch.setattr(verify, "laws", lambda _: found)
    status, out, err = run("verify", zoo.folder("bare"))
    assert (status, err) == (1, "") and "FAILED" in out
    status, out, err = run("verify", zoo.folder("bare"), "--json", "-")
    assert (status, err) == (1, "") and json.loads(out)["passed"] is False


def test_what_is_no_folder_is_one_line_and_status_2(run, tmp_path):
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


def test_missing_compiler_is_status_2(run, monkeypatch):
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


def test_installed_program(tmp_path):
    beside = Path(sys.executable).parent / "serpentail"
    for program, place, status in [
        ([beside], zoo.folder("bare"), 0),
        ([sys.executable, "-m", "serpentail.cli"], tmp_path, 2),
    ]:
        command = [*program, "info", place, "--json", "-"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        told = besides_progress(done.stderr)
        assert done.returncode == status and bool(done.stdout) != bool(told)
