"""The house rules that a machine can check: who imports what, how large things are, what the
project says of itself; and make, which builds what is asked for, once.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import serpentail
import serpentail_codegen
from checks.mutants import results, sample
from checks.mutants.recorded import NO_JUDGES
from tests.house import file_lengths
from tests.support.makes import away_from_make, stand_in
from tests.support.rows import row

CODEGEN, RUNTIME = (Path(package.__file__).parent for package in (serpentail_codegen, serpentail))
ROOT = Path(__file__).parents[2]
VIEWER = ROOT / "viewer"


def test_import_contracts_hold():
    pytest.importorskip("importlinter")
    command = [Path(sys.executable).with_name("lint-imports"), "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"Contracts: [4-9] kept, 0 broken", done.stdout)


def test_only_the_mechanics_import_sympy_and_only_templating_jinja2():
    def importing(library):
        lines = re.compile(rf"^ *(?:import|from) {library}\b", re.MULTILINE)
        paths = (path for package in (CODEGEN, RUNTIME) for path in package.rglob("*.py"))
        return [path for path in paths if lines.search(path.read_text())]

    assert {path.parent for path in importing("sympy")} == {CODEGEN / "mechanics"}
    assert [path.stem for path in importing("jinja2")] == ["templating"]


def test_files_are_short():
    assert file_lengths.main() == 0
    for path in [VIEWER / "build.js", *(VIEWER / "src").rglob("*.*")]:
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= file_lengths.MOST_LINES and max(map(len, lines)) <= 100, path.name
    for path in CODEGEN.rglob("*.jinja"):
        with row(path.name):
            lines = path.read_text().splitlines()
            assert len(lines) <= 120
            numbers = [line for line in lines if re.search(r"%\.\d+[feg]", line)]
            assert all("printf" in line for line in numbers)


def test_package_changelog_and_citation_have_one_version():
    version = serpentail.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", version) and version == serpentail_codegen.__version__
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    releases = re.findall(r"^## \[(\S+)\](?: - (\S+))?$", text, re.MULTILINE)
    assert releases[0] == ("Unreleased", "") and all(date for _, date in releases[1:])
    assert releases[1][0] == version
    notes = f"docs/release_notes/{version}.md"
    assert f"({notes})" in text and (ROOT / notes).exists()
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    keys = ("version", "date-released")
    told = [re.search(rf"^{k}: \"?(.*?)\"?$", citation, re.MULTILINE)[1] for k in keys]
    assert tuple(told) == releases[1]
    builder = pytest.importorskip("hatchling.builders.sdist").SdistBuilder(str(ROOT))
    files = {file.distribution_path for file in builder.recurse_included_files()}
    assert {"CITATION.cff", "CHANGELOG.md", notes} <= files


def test_mutants_that_are_argued_away_are_those_of_lines_that_are_there():
    for entry in results.arguments():
        with row(entry):
            of_file = sample.of_file(ROOT, entry["file"])
            assert any(results.argument(mutation, [entry]) for mutation in of_file)
    assert all((ROOT / name).is_file() for name in NO_JUDGES)


NAME = "articulated_m1_n1_fc4a05d"  # of these functions
ORDER = ("TAIL=articulated", "M=1", "N=1", "FUNCTIONS=mass_matrix")


@pytest.mark.slow
def test_what_is_there_is_not_made_again_and_what_was_lost_is(tmp_path):
    """In a copy of what make builds from, away from a make that runs these tests."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy2(ROOT / name, tmp_path)
    for name in ("codegen", "scenes"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    stand_in(tmp_path)
    own = {name: value for name, value in away_from_make().items() if name != "CC"}
    own |= {"PYTHONPATH": str(tmp_path / "codegen"), "LC_ALL": "C", "UV": ""}

    def make(**more):
        command = ["make", "model", "TAIL=articulated", "M=1", "N=1", "FUNCTIONS=mass_matrix"]
        return subprocess.run(
            command, cwd=tmp_path, env=own | more, capture_output=True, text=True, check=False
        )

    failed = make(CC="no-such-cc", SERPENTAIL_CACHE=str(tmp_path / "cache"))
    assert failed.returncode == 2 and "CC='no-such-cc'" in failed.stderr
    first, name = make(), "articulated_m1_n1_fc4a05d"  # of these functions
    assert first.returncode == 0 and f"{name}: 1 x 1 links" in first.stdout
    folder = tmp_path / "generated" / name
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    assert re.fullmatch(rf"generated/{name}: up to date, \d+\.\d\d s\n", make().stdout)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    readme = (folder / "README.md").read_bytes()
    (folder / "README.md").unlink()
    assert "1 files written" in make().stdout
    assert (folder / "README.md").read_bytes() == readme


UV = """#!/bin/sh
case $SERPENTAIL_PAGE in later) exit;; esac
exec {} -c 'import os; from hatch_build import PageHook
PageHook(os.getcwd(), {{}}, None, None, "", "wheel").initialize("editable", {{"artifacts": []}})'
"""
NODE = "case $1 in --version) echo v20.1.0;; *) echo page > $2;; esac"
NPM = "echo 'npm error code E403' >&2; echo 'npm error  403 Forbidden' >&2; exit 1"


def test_why_there_is_no_page_is_told_in_a_line_and_it_is_tried_again(tmp_path):
    """Installers hide what a hook of the build tells."""
    pytest.importorskip("hatchling")
    for name in ("Makefile", "pyproject.toml", "hatch_build.py"):
        shutil.copy2(ROOT / name, tmp_path)
    for name in ("viewer", "runtime/serpentail/show/page", "bin"):
        (tmp_path / name).mkdir(parents=True)
    stand_in(tmp_path)
    stamps = {name: tmp_path / ".venv" / f".{name}" for name in ("draws", "paged", "ready")}
    stamps["paged"].unlink()
    stamps["ready"].unlink()

    def program(name, text):
        (tmp_path / "bin" / name).write_text(text if text[0] == "#" else f"#!/bin/sh\n{text}\n")
        (tmp_path / "bin" / name).chmod(0o755)

    for name, text in {"uv": UV.format(sys.executable), "node": NODE, "npm": NPM}.items():
        program(name, text)
    own = away_from_make() | {"LC_ALL": "C", "PATH": f"{tmp_path}/bin:{os.environ['PATH']}"}

    def told():
        command = ["make", "-s", "setup", "UV=uv"]
        said = subprocess.run(command, cwd=tmp_path, env=own, capture_output=True, check=True)
        return said.stdout.decode()

    for _ in range(2):
        reason = "npm error code E403 npm error 403 Forbidden"
        assert re.fullmatch(f"no page of runs, .*npm: {reason}\n", told())
        assert stamps["ready"].exists() and not stamps["paged"].exists()
    program("npm", "exit 0")
    assert told() == "" and stamps["paged"].exists()
    page = tmp_path / "runtime/serpentail/show/page/page.html"
    page.unlink()
    assert told() == "" and not page.exists()  # what was made is not made again
