"""`build` makes a model once, whoever asks and however often, and never imports the generator."""

import json
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.building import build as building
from tests.support.models import model_folder

TINY = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy"]}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Return an empty cache."""
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def generations(monkeypatch):
    """Return a list that grows by each run of the generator."""
    runs, generate = [], building.generate
    monkeypatch.setattr(building, "generate", lambda *a: runs.append(a) or generate(*a))
    return runs


def test_a_built_model_is_the_generated_one(cache):
    options = {"functions": ["forward_dynamics", "energy"]}
    built = st.build(tail="articulated", segments=2, links=2, torso_mass=0.06, **options)
    loaded = st.load(model_folder(2, 2, **options), {"torso_mass": 0.06})
    assert built.name == "articulated_m2_n2" and built.parameters == loaded.parameters
    q, v = np.r_[0, 0, 0.3, 1, 0, 0, 0, 0.1, 0.2, 0.3, 0.4], np.linspace(-1, 1, 10)
    assert np.array_equal(
        built.forward_dynamics(q, v, np.ones(4)), loaded.forward_dynamics(q, v, np.ones(4))
    )


def test_the_second_call_generates_nothing(cache, generations):
    first, again = st.build(**TINY), st.build(**TINY, torso_mass=0.05)
    assert len(generations) == 1 and again.parameters["torso_mass"] == 0.05
    assert first.checked.manifest == again.checked.manifest
    st.build(**TINY | {"links": 2})
    assert len(generations) == 2


def test_parameters_of_baked_models_are_part_of_the_code(cache, generations):
    light, heavy = (st.build(**TINY, baked=True, torso_mass=mass) for mass in (0.05, 0.1))
    assert len(generations) == 2
    assert [m.parameters["torso_mass"] for m in (light, heavy)] == [0.05, 0.1]
    assert light.manifest["content_hash"] != heavy.manifest["content_hash"]


def test_a_scene_file_is_built_by_its_content(cache, generations, tmp_path):
    scene = tmp_path / "own.toml"
    text = 'kind = "articulated"\nsegments = 1\nlinks = 1\nfunctions = ["energy"]\n'
    scene.write_text(text + "[parameters]\ntail_mass = 0.01\n[simulate]\nduration = 1\n")
    assert st.build(scene).name == "own"
    scene.write_text(text + "[parameters]\ntail_mass = 0.01\n[simulate]\nduration = 2\n")
    assert st.build(scene).parameters["tail_mass"] == 0.01 and len(generations) == 1
    assert st.build(scene, functions=["momentum"]).generated == ("momentum",)
    scene.write_text(text.replace("links = 1", "links = 3"))
    assert st.build(scene).links == 3 and len(generations) == 3


def test_an_example_is_a_scene_too(cache, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert st.build("righting_m1_n3", functions=["energy"]).name == "righting_m1_n3"
    assert not [path for path in tmp_path.iterdir() if path != cache]
    assert st.examples()["kick"] == "A kick from a crouch with a passive tail"


@pytest.mark.parametrize(
    ("scene", "options", "words"),
    [
        (None, {"segmens": 3}, "segmens: value 3: is neither .* did you mean 'segments'?"),
        (None, {**TINY, "torso_mas": 1}, "did you mean 'torso_mass'"),
        (None, {**TINY, "torso_mass": -1}, "torso_mass: value -1"),
        (None, {**TINY, "mu": 1}, "mu: no such parameter"),
        (None, {"tail": "articulatd", "segments": 0}, "(?s)kind: .*segments: .*links: "),
        (None, {**TINY, "links": 10**30}, "links: value 1000.*needs .* numbers of 64 bits"),
        (None, {**TINY, "contacts": {1j}}, "contacts: value {1j}: needs a text"),
        (None, {**TINY, "name": "../x"}, "name: value '../x'"),
        (None, {**TINY, "threads": 0}, "threads: value 0"),
        ("kik", {}, "is neither a file nor an example; did you mean 'kick'"),
        ("none.toml", {}, "none.toml.*cannot be read"),
        (3, {}, "value 3: needs a path, or the name of an example"),
    ],
)
def test_what_cannot_be_built_is_refused_by_name(cache, scene, options, words):
    with pytest.raises(st.SerpentailError, match=words):
        st.build(scene, **options)


def test_neither_the_generator_nor_sympy_is_imported(cache):
    program = (
        "import sys, serpentail as st\n"
        f"st.build(**{TINY})\n"
        "print([name for name in ('sympy', 'jinja2', 'serpentail_codegen') if name in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True).stdout
    assert said == b"[]\n"


def test_what_lies_in_the_working_folder_is_not_the_generator(cache, tmp_path, monkeypatch):
    (tmp_path / "serpentail_codegen").mkdir()
    (tmp_path / "serpentail_codegen" / "__main__.py").write_text("raise SystemExit('taken')")
    (tmp_path / "serpentail_codegen" / "__init__.py").write_text("")
    monkeypatch.chdir(tmp_path)
    assert st.build(**TINY).links == 1


def test_without_a_generator_it_says_so(cache, monkeypatch):
    monkeypatch.setattr("serpentail.building.generator.find_spec", lambda name: None)
    with pytest.raises(st.ModelError, match="without the package serpentail_codegen: pip install"):
        st.build(**TINY)


@pytest.mark.parametrize("damage", ["model", "file", "note", "lie", "emptied"])
def test_a_damaged_cache_costs_another_generation_only(cache, generations, damage):
    model = st.build(**TINY)
    (note,) = (cache / "builds").iterdir()
    if damage == "model":
        (model.folder / "manifest.json").unlink()
    elif damage == "file":
        (model.folder / "src" / f"{model.name}.c").write_text("int x;")
    elif damage == "note":
        note.write_bytes(b"\xff")
    elif damage == "lie":
        note.write_text("../../../../etc")
    else:
        subprocess.run(
            [sys.executable, "-m", "serpentail.cli", "cache", "--clean"],
            check=True,
            capture_output=True,
        )
    assert st.build(**TINY).generated == ("energy",) and len(generations) == 2
    st.build(**TINY)
    assert len(generations) == 2


def test_others_cannot_put_models_into_the_cache(cache):
    st.build(**TINY)
    (cache / "builds").chmod(0o777)
    with pytest.raises(st.SerpentailError, match="is writable by others"):
        st.build(**TINY)


def _built(wanted):
    """Build a model; return its name and energy."""
    links, parameters = wanted
    model = st.build(**TINY | {"links": links}, **parameters)
    return model.name, model.energy([0, 0, 1, 1, 0, 0, 0, 0, 0], np.zeros(8))[1]


@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_many_processes_build_a_hundred_models_at_once(cache, way):
    wanted = [(1 + k % 3, {"torso_mass": 0.05 + 1e-3 * k}) for k in range(100)]
    with ProcessPoolExecutor(4, get_context(way)) as pool:
        made = list(pool.map(_built, wanted))
    for (name, energy), (links, parameters) in zip(made, wanted, strict=True):
        assert name == f"articulated_m1_n{links}"
        mass = parameters["torso_mass"] + 0.00351
        assert energy == pytest.approx(9.8 * mass, rel=0.02)
    # each was generated once
    assert len(list((cache / "builds").iterdir())) == len(list((cache / "models").iterdir())) == 3


def test_a_build_that_is_killed_leaves_nothing_in_the_way(cache):
    program = f"import serpentail as st; print('begun', flush=True); st.build(**{TINY})"
    for seconds in (0.05, 0.3, 0.6):
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(seconds)
            process.kill()
    assert st.build(**TINY).generated == ("energy",)
    assert json.dumps(st.build(**TINY).checked.manifest)


def test_a_cache_that_cannot_be_written_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(Path(os.devnull) / "cache"))
    with pytest.raises(st.SerpentailError, match="set SERPENTAIL_CACHE to a folder you can write"):
        st.build(**TINY)


def test_springs_are_built_into_the_dynamics():
    """A parameter of the passive tail is of the scene: it makes other code, and can be changed."""
    tiny = TINY | {"functions": ["forward_dynamics"]}
    plain, elastic = st.build(**tiny), st.build(**tiny, tail_stiffness=0.02)
    q = np.zeros(plain.nq)
    q[3], q[7:] = 1.0, 0.1
    v = np.zeros(plain.nv)
    wanted = plain.forward_dynamics(q, v, [-0.002] * (plain.nv - 6))
    found = elastic.forward_dynamics(q, v, [0.0] * (plain.nv - 6))
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    softer = elastic.with_parameters(tail_stiffness=0.01)
    assert np.abs(softer.forward_dynamics(q, v, [0.0] * (plain.nv - 6)) - found).max() > 1e-3
