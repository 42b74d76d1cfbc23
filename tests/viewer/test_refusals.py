"""What cannot be a page is refused by one clear error, and no file is touched."""

import pytest

import serpentail as st
from serpentail.viewer import view as viewer
from tests.support import zoo
from tests.support.rows import row

from .conftest import silent


def test_paths_and_names(tmp_path, flight):
    file = tmp_path / "file"
    file.write_text("no folder")
    for path, words in (
        (tmp_path / "run.png", r"run\.png.*\.html"),
        (tmp_path / "run", r"run.*\.html"),
        (tmp_path, r"\.html"),
        (file / "run.html", r"run\.html.*not.*written|run\.html.*cannot be written"),
        (3, r"3.*\.html"),
        (2.5, r"2\.5.*\.html"),
    ):
        with row(path), pytest.raises(st.ViewError, match=rf"path: value .*{words}"):
            flight.view(path)
    for names in ("ab", ["a"], ["a", "a"], ["a", ""], ["a", 1], ["a", "b", "c"], 3):
        with row(names), pytest.raises(st.ViewError, match=r"names: value .* 2 "):
            st.view([flight, flight], tmp_path / "run.html", names=names)
    assert list(tmp_path.iterdir()) == [file]


def test_motions_and_models(tmp_path, flight):
    path = tmp_path / "run.html"
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    for motions, model, words in (
        ([flight, 3], None, r"motions\[1\]: type int"),
        (None, None, r"motions\[0\]: type NoneType"),
        ([], None, "motions: none"),
        (loaded, None, r"motions\[0\]: .*model"),
        (loaded, "generated", "model: type str"),
        (loaded, zoo.model("m1_n3"), r"motions\[0\]: .*11 .*m1_n3 .*9"),
    ):
        with row(words), pytest.raises(st.ViewError, match=words):
            st.view(motions, path, model=model)
    assert not path.exists()


def test_the_page_that_is_there_stays_and_one_that_was_not_built_says_how(
    tmp_path, flight, monkeypatch
):
    path = tmp_path / "run.html"
    path.write_text("before")
    with pytest.raises(st.ModelError, match="tail_points"):
        silent().view(path)
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    with pytest.raises(st.ViewError, match=r"Node\.js 18 .*make setup"):
        flight.view(path)
    assert path.read_text() == "before"
