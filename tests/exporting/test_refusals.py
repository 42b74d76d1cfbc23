"""What cannot be exported is refused by field, value and remedy, and nothing is written."""

import errno
import json
from pathlib import Path

import pytest

import serpentail as st
from serpentail import cli
from serpentail.commands import models
from serpentail_codegen.scene.parse import parse_scene
from tests.support.models import folder_of, model_folder

OPTIONS = {"functions": ["energy"]}


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(1, 2, **OPTIONS), compiled=False)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder, which stays empty."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("udrf", "kind: value 'udrf': did you mean 'urdf'?"),
        (None, "kind: value None: needs 'urdf' or 'mjcf' or 'bundle' or 'fmu'"),
        (["urdf"], "kind: value ['urdf']: needs 'urdf'"),
    ],
)
def test_an_unknown_kind(model, here, kind, words):
    with pytest.raises(st.ExportError) as refused:
        st.export(model, kind, "x.urdf")
    assert words in str(refused.value)


@pytest.mark.parametrize("value", [None, "articulated_m1_n2", 3])
def test_no_model(here, value):
    with pytest.raises(st.ExportError, match=r"model: value .*: needs a model, as st\.load"):
        st.export(value, "urdf")


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("x.xml", "needs a file whose name ends in .urdf"),
        ("x", "needs a file whose name ends in .urdf"),
        ("", "needs a file whose name ends in .urdf"),
        ("x.urdf/", "needs a file whose name ends in .urdf"),
        (3, "value 3: "),
        ("a\0.urdf", "needs a file whose name ends in .urdf"),
        ("/dev/null/x.urdf", "name another file"),
    ],
)
def test_a_path_that_is_no_file_of_the_kind(model, here, path, words):
    with pytest.raises(st.ExportError, match="path: value ") as refused:
        st.export(model, "urdf", path)
    assert words in str(refused.value)


def test_a_folder_of_that_name(model, tmp_path):
    (tmp_path / "x.urdf").mkdir()
    with pytest.raises(st.ExportError, match=r"x\.urdf is a folder: name another file"):
        st.export(model, "urdf", tmp_path / "x.urdf")


def test_a_folder_that_takes_no_files(model):
    with pytest.raises(st.NotWritten, match=r"'/proc/x\.urdf' is not written"):
        st.export(model, "urdf", "/proc/x.urdf")


def test_a_full_disk_leaves_what_was_there(model, tmp_path, monkeypatch):
    (tmp_path / "x.urdf").write_text("before")

    def full(path, content):
        path.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(st.NotWritten, match="No space left on device"):
        st.export(model, "urdf", tmp_path / "x.urdf")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("x.urdf", "before")]


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
@pytest.mark.parametrize("coordinates", ["bend", "polar"])
def test_a_continuum_is_no_chain_of_links(kind, coordinates, here):
    folder = model_folder(1, None, coordinates=coordinates, **OPTIONS)
    with pytest.raises(st.ExportError) as refused:
        st.export(st.load(folder, compiled=False), kind)
    assert f"kind: value '{kind}': needs an articulated tail" in str(refused.value)
    assert "is not a chain" in str(refused.value)
    assert 'generate a scene with kind = "articulated"' in str(refused.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [("link_inertia", (1e-9, 1e-16, 1e-9)), ("link_inertia", (1e-9, 1e-9, 3e-9))],
)
def test_inertia_that_mujoco_does_not_take(model, here, name, value):
    changed = model.with_parameters(**{name: value})
    with pytest.raises(st.ExportError, match=r"inertia of link_1_1: value .* more than 1e-15"):
        st.export(changed, "mjcf")


def test_more_links_than_mujoco_reads(here):
    long = st.load(
        model_folder(1, 481, **OPTIONS), {"link_inertia": (1e-9, 1e-9, 1e-9)}, compiled=False
    )
    with pytest.raises(st.ExportError, match=r"needs 480 links or fewer.* has 481: export"):
        st.export(long, "mjcf")


# The command


def test_the_command_exports_and_tells_the_file(model, tmp_path, capsys):
    path = str(tmp_path / "new" / "rat.urdf")
    assert cli.main(["export", "urdf", str(model.folder), "-o", path, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": path}
    assert Path(path).read_bytes() == st.export(model, "urdf", tmp_path / "x.urdf").read_bytes()


def test_the_command_names_the_file_after_the_model(model, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["export", "mjcf", str(model.folder)]) == 0
    assert capsys.readouterr().out == "articulated_m1_n2.xml\n"
    assert Path("articulated_m1_n2.xml").is_file()


def test_the_command_refuses_a_file_before_the_model_is_made(monkeypatch, capsys, here):
    monkeypatch.setattr(models, "model_of", lambda _: pytest.fail("it was made"))
    assert cli.main(["export", "urdf", "kick", "-o", "kick.xml"]) == 2
    out, error = capsys.readouterr()
    assert out == "" and "needs a file whose name ends in .urdf" in error


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"parameters": {"tail_stiffness": 0.02}}, "a tail without springs, damping and stops"),
        ({"base": "fixed"}, "a torso that moves"),
    ],
    ids=["passive", "fixed"],
)
def test_what_no_file_would_say_is_refused(kind, keys, words, here):
    table = {"kind": "articulated", "segments": 1, "links": 2, "functions": ["mass_matrix"]}
    model = st.load(folder_of(parse_scene(table | keys, "tail")), compiled=False)
    with pytest.raises(st.ExportError, match=words):
        st.export(model, kind, here / "tail.xml" if kind == "mjcf" else here / "tail.urdf")
