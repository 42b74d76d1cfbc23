"""What cannot be a page is refused by one clear error, and no file is touched."""

import pytest

import serpentail as st
from serpentail.viewer import view as viewer

from .conftest import flown, model_of


@pytest.mark.parametrize(
    "path, words",
    [
        ("run.png", r"path: value '.*run.png': needs a file whose name ends in .html"),
        ("run", "needs a file whose name ends in .html"),
        (".", "needs a file whose name ends in .html"),
        ("file/run.html", r"path: value '.*run.html': cannot be written"),
    ],
)
def test_paths(tmp_path, flight, path, words):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(st.ViewError, match=words):
        flight.view(tmp_path / path)
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("path", [3, 2.5])
def test_paths_that_are_none(flight, path):
    with pytest.raises(st.ViewError, match=r"path: value .*: needs the name of an .html file"):
        flight.view(path)


@pytest.mark.parametrize(
    "names", ["ab", ["a"], ["a", "a"], ["a", ""], ["a", 1], ["a", "b", "c"], 3]
)
def test_names(tmp_path, flight, names):
    with pytest.raises(st.ViewError, match=r"names: value .*: needs 2 names that differ"):
        st.view([flight, flight], tmp_path / "run.html", names=names)
    assert not list(tmp_path.iterdir())


def test_motions(tmp_path, flight):
    path = tmp_path / "run.html"
    with pytest.raises(st.ViewError, match=r"motions\[1\]: type int: needs a Trajectory"):
        st.view([flight, 3], path)
    with pytest.raises(st.ViewError, match=r"motions\[0\]: type NoneType: needs a Trajectory"):
        st.view(None, path)
    with pytest.raises(st.ViewError, match="motions: none: needs one Trajectory or more"):
        st.view([], path)


def test_models(tmp_path, flight):
    path = tmp_path / "run.html"
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    with pytest.raises(st.ViewError, match=r"motions\[0\]: .*give model=st.load\(folder\)"):
        loaded.view(path)
    with pytest.raises(st.ViewError, match="model: type str: needs a Model"):
        loaded.view(path, model="generated")
    with pytest.raises(st.ViewError, match=r"q has 11 numbers, .* has 9: give its own model"):
        loaded.view(path, model=model_of(1, 2))
    assert not path.exists()


def test_a_model_without_tail_points_says_so_and_leaves_the_page_that_is_there(tmp_path):
    path = tmp_path / "run.html"
    path.write_text("before")
    motion = flown(model_of(1, 1, ("energy", "momentum", "rollout")))
    with pytest.raises(st.ModelError, match="without 'tail_points'"):
        motion.view(path)
    assert path.read_text() == "before"


def test_a_page_that_was_not_built_says_how(tmp_path, flight, monkeypatch):
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    with pytest.raises(st.ViewError, match=r"install Node.js 18 or newer .* `make setup`"):
        flight.view(tmp_path / "run.html")
