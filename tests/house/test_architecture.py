"""The house rules that a machine can check: who imports what, how large things are, what the
project says of itself.
"""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import serpentail
import serpentail_codegen
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


def imported(path):
    """Names of the top-level packages that a module imports anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.split(".")[0]


def test_only_the_mechanics_import_sympy_and_only_templating_jinja2():
    uses = [(path, {*imported(path)}) for p in (CODEGEN, RUNTIME) for path in p.rglob("*.py")]
    assert {path.parent for path, names in uses if "sympy" in names} == {CODEGEN / "mechanics"}
    assert {path.stem for path, names in uses if "jinja2" in names} == {"templating"}


def test_files_are_short_and_a_longer_one_is_refused(tmp_path):
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "long.py").write_text("x = 1\n" * (file_lengths.MOST_LINES + 1))
    (tmp_path / "room" / "short.py").write_text("x = 1\n" * file_lengths.MOST_LINES)
    (complaint,) = file_lengths.too_long(tmp_path)
    assert "long.py: 301 lines" in complaint
    assert file_lengths.main() == 0
    for path in [VIEWER / "build.js", *(VIEWER / "src").iterdir()]:
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= file_lengths.MOST_LINES and max(map(len, lines)) <= 100, path.name


def test_templates_are_short_and_print_no_numbers_of_their_own():
    for path in CODEGEN.rglob("*.jinja"):
        with row(path.name):
            lines = path.read_text().splitlines()
            assert len(lines) <= 120
            printed = [line for line in lines if re.search(r"%\.\d+[feg]", line)]
            assert all("printf" in line for line in printed)


def test_the_pages_lock_file_has_versions_and_no_addresses():
    lock = json.loads((VIEWER / "package-lock.json").read_text(encoding="utf-8"))
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert "node_modules/three" in packages
    for entry in packages.values():
        assert entry["version"] and entry["integrity"] and "resolved" not in entry
    for path in (*VIEWER.glob("*.*"), VIEWER / ".npmrc"):
        assert "://" not in path.read_text(encoding="utf-8")


def test_what_is_built_is_not_kept():
    built = ["viewer/node_modules/", "runtime/serpentail/viewer/page.html"]
    command = ["git", "check-ignore", *built]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 128:
        pytest.skip("this is no checkout")
    assert done.stdout.split() == built


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
    told = {k: re.search(rf"^{k}: \"?(.*?)\"?$", citation, re.MULTILINE)[1] for k in RELEASED}
    assert tuple(told.values()) == releases[1]


RELEASED = ("version", "date-released")  # keys of the citation


def test_sdist_has_the_citation():
    builder = pytest.importorskip("hatchling.builders.sdist").SdistBuilder(str(ROOT))
    files = {file.distribution_path for file in builder.recurse_included_files()}
    notes = f"docs/release_notes/{serpentail.__version__}.md"
    assert {"CITATION.cff", "CHANGELOG.md", notes} <= files
