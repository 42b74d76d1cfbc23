"""The wheel has all that runs, and nothing else."""

import subprocess
import sys

import pytest

from tests.compiling.conftest import program
from tests.packaging.wheels import PAGE, ROOT, faults


@pytest.mark.slow
def test_the_wheel_of_the_sdist_is_whole(tmp_path):
    pytest.importorskip("build")
    command = ["build", "--no-isolation", "--skip-dependency-check", "--outdir", tmp_path, ROOT]
    done = subprocess.run([sys.executable, "-m", *command], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    assert faults(wheel, page=(ROOT / "runtime" / PAGE).exists()) == []


def test_the_hook_keeps_a_page_of_the_same_sources_only(tmp_path, monkeypatch, capsys):
    pytest.importorskip("hatchling")
    from hatch_build import PageHook

    page = tmp_path / "runtime" / PAGE  # of an earlier build, without sources to make it anew
    page.parent.mkdir(parents=True)
    page.write_text("old")
    hook = PageHook(str(tmp_path), {}, None, None, str(tmp_path), "wheel")
    data = {"force_include": {}, "artifacts": []}
    with monkeypatch.context() as later:
        later.setenv("SERPENTAIL_PAGE", "later")
        later.setenv("PATH", "")  # so that nothing is asked for to make it
        hook.initialize("editable", data)
        assert hook.dependencies() == [] and page.read_text() == "old"
        assert data == {"force_include": {}, "artifacts": [f"runtime/{PAGE}"]}
    hook.initialize("standard", data)
    assert not page.exists() and "without the page of runs" in capsys.readouterr().err
    assert (tmp_path / ".build" / "page_missing").read_text().count("\n") == 1  # told by make
    assert data["force_include"] == {str(tmp_path / "scenes"): "serpentail/examples"}
    # npm answers, then not any more: for an sdist, a wheel of it, and one of other sources
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    source = tmp_path / "viewer" / "main.js"
    source.parent.mkdir()
    program(tmp_path / "node", "case $1 in --version) echo v20;; *) echo new > $2;; esac")
    program(tmp_path / "npm", "")
    sdist = PageHook(str(tmp_path), {}, None, None, str(tmp_path), "sdist")
    sdist.initialize("standard", {"artifacts": []})  # whose scenes stay where they are
    program(tmp_path / "npm", "echo no network >&2; exit 1")
    hook.initialize("standard", data)
    assert page.read_text().startswith("new\n") and hook.dependencies() == []
    source.write_text("other")
    hook.initialize("standard", data)
    assert not page.exists() and "of runs: no network" in capsys.readouterr().err
