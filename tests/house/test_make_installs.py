"""What make installs, by what, and when."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.makes import away_from_make

ROOT = Path(__file__).resolve().parents[2]
DRAWS, PAGE, REST = "plan,plot", "", "dev,peers"  # extras of what is installed, in their order


@pytest.fixture
def tree(tmp_path):
    """A folder with nothing but what make reads."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy2(ROOT / name, tmp_path)
    (tmp_path / ".venv").mkdir()
    return tmp_path


def planned(tree, target, **more):
    """What make would do for a target, away from a make that runs these tests and its choices."""
    command = ["make", "-n", target]
    done = subprocess.run(
        command, cwd=tree, env=away_from_make() | more, capture_output=True, text=True, check=True
    )
    return done.stdout


def installed(tree, target):
    """What make would install, once each: nothing was made when it calls itself."""
    told = planned(tree, target, UV="")
    found = re.findall(r"install .*--editable (?:'\.\[(.*)\]'|\.)", told)
    return list(dict.fromkeys(found))


def test_each_target_installs_what_it_uses(tree):
    assert installed(tree, "demo") == [DRAWS, PAGE]
    assert installed(tree, "test") == [DRAWS, REST]
    (tree / ".venv" / ".draws").touch()
    assert installed(tree, "demo") == [PAGE]
    assert installed(tree, "setup") == [REST]


def test_the_page_does_not_keep_the_first_picture_waiting(tree):
    told = planned(tree, "demo", UV="")
    first, picture, page = map(told.index, ("SERPENTAIL_PAGE=later", "demo.py", "--no-deps"))
    assert first < picture < page


def test_uv_installs_where_it_is_on_path(tree):
    programs = tree / "programs"
    programs.mkdir()
    (programs / "uv").write_text("#!/bin/sh\n")
    (programs / "uv").chmod(0o755)
    own = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    told = planned(tree, "demo", **own)
    assert f"{programs}/uv venv" in told and " -m venv" not in told
    assert f"{programs}/uv pip install" in told and " -m pip" not in told
    without = planned(tree, "demo", UV="", **own)
    assert " -m venv .venv" in without and " -m pip install" in without
