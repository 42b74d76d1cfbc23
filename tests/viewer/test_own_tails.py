"""Tails whose links differ are drawn as thick as they are."""

import numpy as np
import pytest

import serpentail as st
from serpentail.pictures.frames import body_of
from serpentail.viewer.shape import shape
from serpentail.watching.poses import animal
from tests.support.own_tails import folder_of_tables

CONE = {"length": 0.2, "radii": [0.004, 0.001], "density": 1000.0}
FUNCTIONS = ["tail_points"]


def tapered(kind, **keys):
    """A tail that tapers from 4 to 1 mm."""
    tables = {"kind": kind, "segments": 2, "taper": CONE, **keys}
    return st.load(folder_of_tables(tables, {}, functions=FUNCTIONS))


@pytest.mark.parametrize(
    ("kind", "keys"), [("articulated", {"links": 4}), ("continuum", {"samples": 4})]
)
def test_links_and_arcs_are_drawn_as_thick_as_they_are(kind, keys):
    model = tapered(kind, **keys)
    radii = np.array(shape(model)["tail_radii"])
    ends = np.linspace(0.004, 0.001, 9 if kind == "articulated" else 3)
    middles = np.repeat((ends[1:] + ends[:-1]) / 2, 8 // (len(ends) - 1))
    np.testing.assert_allclose(radii, middles, rtol=0.05)
    thickness = body_of(model).thickness
    np.testing.assert_allclose(thickness, radii / radii.mean())

    q = np.zeros((2, model.nq))
    q[:, 3] = 1
    rods = animal(model, q, None)["tail"]
    np.testing.assert_allclose(rods.scales[:8, 0], radii)
    np.testing.assert_allclose(rods.scales[8:, 1], radii)


def test_equal_links_have_one_thickness():
    model = st.load(
        folder_of_tables(
            {"kind": "articulated", "segments": 2, "links": 2}, {}, functions=FUNCTIONS
        )
    )
    assert body_of(model).thickness == ()
    np.testing.assert_allclose(shape(model)["tail_radii"], 0.0029 * (1.15 - 0.5 * np.arange(4) / 5))
