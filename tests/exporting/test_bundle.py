"""Bundles: equal models have equal bytes, and ``st.load`` takes what is unpacked."""

import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo


@pytest.fixture
def model():
    return zoo.model("bare")


def test_a_bundle_is_loaded_by_another_process_with_another_cache(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = st.export(model, "bundle")
    name = f"{model.name}-{model.checked.manifest_hash[:16]}"
    assert path.name == f"{name}.zip"
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path / "there")
    assert os.listdir("there") == [name]
    script = (
        "import numpy as np, serpentail as st\n"
        f"model = st.load('there/{name}', {{'tail_mass': 0.004}})\n"
        "q = np.linspace(0.1, 1, model.nq)\n"
        "np.save('rates.npy', model.forward_dynamics(q, np.ones(8), np.ones(2)))"
    )
    environment = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", script], check=True, env=environment, timeout=120)
    other, q = model.with_parameters(tail_mass=0.004), np.linspace(0.1, 1, model.nq)
    expected = other.forward_dynamics(q, np.ones(8), np.ones(2))
    np.testing.assert_array_equal(np.load("rates.npy"), expected)


def test_equal_models_have_equal_bundles(model, tmp_path):
    """Whatever the folder, its dates and its rights, and what became of it after it was loaded: a
    model goes on as it was checked.
    """
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


def test_other_parameters_do_not_get_lost(model, tmp_path):
    changed = model.with_parameters(torso_mass=0.2)
    with pytest.raises(st.ExportError, match=r"torso_mass: value 0\.2: .* 0\.10572"):
        st.export(changed, "bundle", tmp_path / "x.zip")
    assert list(tmp_path.iterdir()) == []
