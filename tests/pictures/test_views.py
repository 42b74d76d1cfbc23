"""Views: right-handed frames that look from where they say."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.pictures.views import NAMED, SIDE, TOP, looking, views_of
from tests.support.drawn_flight import flight
from tests.support.rows import row


def test_views_are_right_handed_with_a_level_horizon():
    for view in (*NAMED.values(), looking("own", -130, 63)):
        with row(view.name):
            np.testing.assert_allclose(view.matrix @ view.matrix.T, np.eye(3), atol=3e-15)
            np.testing.assert_allclose(np.cross(*view.matrix[:2]), view.matrix[2], atol=3e-15)
            assert view.matrix[0, 2] == 0 and view.matrix[1, 2] >= 0
    np.testing.assert_array_equal(SIDE.matrix, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(TOP.matrix, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])


def test_points_are_seen_as_after_turning_the_world():
    """The side view of a world that is turned by -azimuth about z, then tipped by the elevation."""
    points = np.random.default_rng(1).normal(size=(20, 3))
    for azimuth, elevation in product((-200, -30, 0, 40, 90), (0, 20, 65, 90)):
        turns = Rotation.from_euler("zy", [-azimuth, elevation], degrees=True)
        found = looking("a", azimuth, elevation).of(points)
        with row(azimuth, elevation):
            np.testing.assert_allclose(found, turns.apply(points)[:, [1, 2, 0]], atol=1e-14)
    # the viewer is where the angles say: 90 degrees is in front of the head
    np.testing.assert_array_equal(looking("a", 90, 0).matrix[2], [0, 1, 0])
    assert NAMED["oblique"].matrix[2].min() > 0  # right of it, before it and above


def test_views_that_are_none_are_refused():
    for views, words in (
        (("sid",), r"views\[0\]: value 'sid': .*'side'"),
        (("side", (1, 2, 3)), r"views\[1\]: value \(1, 2, 3\)"),
        (((0, 120),), r"views\[0\]: value \(0, 120\).* 0 to 90"),
        (((0, 90.1),), r"views\[0\]: value \(0, 90\.1\)"),
        (((0, -0.1),), r"views\[0\]: value \(0, -0\.1\)"),
        (((np.nan, 3),), r"views\[0\]"),
        ("side", "views: value 'side'"),
        ((), r"views: value \(\)"),
    ):
        for refused in (views_of, lambda views: flight().filmstrip(views=views)):
            with row(views), pytest.raises(st.ViewError, match=words):
                refused(views)
