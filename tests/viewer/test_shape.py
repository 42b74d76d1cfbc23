"""Tails are drawn as thick as they are, and a torso and joints large enough to be seen."""

import numpy as np

from serpentail.pictures.frames import body_of
from serpentail.viewer.shape import shape
from serpentail.watching.poses import animal
from tests.support import zoo
from tests.support.rows import row

RADIUS = 0.0029  # m: the rat's usual one


def thick(name):
    """A model of the zoo with links and arcs of chosen radii; the last link has no inertia along
    itself. Return it and the radii of links and arcs (m).
    """
    model, changes = zoo.model(name), {}
    links, arcs = (len(model.parameters.get(each, ())) for each in ("link_masses", "arc_masses"))
    of_links, of_arcs = np.linspace(0.004, 0.001, links), np.linspace(0.003, 0.002, arcs)
    if links:
        masses = np.linspace(2e-3, 1e-3, links)
        along = masses * of_links**2 / 2
        along[-1], of_links[-1] = 0, 0.015 * model.parameters["tail_length"]
        inertias = np.stack([2e-8 + 0 * along, along, 2e-8 + 0 * along], axis=1)
        changes = {"link_masses": masses, "link_inertias": inertias}
    if arcs:  # as thick as that mass of water
        lengths = np.array(model.parameters["arc_lengths"])
        changes["arc_masses"] = 1e3 * np.pi * of_arcs**2 * lengths
    return model.with_parameters(**changes), of_links, np.repeat(of_arcs, model.samples or 1)


def test_links_and_arcs_are_drawn_as_thick_as_they_are():
    for name in ("own_links", "own_arcs", "mixed"):
        model, links, arcs = thick(name)
        radii = np.concatenate([links, arcs])
        if name == "mixed":  # an arc, two links, an arc, three links
            radii = np.concatenate([arcs[:3], links[:2], arcs[3:], links[2:]])
        q = np.zeros((2, model.nq))
        q[:, 3] = 1
        scales = animal(model, q, None)["tail"].scales
        with row(name):
            np.testing.assert_allclose(shape(model)["tail_radii"], radii)
            np.testing.assert_allclose(body_of(model).thickness, radii / radii.mean())
            np.testing.assert_allclose(scales[: len(radii), 0], radii)
            np.testing.assert_allclose(scales[len(radii) :, 1], radii)


def test_equal_links_have_one_thickness_and_thin_torsos_are_seen():
    model = zoo.model("m2_n2")
    assert body_of(model).thickness == ()
    found = shape(model)
    np.testing.assert_allclose(found["tail_radii"], RADIUS * (1.15 - 0.5 * np.arange(4) / 5))
    assert found["jointed"] and not shape(zoo.model("arcs2"))["jointed"]
    flat = model.with_parameters(torso_inertia=(8e-5, 8e-5, 1.6e-4))  # a disc
    least, most, _ = np.sort(shape(flat)["semi_axes"])
    assert least == 0.15 * most


def test_a_fixed_base_is_a_ball_at_the_mount():
    model = zoo.model("fixed")
    reach = np.linalg.norm(model.parameters["tail_mount"])
    assert shape(model)["semi_axes"] == [max(reach, 2 * RADIUS)] * 3
    assert shape(model.with_parameters(tail_mount=(0, 0, 0)))["semi_axes"] == [2 * RADIUS] * 3
