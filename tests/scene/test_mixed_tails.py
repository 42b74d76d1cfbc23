"""Scenes of tails of links and arcs: what their tables say, and what they cannot."""

import pytest

from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.scene import KINDS
from serpentail_codegen.scene.schema import scene_schema

LINKS = {"kind": "articulated", "links": 3, "length": 0.1, "mass": 0.002}
ARC = {"kind": "continuum", "length": 0.08, "mass": 0.001}


def test_the_schema_knows_kinds_of_segments():
    tables = scene_schema()["properties"]["segments"]["anyOf"][1]["items"]["properties"]
    assert tables["kind"] == {"enum": [kind for kind in KINDS if kind != "mixed"]}


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"taper": {"length": 0.2, "radii": [0.004, 0.001], "density": 1000.0}},
        {"parameters": {"mount_angles": "10, 0, 5 deg", "tail_stiffness": 0.01}},
        {"base": "fixed", "weightless": True},
    ],
)
def test_scenes_are_read_again_as_they_are(keys):
    bare = [{"kind": "articulated", "links": 3}, {"kind": "continuum"}]
    segments = bare if "taper" in keys else [LINKS, ARC]
    found = parse_scene({"kind": "mixed", "segments": segments, **keys}, "both")
    assert parse_scene(scene_to_dict(found), "other") == found


def test_pieces_may_be_parameters():
    bare = [{"kind": "articulated", "links": 2}, {"kind": "continuum"}]
    given = {"link_masses": [1e-3, 2e-3], "link_lengths": [0.02, 0.03]}
    given |= {"arc_masses": 1e-3, "arc_lengths": "5 cm"}
    found = parse_scene({"kind": "mixed", "segments": bare, "parameters": given}, "both")
    assert found.parameters["link_centers"] == (0.01, 0.015)
    assert found.parameters["arc_lengths"] == 0.05
    with pytest.raises(SceneError, match=r"parameters\.arc_masses: value \[1, 2\]: needs a finite"):
        parse_scene(
            {"kind": "mixed", "segments": bare, "parameters": given | {"arc_masses": [1, 2]}}, "x"
        )
    with pytest.raises(SceneError, match=r"parameters\.arc_lengths"):
        lacking = {k: v for k, v in given.items() if k != "arc_lengths"}
        parse_scene({"kind": "mixed", "segments": bare, "parameters": lacking}, "both")


@pytest.mark.parametrize(
    ("keys", "field", "words"),
    [
        ({"segments": 2}, "segments", "an array of tables"),
        ({"segments": [LINKS | {"kind": "arc"}, ARC]}, "segments[0].kind", 'needs "articulated"'),
        (
            {"segments": [LINKS, {"length": 1, "mass": 1}]},
            "segments[1].kind",
            "as the tail is mixed",
        ),
        ({"segments": [LINKS, ARC | {"links": 2}]}, "segments[1].links", "an arc has no links"),
        (
            {"segments": [LINKS, ARC | {"link_radius": 1}]},
            "segments[1].link_radius",
            "an arc has no",
        ),
        ({"segments": [LINKS | {"links": 0}, ARC]}, "segments[0].links", "1 or above"),
        ({"segments": [{"kind": "articulated"}, ARC]}, "segments[0].links", "1 or above"),
        ({"segments": [LINKS, LINKS]}, "kind", 'set kind = "articulated"'),
        ({"segments": [ARC]}, "kind", 'set kind = "continuum"'),
        ({"segments": [LINKS, {"kind": "continuum"}]}, "segments[1].length", "give length"),
        ({"segments": [LINKS, ARC], "links": 3}, "links", "has none; remove it"),
        ({"segments": [LINKS, ARC], "samples": 0}, "samples", "1 or above"),
        ({"segments": [LINKS, ARC], "coordinates": "polar"}, "coordinates", 'needs "mixed"'),
        ({"segments": [LINKS, ARC], "contacts": ["tail"]}, "contacts", "remove the group"),
        (
            {"segments": [LINKS, ARC], "parameters": {"tail_mass": 1}},
            "parameters.tail_mass",
            "a value of its own",
        ),
        (
            {"kind": "articulated", "segments": [LINKS, ARC]},
            "segments[1].kind",
            'set kind = "mixed"',
        ),
        (
            {"kind": "continuum", "segments": [LINKS]},
            "segments[0].kind",
            'this scene is "continuum"',
        ),
    ],
)
def test_what_cannot_be_is_refused(keys, field, words):
    with pytest.raises(SceneError) as refused:
        parse_scene({"kind": "mixed", **keys}, "both")
    problems = {problem.field: str(problem) for problem in refused.value.problems}
    assert words in problems.get(field, ""), problems
