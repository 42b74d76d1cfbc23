"""The model that was checked is the model that runs, whatever becomes of its folder."""

import copy
import json
import os
import pickle
import shutil
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from serpentail.model import manifest
from serpentail.simulation.runs import batch as batch_runs
from serpentail_codegen.targets.write import write_folder
from tests.support import zoo
from tests.support.models import model_folder

from ..support.rows import row

Q, V, TAU = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2], [0.5] * 8, [0.1, 0.2]
FUNCTIONS = ["mass_matrix", "forward_dynamics", "energy", "momentum", "rollout"]


def put(folder, links):
    """Write a model called tail, as the zoo has none, to a folder, as the generator does."""
    made = model_folder(1, links, name="tail", functions=FUNCTIONS)
    manifest = json.loads((made / "manifest.json").read_text())
    write_folder(folder, {name: (made / name).read_text() for name in manifest["files"]}, manifest)
    return folder


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "tail"


def test_late_code_is_of_the_model_and_needs_nothing_of_the_cache(folder, cache, monkeypatch):
    """Batches, runs side by side and CasADi functions; what was deleted there is written again."""
    monkeypatch.setattr(batch_runs, "worth_lanes", lambda *_: True)
    rng = np.random.default_rng(4)
    q, v = rng.normal(size=(1000, 9)), rng.normal(size=(1000, 8))
    model = st.load(put(folder, 1))
    put(folder, 2)
    shutil.rmtree(cache)
    expected = [model.forward_dynamics(*state, TAU) for state in zip(q[:9], v[:9], strict=True)]
    found = model.forward_dynamics(q, v, TAU)[:9]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    shutil.rmtree(folder)
    shutil.rmtree(cache)
    settings = {"t_span": 0.01, "method": "rk4", "step": 1e-3, "output_step": 1e-3}
    runs = st.simulate(model, np.tile(Q, (9, 1)), 0.1 * v[:9], **settings)
    assert runs.info["abreast"] == 8
    alone = st.simulate(model, Q, 0.1 * v[8], **settings)
    np.testing.assert_allclose(runs.q[8], alone.q, rtol=0, atol=1e-9)
    for each in (model, model.with_parameters(tail_mass=0.005), copy.deepcopy(model)):
        of_casadi = each.casadi.mass_matrix(Q).full()
        np.testing.assert_allclose(of_casadi, each.mass_matrix(Q), rtol=1e-12, atol=1e-18)


def test_pickle_is_of_the_model_that_was_pickled_and_takes_its_folder_or_none(
    folder, cache, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    put(folder, 1)
    model = st.load("tail", {"tail_mass": 0.005}, profile="reproducible", threads=3)
    pickled, expected = pickle.dumps(model), model.mass_matrix(Q)
    put(folder, 2)
    twin = pickle.loads(pickled)
    np.testing.assert_array_equal(twin.mass_matrix(Q), expected)
    assert (twin.folder, twin.profile, twin.batch_library.threads) == (folder, "reproducible", 3)
    assert twin.parameters == model.parameters
    text = f"import pickle; print(pickle.loads({pickled!r}).mass_matrix({Q}).tobytes().hex())"
    found = subprocess.check_output([sys.executable, "-c", text], text=True, cwd="/")
    assert found.strip() == expected.tobytes().hex()
    # without its snapshot
    put(folder, 1)
    (snapshot,) = (cache / "models").iterdir()
    (snapshot / "src" / "tail.c").write_text("int other;\n")
    assert pickle.loads(pickled).checked.files == model.checked.files
    put(snapshot, 2)
    assert pickle.loads(pickled).checked.files == model.checked.files
    shutil.rmtree(cache / "models")
    np.testing.assert_array_equal(pickle.loads(pickled).mass_matrix(Q), expected)
    shutil.rmtree(cache)
    put(folder, 2)
    with pytest.raises(st.ModelError, match="generated again since the model was pickled"):
        pickle.loads(pickled)
    shutil.rmtree(folder)
    with pytest.raises(st.ModelError, match="is not a generated folder"):
        pickle.loads(pickled)


DAMAGES = [  # of the whole, of a file, and beside it, where no compiler looks
    *(("", lambda path: path.write_text("")), ("", os.mkfifo)),
    *(("src/bare.c", lambda path: path.write_text("int other;\n")), ("src/bare.c", os.mkfifo)),
    *(("src/bare.c", lambda _: None), ("include/math.h", lambda path: path.write_text("#error"))),
]


def test_snapshots_are_for_the_user_alone_and_a_damaged_one_is_replaced(cache, tmp_path):
    folder = shutil.copytree(zoo.folder("bare"), tmp_path / "bare")
    for place in ("include", "src"):
        (folder / place / "math.h").write_text("#error planted\n")
    before = os.umask(0)
    try:
        model, expected = st.load(folder), zoo.model("bare").forward_dynamics(Q, V, TAU)
    finally:
        os.umask(before)
    (snapshot,) = (cache / "models").iterdir()
    assert snapshot.stat().st_mode & 0o777 == 0o700 and not list(cache.rglob("math.h"))
    for k, (name, put_in_place) in enumerate(DAMAGES):
        with row(k, name):
            shutil.rmtree(cache / "libraries")
            path = snapshot / name
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
            put_in_place(path)
            np.testing.assert_array_equal(st.load(folder).forward_dynamics(Q, V, TAU), expected)
            files = {p.relative_to(snapshot).as_posix() for p in snapshot.rglob("*") if p.is_file()}
            assert files - {"include/math.h"} == {*model.checked.files, "manifest.json"}
            assert not list((cache / "parts").iterdir())


def test_a_folder_that_is_exchanged_while_it_is_read(folder, monkeypatch):
    """No mixture of two models, and no charge that somebody changed the files."""
    read, exchanges = manifest.regular_bytes, []

    def exchanging(path):
        if path.name != "manifest.json" and len(exchanges) < most:
            exchanges.append(path)
            put(folder, 1 + len(exchanges) % 2)
        return read(path)

    monkeypatch.setattr(manifest, "regular_bytes", exchanging)
    for most in (1, 4):
        exchanges.clear()
        model = st.load(put(folder, 1), compiled=False)
        assert model.links == 1 + most % 2 and len(exchanges) == most
        assert model.checked.files["src/tail.c"] == (folder / "src" / "tail.c").read_bytes()
    most = 1000
    monkeypatch.setattr(manifest, "MOST_READS", 3)
    with pytest.raises(st.ModelError, match="keeps changing"):
        st.load(folder, compiled=False)
