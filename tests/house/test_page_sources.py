"""The sources of the page: short, ours alone, and from no particular registry."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.house.file_lengths import MOST_LINES

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "viewer"
SOURCES = [FOLDER / "build.js", *sorted((FOLDER / "src").iterdir())]
MOST_COLUMNS = 100


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_sources_are_short(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MOST_LINES and max(map(len, lines)) <= MOST_COLUMNS


def test_the_lock_file_has_versions_and_no_addresses():
    lock = json.loads((FOLDER / "package-lock.json").read_text(encoding="utf-8"))
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert "node_modules/three" in packages
    for entry in packages.values():
        assert entry["version"] and entry["integrity"] and "resolved" not in entry
    for path in (*FOLDER.glob("*.*"), FOLDER / ".npmrc"):
        assert "://" not in path.read_text(encoding="utf-8")


def test_what_is_built_is_not_kept():
    built = ["viewer/node_modules/", "runtime/serpentail/viewer/page.html"]
    command = ["git", "check-ignore", *built]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 128:
        pytest.skip("this is no checkout")
    assert done.stdout.split() == built
