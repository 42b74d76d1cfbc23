"""Where markers are on the body, against the model's own tail points and SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.identification.placement import placements
from serpentail.identification.points import body_points, geometry_of
from serpentail.identification.trial import world_points
from tests.identification.flights import elastic
from tests.support import own_tails


def states(model, count=5):
    """Configurations of any attitude, with tails bent by up to a radian a coordinate."""
    q = np.random.default_rng(3).normal(size=(count, model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[-1, 7:] = 0.0
    return q


MODELS = {
    "links": lambda: elastic(2, 3),
    "arcs": lambda: elastic(2, None),
    "tilted links": lambda: st.load(own_tails.folder("links", tilted=True)),
    "tilted arcs": lambda: st.load(own_tails.folder("arcs", tilted=True)),
}


@pytest.mark.parametrize("name", MODELS)
def test_markers_on_the_centre_line_are_at_the_models_tail_points(name):
    model = MODELS[name]()
    q = states(model)
    points = model.tail_points(q)
    p = model.parameters
    pieces = np.array(p.get("link_lengths", p.get("arc_lengths", ())))
    count = points.shape[1] - 1
    each = len(pieces) or int(np.sum(model.joints_each))
    pieces = pieces if len(pieces) else np.full(each, p["tail_length"] / each)
    ends = np.concatenate([[0], np.cumsum(np.repeat(pieces / (count // each), count // each))])
    along = np.minimum(ends / ends[-1], 1)
    placed = placements(model, {f"p{k}": st.Marker(tail=s) for k, s in enumerate(along)})
    np.testing.assert_allclose(world_points(model, placed, q), points, atol=1e-14)


def test_offsets_turn_with_the_links():
    model = elastic(2, 3)
    q = states(model)
    placed = placements(model, {"a": st.Marker(tail=0.5, offset=(0.001, 0.002, 0.003))})
    turn = Rotation.from_quat(q[:, [4, 5, 6, 3]])
    for _ in range(3):
        turn = turn * Rotation.from_rotvec(q[:, 7:8] * [1, 0, 0])
        turn = turn * Rotation.from_rotvec(q[:, 8:9] * [0, 0, 1])
    reference = model.tail_points(q)[:, 3] + turn.apply([0.001, 0.002, 0.003])
    np.testing.assert_allclose(world_points(model, placed, q)[:, 0], reference, atol=1e-14)


def test_offsets_turn_with_the_slices_of_arcs():
    model = elastic(2, None)
    q = states(model)
    placed = placements(model, {"a": st.Marker(tail=0.75, offset=(0.001, 0.002, 0.003))})
    line = placements(model, {"a": st.Marker(tail=0.75)})
    turn = Rotation.from_quat(q[:, [4, 5, 6, 3]])
    for k, share in ((7, 1.0), (9, 0.5)):
        bend = np.stack([q[:, k], 0 * q[:, k], q[:, k + 1]], axis=1)
        turn = turn * Rotation.from_rotvec(share * bend)
    reference = world_points(model, line, q)[:, 0] + turn.apply([0.001, 0.002, 0.003])
    np.testing.assert_allclose(world_points(model, placed, q)[:, 0], reference, atol=1e-14)


@pytest.mark.parametrize("name", MODELS)
def test_derivatives_are_central_differences(name):
    model = MODELS[name]()
    shape = geometry_of(model)
    tail = states(model)[:, 7:]
    offset = (0.001, -0.002, 0.003)
    places = {f"p{k}": st.Marker(tail=s, offset=offset) for k, s in enumerate((0.1, 0.6, 1.0))}
    placed = placements(model, places | {"torso": st.Marker(torso=(0.01, 0.02, 0.03))})
    none = np.zeros(0, int)
    found = body_points(shape, tail, placed, np.arange(len(shape.numbers)))
    h = 1e-6
    for k in range(tail.shape[1]):
        step = h * np.eye(tail.shape[1])[k]
        ahead = body_points(shape, tail + step, placed, none).points
        behind = body_points(shape, tail - step, placed, none).points
        np.testing.assert_allclose(found.by_tail[..., k], (ahead - behind) / (2 * h), atol=1e-9)
    mount = np.array(model.parameters["tail_mount"])
    longer = model.with_parameters(tail_mount=mount + h * np.eye(3)[0])
    ahead = body_points(geometry_of(longer), tail, placed, none).points
    np.testing.assert_allclose(found.by_geometry[..., 0], (ahead - found.points) / h, atol=1e-8)
