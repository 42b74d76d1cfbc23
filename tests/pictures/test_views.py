"""Views, right-handed frames that look from where they say, and the torso in a view: its outline,
and what it hides.
"""

import dataclasses
from itertools import product

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.pictures.animal import Pen, above_ground, hull
from serpentail.pictures.frames import frames, silhouette
from serpentail.pictures.views import NAMED, SIDE, TOP, looking, views_of
from tests.support.drawn_flight import SEMI_AXES, flight
from tests.support.rows import row


def test_points_are_seen_as_after_turning_the_world():
    """The side view of a world that is turned by -azimuth about z, then tipped by the elevation."""
    points = np.random.default_rng(1).normal(size=(20, 3))
    for azimuth, elevation in product((-200, -30, 0, 40, 90), (0, 20, 65, 90)):
        turns = Rotation.from_euler("zy", [-azimuth, elevation], degrees=True)
        found = looking("a", azimuth, elevation).of(points)
        with row(azimuth, elevation):
            np.testing.assert_allclose(found, turns.apply(points)[:, [1, 2, 0]], atol=1e-14)
    np.testing.assert_array_equal(SIDE.matrix, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(TOP.matrix, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
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


# The torso.


def surface(count=150):
    """Points on the torso's ellipsoid, in its frame."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, count), np.linspace(0, 2 * np.pi, 2 * count))
    sphere = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    return np.stack(sphere, axis=-1).reshape(-1, 3) * SEMI_AXES


def film_frame(seed, height=0.06):
    """One frame in a random attitude."""
    trajectory = flight(samples=1)
    q = trajectory.q.copy()
    q[:, 2], q[:, 3:7] = height, Rotation.random(rng=seed).as_quat()
    return frames(trajectory.model, dataclasses.replace(trajectory, q=q), [0], 0.0)[0]


def widths(points):
    """How far points (P, 2) reach in 90 directions."""
    angle = np.linspace(0, 2 * np.pi, 90)
    return (points @ np.stack([np.cos(angle), np.sin(angle)])).max(axis=0)


def test_silhouette_is_the_outline_of_the_projected_surface():
    for seed, view in product(range(5), NAMED.values()):
        rotation = Rotation.random(rng=seed).as_matrix()
        shadow = view.of(surface() @ rotation.T)[:, :2]
        outline = silhouette(rotation, SEMI_AXES, view, count=721)
        with row(seed, view.name):
            np.testing.assert_allclose(widths(outline), widths(shadow), rtol=2e-4)
            np.testing.assert_allclose(outline[0], outline[-1], atol=1e-15)


def test_the_torso_hides_exactly_what_a_ray_to_the_viewer_hits():
    for seed, view in product(range(3), NAMED.values()):
        frame = film_frame(seed)
        points = frame.torso + np.random.default_rng(seed).uniform(-0.06, 0.06, (400, 3))
        steps = np.linspace(0, 0.2, 2001)[:, None, None] * view.matrix[2]
        ray = np.linalg.norm((points + steps - frame.torso) @ frame.rotation / SEMI_AXES, axis=-1)
        nearest, over = ray.min(axis=0), frame.in_front(points, view)
        # beside the torso nothing is covered
        spread = view.matrix[:2] @ frame.rotation * SEMI_AXES
        flat = view.of(points - frame.torso)[:, :2]
        covered = np.einsum("ni,ij,nj->n", flat, np.linalg.inv(spread @ spread.T), flat) < 1
        with row(seed, view.name):
            assert not (over & (nearest < 1 - 1e-3)).any()
            assert not (~over & covered & (nearest > 1 + 1e-3)).any()


def test_what_is_above_the_ground_is_outlined():
    for seed, view, height in product(range(2), NAMED.values(), (-0.02, 0.005)):
        frame = film_frame(seed, height)
        world = frame.torso + surface(300) @ frame.rotation.T
        shadow = view.of(world[world[:, 2] >= 0])[:, :2]
        outline = hull(view.of(above_ground(frame))[:, :2])
        with row(seed, view.name, height):
            np.testing.assert_allclose(widths(outline), widths(shadow), atol=5e-4)
    # above the ground there is no part below
    frame = film_frame(1, height=0.06)
    assert above_ground(frame) is None and frame.lowest < 0.06 - SEMI_AXES.min()
    assert len(above_ground(film_frame(1, height=-0.06))) == 0


def test_a_line_before_the_torso_has_a_rim_and_one_behind_is_hidden():
    """Seen from the right, +x: of a line across, what is drawn over the torso, and its rim."""
    frame = dataclasses.replace(film_frame(0), rotation=np.eye(3))
    for side, colours in ((1, ["white", "red"]), (-1, [])):
        axes = Figure().subplots()
        pen = Pen(axes, frame, NAMED["side"], frame.torso)
        across = frame.torso + np.array([[0.05 * side, -0.2, 0], [0.05 * side, 0.2, 0]])
        pen.line(across, color="red", linewidth=1.0)
        over = [line for line in axes.lines if line.get_zorder() > 0.4]  # the torso's level
        assert [line.get_color() for line in over] == colours
        assert all(np.ptp(line.get_xdata()) == pytest.approx(0.4) for line in axes.lines)
