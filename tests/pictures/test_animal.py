"""The torso in a view: its outline, and what it hides."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from serpentail.pictures import filmstrip as film
from serpentail.pictures.animal import SIDE, TOP, Body, silhouette
from tests.support.drawn_flight import SEMI_AXES, flight, tail_points


def surface(count=300):
    """Points on the torso's ellipsoid, in its frame."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, count), np.linspace(0, 2 * np.pi, 2 * count))
    sphere = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    return np.stack(sphere, axis=-1).reshape(-1, 3) * SEMI_AXES


def film_frame(seed):
    """One frame of a film in a random attitude."""
    trajectory = flight(samples=1)
    q = trajectory.q.copy()
    q[:, 3:7] = Rotation.random(rng=seed).as_quat()
    trajectory = dataclasses.replace(trajectory, q=q)
    points = tail_points(trajectory)
    return film._frame(trajectory, points, q[:, :3], Body(), 0)


@pytest.mark.parametrize("view", [SIDE, TOP], ids=lambda view: view.name)
def test_views_are_right_handed(view):
    np.testing.assert_array_equal(np.cross(view.matrix[0], view.matrix[1]), view.matrix[2])


@pytest.mark.parametrize("view", [SIDE, TOP], ids=lambda view: view.name)
@pytest.mark.parametrize("seed", range(5))
def test_silhouette_is_the_outline_of_the_projected_surface(view, seed):
    rotation = Rotation.random(rng=seed).as_matrix()
    shadow = view.of(surface() @ rotation.T)[:, :2]
    outline = silhouette(rotation, SEMI_AXES, view, count=721)
    angle = np.linspace(0, 2 * np.pi, 90)
    directions = np.stack([np.cos(angle), np.sin(angle)])
    widths = (outline @ directions).max(axis=0), (shadow @ directions).max(axis=0)
    np.testing.assert_allclose(*widths, rtol=2e-4)
    np.testing.assert_allclose(outline[0], outline[-1], atol=1e-15)


@pytest.mark.parametrize("view", [SIDE, TOP], ids=lambda view: view.name)
@pytest.mark.parametrize("seed", range(3))
def test_the_torso_hides_exactly_what_a_ray_to_the_viewer_hits(view, seed):
    frame = film_frame(seed)
    points = frame.torso + np.random.default_rng(seed).uniform(-0.06, 0.06, (400, 3))
    outside = np.linalg.norm((points - frame.torso) @ frame.rotation / SEMI_AXES, axis=1) > 1
    steps = np.linspace(0, 0.2, 2001)[:, None, None] * view.matrix[2]
    ray = np.linalg.norm((points + steps - frame.torso) @ frame.rotation / SEMI_AXES, axis=-1)
    clear = ray.min(axis=0) > 1
    grazing = np.abs(ray.min(axis=0) - 1) < 1e-3
    over = frame.in_front(points, view)
    under_but_clear = (
        outside & ~over & clear
    )  # beside the torso: drawn under it, nothing covers it there
    spread = view.matrix[:2] @ frame.rotation * SEMI_AXES
    flat = view.of(points - frame.torso)[:, :2]
    covered = np.einsum("ni,ij,nj->n", flat, np.linalg.inv(spread @ spread.T), flat) < 1
    assert not (over & ~clear & ~grazing).any()
    assert not (under_but_clear & covered & ~grazing).any()
