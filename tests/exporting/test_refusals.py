"""What cannot be exported is refused by field, value and remedy, and nothing is written; bundles of
equal models have equal bytes, and ``st.load`` takes what is unpacked.
"""

import errno
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.commands import models
from serpentail.exporting import mjcf
from tests.support import zoo
from tests.support.rows import row


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder, which stays empty."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert list(tmp_path.iterdir()) == []


def test_arguments_that_are_wrong(here):
    model = zoo.model("m1_n3")
    for given, words in (
        ((model, "udrf", "x.urdf"), "kind: value 'udrf': .*'urdf'"),
        ((model, None), "kind: value None: .*'urdf' or 'mjcf' or 'bundle' or 'fmu'"),
        ((model, ["urdf"]), r"kind: value \['urdf'\]"),
        (("m1_n3", "urdf"), "model: value 'm1_n3'"),
        ((model, "urdf", "x.xml"), r"path: value 'x\.xml': .*\.urdf"),
        ((model, "mjcf", "x.urdf"), r"path: value 'x\.urdf': .*\.xml"),
        ((model, "urdf", ""), r"path: value '': .*\.urdf"),
        ((model, "urdf", "x.urdf/"), r"path: value 'x\.urdf/': .*\.urdf"),
        ((model, "urdf", 3), "path: value 3: "),
        ((model, "urdf", "a\0.urdf"), r"path: value .*: needs .*\.urdf"),
        ((model, "urdf", "/dev/null/x.urdf"), "path: value .*another file"),
    ):
        with row(given), pytest.raises(st.ExportError, match=words):
            st.export(*given)


def test_files_that_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "x.urdf").mkdir()
    with pytest.raises(st.ExportError, match=r"x\.urdf is a folder"):
        st.export(zoo.model("m1_n3"), "urdf", tmp_path / "x.urdf")

    def full(path, content):
        path.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "y.urdf").write_text("before")
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(st.NotWritten, match="No space left on device"):
        st.export(zoo.model("m1_n3"), "urdf", tmp_path / "y.urdf")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.urdf", "y.urdf"]
    assert (tmp_path / "y.urdf").read_text() == "before"


@pytest.mark.filterwarnings("ignore::serpentail.UnusualSize")
def test_what_no_file_would_say_is_refused(here, monkeypatch):
    model = zoo.model("m1_n3")
    for kind in ("urdf", "mjcf"):
        for name, words in (
            ("arcs1", "kind.*articulated tail.*arcs1.*chain|kind.*articulated tail.*chain.*arcs1"),
            ("polar", "kind.*articulated tail"),
            ("mixed", "kind.*articulated tail"),
            ("elastic", "kind.*springs, damping"),
            ("fixed", "kind.*torso that moves"),
        ):
            with row(kind, name), pytest.raises(st.ExportError, match=words):
                st.export(zoo.model(name), kind)
    for changes, words in (
        ({"link_inertia": (1e-9, 1e-15, 1e-9)}, "inertia of link_1_1: value .* 1e-15"),
        ({"link_inertia": (1e-9, 1e-9, 3e-9)}, "inertia of link_1_1: value"),
        ({"tail_mass": 3e-16}, "mass of link_1_1: value"),
        ({"torso_mass": 1e-15}, "torso_mass: value"),
    ):
        with row(changes), pytest.raises(st.ExportError, match=words):
            st.export(model.with_parameters(**changes), "mjcf")
    monkeypatch.setattr(mjcf, "MOST_LINKS", 11)
    with pytest.raises(st.ExportError, match=r"11 links.* m3_n4 has 12"):
        st.export(zoo.model("m3_n4"), "mjcf")
    monkeypatch.setattr(mjcf, "MOST_LINKS", 12)
    st.export(zoo.model("m3_n4"), "mjcf").unlink()


def test_the_command_exports_tells_the_file_and_refuses_before_the_model_is_made(
    tmp_path, monkeypatch, capsys
):
    model, path = zoo.model("m1_n3"), str(tmp_path / "new" / "rat.urdf")
    assert cli.main(["export", "urdf", str(model.folder), "-o", path, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": path}
    assert Path(path).read_bytes() == st.export(model, "urdf", tmp_path / "x.urdf").read_bytes()
    monkeypatch.chdir(tmp_path)
    assert cli.main(["export", "mjcf", str(model.folder)]) == 0
    assert capsys.readouterr().out == "m1_n3.xml\n" and Path("m1_n3.xml").is_file()
    monkeypatch.setattr(models, "model_of", lambda _: pytest.fail("it was made"))
    assert cli.main(["export", "urdf", "kick", "-o", "kick.xml"]) == 2
    out, error = capsys.readouterr()
    assert out == "" and "kick.xml" in error and ".urdf" in error and not Path("kick.xml").exists()


# Bundles

LOADS = """
import numpy as np, sys, serpentail as st
model = st.load(sys.argv[1], {"tail_mass": 0.004})
rates = model.forward_dynamics(np.linspace(0.1, 1, model.nq), np.ones(8), np.ones(2))
np.save("rates.npy", rates)
"""


def test_a_bundle_is_loaded_by_another_process_with_another_cache(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model = zoo.model("bare")
    path = st.export(model, "bundle")
    name = f"{model.name}-{model.checked.manifest_hash[:16]}"
    assert path.name == f"{name}.zip"
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path / "there")
    assert os.listdir("there") == [name]
    environment = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", LOADS, f"there/{name}"], check=True, env=environment)
    other, q = model.with_parameters(tail_mass=0.004), np.linspace(0.1, 1, model.nq)
    expected = other.forward_dynamics(q, np.ones(8), np.ones(2))
    np.testing.assert_array_equal(np.load("rates.npy"), expected)


def test_equal_models_have_equal_bundles_and_others_none(tmp_path):
    """Whatever the folder, its dates and its rights, and what became of it after it was loaded: a
    model goes on as it was checked.
    """
    model = zoo.model("bare")
    changed, path = model.with_parameters(torso_mass=0.2), tmp_path / "x.zip"
    with pytest.raises(st.ExportError, match=r"torso_mass: value 0\.2: .* 0\.10572"):
        st.export(changed, "bundle", path)
    assert not path.exists()
    first = st.export(model, "bundle", tmp_path / "first.zip")
    with zipfile.ZipFile(first) as archive:
        archive.extractall(tmp_path)
        names = archive.namelist()
    assert names == sorted(names)
    again = tmp_path / names[0].split("/")[0]
    for path in again.rglob("*.c"):
        path.chmod(0o755)
        os.utime(path, (1e9, 1e9))
    copy = st.load(again)
    (again / "manifest.json").write_text("{}")
    second = st.export(copy, "bundle", tmp_path / "second.zip")
    assert first.read_bytes() == second.read_bytes()
