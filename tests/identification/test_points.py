"""Where markers are on the body, against the model's own tail points and SciPy's rotations."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.identification.placement import placements
from serpentail.identification.points import body_points, geometry_of
from serpentail.identification.trial import world_points
from tests.support import zoo
from tests.support.rows import row

MODELS = ("m2_n2", "arcs2", "own_links", "own_arcs")  # the last two on a tilted mount
OFFSET = (0.001, 0.002, 0.003)


def states(model, count=5):
    """Configurations of any attitude, with tails bent by up to a radian a coordinate."""
    q = np.random.default_rng(3).normal(size=(count, model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[-1, 7:] = 0.0
    return q


def test_markers_on_the_centre_line_are_at_the_models_tail_points():
    for name in MODELS:
        model = zoo.model(name)
        q, p = states(model), model.parameters
        points = model.tail_points(q)
        pieces = np.array(p.get("link_lengths", p.get("arc_lengths", ())))
        count = points.shape[1] - 1
        each = len(pieces) or int(np.sum(model.joints_each))
        pieces = pieces if len(pieces) else np.full(each, p["tail_length"] / each)
        ends = np.concatenate([[0], np.cumsum(np.repeat(pieces / (count // each), count // each))])
        along = np.minimum(ends / ends[-1], 1)
        placed = placements(model, {f"p{k}": st.Marker(tail=s) for k, s in enumerate(along)})
        np.testing.assert_allclose(world_points(model, placed, q), points, atol=1e-14, err_msg=name)


def test_offsets_turn_with_links_and_with_slices_of_arcs():
    def turned(model, tail, turns):
        q = states(model)
        turn = Rotation.from_quat(q[:, [4, 5, 6, 3]])
        for vector in turns(q):
            turn = turn * Rotation.from_rotvec(vector)
        markers = {"a": st.Marker(tail=tail, offset=OFFSET), "line": st.Marker(tail=tail)}
        found = world_points(model, placements(model, markers), q)
        np.testing.assert_allclose(found[:, 0], found[:, 1] + turn.apply(OFFSET), atol=1e-14)

    def of_links(q):
        return [q[:, 7:8] * [1, 0, 0], q[:, 8:9] * [0, 0, 1]] * 2

    def of_arcs(q):
        bends = [np.stack([q[:, k], 0 * q[:, k], q[:, k + 1]], axis=1) for k in (7, 9)]
        return [bends[0], bends[1] / 2]

    turned(zoo.model("m2_n2"), 0.5, of_links)  # at the end of the first segment's links
    turned(zoo.model("arcs2"), 0.75, of_arcs)


def test_derivatives_are_central_differences():
    h, none = 1e-6, np.zeros(0, int)
    for name in MODELS:
        model = zoo.model(name)
        shape, tail = geometry_of(model), states(model)[:, 7:]
        offset = (0.001, -0.002, 0.003)
        places = {f"p{k}": st.Marker(tail=s, offset=offset) for k, s in enumerate((0.1, 0.6, 1.0))}
        placed = placements(model, places | {"torso": st.Marker(torso=(0.01, 0.02, 0.03))})
        numbers = shape.numbers
        found = body_points(shape, tail, placed, np.arange(len(numbers)))
        with row(name):
            for k, step in enumerate(h * np.eye(tail.shape[1])):
                ahead = body_points(shape, tail + step, placed, none).points
                behind = body_points(shape, tail - step, placed, none).points
                wanted = (ahead - behind) / (2 * h)
                np.testing.assert_allclose(found.by_tail[..., k], wanted, atol=1e-9)
            for k, step in enumerate(h * np.eye(len(numbers))):
                ends = [
                    body_points(other(shape, numbers + way * step), tail, placed, none).points
                    for way in (1, -1)
                ]
                wanted = (ends[0] - ends[1]) / (2 * h)
                np.testing.assert_allclose(found.by_geometry[..., k], wanted, atol=1e-9)


def other(shape, numbers):
    """The geometry with other numbers."""
    return replace(shape, mount=numbers[:3], angles=numbers[3:6], lengths=numbers[6:])
