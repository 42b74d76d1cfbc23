"""The house rules that a machine can check: who imports what, how large things are, what the
project says of itself.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import serpentail
import serpentail_codegen
from checks.mutants import results, sample
from checks.mutants.recorded import NO_JUDGES
from tests.house import file_lengths
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
