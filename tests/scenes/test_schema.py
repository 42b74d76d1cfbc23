"""The JSON Schema of scene files accepts what the two packages accept, and refuses slips."""

import copy
import json
import tomllib

import jsonschema
import pytest

import serpentail as st
from serpentail.cli import cli
from serpentail.scenes.plan import plan_arguments
from serpentail.scenes.schema import scene_schema
from serpentail_codegen.scene.parse import load_scene, parse_scene
from serpentail_codegen.scene.problems import SceneError
from serpentail_scene.parameters import NAMED
from tests.support.rows import row
from tests.support.scenes import SCENES

Q = [0, 0, 0.3, 1, 0, 0, 0, 0.1, 0.1]
SIMULATE = {
    "duration": 0.005,
    "output_step": 0.001,
    "start": {"height": 0.1, "bends": [0.1], "velocity": [0, 0, 1]},
    "legs": {"gamma": 3.67, "delta": -0.26, "moves": [{"at": 0.001, "delta": -1.0, "rate": 70.0}]},
    "reference": {"times": [0.0, 0.01], "bends": [[0.1], [0.2]]},
    "controller": {"kind": "damping", "damping": 1e-3},
}
PLAN = {
    "start": {"q": Q, "v": [0, 0, 1, 5, 0, 0, 0, 0]},
    "goal": {"attitude": "upright", "tail": [0.0, "free"]},
    "duration": 0.3,
    "bounds": {"angle": 3.0, "torque": 0.02},
}
GENERATE = {
    "name": "x",
    "kind": "articulated",
    "segments": 2,
    "links": 3,
    "functions": ["mass_matrix"],
    "parameters": {"tail_mass": 0.1, "hip": [0, 0, 0.0]},
    "contacts": ["feet"],
}
WHOLE = GENERATE | {"simulate": SIMULATE, "plan": PLAN}
LINK = {"links": 2, "length": "1 cm", "mass": 0.001}


def changed(table, path, value):
    """A copy of a table with a value at a path; missing tables are made."""
    part = table = copy.deepcopy(table)
    for key in path[:-1]:
        part = part.setdefault(key, {}) if isinstance(part, dict) else part[key]
    part[path[-1]] = value
    return table


@pytest.fixture(scope="module")
def valid():
    """Return a function that tells if a table is a scene."""
    schema = scene_schema()
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema).is_valid


def with_value(path, value):
    """Return a whole scene with another value at a path such as "simulate.legs.gamma"."""
    return changed(WHOLE, [int(x) if x.isdigit() else x for x in path.split(".")], value)


def test_scenes_and_segments_of_their_own(valid):
    for path in sorted(SCENES.glob("*.toml")):
        with row(path.stem):
            assert valid(tomllib.loads(path.read_text())) and load_scene(path).name == path.stem
    one, two = {"segments": 1, "links": 1}, {"segments": 1, "links": 2}
    good = [
        {"segments": [LINK, LINK | {"link_radius": "1 mm"}]},
        {"segments": [{"links": 2}], "taper": {"radii": "4, 1 mm", "density": 1000}},
        two | {"parameters": {"link_masses": "1, 2 g"}},
        one | {"parameters": {"link_inertias": [[1, 1, 1]]}},
        one | {"base": "fixed", "weightless": True},
        *(one | {"parameters": {"tail_stiffness": x}} for x in (0.1, "0.1 N m/rad")),
        one | {"parameters": {"tail_stiffness": [0.1, "0.1 N m/rad", 0, 0]}},
        {"kind": "mixed", "segments": [{"kind": "continuum", "length": 1, "mass": 1}]},
    ]
    bad = [
        {"segments": 1},
        {"segments": [LINK | {"mass": 0}]},
        {"segments": [LINK | {"colour": 1}]},
        {"segments": [LINK | {"radii": [0.1]}]},
        {"segments": [LINK], "taper": {"density": 1000}},
        two | {"parameters": {"link_masses": 1}},
        two | {"base": "floating"},
        *(two | {"parameters": {"tail_stiffness": x}} for x in (-0.1, "0.1 N m", [1, -1], [1])),
        {"kind": "mixed", "segments": [{"kind": "mixed", "length": 1, "mass": 1}]},
    ]
    for keys in (*good, *bad):
        with row(keys):
            assert valid({"kind": "articulated"} | keys) is (keys in good)


def test_what_is_right_is_valid(valid):
    """The packages take it too."""
    phase = [{"begin": 0, "kind": "none"}, {"begin": "1 s", "kind": "none"}]
    free = {"tail": ["-20 deg", 0.5], "torso_rate": [[0, 0, 0], [1, 1, 2]]}
    rows = [
        *(("functions", "all"), ("targets", ["c"]), ("parameters.torso_mass", "105.7 g")),
        ("parameters.tail_mount", [0, "-40.5 mm", "0.45 cm"]),
        ("parameters.torso_semi_axes", "31.5, 49.5, 27 mm"),
        ("parameters.torso_inertia", "700, 700, 700 g cm^2"),
        *(("parameters.delta_m", "-30 deg"), ("simulate.duration", "20 ms")),
        ("simulate.start.velocity", ["1 cm/s", 0, "3.6 km/h"]),
        ("simulate.start.settle", {"rounds": 2, "duration": 0.1}),
        ("simulate.legs.gamma", ["210 deg", 3.6]),
        *(("simulate.legs.moves.0.rate", "4000 deg/s"), ("simulate.controller", phase)),
        ("simulate.controller", {"kind": "pfl", "kp": "4e4 1/s^2", "feedforward": False}),
        *(("plan.goal", "upright"), ("plan.goal.attitude", [1, 0, 0, 0])),
        *(("plan.goal.tail", ["free", "10 deg"]), ("plan.tolerance", "free")),
        *(("plan.duration", ["300 ms", 0.58]), ("plan.bounds.torque", "20 mN m")),
        *(("plan.options", {"ipopt.max_iter": 100}), ("plan.intervals", 20)),
        *(("plan.design", {"tail_length": ["8 cm", 0.25]}), ("plan.free_start", free)),
    ]
    for path, value in rows:
        with row(path, value):
            table = with_value(path, value) | {"contacts": ["feet", "torso"]}
            assert valid(table)
            parse_scene(table, "x")
            plan_arguments(table["plan"])


def test_what_is_wrong_is_not_valid(valid):
    """The packages refuse it too: what needs a model, in tests of their own."""
    rows = [
        *(("segmnts", 3), ("kind", "snake"), ("segments", 0), ("links", "3"), ("name", "Rat")),
        ("samples", 3),  # of an articulated tail
        *(("name", "math"), ("functions", ["mass_matrx"]), ("contacts", ["feet", "feet"])),
        *(("targets", []), ("baked", "true"), ("coordinates", "bend"), ("parameters.tail_mas", 1)),
        *(("parameters.torso_mass", wrong) for wrong in (0, "105.7", "217 deg")),
        *(("parameters.tail_mount", wrong) for wrong in ([0, 0], "1, 2 mm")),
        *(("parameters.mu", "1 m"), ("simulate.duratoin", 1), ("simulate.duration", "3 m")),
        *(("simulate.method", "euler"), ("simulate.start.heigth", 1)),
        *(("simulate.start.pitch", "20 mm"), ("simulate.legs.moves.0.dleta", 1)),
        *(("simulate.controller.kind", "pdf"), ("simulate.controller.kp", 1)),  # of "damping"
        *(("simulate.reference.blend", "cubic"), ("plan.path", []), ("plan.start", {"q": [0]})),
        *(("plan.goal", "upwright"), ("plan.goal.tale", 1), ("plan.free_start.tale", [0, 1])),
        *(("plan.free_start.tail", ["0 m", 1]), ("plan.bounds.angle", "3 s")),
        *(("plan.intervals", 0), ("plan.solver", "radau"), ("plan.track", "yes")),
        *((f"plan.{name}", "x") for name in ("rule", "formulation", "attitude", "dynamics")),
        ("plan.goal.turns", [0, 0]),
    ]
    for path, value in rows:
        with row(path, value):
            table = with_value(path, value)
            assert valid(with_value("segments", 2)) and not valid(table)
            if not path.startswith(("simulate", "plan.intervals", "plan.solver", "plan.track")):
                with pytest.raises((SceneError, st.SerpentailError)):
                    parse_scene(table, "x")
                    plan_arguments(table["plan"])
    for key in ("kind", "segments", "links"):
        assert not valid({name: value for name, value in WHOLE.items() if name != key}), key
    phases = tomllib.loads((SCENES / "kick_and_land.toml").read_text())
    assert valid(phases) and not valid(changed(phases, ("phase", 0, "until"), "up"))


def test_editors_show_what_each_parameter_is(capsys):
    assert cli.main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    shown = schema["properties"]["parameters"]["properties"]
    assert {name: each["description"] for name, each in shown.items()} == {
        p.name: f"{p.meaning} ({p.unit})" for p in NAMED
    }
