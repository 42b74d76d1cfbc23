"""The model that was checked is the model that runs, whatever becomes of its folder."""

import copy
import importlib.util
import os
import pickle
import py_compile
import shutil
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import parallel_runs
from tests.support.generations import FUNCTIONS, Q, agree, model_of, put, texts

STATES = 3000
RACE_S = 4.0  # s that loads and generations of one folder go on
RACERS = 8


def padded(links):
    """A model whose CasADi functions are a file of a certain length."""
    files, manifest = model_of(links)
    name = "tail_casadi.py"
    return files | {name: files[name].ljust(60_000, "#")}, manifest


def states():
    rng = np.random.default_rng(4)
    q, v = rng.normal(size=(STATES, 9)), rng.normal(size=(STATES, 8))
    return q, v, 1e-4 * rng.normal(size=(STATES, 2))


@pytest.fixture(autouse=True)
def bytecode(monkeypatch):
    """Let Python keep what it compiles, as it does for a user."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(sys, "pycache_prefix", None)


# Python's bytecode


def test_casadi_functions_are_of_their_text_when_times_are_kept(folder):
    """As after `rsync -t`, `tar`, or two generations within a second."""
    put(folder, padded(2))
    module, kept = folder / "tail_casadi.py", (folder / "tail_casadi.py").stat()
    agree(st.load(folder))
    put(folder, padded(3))
    os.utime(module, ns=(kept.st_atime_ns, kept.st_mtime_ns))
    assert module.stat().st_size == kept.st_size
    agree(st.load(folder))


def test_planted_bytecode_is_not_run(folder, tmp_path):
    put(folder, model_of(1))
    module = folder / "tail_casadi.py"
    status = module.stat()
    planted = tmp_path / "planted.py"
    planted.write_text("raise KeyError('planted')\n".ljust(status.st_size, "#"))
    os.utime(planted, ns=(status.st_atime_ns, status.st_mtime_ns))
    py_compile.compile(str(planted), cfile=importlib.util.cache_from_source(str(module)))
    agree(st.load(folder))
    assert sorted(path.name for path in folder.rglob("*.pyc")) == [
        os.path.basename(importlib.util.cache_from_source(str(module)))
    ]


def test_module_is_executed_from_the_text_that_was_checked(folder):
    model = st.load(put(folder, model_of(1)))
    (folder / "tail_casadi.py").write_text("raise KeyError('edited')\n")
    agree(model)


# What is compiled or built later


def test_batches_that_compile_late_are_of_the_model(folder, cache):
    q, v, tau = states()
    model = st.load(put(folder, model_of(1)))
    put(folder, model_of(2))
    expected = [model.forward_dynamics(*state) for state in zip(q, v, tau, strict=True)]
    found = model.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_flights_that_compile_late_are_of_the_model(folder, cache, monkeypatch):
    monkeypatch.setattr(parallel_runs, "worth_batching", lambda *_: True)
    q, v = np.tile(Q, (12, 1)), 0.1 * states()[1][:12]
    model = st.load(put(folder, model_of(1)))
    shutil.rmtree(folder)
    settings = {"t_span": 0.05, "method": "rk4", "step": 1e-3}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == 8
    for k in range(12):
        alone = st.simulate(model, q[k], v[k], **settings)
        np.testing.assert_allclose(found.q[k], alone.q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("change", ["regenerated", "deleted"])
def test_casadi_functions_that_are_built_late_are_of_the_model(folder, change):
    model = st.load(put(folder, model_of(1)))
    shutil.rmtree(folder)
    if change == "regenerated":
        put(folder, model_of(2))
    agree(model)
    agree(model.with_parameters(tail_mass=0.005))
    agree(copy.deepcopy(model))


def test_late_code_needs_no_entry_of_the_cache(folder, cache):
    """It writes again what was deleted there."""
    q, v, tau = states()
    model = st.load(put(folder, model_of(1)))
    shutil.rmtree(cache)
    shutil.rmtree(folder)
    whole = model.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(whole[7], model.forward_dynamics(q[7], v[7], tau[7]), rtol=1e-9)


# Pickles

UNPICKLE = (
    "import pathlib, pickle, sys; model = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes()); "
    f"print(model.mass_matrix({Q}).tobytes().hex())"
)


def test_pickle_is_of_the_model_that_was_pickled(folder, cache, tmp_path):
    model = st.load(put(folder, model_of(1)), {"tail_mass": 0.005})
    (tmp_path / "pickled").write_bytes(pickle.dumps(model))
    put(folder, model_of(2))
    twin = pickle.loads((tmp_path / "pickled").read_bytes())
    np.testing.assert_array_equal(twin.mass_matrix(Q), model.mass_matrix(Q))
    assert twin.folder == model.folder and twin.parameters == model.parameters
    command = [sys.executable, "-c", UNPICKLE, str(tmp_path / "pickled")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == model.mass_matrix(Q).tobytes().hex()


def test_pickle_without_a_cache_takes_the_same_folder_and_no_other(folder, cache, tmp_path):
    model = st.load(put(folder, model_of(1)))
    pickled = pickle.dumps(model)
    shutil.rmtree(cache)
    np.testing.assert_array_equal(pickle.loads(pickled).mass_matrix(Q), model.mass_matrix(Q))
    shutil.rmtree(cache)
    put(folder, model_of(2))
    with pytest.raises(st.ModelError, match="generated again since the model was pickled"):
        pickle.loads(pickled)
    shutil.rmtree(folder)
    with pytest.raises(st.ModelError, match="is not a generated folder"):
        pickle.loads(pickled)


def test_damaged_snapshot_is_not_unpickled(folder, cache):
    model = st.load(put(folder, model_of(1)))
    pickled = pickle.dumps(model)
    (snapshot,) = (cache / "models").iterdir()
    (snapshot / "src" / "tail.c").write_text("int other;\n")
    assert pickle.loads(pickled).checked.files == model.checked.files


def test_snapshot_of_another_model_is_not_unpickled(folder, cache):
    model = st.load(put(folder, model_of(1)))
    pickled = pickle.dumps(model)
    (snapshot,) = (cache / "models").iterdir()
    put(snapshot, model_of(2))
    assert pickle.loads(pickled).checked.files == model.checked.files


def test_models_without_c_need_no_cache(folder, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "file" / "cache"))
    model = st.load(put(folder, model_of(1)), compiled=False)
    twin = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(twin.casadi.mass_matrix(Q), model.casadi.mass_matrix(Q))


# Loads while the folder is generated again

LOADS = f"""
import sys, time, numpy as np, serpentail as st
count, seen, end = 0, set(), time.monotonic() + {RACE_S}
while time.monotonic() < end:
    model = st.load(sys.argv[1])
    mass = model.mass_matrix({Q})
    assert abs(mass[0, 0] - model.parameters["torso_mass"] - model.parameters["tail_mass"]) < 1e-12
    if count % 4 == 0:
        np.testing.assert_allclose(model.casadi.mass_matrix({Q}), mass, rtol=1e-12)
    count += 1
    seen.add(model.manifest["scene"]["baked"])
print(count, len(seen))
"""


def test_loads_while_the_folder_changes_are_of_one_generation(folder, cache):
    """No mixture of two option sets, and no charge that somebody changed the files."""
    both = [
        texts(1, 1, functions=FUNCTIONS),
        texts(1, 2, functions=["mass_matrix", "energy"], baked=True),
    ]
    for made in both:
        st.load(put(folder, made))
    command = [sys.executable, "-c", LOADS, str(folder)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    racers = [subprocess.Popen(command, **pipes) for _ in range(RACERS)]
    generations = 0
    while any(racer.poll() is None for racer in racers):
        put(folder, both[generations % 2])
        generations += 1
    answers = [racer.communicate() for racer in racers]
    assert [error for _, error in answers] == [""] * RACERS
    counts = [tuple(map(int, words.split())) for words, _ in answers]
    print(f"{sum(count for count, _ in counts)} loads, {generations} generations")
    assert sum(count for count, _ in counts) > 5 * RACERS and generations > 10
    assert max(seen for _, seen in counts) == 2
