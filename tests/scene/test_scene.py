"""What a scene file becomes: defaults, order of functions, names, round trips."""

import json
import math
import pickle
import subprocess
import sys

import pytest

from serpentail_codegen.__main__ import main, parser, scene_of
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import KEYS, ONLY, Scene
from serpentail_codegen.scene.signatures.signature import ALWAYS, CALLED, GROUND, NAMED
from serpentail_codegen.scene.signatures.table import (
    ALL,
    DEFAULT,
    DEFAULT_ON_GROUND,
    DERIVATIVES,
    EXACT_DERIVATIVES,
    FIXED,
    NEEDS,
    SIGNATURES,
)
from tests.support.rows import row
from tests.support.scenes import SCENES, VALID

STANCE = VALID + 'contacts = ["torso", "feet"]\n'
SIZE = ["--tail", "articulated", "--segments", "1", "--links", "3"]


def test_defaults_of_the_other_keys(read):
    scene = read(VALID)
    assert scene == Scene("rat", "articulated", 2, 3, DEFAULT, resolve_parameters({}, 6))
    keys = (scene.coordinates, scene.baked, scene.real, scene.emission, scene.profile)
    assert keys == ("joint", False, "double", "auto", "fast")
    assert read('name = "kick_2"\n' + VALID).name == "kick_2"


def test_scenes_of_options_are_frozen_and_hashable():
    keys = {"baked": True, "functions": ["energy"], "parameters": {"gravity": 0}}
    scene = scene_for("articulated", 3, 4, **keys)
    assert (scene.name, scene.segments, scene.links) == ("articulated_m3_n4", 3, 4)
    assert (scene.baked, scene.functions, scene.parameters["gravity"]) == (True, ("energy",), 0.0)
    assert scene_for("continuum", 3).name == "continuum_m3"
    with pytest.raises(SceneError, match=r"^kind: value 'Elastic-2': .*mixed"):
        scene_for("Elastic-2", 3, 4)
    same = scene_for("articulated", 3, 4, **keys)
    assert len({scene, same, scene_for("articulated", 4, 3)}) == 2
    with pytest.raises(AttributeError):
        scene.links = 5
    with pytest.raises(TypeError):
        scene.parameters["gravity"] = 0


def test_round_trip_is_exact():
    for given in ({"tail_mass": 0.1 + 0.2}, {"link_inertia": [1e-8 / 3, 2e-10, 1]}, {}):
        keys = {"real": "float", "emission": "loops", "parameters": given}
        scene = scene_for("articulated", 2, 7, **keys)
        table = json.loads(json.dumps(scene_to_dict(scene), allow_nan=False))
        with row(given):
            assert parse_scene(table, "another") == scene
            assert scene_to_dict(parse_scene(table, "another")) == table
            assert pickle.loads(pickle.dumps(scene)) == scene


def test_the_paper_rats():
    for segments, links in ((1, 3), (3, 4)):
        name = f"kangaroo_rat_m{segments}_n{links}"
        scene = load_scene(SCENES / f"{name}.toml")
        parameters = resolve_parameters({}, segments * links)
        assert scene == Scene(name, "articulated", segments, links, DEFAULT, parameters)


def test_the_full_scene_files_show_every_key():
    names = ("kangaroo_rat_m1_n3", "contact_m1_n3", "tapered_tail")
    text = "".join((SCENES / f"{name}.toml").read_text() for name in names)
    tables = {"name", "parameters", "plan", "simulate", "identify", "phase", "sweep", "taper"}
    words = set(KEYS) - {*tables, "body", *ONLY["continuum"].keys}
    words |= {p.name for p in PARAMETERS}
    assert [word for word in words if f"{word} =" not in text] == []


def test_tables_of_motions_are_left_to_the_runtime():
    alone = {"kind": "articulated", "segments": 1, "links": 3}
    motions = {name: {"anything": 1} for name in ("plan", "simulate", "identify", "sweep")}
    motions |= {"phase": [{"anything": 1}]}
    assert parse_scene(alone | motions, "rat") == parse_scene(alone, "rat")
    assert load_scene(SCENES / "righting_m1_n3.toml").links == 3


# Functions.


def test_functions_come_in_their_order_and_all_that_fit(read):
    assert read('functions = ["energy", "mass_matrix"]\n' + VALID).functions == (
        "mass_matrix",
        "energy",
    )
    every = 'functions = "all"\n'
    assert not set(NEEDS) & set(read(VALID + every).functions)
    fixed = VALID + 'base = "fixed"\n'
    assert read(fixed + every).functions == tuple(name for name in ALL if name in FIXED)
    assert set(read(fixed).functions) == set(DEFAULT) & set(FIXED)
    polar = read('kind = "continuum"\nsegments = 1\ncoordinates = "polar"\n').functions
    assert polar == tuple(name for name in DEFAULT if name not in DERIVATIVES)
    damped = read(VALID + "[parameters]\ntail_damping = 1e-3\n").functions
    assert set(damped) == {*DEFAULT, "implicit"}


def test_contacts_bring_their_parameters_and_functions(read):
    scene = read(STANCE)
    assert scene.contacts == ("feet", "torso") and scene.friction == "cone"
    assert scene.functions == tuple(name for name in ALL if name in DEFAULT + DEFAULT_ON_GROUND)
    own = dict(scene.parameters).keys() - dict(read(VALID).parameters)
    assert own == {p.name for p in PARAMETERS if p.needs}
    legs = [scene.parameters[f"L_{link}"] for link in ("h2d", "d2k", "k2a", "a2m", "m2t")]
    assert legs == [0.008, 0.024, 0.032, 0.035, 0.016]
    assert scene.parameters["delta_m"] == pytest.approx(math.radians(30))
    assert parse_scene(scene_to_dict(scene), "other") == scene
    tail = read(VALID + 'contacts = ["tail"]\nfriction = "box"\n')
    assert "mu" in tail.parameters and "hip" not in tail.parameters and tail.friction == "box"
    flight = read(VALID)
    assert flight.contacts == () and not {"contacts", "friction"} & set(scene_to_dict(flight))


def test_legs_have_joints_where_there_are_feet(read):
    points = {"contact_points", "leg_points"}
    for more in ("", 'functions = "all"\n'):
        tail = read(VALID + 'contacts = ["tail", "torso"]\n' + more)
        assert points & set(tail.functions) == {"contact_points"}
        assert points <= set(read(STANCE + more).functions)


def test_the_table_of_functions_knows_assemblies_shapes_and_derivatives():
    assert list(CATALOGUE) == [name for name, s in SIGNATURES.items() if s.outputs]
    tails = [Tail(2, 3), Tail(1, 5, "continuum"), Tail(2, 2, contacts=("feet", "tail", "torso"))]
    for name, function in CATALOGUE.items():
        signature = SIGNATURES[name]
        assert (function.inputs, function.outputs) == (signature.inputs, signature.outputs)
        for argument in (*signature.inputs, *signature.outputs):
            with row(name, argument.name):
                assert all(n >= 0 for tail in tails for n in argument.shape(tail))
                assert argument.meaning
    assert {s.emitted for s in SIGNATURES.values()} == {ALWAYS, GROUND, NAMED, CALLED}
    assert set(ALL) == {name for name, s in SIGNATURES.items() if s.emitted != CALLED}
    parts = {part for orders in EXACT_DERIVATIVES.values() for order in orders for part in order}
    assert parts <= set(CATALOGUE)


def test_a_scene_is_checked_without_heavy_packages():
    """SymPy, NumPy and Jinja take a second to import."""
    code = "import sys, serpentail_codegen.scene.signatures.table, serpentail_codegen.scene.parse\n"
    code += "print({'sympy', 'numpy', 'jinja2', 'casadi'} & {*sys.modules})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"


# Options of the command line are part of a model's name: none overwrites another's folder.


def named(*arguments):
    return scene_of(parser().parse_args(arguments)).name


def test_what_an_option_changes_is_part_of_the_name():
    rows = [
        ([], ""),
        (["--real", "double", "--emission", "auto", "--profile", "fast"], ""),
        (["--baked", "--emission", "loops", "--real", "float"], "_float_loops_baked"),
        (["--profile", "reproducible"], "_reproducible"),
        (["--functions", "all"], "_all"),
        (["--functions", "mass_matrix"], "_fc4a05d"),
        (["--real", "float", "--functions", "mass_matrix"], "_float_fc4a05d"),
    ]
    for options, suffix in rows:
        with row(options):
            assert named(*SIZE, *options) == f"articulated_m1_n3{suffix}"
    orders = ("energy,momentum", "momentum,energy")
    names = {named(*SIZE, "--functions", chosen) for chosen in orders}
    assert len(names) == 1 and names != {named(*SIZE, "--functions", "energy")}


def test_a_scenes_own_choice_is_no_part_of_its_name(tmp_path):
    path = tmp_path / "rat.toml"
    path.write_text(VALID + 'real = "float"\nbaked = true\nfunctions = ["energy"]\n')
    own = ["--real", "float", "--baked", "--functions", "energy"]
    assert named(str(path), *own) == named(str(path)) == "rat"
    assert named(str(path), "--real", "double") == "rat_double"


def test_a_name_that_is_given_stays_and_is_checked(tmp_path, capsys):
    assert named(*SIZE, "--real", "float", "--name", "own") == "own"
    path = tmp_path / ("a" * 60 + ".toml")
    path.write_text(VALID)
    rows = {"../own": [*SIZE, "--name", "../own"], f"{path.stem}_float": [path, "--real", "float"]}
    for name, arguments in rows.items():
        assert main([*map(str, arguments)]) == 2
        assert capsys.readouterr().err.startswith(f"name: value '{name}': ")
