"""The private copies of models in the cache, from which alone they are compiled."""

import json
import os
import pickle
import shutil

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.targets.write import signed
from tests.support.generations import Q, model_of, put


def test_planted_header_is_not_seen(folder, cache):
    put(folder, model_of(1))
    expected = st.load(folder).mass_matrix(Q)
    shutil.rmtree(cache)
    for place in ("include", "src"):
        (folder / place / "math.h").write_text("#error planted\n")
    np.testing.assert_array_equal(st.load(folder).mass_matrix(Q), expected)
    assert not list(cache.rglob("math.h"))


@pytest.mark.parametrize(
    "damage",
    [
        lambda place: (place / "include" / "math.h").write_text("#error planted\n"),
        lambda place: (place / "src" / "tail.c").write_text("int other;\n"),
        lambda place: (place / "src" / "tail.c").unlink(),
        lambda place: (shutil.rmtree(place), place.write_text("")),
        lambda place: (shutil.rmtree(place), os.mkfifo(place)),
        lambda place: ((place / "src/tail.c").unlink(), os.mkfifo(place / "src" / "tail.c")),
    ],
    ids=["header", "text", "lost", "file", "pipe", "pipe for text"],
)
def test_damaged_snapshot_is_replaced(folder, cache, damage):
    model = st.load(put(folder, model_of(1)))
    (snapshot,) = (cache / "models").iterdir()
    shutil.rmtree(cache / "libraries")
    damage(snapshot)
    np.testing.assert_array_equal(st.load(folder).mass_matrix(Q), model.mass_matrix(Q))
    files = {p.relative_to(snapshot).as_posix() for p in snapshot.rglob("*") if p.is_file()}
    assert files == {*model.checked.files, "manifest.json"}
    assert not list((cache / "parts").iterdir())


@pytest.mark.parametrize("name", ["../outside.c", "/etc/passwd", "src/../../outside.c"])
def test_manifest_that_leads_out_of_its_folder_is_refused(folder, name):
    files, manifest = model_of(1)
    put(folder, (files, manifest))
    (folder.parent / "outside.c").write_text("")
    manifest["files"] |= {name: manifest["files"]["src/tail.c"]}
    (folder / "manifest.json").write_text(json.dumps(signed(manifest)))
    with pytest.raises(st.ModelError, match="leads out of the folder"):
        st.load(folder)


@pytest.mark.parametrize("name", ["manifest.json", "src/tail.c"])
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_what_is_no_file_is_refused_at_once(folder, name, make):
    put(folder, model_of(1))
    (folder / name).unlink()
    make(folder / name)
    with pytest.raises(st.ModelError, match=r"cannot be read \(not a regular file\)"):
        st.load(folder)


def test_snapshots_are_for_the_user_alone(folder, cache):
    put(folder, model_of(1))
    before = os.umask(0)
    try:
        model = st.load(folder)
    finally:
        os.umask(before)
    (snapshot,) = (cache / "models").iterdir()
    assert snapshot.stat().st_mode & 0o777 == 0o700
    np.testing.assert_array_equal(
        pickle.loads(pickle.dumps(model)).mass_matrix(Q), model.mass_matrix(Q)
    )
