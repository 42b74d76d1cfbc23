"""Scenes whose segments and links differ: values that follow, and what is refused."""

import numpy as np
import pytest

from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.problems import SceneError

CONE = {"length": "0.2 m", "radii": "4, 1 mm", "density": "1.2 g/cm^3"}


def scene(segments, kind="articulated", parameters=None, **keys):
    """The scene of some segments."""
    table = {"kind": kind, "segments": segments, **keys}
    return parse_scene(table | ({"parameters": parameters} if parameters else {}), "own")


def quadrature(a, b, length, density, count=20000):
    """Mass, COM and moments of a truncated cone by thin discs."""
    s = (np.arange(count) + 0.5) / count * length
    r = a + (b - a) * s / length
    m = density * np.pi * r**2 * length / count
    center = (m @ s) / m.sum()
    along, across = m @ r**2 / 2, m @ (r**2 / 4 + (s - center) ** 2)
    return m.sum(), center, (across, along, across)


def test_links_of_a_taper_are_slices_of_one_cone():
    parameters = scene([{"links": 2}, {"links": 3}], taper=CONE).parameters
    radii = np.linspace(0.004, 0.001, 6)
    assert parameters["link_lengths"] == pytest.approx((0.04,) * 5, rel=1e-15)
    for k in range(5):
        mass, center, moments = quadrature(radii[k], radii[k + 1], 0.04, 1200)
        assert parameters["link_masses"][k] == pytest.approx(mass, rel=1e-7)
        assert parameters["link_centers"][k] == pytest.approx(center, rel=1e-7)
        assert parameters["link_inertias"][3 * k : 3 * k + 3] == pytest.approx(moments, rel=1e-7)


def test_a_taper_may_have_a_mass_and_segments_their_lengths():
    taper = {"radii": [0.004, 0.001], "mass": "3 g"}
    segments = [{"links": 2, "length": 0.1}, {"links": 2, "link_lengths": "3, 5 cm"}]
    found = scene(segments, taper=taper)
    assert sum(found.parameters["link_masses"]) == pytest.approx(0.003, rel=1e-14)
    assert found.parameters["link_lengths"] == (0.05, 0.05, 0.03, 0.05)
    ends = [0.004 - 0.003 * place / 0.18 for place in (0.1, 0.13)]
    square = [a * a + a * b + b * b for a, b in (ends, (0.004, 0.001))]
    share = square[0] * 0.03 / (square[1] * 0.18)
    assert found.parameters["link_masses"][2] == pytest.approx(0.003 * share)


def test_arcs_of_a_taper():
    parameters = scene(2, "continuum", taper=CONE).parameters
    masses = [quadrature(*ends, 0.1, 1200)[0] for ends in ((0.004, 0.0025), (0.0025, 0.001))]
    assert parameters["arc_masses"] == pytest.approx(masses, rel=1e-7)
    assert parameters["arc_lengths"] == (0.1, 0.1)


def test_tables_with_links_alone_are_an_equal_tail():
    found = scene([{"links": 2}, {"links": 3}], parameters={"tail_mass": 0.01})
    assert (found.segments, found.shape.counts, found.shape.own) == (2, (2, 3), False)
    assert found.parameters["link_inertia"][1] == pytest.approx(0.002 / 5 * 2 * 0.0029**2)
    same = scene([{"links": 3}, {"links": 3}])
    assert same.shape == scene(2, links=3).shape and same.links == 3


def test_parameters_of_links_make_links_of_their_own():
    given = {"link_masses": "1, 2 g", "link_lengths": [0.02, 0.03]}
    parameters = scene(1, links=2, parameters=given).parameters
    assert parameters["link_centers"] == (0.01, 0.015)
    moments = [m / 5 * (L * L / 4 + 0.0029**2) for m, L in ((1e-3, 0.02), (2e-3, 0.03))]
    assert parameters["link_inertias"][::3] == pytest.approx(moments)
    assert "tail_mass" not in parameters
    one = scene(1, links=1, parameters={"link_masses": [1e-3], "link_lengths": ["2 cm"]})
    assert (one.parameters["link_masses"], one.parameters["link_lengths"]) == (1e-3, 0.02)


@pytest.mark.parametrize(
    "keys",
    [
        {"segments": [{"links": 2}, {"links": 3}], "taper": CONE},
        {"segments": [{"links": 2, "length": "3 cm", "mass": 0.001}], "real": "float"},
        {"segments": 1, "links": 2, "parameters": {"link_masses": [1, 2], "link_lengths": [1, 2]}},
        {"segments": 1, "links": 2, "parameters": {"mount_angles": "10, 0, -20 deg"}},
    ],
)
def test_scenes_are_read_again_as_they_are(keys):
    found = parse_scene({"kind": "articulated", **keys}, "own")
    assert parse_scene(scene_to_dict(found), "other") == found


LINK = {"links": 2, "length": 0.1, "mass": 0.001}


@pytest.mark.parametrize(
    ("segments", "more", "field", "words"),
    [
        ([], {}, "segments", "or an array of tables"),
        ([3], {}, "segments[0]", "needs a table"),
        ([LINK | {"mass": 0}], {}, "segments[0].mass", "above 0, in kg"),
        ([LINK | {"mass": "-1 g"}], {}, "segments[0].mass", "above 0"),
        ([LINK | {"length": "1 kg"}], {}, "segments[0].length", "a mass where a length is needed"),
        ([LINK | {"links": 0}], {}, "segments[0].links", "a whole number, 1 or above"),
        ([{"length": 0.1, "mass": 1}], {}, "links", "a whole number, 1 or above"),
        ([LINK | {"weight": 1}], {}, "segments[0].weight", "unknown; known: "),
        ([LINK | {"link_mass": 1}], {}, "segments[0].link_mass", "did you mean 'link_masses'?"),
        ([LINK, {"links": 2}], {}, "segments[1].length", "give length"),
        ([LINK, {"links": 2, "length": 1}], {}, "segments[1].mass", "give mass"),
        ([LINK | {"link_masses": [1, 2]}], {}, "segments[0].link_masses", "given together with"),
        ([LINK | {"radii": "3, 0 mm"}], {}, "segments[0].radii", "above 0, in m"),
        ([LINK | {"radii": [0.003, -0.001]}], {}, "segments[0].radii", "2 finite numbers above 0"),
        ([LINK | {"radii": 0.003}], {}, "segments[0].radii", "2 finite numbers"),
        (
            [{"links": 2, "length": 0.1, "link_masses": [1, 2, 3]}],
            {},
            "segments[0].link_masses",
            "needs 2 finite numbers, 1 for each of 2 links above 0",
        ),
        ([{"links": 2, "length": 1, "density": 1}], {}, "segments[0].density", "needs the radii"),
        ([LINK | {"radii": [1, 1], "link_centers": [1, 1]}], {}, "segments[0].link_centers", "fol"),
        ([LINK], {"taper": CONE}, "segments[0].mass", "follows from taper"),
        ([{"links": 2}], {"taper": {"radii": [1, 1]}}, "taper.density", "either a density or"),
        ([{"links": 2}], {"taper": CONE | {"mass": 1}}, "taper.density", "either a density or"),
        ([{"links": 2}], {"taper": CONE | {"radii": [1, 0]}}, "taper.radii", "above 0"),
        ([{"links": 2}], {"taper": CONE | {"colour": 1}}, "taper.colour", "unknown"),
        ([{"links": 2}], {"taper": 3}, "taper", "needs a table"),
        ([{"links": 2}], {"taper": {}}, "taper.radii", "radii of root and tip"),
        ([{"links": 2}], {"taper": CONE | {"radii": [1e-200] * 2}}, "taper", "no finite masses"),
        ([{"links": 2}], {"taper": CONE | {"radii": [1e200] * 2}}, "parameters.link_masses", "fi"),
        ([{"links": 2}], {"taper": {"radii": [1, 1], "mass": 1}}, "taper.length", "length of the"),
        ([{"links": 2, "length": 1}], {"taper": CONE}, "taper.length", "lengths of their own"),
        ([LINK], {"parameters": {"tail_mass": 1}}, "parameters.tail_mass", "value of its own"),
        ([LINK], {"parameters": {"link_masses": [1, 1]}}, "parameters.link_masses", "remove one"),
        ([{"links": 2}], {"parameters": {"link_masses": [1, 1]}}, "parameters.link_lengths", "2 f"),
        (
            [{"links": 2}],
            {"parameters": {"link_masses": [1]}},
            "parameters.link_masses",
            "2 finite",
        ),
        ([{"links": 2}], {"parameters": {"arc_masses": [1]}}, "parameters.arc_masses", "has none"),
        ([{"links": 2}], {"parameters": {"mount_angles": [1]}}, "parameters.mount_angles", "3 fin"),
        ([{"links": 9000}, {"links": 2000}], {}, "segments", "more than 10000 links"),
    ],
)
def test_what_cannot_be_is_refused(segments, more, field, words):
    with pytest.raises(SceneError) as refused:
        scene(segments, **more)
    problems = {problem.field: str(problem) for problem in refused.value.problems}
    assert field in problems, problems
    assert words in problems[field], problems


def test_arcs_have_no_links():
    with pytest.raises(SceneError, match=r"segments\[0\].link_masses"):
        scene([{"length": 0.1, "link_masses": [1]}], "continuum")
    with pytest.raises(SceneError, match=r"segments\[0\].links"):
        scene([{"length": 0.1, "mass": 1, "links": 2}], "continuum")
