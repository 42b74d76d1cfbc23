"""The build's hook makes the page, or leaves it to somebody else."""

import pytest

from hatch_build import PAGE, PageHook


@pytest.fixture
def page(tmp_path):
    """The page of an earlier build, without sources to make it anew."""
    path = tmp_path / PAGE
    path.parent.mkdir(parents=True)
    path.write_text("old")
    return path


def initialized(root, version):
    """A hook of a project, and what it adds to a build."""
    data = {"force_include": {}, "artifacts": []}
    hook = PageHook(str(root), {}, None, None, str(root), "wheel")
    hook.initialize(version, data)
    return hook, data


def test_a_page_that_comes_later_is_left_as_it_is(page, tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_PAGE", "later")
    monkeypatch.setenv("PATH", "")  # so that nothing is asked for to make it
    hook, data = initialized(tmp_path, "editable")
    assert hook.dependencies() == [] and page.read_text() == "old"
    assert data == {"force_include": {}, "artifacts": [PAGE]}


def test_a_page_that_cannot_be_made_is_gone_and_the_build_goes_on(page, tmp_path, capsys):
    _, data = initialized(tmp_path, "standard")
    assert not page.exists() and "without the page of runs" in capsys.readouterr().err
    assert data["force_include"] == {str(tmp_path / "scenes"): "serpentail/examples"}
