"""What cannot be exported is refused by field, value and remedy, and nothing is written; bundles of
equal models have equal bytes, and ``st.load`` takes what is unpacked; FMUs at their limits.
"""

import ctypes
import errno
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

import serpentail as st
from serpentail.bridges.exporting import mjcf
from serpentail.bridges.exporting.fmu import NATIVE
from serpentail.cli import cli, models
from tests.support import zoo
from tests.support.models import model_folder
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
        ((model, "mjcf", "x.urdf"), r"path: value 'x\.urdf': .*\.xml or \.mjcf"),
        ((model, "bundle", "x.tar"), r"path: value 'x\.tar': .*\.zip or \.bundle"),
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
            ("fixed", "kind.*torso that moves"),
            ("motors", "kind.*without rotors.*fmu"),
            ("air", "kind.*without air.*air_density.*fmu"),
        ):
            with row(kind, name), pytest.raises(st.ExportError, match=words):
                st.export(zoo.model(name), kind)
    with pytest.raises(st.ExportError, match=r"kind: value .urdf.: .*without springs.*mjcf"):
        st.export(zoo.model("elastic"), "urdf")
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


# FMUs

DISCARD, ERROR = 2, 3


def test_what_no_fmu_can_be_of(tmp_path):
    # no model of the zoo lacks C
    functions = ["forward_dynamics", "forward_dynamics_derivatives", "rollout"]
    casadi = st.load(model_folder(1, 1, functions=functions, targets=["casadi"]), compiled=False)
    for model, error, words in (
        (zoo.model("fixed"), st.ExportError, "base: value 'fixed' of fixed"),
        (zoo.model("polar"), st.ExportError, "coordinates: value 'polar' of polar.*bend"),
        (zoo.model("single"), st.ExportError, "real: value 'float' of single.*double"),
        (zoo.model("bare"), st.ModelError, "'forward_dynamics_derivatives'.*'rollout'.*functions"),
        (casadi, st.ModelError, '"c".*targets'),
    ):
        with row(model.name), pytest.raises(error, match=words):
            st.export(model, "fmu", tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def status_of(call, *arguments):
    """The status that a call is refused with."""
    with pytest.raises(Exception, match="status") as refused:
        call(*arguments)
    return refused.value.status


def test_calls_that_make_no_sense_are_refused_and_told(fmu, opened):
    with pytest.raises(Exception, match="Failed to instantiate"):
        opened(fmu("m1_n1"), "Model", guid="0")
    one, _, told = opened(fmu("m1_n1"), "Model")
    for call, *arguments in (
        (one.getReal, [10**6]),
        (one.setReal, [20], [0.0]),
        (one.setReal, [10**6], [0.0]),
        (one.getInteger, [0]),
        (one.setBoolean, [0], [1]),
        (one.getDirectionalDerivative, [17], [10**6], [1.0]),
        (one.getDirectionalDerivative, [10**6], [0], [1.0]),
        (one.getDirectionalDerivative, [17], [20], [1.0]),
    ):
        with row(call.__name__, *arguments):
            told.clear()
            assert status_of(call, *arguments) == ERROR
            assert "needs" in told[0] or "Real" in told[0]
    # a state without accelerations is discarded
    told.clear()
    one.setReal([3, 4, 5, 6], [0.0, 0.0, 0.0, 0.0])
    assert status_of(one.getReal, [30]) == DISCARD
    assert "no accelerations" in told[0]
    status_of(one.getDirectionalDerivative, [20], [0], [1.0])
    one.setReal([3], [1.0])
    assert one.getReal([28]) == pytest.approx([-9.8], rel=1e-12)


def test_a_step_that_cannot_be_made_leaves_the_state(fmu, opened):
    one, _, told = opened(fmu("m1_n1"), "Slave")
    references = list(range(17))
    before = one.getReal(references)
    one.setReal([34], [1e300])
    for step in (0.1, 0.0, -1.0, float("nan")):
        assert status_of(one.doStep, 0.0, step) == ERROR
    assert "the motion cannot go on" in told[0] and "communicationStepSize" in told[1]
    assert one.getReal(references) == before
    one.setReal([34], [0.0])
    one.doStep(0.0, 0.25)
    last = ctypes.c_double()
    one.fmi2GetRealStatus(one.component, 2, ctypes.byref(last))
    assert last.value == 0.25


def shown(library):
    command = ["nm", "-D", "--defined-only", str(library)]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return set(re.findall(r" T (\w+)", listed))


def test_libraries_show_the_interface_alone_and_sources_compile_without_a_warning(fmu, tmp_path):
    """Several units in one process share no function; with a prefix the names have it."""
    fmi2 = pytest.importorskip("fmpy.fmi2")
    with zipfile.ZipFile(fmu("ground_m1_n1")) as archive:
        archive.extractall(tmp_path)
    own = shown(tmp_path / "binaries" / "linux64" / "ground_m1_n1.so")
    assert len(own) == 44 and all(name.startswith("fmi2") for name in own)
    asked = dir(fmi2.FMU2Model) + dir(fmi2.FMU2Slave)
    assert {name for name in asked if name.startswith("fmi2")} <= own
    sources = sorted((tmp_path / "sources").glob("*.c"))
    described = Xml.parse(tmp_path / "modelDescription.xml")
    for kind in ("ModelExchange", "CoSimulation"):
        files = described.findall(f"{kind}/SourceFiles/File")
        assert {each.get("name") for each in files} == {path.name for path in sources}
    assert all("-" in path.name for path in NATIVE.iterdir())  # as in no model's name
    library = tmp_path / "unit.so"
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    options = ["-fvisibility=hidden", "-DFMI2_FUNCTION_PREFIX=rat_", "-o", library, "-lm"]
    command = list(map(str, ["cc", *strict, *sources, *options]))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert shown(library) == {f"rat_{name}" for name in own}
    read = ctypes.CDLL(str(library))
    read.rat_fmi2GetVersion.restype = ctypes.c_char_p
    assert read.rat_fmi2GetVersion() == b"2.0"
