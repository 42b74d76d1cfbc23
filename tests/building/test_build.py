"""`build` makes a model once, whoever asks and however often, and never imports the generator."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.building import build as building
from serpentail_codegen.scene.parse import load_scene
from tests.support import zoo
from tests.support.models import folder_of

from ..support.rows import row

TINY = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy"]}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Return an empty cache."""
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def generations(cache, monkeypatch):
    """Return a list that grows by each run of the generator, which makes each text once a day."""
    runs = []

    def generate(scene, output):
        runs.append(scene)
        return shutil.copytree(folder_of(load_scene(scene)), output / scene.stem)

    monkeypatch.setattr(building, "generate", generate)
    return runs


def made(scene=None, **options):
    """A model that is built but not compiled."""
    return st.build(*([scene] if scene else []), compiled=False, **options)


def test_a_built_model_is_the_generated_one(cache):
    options = {"functions": ["forward_dynamics"], "name": "bare"}
    built = st.build(**TINY | options, torso_mass=0.06)
    loaded = st.load(zoo.folder("bare"), {"torso_mass": 0.06})
    assert built.checked.files == loaded.checked.files and built.parameters == loaded.parameters
    state = np.r_[0, 0, 0.3, 1, 0, 0, 0, 0.1, 0.2], np.linspace(-1, 1, 8), np.ones(2)
    assert np.array_equal(built.forward_dynamics(*state), loaded.forward_dynamics(*state))


def test_the_second_call_generates_nothing(generations):
    first, again = made(**TINY), made(**TINY, torso_mass=0.05)
    assert len(generations) == 1 and again.parameters["torso_mass"] == 0.05
    assert first.checked.manifest == again.checked.manifest
    assert first.name == "articulated_m1_n1"
    assert made(**TINY | {"links": 2}).name == "articulated_m1_n2" and len(generations) == 2


def test_parameters_that_shape_the_code_make_another_model(generations):
    """Those of baked models, of the passive tail and of single links; the rest do not."""
    light, heavy = (made(**TINY, baked=True, torso_mass=mass) for mass in (0.05, 0.1))
    assert [m.parameters["torso_mass"] for m in (light, heavy)] == [0.05, 0.1]
    assert light.manifest["content_hash"] != heavy.manifest["content_hash"]
    elastic = made(**TINY, tail_stiffness=0.02, torso_mass=0.05)
    assert elastic.with_parameters(tail_stiffness=0.01).parameters["tail_stiffness"] == (0.01,) * 2
    own = made(**TINY | {"links": 2}, link_masses=[1e-3, 2e-3], link_lengths=[0.02, 0.03])
    assert own.parameters["tail_mass"] == pytest.approx(3e-3)
    tilted = made(**TINY, mount_angles=[0.1, 0.2, 0.3])
    assert tilted.parameters["mount_angles"] == (0.1, 0.2, 0.3)
    assert len(generations) == 5


def test_a_scene_file_is_built_by_its_content(generations, tmp_path):
    scene = tmp_path / "own.toml"
    text = 'kind = "articulated"\nsegments = 1\nlinks = 1\nfunctions = ["energy"]\n'
    for duration in (1, 2):
        more = f"[parameters]\ntail_mass = 0.01\n[simulate]\nduration = {duration}\n"
        scene.write_text(text + more)
        model = made(scene)
        assert model.name == "own" and model.parameters["tail_mass"] == 0.01
    assert len(generations) == 1
    assert made(scene, functions=["momentum"]).generated == ("momentum",)
    scene.write_text(text.replace("links = 1", "links = 3"))
    assert made(scene).links == 3 and len(generations) == 3


def test_an_example_is_a_scene_too(cache, generations, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert made("righting_m1_n3", functions=["energy"]).name == "righting_m1_n3"
    assert not [path for path in tmp_path.iterdir() if path != cache]
    assert st.examples()["kick"]


REFUSED = [
    (None, {"segmens": 3}, "segmens: value 3: .*'segments'"),
    (None, {"m": 2}, "m: value 2.*'segments'"),
    (None, {"n": 2}, "n: value 2.*'links'"),
    (None, {**TINY, "torso_mas": 1}, "torso_mas: .*'torso_mass'"),
    (None, {**TINY, "torso_mass": -1}, "torso_mass: value -1"),
    (None, {**TINY, "mu": 1}, "mu: no such parameter"),
    (None, {"tail": "articulatd", "segments": 0}, "(?s)kind: .*segments: .*links: "),
    (None, {**TINY, "links": 10**30}, "links: value 1000.*64 bits"),
    (None, {**TINY, "contacts": {1j}}, "contacts: value {1j}"),
    (None, {**TINY, "name": "../x"}, "name: value '../x'"),
    (None, {**TINY, "threads": 0}, "threads: value 0"),
    ("kik", {}, "'kik': .*'kick'"),
    ("none.toml", {}, "none.toml.*cannot be read"),
    (3, {}, "scene file: value 3"),
]


def test_what_cannot_be_built_is_refused_by_name(cache):
    for scene, options, words in REFUSED:
        with row(scene, options), pytest.raises(st.SerpentailError, match=words):
            made(scene, **options)


def test_neither_the_generator_nor_what_lies_in_the_working_folder_is_imported(cache, tmp_path):
    fake = tmp_path / "serpentail_codegen"
    fake.mkdir()
    (fake / "__main__.py").write_text("raise SystemExit('taken')")
    (fake / "__init__.py").write_text("")
    program = (
        "import sys, serpentail as st\n"
        f"st.build(**{TINY}, compiled=False)\n"
        "print([name for name in ('sympy', 'jinja2', 'serpentail_codegen') if name in sys.modules])"
    )
    command = [sys.executable, "-P", "-c", program]
    said = subprocess.run(command, capture_output=True, check=True, cwd=tmp_path).stdout
    assert said == b"[]\n"


def test_without_a_generator_it_says_so(cache, monkeypatch):
    monkeypatch.setattr("serpentail.building.generator.find_spec", lambda name: None)
    with pytest.raises(st.ModelError, match="without the package serpentail_codegen"):
        made(**TINY)


DAMAGES = {
    "model": lambda model, _: (model.folder / "manifest.json").unlink(),
    "file": lambda model, _: (model.folder / "src" / f"{model.name}.c").write_text("int x;"),
    "note": lambda _, note: note.write_bytes(b"\xff"),
    "lie": lambda _, note: note.write_text("../../../../etc"),
    "emptied": lambda *_: cli.main(["cache", "--clean"]),
}


def test_a_damaged_cache_costs_another_generation_only(cache, generations, capsys):
    for name, damage in DAMAGES.items():
        with row(name):
            model, before = made(**TINY), len(generations)
            (note,) = (cache / "builds").iterdir()
            damage(model, note)
            assert made(**TINY).generated == ("energy",) and len(generations) == before + 1
            made(**TINY)
            assert len(generations) == before + 1


def test_a_cache_that_others_write_or_nobody_can_is_told(cache, generations, monkeypatch):
    made(**TINY)
    (cache / "builds").chmod(0o777)
    with pytest.raises(st.SerpentailError, match="is writable by others"):
        made(**TINY)
    monkeypatch.setenv("SERPENTAIL_CACHE", str(Path(os.devnull) / "cache"))
    with pytest.raises(st.SerpentailError, match="set SERPENTAIL_CACHE"):
        made(**TINY)


def _built(wanted):
    """Build a model; return its name and a parameter."""
    links, mass = wanted
    model = made(**TINY | {"links": links}, torso_mass=mass)
    return model.name, model.parameters["torso_mass"]


def test_processes_build_each_model_once(cache):
    wanted = [(1 + k % 2, 0.05 + 1e-3 * k) for k in range(8)]
    with ProcessPoolExecutor(4, get_context("fork")) as pool:
        found = list(pool.map(_built, wanted))
    assert found == [(f"articulated_m1_n{links}", mass) for links, mass in wanted]
    assert len(list((cache / "builds").iterdir())) == len(list((cache / "models").iterdir())) == 2
    locks = [path.name for path in (cache / "locks").iterdir()]
    assert len(locks) == 2 and not list((cache / "parts").iterdir())
