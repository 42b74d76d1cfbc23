"""Generated folders: what does not fit together is refused with its name and the way out."""

import json
import os
import shutil

import pytest

import serpentail as st
from serpentail_codegen.targets.write import signed
from tests.support import zoo

from ..support.rows import row


@pytest.fixture
def folder(tmp_path):
    """A copy of the smallest model, to break."""
    return shutil.copytree(zoo.folder("bare"), tmp_path / "bare")


def edit(folder, change=lambda manifest: manifest, **changes):
    """Change entries of the manifest, then the whole; None removes an entry."""
    path = folder / "manifest.json"
    manifest = {k: v for k, v in (json.loads(path.read_text()) | changes).items() if v is not None}
    path.write_text(json.dumps(change(manifest)))


def refused(folder, *words):
    """Check that a folder is refused with words."""
    with pytest.raises(st.ModelError) as caught:
        st.load(folder)
    for word in map(str, words):
        assert word in str(caught.value)


def test_intact_copy_loads(folder):
    assert st.load(folder).name == st.load(str(folder)).name == "bare"
    edit(folder, lambda manifest: dict(sorted(manifest.items())))  # the same, laid out anew
    assert st.load(folder).name == "bare"


def test_folder_without_manifest_says_how_to_make_one(folder, tmp_path):
    for place in ("nowhere", "bare/src", "bare/manifest.json"):
        with row(place):
            refused(tmp_path / place, f"{tmp_path / place} is not a generated", "make model")
    with pytest.raises(st.ModelError, match="folder: value 3"):
        st.load(3)


def test_settings_of_load_are_checked(folder):
    for name, value in (("compiled", 1), ("threads", 0), ("threads", True)):
        with row(name), pytest.raises(st.ModelError, match=f"{name}: value {value}"):
            st.load(folder, **{name: value})


def test_damaged_manifest(folder):
    path = folder / "manifest.json"
    half = path.read_text()[:-100]
    for text in ("", "{", "[]", "{}", "null", '{"format": 2}', "\xff", half):
        with row(text[:20]):
            path.write_text(text, encoding="latin-1")
            refused(folder, f"{path} is damaged (", "generate it again")


def test_manifest_without_an_entry(folder):
    whole = (folder / "manifest.json").read_text()
    for key in (
        *("format", "generator", "abi_hash", "prefix", "real", "scene", "dimensions", "parameters"),
        *("functions", "work", "batch", "files", "manifest_hash"),
    ):
        with row(key):
            (folder / "manifest.json").write_text(whole)
            edit(folder, **{key: None})
            refused(folder, "manifest.json is damaged (", key)


def test_folder_of_another_generator_is_stale(folder):
    whole = (folder / "manifest.json").read_text()
    for change in ({"generator": "0.0.9"}, {"format": 1}, {"generator": "0.9", "parameters": None}):
        with row(change):
            (folder / "manifest.json").write_text(whole)
            edit(folder, **change)
            made, now = f"format {change.get('format', 2)}, ", f"format 2, {st.__version__}"
            refused(folder, f"{folder} is stale", made, now, "generate it again")


def test_changed_missing_and_strange_files_are_named(folder):
    for name in ("src/bare.c", "src/bare_host.c", "include/bare.h", "bare_casadi.py"):
        path = folder / name
        text = path.read_text()
        with row(name):
            path.write_text(text + " ")
            refused(folder, f"{path} was changed after it was generated", f"delete {folder}")
            path.unlink()
            refused(folder, f"{path} cannot be read (No such file", f"delete {folder}")
            path.write_text(text)
    for name in ("manifest.json", "src/bare.c"):
        path = folder / name
        text = path.read_text()
        for make in (os.mkfifo, os.mkdir):
            with row(name, make):
                path.unlink()
                make(path)
                refused(folder, "cannot be read (not a regular file)")
                (os.rmdir if make is os.mkdir else os.unlink)(path)
                path.write_text(text)
    assert st.load(folder).name == "bare"


def larger(manifest):
    """The tail of a segment more: what C then reads lies beyond the arrays it is given."""
    sizes = manifest["dimensions"]
    more = {"segments": 2, "nq": sizes["nq"] + 2, "nv": sizes["nv"] + 2}
    return manifest | {"dimensions": sizes | more}


def heavier(manifest):
    """Another default of a parameter."""
    manifest["parameters"][1]["default"] *= 2
    return manifest


def test_manifest_changed_by_hand_is_named(folder):
    path = folder / "manifest.json"
    whole = path.read_text()
    for change in (larger, heavier, lambda manifest: manifest | {"work": {"x": 1}}):
        with row(change):
            path.write_text(whole)
            edit(folder, change)
            refused(folder, f"{path} was changed after it was generated", "parameters=...")


def test_manifest_that_leads_out_of_its_folder_is_refused(folder):
    (folder.parent / "outside.c").write_text("")
    files = json.loads((folder / "manifest.json").read_text())["files"]
    for name in ("../outside.c", "/etc/passwd", "src/../../outside.c", "a\0"):
        with row(name):
            edit(folder, signed, files=files | {name: files["src/bare.c"]})
            refused(folder, "leads out of the folder")


def test_manifest_of_other_code(folder):
    edit(folder, signed, abi_hash="0123456789abcdef")
    refused(folder, "the manifest 0123456789abcdef", f"delete {folder}")


def test_profile_is_the_scene_s_unless_one_is_asked_for(folder):
    scene = json.loads((folder / "manifest.json").read_text())["scene"]
    for profile in ("fast", "reproducible"):
        edit(folder, signed, scene=scene | {"profile": profile})
        assert st.load(folder).profile == profile
    assert st.load(folder, profile="fast").profile == "fast"


def test_library_that_cannot_be_loaded(folder, monkeypatch):
    foreign = folder / "foreign.so"
    foreign.write_text("of another machine")
    monkeypatch.setattr("serpentail.model.library.model_library", lambda *_: foreign)
    with pytest.raises(st.SerpentailError, match=r"foreign\.so.*set SERPENTAIL_CACHE"):
        st.load(folder)
