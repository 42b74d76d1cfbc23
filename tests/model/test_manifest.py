"""Generated folders: what does not fit together is refused with its name and the way out."""

import json
import os
import pickle
import shutil

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.targets.write import signed
from tests.support import zoo
from tests.support.models import folder_of

from ..support.rows import row


@pytest.fixture
def folder(tmp_path):
    return shutil.copytree(zoo.folder("bare"), tmp_path / "bare")


def edit(folder, change=lambda manifest: manifest, **changes):
    """Change entries of the manifest, then the whole; None removes an entry."""
    path = folder / "manifest.json"
    manifest = {k: v for k, v in (json.loads(path.read_text()) | changes).items() if v is not None}
    path.write_text(json.dumps(change(manifest)))


def refused(folder, *words):
    with pytest.raises(st.ModelError) as caught:
        st.load(folder)
    for word in map(str, words):
        assert word in str(caught.value)


def test_intact_copy_and_settings_of_load(folder):
    edit(folder, lambda manifest: dict(sorted(manifest.items())))  # the same, laid out anew
    assert st.load(str(folder)).name == "bare"
    for name, value in (("compiled", 1), ("threads", 0), ("threads", True), ("profile", "quick")):
        with row(name), pytest.raises(st.SerpentailError, match=f"{name}: value '?{value}"):
            st.load(folder, **{name: value})
    scene, libraries = json.loads((folder / "manifest.json").read_text())["scene"], set()
    for profile in ("fast", "reproducible"):  # the scene's, unless one is asked for
        edit(folder, signed, scene=scene | {"profile": profile})
        found = st.load(folder)
        assert found.profile == profile
        libraries.add(found.library._name)
    assert len(libraries) == 2 and st.load(folder, profile="fast").library._name in libraries
    assert st.load(folder, profile="fast").profile == "fast"


def test_damaged_stale_and_changed_manifests_are_named(folder):
    path = folder / "manifest.json"
    whole, changed = path.read_text(), f"{path} was changed after it was generated"
    for text in ("", "{", "[]", "{}", "null", '{"format": 2}', "\xff", whole[:-100]):
        with row(text[:20]):
            path.write_text(text, encoding="latin-1")
            refused(folder, f"{path} is damaged (", "generate it again")
    keys = ("format", "generator", "abi_hash", "prefix", "real", "scene", "dimensions")
    more = ("parameters", "functions", "work", "batch", "files", "manifest_hash")
    rows = [({key: None}, ("manifest.json is damaged (", key)) for key in (*keys, *more)]
    now = (f"{folder} is stale", f"format 2, {st.__version__}", "generate it again")
    rows += [
        ({"generator": "0.0.9"}, (*now, "format 2, generator 0.0.9")),
        ({"format": 1}, (*now, "format 1, ")),
        ({"generator": "0.9", "parameters": None}, now),
        ({"dimensions": {"segments": 2}}, (changed, "parameters=...")),
        ({"work": {"x": 1}}, (changed, "parameters=...")),
    ]
    for changes, words in rows:
        with row(changes):
            path.write_text(whole)
            edit(folder, **changes)
            refused(folder, *words)


def test_changed_missing_and_strange_files_are_named(folder):
    held = folder / "held"
    for name in (
        "manifest.json",
        "src/bare.c",
        "src/bare_host.c",
        "include/bare.h",
        "bare_casadi.py",
    ):
        path = folder / name
        path.rename(held)
        puts = [(make, "cannot be read (not a regular file)") for make in (os.mkfifo, os.mkdir)]
        if name != "manifest.json":
            edited = held.read_text() + " "
            puts.append((lambda path, text=edited: path.write_text(text), "was changed after it"))
            puts.append((lambda _: None, "cannot be read (No such file"))
        for put, words in puts:
            with row(name, words):
                put(path)
                refused(folder, f"{path} {words}", f"delete {folder}")
                path.rmdir() if path.is_dir() else path.unlink(missing_ok=True)
        held.rename(path)
    assert st.load(folder).name == "bare"


def test_folders_that_are_none_or_lead_out_and_code_that_is_not_theirs(folder, monkeypatch):
    for place in ("nowhere", "bare/src", "bare/manifest.json"):
        with row(place):
            path = folder.parent / place
            refused(path, f"{path} is not a generated", "make model")
    with pytest.raises(st.ModelError, match="folder: value 3"):
        st.load(3)
    (folder.parent / "outside.c").write_text("")
    files = json.loads((folder / "manifest.json").read_text())["files"]
    for name in ("../outside.c", "/etc/passwd", "src/../../outside.c", "a\0"):
        with row(name):
            edit(folder, signed, files=files | {name: files["src/bare.c"]})
            refused(folder, "leads out of the folder")
    edit(folder, signed, files=files, abi_hash="0123456789abcdef")
    refused(folder, "the manifest 0123456789abcdef", f"delete {folder}")
    foreign = folder / "foreign.so"
    foreign.write_text("of another machine")
    monkeypatch.setattr("serpentail.model.library.model_library", lambda *_: foreign)
    with pytest.raises(st.SerpentailError, match=r"foreign\.so.*set SERPENTAIL_CACHE"):
        st.load(folder)


Q = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2]
STATE = Q, [0.5] * 8, [0.1, 0.2]


def test_models_of_one_target_evaluate_what_is_there(monkeypatch, tmp_path):
    names, both = ["forward_dynamics", "rollout"], zoo.model("bare")
    symbolic = folder_of(zoo.scene("bare", functions=names, targets=["casadi"]))
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "file" / "cache"))
    (tmp_path / "file").touch()
    names = sorted(path.name for path in symbolic.iterdir())
    assert names == ["bare_casadi.py", "manifest.json"]
    for folder in (zoo.folder("bare"), symbolic):
        model = pickle.loads(pickle.dumps(st.load(folder, compiled=False)))
    assert model.generated == ("forward_dynamics",)
    found = model.casadi.forward_dynamics(*STATE).full()[:, 0]
    np.testing.assert_allclose(found, both.forward_dynamics(*STATE), rtol=1e-12)
    assert isinstance(model.casadi.symbolic("forward_dynamics"), casadi.Function)
    for call in (
        lambda: st.load(symbolic),
        lambda: model.forward_dynamics(*STATE),
        lambda: model.casadi.external("forward_dynamics"),
        lambda: st.simulate(model, *STATE[:2]),
        lambda: st.plan(model, start=STATE[:2], duration=1.0),
        lambda: model.step(*STATE, 1e-3),
    ):
        with pytest.raises(st.ModelError, match=r"bare was .*compiled=False"):
            call()
    with pytest.raises(st.ModelError, match=r'without C.*"c" to `targets`'):
        st.load(symbolic)
    plain = folder_of(zoo.scene("bare", targets=["c"]))
    assert not list(plain.glob("*.py")) and "_casadi.py" not in (plain / "README.md").read_text()
    monkeypatch.undo()
    model, expected = st.load(plain), both.forward_dynamics(*STATE)
    np.testing.assert_array_equal(model.forward_dynamics(*STATE), expected)
    compiled = model.casadi.external("forward_dynamics", folded=True)
    np.testing.assert_array_equal(compiled(*STATE).full()[:, 0], expected)
    own = ("external", "parameter_names", "parameter_vector", "symbolic")
    assert dir(model.casadi) == [*own]
    for call in (
        lambda: model.casadi.forward_dynamics,
        lambda: model.casadi.symbolic("forward_dynamics"),
    ):
        with pytest.raises(st.ModelError, match=r'without CasADi .*"casadi" to `targets`'):
            call()
    for path in plain.rglob("*.[ch]"):
        with row(path):
            assert path.read_text() == (zoo.folder("bare") / path.relative_to(plain)).read_text()
