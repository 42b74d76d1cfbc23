"""Tails of a scene: segments that differ, a taper, arcs, and links beside arcs."""

import numpy as np
import pytest

from serpentail_codegen.scene.parse import parse_scene

CONE = {"length": "0.2 m", "radii": "4, 1 mm", "density": "1.2 g/cm^3"}
LINK = {"links": 2, "length": 0.1, "mass": 0.001}
BARE = [{"kind": "articulated", "links": 2}, {"kind": "continuum"}]
BOTH = [
    {"kind": "articulated", "links": 3, "length": 0.1, "mass": 0.002},
    {"kind": "continuum", "length": 0.08, "mass": 0.001},
]


def table(segments, kind="articulated", **keys):
    return {"kind": kind, "segments": segments, **keys}


def parameters(*arguments, **keys):
    return parse_scene(table(*arguments, **keys), "own").parameters


def quadrature(a, b, length, density, count=20000):
    """Mass, COM and moments about it of a truncated cone by thin discs."""
    s = (np.arange(count) + 0.5) / count * length
    r = a + (b - a) * s / length
    m = density * np.pi * r**2 * length / count
    center = (m @ s) / m.sum()
    along, across = m @ r**2 / 2, m @ (r**2 / 4 + (s - center) ** 2)
    return m.sum(), center, (across, along, across)


def test_links_and_arcs_of_a_cone_are_its_slices():
    """Of a taper, and of a segment with radii: its density, or its mass, is that of the cone."""
    found = parameters([{"links": 2}, {"links": 3}], taper=CONE)
    own = {"links": 2, "length": "8 cm", "radii": [0.004, 0.0028]}
    mass = quadrature(0.004, 0.0028, 0.08, 1200)[0]
    radii = np.linspace(0.004, 0.001, 6)
    dense = parameters([own | {"density": 1200}])
    heavy = parameters([own | {"mass": mass}])
    assert found["link_lengths"] == pytest.approx((0.04,) * 5, rel=1e-15)
    for numbers, count in ((found, 5), (dense, 2), (heavy, 2)):
        assert len(numbers["link_masses"]) == count
        for k in range(count):
            expected = quadrature(radii[k], radii[k + 1], 0.04, 1200)
            moments = numbers["link_inertias"][3 * k : 3 * k + 3]
            given = numbers["link_masses"][k], numbers["link_centers"][k]
            assert given == pytest.approx(expected[:2], rel=1e-7)
            assert moments == pytest.approx(expected[2], rel=1e-7)
    arcs = parameters(2, "continuum", taper=CONE)
    masses = [quadrature(*ends, 0.1, 1200)[0] for ends in ((0.004, 0.0025), (0.0025, 0.001))]
    assert arcs["arc_masses"] == pytest.approx(masses, rel=1e-7)
    assert arcs["arc_lengths"] == (0.1, 0.1)


def test_links_and_arcs_of_a_mixed_taper_share_its_length_by_segments():
    segments = [{"kind": "articulated", "links": 4}, {"kind": "continuum"}]
    found = parameters(segments, "mixed", taper=CONE)
    assert found["link_lengths"] == pytest.approx((0.025,) * 4)
    assert np.ravel(found["arc_lengths"]) == pytest.approx([0.1])
    assert np.ravel(found["arc_masses"]) == pytest.approx([quadrature(0.0025, 0.001, 0.1, 1200)[0]])


def test_a_taper_may_have_a_mass_and_segments_their_lengths():
    taper = {"radii": [0.004, 0.001], "mass": "3 g"}
    segments = [{"links": 2, "length": 0.1}, {"links": 2, "link_lengths": "3, 5 cm"}]
    found = parameters(segments, taper=taper)
    assert sum(found["link_masses"]) == pytest.approx(0.003, rel=1e-14)
    assert found["link_lengths"] == (0.05, 0.05, 0.03, 0.05)
    ends = [0.004 - 0.003 * place / 0.18 for place in (0.1, 0.13)]
    square = [a * a + a * b + b * b for a, b in (ends, (0.004, 0.001))]
    share = square[0] * 0.03 / (square[1] * 0.18)
    assert found["link_masses"][2] == pytest.approx(0.003 * share)


def test_links_of_their_own_are_as_given_or_ellipsoids():
    """Moments are about the COM, wherever it is."""

    def ellipsoid(m, L, r):
        return m / 5 * (L * L / 4 + r * r), m / 5 * 2 * r * r, m / 5 * (L * L / 4 + r * r)

    given = [
        {"links": 2, "length": "6 cm", "mass": "2 g"},
        {"links": 1, "length": 0.02, "mass": 0.001, "link_radius": "1 mm"},
        {"links": 1, "length": 0.05, "mass": 0.004, "link_centers": [0.01], "link_radius": 0},
        {"links": 2, "length": 0.02, "mass": 0.002, "link_inertia": "2, 1, 3 g mm^2"},
        {
            "links": 2,
            "link_lengths": [0.01, 0.02],
            "link_masses": "1, 2 g",
            "link_centers": "-1, 12 mm",
            "link_inertias": [[3e-8, 2e-9, 4e-8], [2e-8, 1e-9, 1e-8]],
        },
    ]
    found = parameters(given)
    assert found["link_masses"] == (1e-3, 1e-3, 1e-3, 4e-3, 1e-3, 1e-3, 1e-3, 2e-3)
    assert found["link_lengths"] == (0.03, 0.03, 0.02, 0.05, 0.01, 0.01, 0.01, 0.02)
    assert found["link_centers"] == (0.015, 0.015, 0.01, 0.01, 0.005, 0.005, -0.001, 0.012)
    moments = [*ellipsoid(1e-3, 0.03, 0.0029)] * 2 + [*ellipsoid(1e-3, 0.02, 1e-3)]
    moments += [*ellipsoid(4e-3, 0.05, 0.0)] + [2e-9, 1e-9, 3e-9] * 2
    moments += [3e-8, 2e-9, 4e-8, 2e-8, 1e-9, 1e-8]
    assert found["link_inertias"] == pytest.approx(moments, rel=1e-14)


def test_tables_with_links_alone_are_an_equal_tail():
    found = parse_scene(table([{"links": 2}, {"links": 3}], parameters={"tail_mass": 0.01}), "own")
    assert (found.segments, found.shape.counts, found.shape.own) == (2, (2, 3), False)
    assert found.parameters["link_inertia"][1] == pytest.approx(0.002 / 5 * 2 * 0.0029**2)
    same = parse_scene(table([{"links": 3}, {"links": 3}]), "own")
    assert same.shape == parse_scene(table(2, links=3), "own").shape and same.links == 3


def test_parameters_of_links_make_links_of_their_own():
    given = {"link_masses": "1, 2 g", "link_lengths": [0.02, 0.03]}
    found = parameters(1, links=2, parameters=given)
    assert found["link_centers"] == (0.01, 0.015)
    moments = [m / 5 * (L * L / 4 + 0.0029**2) for m, L in ((1e-3, 0.02), (2e-3, 0.03))]
    assert found["link_inertias"][::3] == pytest.approx(moments)
    assert "tail_mass" not in found
    given = {"link_masses": [1e-3], "link_lengths": ["2 cm"]}
    one = parameters(1, links=1, parameters=given)
    assert [one[f"link_{name}"] for name in ("masses", "lengths", "centers")] == [1e-3, 0.02, 0.01]


def test_pieces_of_a_mixed_tail_may_be_parameters(refuse_rows):
    given = {"link_masses": [1e-3, 2e-3], "link_lengths": [0.02, 0.03]}
    given |= {"arc_masses": 1e-3, "arc_lengths": "5 cm"}
    found = parameters(BARE, "mixed", parameters=given)
    assert found["link_centers"] == (0.01, 0.015) and found["arc_lengths"] == 0.05
    two = table(BARE, "mixed", parameters=given | {"arc_masses": [1, 2]})
    short = table(BARE, "mixed", parameters={n: given[n] for n in given if n != "arc_lengths"})
    refuse_rows([(two, "parameters.arc_masses", ""), (short, "parameters.arc_lengths", "")])


def test_a_continuum_scene(refuse_rows, read):
    found = read({"kind": "continuum", "segments": 3, "samples": 7})
    assert (found.segments, found.samples, found.coordinates) == (3, 7, "bend")
    assert "link_inertia" not in found.parameters
    rows = [
        ({"links": 4}, "links", ""),
        ({"parameters": {"link_radius": 1}}, "parameters.link_radius", ""),
    ]
    values = (0, -1.0, float("nan"), float("inf"), 100.001, True, "2", "1 m", "9999 deg")
    rows += [({"bend_range": value}, "bend_range", "deg") for value in values]
    refuse_rows((table(3, "continuum", **keys), field, words) for keys, field, words in rows)
    for value in (100, 1e-9, "180 deg"):
        found = read(table(3, "continuum", bend_range=value))
        assert found.bend_range == (np.pi if isinstance(value, str) else value)


def test_segments_that_cannot_be_are_refused(refuse_rows):
    two, odd, first = {"links": 2}, CONE | {"radii": [1, 1]}, "segments[0]"
    own, shared = {"links": 2, "length": 0.1}, {"links": 2, "ratios": [1, 0.5]}
    rows = [
        ([], {}, "segments", ""),
        ([3], {}, first, ""),
        ([LINK | {"mass": 0}], {}, f"{first}.mass", "kg"),
        ([LINK | {"length": "1 kg"}], {}, f"{first}.length", "cm"),
        ([LINK | {"links": 0}], {}, f"{first}.links", "1 or above"),
        ([{"length": 0.1, "mass": 1}], {}, "links", "1 or above"),
        ([LINK | {"link_mass": 1}], {}, f"{first}.link_mass", "mean 'link_masses'"),
        ([LINK, two], {}, "segments[1].length", "give length"),
        ([LINK, two | {"length": 1}], {}, "segments[1].mass", "give mass"),
        ([LINK | {"link_masses": [1, 2]}], {}, f"{first}.link_masses", "mass"),
        ([LINK | {"link_radius": 1, "radii": [1, 1]}], {}, f"{first}.radii", "link_radius"),
        ([LINK | {"radii": "3, 0 mm"}], {}, f"{first}.radii", "above 0"),
        ([LINK | {"radii": 0.003}], {}, f"{first}.radii", "2 finite"),
        ([LINK | {"mass": [1, 2]}], {}, f"{first}.mass", "a finite"),
        ([own | {"link_masses": [1, 2, 3]}], {}, f"{first}.link_masses", "2 finite"),
        ([own | {"link_masses": [1, float("nan")]}], {}, f"{first}.link_masses", "2 links"),
        ([LINK | {"link_inertias": [1] * 5}], {}, f"{first}.link_inertias", "6 finite"),
        ([own | {"density": 1}], {}, f"{first}.density", "radii"),
        ([LINK | {"radii": [1, 1], "link_centers": [1, 1]}], {}, f"{first}.link_centers", "radii"),
        ([own | {"radii": [1, 1], "link_masses": [1, 1]}], {}, f"{first}.link_masses", "radii"),
        ([LINK], {"taper": CONE}, f"{first}.mass", "taper"),
        ([two], {"taper": {"radii": [1, 1]}}, "taper.density", "mass"),
        ([two], {"taper": CONE | {"mass": 1}}, "taper.density", "mass"),
        ([two], {"taper": CONE | {"radii": [1, 0]}}, "taper.radii", "above 0"),
        ([two], {"taper": 3}, "taper", "table"),
        ([two], {"taper": {}}, "taper.radii", "root"),
        ([two], {"taper": CONE | {"radii": [1e-200] * 2}}, "taper", "finite"),
        ([own | {"radii": [1e-200] * 2, "mass": 1}], {}, "segments", "finite"),
        ([two], {"taper": CONE | {"radii": [1e200] * 2}}, "parameters.link_masses", "2 finite"),
        ([two], {"taper": {"radii": [1, 1], "mass": 1}}, "taper.length", "every segment"),
        ([two | {"length": 1}], {"taper": odd}, "taper.length", "remove"),
        ([own, two], {"taper": {"radii": [1, 1], "mass": 1}}, "taper.length", "every segment"),
        ([own | {"link_lengths": [1, 1]}], {"taper": odd}, "segments", "link_lengths"),
        ([LINK], {"parameters": {"tail_mass": 1}}, "parameters.tail_mass", "own"),
        ([LINK], {"parameters": {"link_masses": [1, 1]}}, "parameters.link_masses", "taper"),
        ([two], {"parameters": {"link_masses": [1, 1]}}, "parameters.link_lengths", "2 fin"),
        ([two], {"parameters": {"link_masses": [1]}}, "parameters.link_masses", "2 finite"),
        ([two], {"parameters": {"arc_masses": [1]}}, "parameters.arc_masses", "remove"),
        ([two], {"parameters": {"mount_angles": [1]}}, "parameters.mount_angles", "3 fin"),
        ([{"links": 9000}, {"links": 1001}], {}, "segments", "10000 links"),
        ([{"links": 2, "ratios": [1]}], {}, "segments[0].ratios", "2 finite"),
        ([shared, {"links": 2, "ratios": [1, -1]}], {}, "segments[1].ratios", "sum 0"),
        ([shared], {"parameters": {"joint_ratios": [1, 1]}}, "parameters.joint_ratios", "remove"),
        ([shared], {"contacts": ["tail"]}, "contacts", "remove tail"),
        (
            [shared],
            {"tendon": {"a": {"offset": [1, 0], "tension": 1}}},
            "parameters.joint_ratios",
            "tendons",
        ),
    ]
    refuse_rows(((table(of, **more), field, words) for of, more, field, words in rows), alone=False)


def test_mixed_tails_that_cannot_be_are_refused(refuse_rows):
    links, arc = BOTH
    rows = [
        ({"segments": 2}, "segments", "array of tables"),
        ({"segments": [links | {"kind": "arc"}, arc]}, "segments[0].kind", "articulated"),
        ({"segments": [links, {"length": 1, "mass": 1}]}, "segments[1].kind", "continuum"),
        ({"segments": [links, arc | {"links": 2}]}, "segments[1].links", "arc"),
        ({"segments": [links, arc | {"link_radius": 1}]}, "segments[1].link_radius", "arc"),
        ({"segments": [links | {"links": 0}, arc]}, "segments[0].links", "1 or above"),
        ({"segments": [{"kind": "articulated"}, arc]}, "segments[0].links", "1 or above"),
        ({"segments": [links, links]}, "kind", '"articulated"'),
        ({"segments": [arc]}, "kind", '"continuum"'),
        ({"segments": [links, {"kind": "continuum"}]}, "segments[1].length", "give length"),
        ({"segments": BOTH, "links": 3}, "links", "remove"),
        ({"segments": BOTH, "samples": 0}, "samples", "1 or above"),
        ({"segments": BOTH, "coordinates": "polar"}, "coordinates", '"mixed"'),
        ({"segments": BOTH, "parameters": {"tail_mass": 1}}, "parameters.tail_mass", "own"),
        ({"kind": "articulated", "segments": BOTH}, "segments[1].kind", '"mixed"'),
        ({"kind": "continuum", "segments": [links]}, "segments[0].kind", '"continuum"'),
        ({"kind": "continuum", "segments": [arc | {"links": 2}]}, "segments[0].links", "arc"),
        ({"segments": [links | {"ratios": [1, 1, 2]}, arc]}, "segments", "remove them"),
    ]
    own = {"kind": "continuum", "segments": [arc | {"link_masses": [1]}]}
    rows += [(own, "segments[0].link_masses", "arc")]
    refuse_rows((({"kind": "mixed"} | keys, field, words) for keys, field, words in rows), False)
