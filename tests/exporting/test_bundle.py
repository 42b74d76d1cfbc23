"""Bundles: equal models have equal bytes, and ``st.load`` takes what is unpacked."""

import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder

OPTIONS = {"functions": ["energy", "mass_matrix"]}


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(1, 2, **OPTIONS))


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
        "np.save('H.npy', model.mass_matrix(np.linspace(0.1, 1, model.nq)))"
    )
    environment = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", script], check=True, env=environment, timeout=120)
    other = model.with_parameters(tail_mass=0.004)
    expected = other.mass_matrix(np.linspace(0.1, 1, model.nq))
    np.testing.assert_array_equal(np.load("H.npy"), expected)


def test_equal_models_have_equal_bundles(model, tmp_path):
    """Whatever the folder, its dates, its rights and how its manifest is laid out."""
    first = st.export(model, "bundle", tmp_path / "first.zip")
    with zipfile.ZipFile(first) as archive:
        archive.extractall(tmp_path)
        names = archive.namelist()
    assert names == sorted(names)
    again = tmp_path / names[0].split("/")[0]
    for path in again.rglob("*.c"):
        path.chmod(0o755)
        os.utime(path, (1e9, 1e9))
    second = st.export(st.load(again), "bundle", tmp_path / "second.zip")
    assert first.read_bytes() == second.read_bytes()


def test_other_parameters_do_not_get_lost(model, tmp_path):
    changed = model.with_parameters(torso_mass=0.2)
    with pytest.raises(st.ExportError, match=r"torso_mass: value 0\.2: .* 0\.10572: export"):
        st.export(changed, "bundle", tmp_path / "x.zip")
    assert list(tmp_path.iterdir()) == []


def test_what_became_of_the_folder_does_not_matter(tmp_path):
    """A model goes on as it was checked, and so does its bundle."""
    model = st.load(model_folder(1, 2, **OPTIONS))
    path = st.export(model, "bundle", tmp_path / "one.zip")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
        root = tmp_path / archive.namelist()[0].split("/")[0]
    copy = st.load(root)
    (root / "manifest.json").write_text("{}")
    assert st.export(copy, "bundle", tmp_path / "two.zip").read_bytes() == path.read_bytes()
