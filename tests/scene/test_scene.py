"""What a scene file becomes: defaults, order of functions, names, round trips."""

import json
import math
import pickle

import pytest

from serpentail_codegen.__main__ import main, parser, scene_of
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.scene.parse import parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import Scene
from serpentail_scene.parameters import PARAMETERS
from serpentail_scene.signatures import table as functions
from serpentail_scene.signatures.table import ALL, FIXED, SIGNATURES
from tests.support.rows import row
from tests.support.scenes import VALID

STANCE = VALID + 'contacts = ["torso", "feet"]\n'
FLIGHT = ("forward_dynamics", "energy", "momentum", "tail_points", "center_of_mass", "rollout")
SIZE = ["--tail", "articulated", "--segments", "1", "--links", "3"]


def test_defaults_of_the_other_keys_and_scenes_of_options(read):
    scene = read(VALID)
    assert scene == Scene("rat", "articulated", 2, 3, FLIGHT, resolve_parameters({}, 6))
    keys = (scene.coordinates, scene.baked, scene.real, scene.emission, scene.profile)
    assert keys == ("joint", False, "double", "auto", "fast")
    assert read('name = "kick_2"\n' + VALID).name == "kick_2"
    assert read(VALID).targets == read('targets = ["casadi", "c"]\n' + VALID).targets
    # those of options are frozen and hashable
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


CONE = {"length": "0.2 m", "radii": "4, 1 mm", "density": "1.2 g/cm^3"}
BARE = [{"kind": "articulated", "links": 2}, {"kind": "continuum"}]
BOTH = [BARE[0] | {"length": 0.1, "mass": 0.002}, {"kind": "continuum", "length": 1, "mass": 1}]
BOX = {"shape": "box", "sides": [0.1, 0.2, 0.1], "density": 1e3}
TILTED = {"mount_angles": "10, 0, -20 deg"}
EXACT = {"tail_mass": 0.1 + 0.2}, {"link_inertia": [1e-8 / 3, 2e-10, 1]}, {}
BODIES = {"scale": 1.6}, {"mass": 3.0}, {"scale": 0.5, "torso": BOX}, {"scale": 1}
WRITTEN = [
    *({"links": 7, "real": "float", "emission": "loops", "parameters": each} for each in EXACT),
    *({"links": 3, "body": each} | more for each in BODIES for more in ({}, {"taper": CONE})),
    {"links": 3, "contacts": ["feet", "tail"], "friction": "smooth", "parameters": TILTED},
    {"links": 2, "parameters": {"tail_stiffness": 0.01, "tail_damping": 1e-4}},
    {"segments": 1, "links": 2, "parameters": {"link_masses": [1, 2], "link_lengths": [1, 2]}},
    {"segments": [{"links": 2}, {"links": 3}], "taper": CONE},
    {"segments": [{"links": 2, "length": "3 cm", "mass": 0.001}], "real": "float"},
    {"kind": "continuum", "segments": 3, "samples": 7},
    {"kind": "mixed", "segments": BOTH, "parameters": TILTED | {"tail_stiffness": 0.01}},
    {"kind": "mixed", "segments": BARE, "taper": CONE},
    {"kind": "mixed", "segments": BOTH, "base": "fixed", "weightless": True},
]


def test_scenes_are_read_again_as_they_are():
    for keys in WRITTEN:
        scene = parse_scene({"kind": "articulated", "segments": 2} | keys, "own")
        table = json.loads(json.dumps(scene_to_dict(scene), allow_nan=False))
        with row(keys):
            assert parse_scene(table, "other") == scene == pickle.loads(pickle.dumps(scene))
            assert scene_to_dict(parse_scene(table, "other")) == table


# Functions.


def test_functions_come_in_their_order_and_all_that_fit(read):
    named = read('functions = ["energy", "mass_matrix"]\n' + VALID).functions
    assert named == ("mass_matrix", "energy")
    every = 'functions = "all"\n'
    assert not set(functions.NEEDS) & set(read(VALID + every).functions)
    fixed = VALID + 'base = "fixed"\n'
    assert read(fixed + every).functions == tuple(
        name for name in ALL if name in {*FIXED} - {*functions.NEEDS, "loads"}
    )
    assert read(fixed).functions == FLIGHT


MASS, SOLVER = "mass_matrix", "implicit"
PLAN = {MASS, "pfl", "airborne_rates", "airborne_rates_derivatives", "airborne_rates_hessian"}
FIT = {"inverse_dynamics", "forward_dynamics_derivatives"}
FIT |= {"forward_dynamics_parameter_derivatives", *FLIGHT} - {"rollout"}
STANDING = {*FLIGHT, SOLVER, "contact_points", "leg_points"}
TRACKED = '[[simulate.controller]]\nkind = "pfl"\n'
SERIES = 'phase = [{ name = "up" }, { name = "on", plan = { goal = "upright" } }]\n'
NEEDED = [  # above the scene, below it, the functions
    ("", "", FLIGHT),
    ("", "[simulate]\nduration = 1\n", FLIGHT),
    ("", "[parameters]\ntail_damping = 1e-3\n", {*FLIGHT, SOLVER}),
    ("", TRACKED, {*FLIGHT, "pfl"}),
    ("", "[plan]\nduration = 1\n", {*FLIGHT, *PLAN}),
    ("", SERIES, {*FLIGHT, *PLAN}),
    ("", "[identify]\ntorques = 3\n", FIT),
    ("", "[identify]\na = 3\n[simulate]\na = 3\n", {*FIT, *FLIGHT}),
    ('contacts = ["feet"]\n', "", STANDING),
    ('contacts = ["tail"]\n', "", STANDING - {"leg_points"}),
    ('base = "fixed"\n', "[plan]\na = 3\n", {*FLIGHT, MASS, "pfl"}),
    ('purpose = ["mpc"]\n', "", {*FLIGHT, "airborne_rates", "airborne_rates_derivatives"}),
    ('functions = ["energy"]\n', "[plan]\na = 3\n", {"energy"}),
    ('functions = ["energy"]\npurpose = ["identify"]\n', "", FIT),
    (f'functions = ["+{MASS}", "+energy"]\n', "", {*FLIGHT, MASS}),
    (f'functions = ["+{MASS}"]\npurpose = ["plan"]\n', "", {*FLIGHT, *PLAN}),
]


def test_functions_follow_from_what_a_scene_is_for(read):
    for above, below, names in NEEDED:
        with row(above, below):
            assert read(above + VALID + below).functions == tuple(n for n in ALL if n in names)
    polar = read('purpose = ["plan", "derivatives"]\nkind = "continuum"\nsegments = 1\n').functions
    curved = 'purpose = ["plan", "derivatives"]\nkind = "continuum"\nsegments = 1\ncoordinates = '
    left = {*polar} - {*read(curved + '"polar"\n').functions}
    assert left == {n for n in polar if SIGNATURES[n].group in ("derivative", "planning")}


def test_contacts_bring_their_parameters_and_functions(read):
    scene = read(STANCE)
    assert scene.contacts == ("feet", "torso") and scene.friction == "cone"
    own = scene.parameters.keys() - read(VALID).parameters.keys()
    assert own == {p.name for p in PARAMETERS if p.needs}
    legs = [scene.parameters[f"L_{link}"] for link in ("h2d", "d2k", "k2a", "a2m", "m2t")]
    assert legs == [0.008, 0.024, 0.032, 0.035, 0.016]
    assert scene.parameters["delta_m"] == pytest.approx(math.radians(30))
    points = {"contact_points", "leg_points"}
    for more in ("", 'functions = "all"\n'):
        tail = read(VALID + 'contacts = ["tail", "torso"]\n' + more)
        assert points & set(tail.functions) == {"contact_points"}
        assert points <= set(read(STANCE + more).functions)
    tail = read(VALID + 'contacts = ["tail"]\nfriction = "smooth"\n')
    assert "mu" in tail.parameters and "hip" not in tail.parameters and tail.friction == "smooth"
    flight = read(VALID)
    assert flight.contacts == () and not {"contacts", "friction"} & set(scene_to_dict(flight))


def test_the_table_of_functions_knows_assemblies_shapes_and_derivatives():
    assert list(CATALOGUE) == [name for name, s in SIGNATURES.items() if s.outputs]
    for name, function in CATALOGUE.items():
        signature = SIGNATURES[name]
        assert (function.inputs, function.outputs) == (signature.inputs, signature.outputs)
    assert set(ALL) == {name for name, s in SIGNATURES.items() if not s.called}
    orders = [order for each in functions.EXACT_DERIVATIVES.values() for order in each]
    assert {part for order in orders for part in order} <= set(CATALOGUE)


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


def test_a_scenes_own_choice_is_no_part_of_its_name_and_one_that_is_given_is_checked(
    tmp_path, capsys
):
    path = tmp_path / f"{'a' * 60}.toml"
    path.write_text(VALID + 'real = "float"\nbaked = true\nfunctions = ["energy"]\n')
    own = ["--real", "float", "--baked", "--functions", "energy"]
    assert named(str(path), *own) == named(str(path)) == path.stem
    assert named(*SIZE, "--real", "float", "--name", "own") == "own"
    wrong = {"../own": [*SIZE, "--name", "../own"]}
    for name, words in (wrong | {f"{path.stem}_double": [str(path), "--real", "double"]}).items():
        assert main(words) == 2
        assert capsys.readouterr().err.startswith(f"name: value '{name}': ")
