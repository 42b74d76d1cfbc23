"""`build` makes a model once, whoever asks, by a text, and never imports the generator."""

import math
import os
import subprocess
import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import serpentail as st
from serpentail.building.build import NEEDED, with_contacts
from serpentail.building.options import ParameterOptions, SceneKeys
from serpentail.building.scene_text import scene_text
from serpentail.cli import cli
from serpentail_codegen.scene.parse import parse_scene
from serpentail_scene.keys import KEYS
from serpentail_scene.parameters import NAMED, PARAMETERS
from serpentail_scene.signatures.table import ALL, NEEDS
from tests.support import zoo
from tests.support.scenes import SCENES

from ..support.rows import row

TINY = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy"]}


def made(scene=None, **options):
    return st.build(*([scene] if scene else []), compiled=False, **options)


def test_a_model_is_made_once_and_anew_for_what_shapes_its_code(generations, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, again = made(**TINY), made(**TINY, torso_mass=0.05)
    assert len(generations) == 1 and again.parameters["torso_mass"] == 0.05
    assert first.checked.manifest == again.checked.manifest
    assert first.name == "articulated_m1_n1"
    assert made(**TINY | {"links": 2}).name == "articulated_m1_n2" and len(generations) == 2
    light, heavy = (made(**TINY, baked=True, torso_mass=mass) for mass in (0.05, 0.1))
    assert [m.parameters["torso_mass"] for m in (light, heavy)] == [0.05, 0.1]
    assert light.manifest["content_hash"] != heavy.manifest["content_hash"]
    elastic = made(**TINY, tail_stiffness=0.02, torso_mass=0.05)
    assert elastic.with_parameters(tail_stiffness=0.01).parameters["tail_stiffness"] == (0.01,) * 2
    own = made(**TINY | {"links": 2}, link_masses=[1e-3, 2e-3], link_lengths=[0.02, 0.03])
    assert own.parameters["tail_mass"] == pytest.approx(3e-3)
    tilted = made(**TINY, mount_angles=[0.1, 0.2, 0.3])
    assert tilted.parameters["mount_angles"] == (0.1, 0.2, 0.3)
    assert len(generations) == 7
    generations.clear()  # a file is one of its content
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
    assert made("righting_m1_n3", functions=["energy"]).name == "righting_m1_n3"  # an example
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "own.toml"]
    assert st.examples()["kick"]


REFUSED = [
    (None, {"segmens": 3}, "segmens: value 3: .*'segments'"),
    (None, {"kind": "mixed"}, "kind: value 'mixed': .*'tail'"),
    (None, {"m": 2}, "m: value 2.*'segments'"),
    (None, {**TINY, "torso_mas": 1}, "torso_mas: .*'torso_mass'"),
    (None, {**TINY, "mu": 1}, "mu: value 1: nothing touches the ground by it"),
    (None, {"tail": "articulatd", "segments": 0}, "(?s)tail: .*segments: .*links: "),
    (None, {**TINY, "links": 10**30}, "links: value 1000.*64 bits"),
    (None, {**TINY, "contacts": {1j}}, "contacts: value {1j}"),
    (None, {**TINY, "name": "../x"}, "name: value '../x'"),
    ("kik", {}, "'kik': .*'kick'"),
    ("none.toml", {}, "none.toml.*cannot be read"),
    (3, {}, "scene file: value 3"),
]


def test_what_cannot_be_built_is_refused_by_name(cache, monkeypatch):
    for scene, options, words in REFUSED:
        with row(scene, options), pytest.raises(st.SerpentailError, match=words):
            made(scene, **options)
    monkeypatch.setattr("serpentail.building.generator.find_spec", lambda name: None)
    with pytest.raises(st.ModelError, match="without the package serpentail_codegen"):
        made(**TINY)
    killed = ["sh", "-c", "kill -9 $$"]  # as by a system without memory
    monkeypatch.setattr("serpentail.building.generator.command", lambda: killed)
    with pytest.raises(st.ModelError, match="status -9"):
        made(**TINY)


def test_wrong_parameters_are_refused_before_anything_is_derived(cache):
    """In less than a second of processor time; the shortest derivation takes several."""
    wrong, before = ("3 st", -1, "3 kg cm2", "3 N cm", "3 N cm/rad"), os.times()
    for value in wrong:
        words = f"tail_mass: value {value!r}: "
        with row(value), pytest.raises(st.ModelError, match=words) as caught:
            st.build(**TINY, tail_mass=value)
        assert "\n" not in str(caught.value) and str(cache) not in str(caught.value)
    spent = sum(os.times()[:4]) - sum(before[:4])  # with that of children
    assert not (cache / "models").exists() and spent < len(wrong)


def test_a_built_model_is_the_generated_one_and_nothing_else_is_imported(cache, tmp_path):
    options = TINY | {"functions": ["forward_dynamics"], "name": "bare", "torso_mass": 0.06}
    fake = tmp_path / "serpentail_codegen"
    fake.mkdir()
    (fake / "__init__.py").touch()
    (fake / "__main__.py").write_text("raise SystemExit('taken')")
    program = (
        f"import sys, serpentail as st; st.build(**{options}, compiled=False)\n"
        "print([name for name in ('sympy', 'jinja2', 'serpentail_codegen') if name in sys.modules])"
    )
    found = subprocess.check_output([sys.executable, "-P", "-c", program], cwd=tmp_path)
    assert found == b"[]\n"
    built, loaded = st.build(**options), st.load(zoo.folder("bare"), {"torso_mass": 0.06})
    assert built.checked.files == loaded.checked.files and built.parameters == loaded.parameters
    state = np.r_[0, 0, 0.3, 1, 0, 0, 0, 0.1, 0.2], np.linspace(-1, 1, 8), np.ones(2)
    assert np.array_equal(built.forward_dynamics(*state), loaded.forward_dynamics(*state))


DAMAGES = {
    "model": lambda model, _: (model.folder / "manifest.json").unlink(),
    "file": lambda model, _: (model.folder / "src" / f"{model.name}.c").write_text("int x;"),
    "note": lambda _, note: note.write_bytes(b"\xff"),
    "lie": lambda _, note: note.write_text("../../../../etc"),
    "emptied": lambda *_: cli.main(["cache", "--clean"]),
}


def test_a_damaged_cache_costs_another_generation_and_one_of_others_is_told(
    cache, generations, monkeypatch
):
    for name, damage in DAMAGES.items():
        with row(name):
            model, before = made(**TINY), len(generations)
            (note,) = (cache / "builds").glob("*/*")
            damage(model, note)
            for _ in range(2):
                assert made(**TINY).generated == ("energy",) and len(generations) == before + 1
    (cache / "builds").chmod(0o777)
    with pytest.raises(st.SerpentailError, match="is writable by others"):
        made(**TINY)
    monkeypatch.setenv("SERPENTAIL_CACHE", str(Path(os.devnull) / "cache"))
    with pytest.raises(st.SerpentailError, match="set SERPENTAIL_CACHE"):
        made(**TINY)


def _mass(links, mass):
    return made(**TINY | {"links": links}, torso_mass=mass).parameters["torso_mass"]


def test_processes_build_each_model_once(cache):
    links, masses = [1, 2] * 4, [0.05 + 1e-3 * k for k in range(8)]
    with ProcessPoolExecutor(4, get_context("fork")) as pool:
        assert list(pool.map(_mass, links, masses)) == masses
    for kind, count in {"builds": 2, "models": 2, "locks": 2, "parts": 0}.items():
        assert len(list((cache / kind).iterdir())) == count, kind


TEXTS = some.text(some.characters(codec="utf-8"))
VALUES = some.recursive(
    some.booleans() | some.integers(-(2**63) + 1, 2**63 - 1) | some.floats(allow_nan=False) | TEXTS,
    lambda inner: some.lists(inner, max_size=4) | some.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=20,
)


@given(some.dictionaries(TEXTS, VALUES, max_size=5))
def test_tables_survive(tables):
    assert tomllib.loads(scene_text(tables)) == tables


def test_numbers_of_numpy_are_numbers_and_what_toml_cannot_say_is_named():
    tables = {"a": np.float32(0.5), "b": np.int64(3), "c": np.eye(2), "d": (1, 2.5)}
    back = tomllib.loads(scene_text(tables))
    assert back == {"a": 0.5, "b": 3, "c": [[1.0, 0.0], [0.0, 1.0]], "d": [1, 2.5]}
    assert math.isnan(tomllib.loads(scene_text({"a": math.nan}))["a"])
    deep = []
    for _ in range(5000):
        deep = [deep]
    rows = [({"b": x}, r"^a\.b: value ") for x in (None, 1j, object(), {1}, b"x", 2**63, -(2**63))]
    for value, words in [*rows, ("\ud800", "has no UTF-8"), (deep, "nested too deeply")]:
        with row(type(value)), pytest.raises(st.ModelError, match=words):
            scene_text({"a": value})


def test_options_are_what_the_generator_knows():
    keys = {{"kind": "tail", "tendon": "tendons"}.get(key, key) for key in KEYS}
    left = {"description", "parameters", "plan", "simulate", "phase", "identify", "sweep"}
    assert set(SceneKeys.__annotations__) == keys - left
    of_limbs = {"link_tips", "link_offsets", "rotors"}
    names = [parameter.name for parameter in NAMED if parameter.name not in of_limbs]
    assert list(ParameterOptions.__annotations__) == names
    wanted = {group: [p.name for p in PARAMETERS if p.needs == group] for group in NEEDED}
    assert {group: [*names] for group, names in NEEDED.items()} == wanted
    assert {p.needs for p in PARAMETERS} == {"", *NEEDED}


def test_a_robot_file_serves_with_fewer_contacts():
    path = SCENES / "contact_m1_n3.toml"
    tables = tomllib.loads(path.read_text())
    tables["functions"] = [
        name
        for name in (*NEEDS, "energy")
        if name in ALL and NEEDS.get(name) not in ("air", "tendons")
    ]
    for contacts in ([], ["feet"], ["tail"], ["torso"], ["feet", "tail", "torso"]):
        with row(contacts):
            scene = parse_scene(with_contacts(tables, contacts), "robot")
            names = {*dict(scene.parameters), *scene.functions}
            assert list(scene.contacts) == contacts
            assert ("mu" in names) == ("contact_points" in names) == bool(contacts)
            assert ("hip" in names) == ("leg_points" in names) == ("feet" in contacts)
            assert ("torso_semi_axes" in names) == ("torso" in contacts)
    assert with_contacts(tables, 3)["contacts"] == 3  # which the generator refuses
    options = {"contacts": [], "functions": ["energy"]}
    assert not made(path, **options).contacts
    with pytest.raises(st.ModelError, match="mu: no such parameter"):
        made(path, **options, mu=0.5)
