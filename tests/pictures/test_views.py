"""Views: right-handed frames that look from where they say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.pictures.views import NAMED, SIDE, TOP, looking, views_of
from tests.support.drawn_flight import flight

every_view = pytest.mark.parametrize(
    "view", [*NAMED.values(), looking("own", -130, 63)], ids=lambda view: view.name
)


@every_view
def test_views_are_right_handed_and_orthonormal(view):
    np.testing.assert_allclose(view.matrix @ view.matrix.T, np.eye(3), atol=3e-15)
    np.testing.assert_allclose(np.cross(*view.matrix[:2]), view.matrix[2], atol=3e-15)


@every_view
def test_the_horizon_is_level_and_up_is_up(view):
    assert view.matrix[0, 2] == 0 and view.matrix[1, 2] >= 0


def test_side_and_top_are_exact():
    np.testing.assert_array_equal(SIDE.matrix, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(TOP.matrix, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize("azimuth", [-200, -30, 0, 40, 90])
@pytest.mark.parametrize("elevation", [0, 20, 65, 90])
def test_points_are_seen_as_after_turning_the_world(azimuth, elevation):
    """The side view of a world that is turned by -azimuth about z, then tipped by the elevation."""
    points = np.random.default_rng(1).normal(size=(20, 3))
    turned = Rotation.from_euler("zy", [-azimuth, elevation], degrees=True).apply(points)
    found = looking("a", azimuth, elevation).of(points)
    np.testing.assert_allclose(found, turned[:, [1, 2, 0]], atol=1e-14)


def test_the_viewer_is_where_the_angles_say():
    towards = looking("a", 90, 0).matrix[2]
    np.testing.assert_array_equal(towards, [0, 1, 0])  # 90 degrees: in front of the head
    assert NAMED["oblique"].matrix[2].min() > 0  # right of it, before it and above


@pytest.mark.parametrize(
    ("views", "words"),
    [
        (("sid",), r"views\[0\]: value 'sid': did you mean 'side'\?"),
        (("side", (1, 2, 3)), r"views\[1\]: value \(1, 2, 3\): needs .*degrees"),
        (((0, 120),), r"views\[0\]: value \(0, 120\): needs an elevation from 0 to 90"),
        (((np.nan, 3),), r"views\[0\]"),
        ("side", r"views: value 'side': needs a tuple"),
        ((), r"views: value \(\): needs a tuple"),
    ],
)
def test_views_that_are_none_are_refused(views, words):
    with pytest.raises(st.ViewError, match=words):
        views_of(views)
    with pytest.raises(st.ViewError, match=words):
        flight().filmstrip(views=views)
