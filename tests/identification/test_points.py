"""Where markers are on the body, against the model's own tail points and SciPy's rotations; and
integrated intervals against SciPy's integrator, their derivatives against differences.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.identification import stages
from serpentail.identification.placement import placements
from serpentail.identification.points import body_points, geometry_of
from serpentail.identification.trial import world_points
from tests.identification.flights import flown, start
from tests.support import zoo
from tests.support.rows import row

MODELS = ("m2_n2", "arcs2", "own_links", "own_arcs")  # the last two on a tilted mount
OFFSET = (0.001, 0.002, 0.003)


def shapes(model, count=5):
    """Configurations of any attitude, with tails bent by up to a radian a coordinate."""
    q = np.random.default_rng(3).normal(size=(count, model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[-1, 7:] = 0.0
    return q


def test_markers_on_the_centre_line_are_at_the_models_tail_points():
    for name in MODELS:
        model = zoo.model(name)
        q, p = shapes(model), model.parameters
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
        q = shapes(model)
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


def test_derivatives_of_points_are_central_differences():
    h, none = 1e-6, np.zeros(0, int)
    for name in MODELS:
        model = zoo.model(name)
        shape, tail = geometry_of(model), shapes(model)[:, 7:]
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


# Intervals.


@pytest.mark.parametrize("name", ["m1_n3", "elastic", "arcs2"])
def test_ends_of_intervals_are_those_of_scipy(name):
    model = zoo.model(name)
    times = np.linspace(0, 0.05, 41)
    states = flown(model, times, start(model))
    spans, begin = np.diff(times), states[:-1]
    torques = np.zeros((len(spans), 3, model.layout.nt))
    found = stages.solved(model, spans, begin, torques, np.repeat(begin[:, None], 3, axis=1))
    off = stages.difference(model, found[:, -1], states[1:])
    assert np.abs(off).max() < 1e-7


def interval(model, x, torques, span=0.004):
    """End of one interval with torques at both ends."""
    nodes = stages.NODES[:, None]
    over = ((1 - nodes) * torques[0] + nodes * torques[1])[None]
    begin = x[None]
    guess = np.repeat(begin[:, None], 3, axis=1)
    return stages.solved(model, np.array([span]), begin, over, guess)[0], over


@pytest.mark.parametrize("name", ["m1_n3", "elastic_arcs"])
def test_derivatives_of_intervals_are_central_differences(name):
    model = zoo.model(name)
    rng = np.random.default_rng(0)
    x, torques = start(model), 1e-3 * rng.standard_normal((2, model.layout.nt))
    columns = np.eye(len(model.parameter_vector))
    X, over = interval(model, x, torques)
    parts = X[None], columns, True
    found = stages.differentiated(model, np.array([0.004]), x[None], over, parts)

    def change(ahead, behind, h):
        return stages.difference(model, ahead[-1], behind[-1]) / (2 * h)

    h = 1e-6
    for k, step in enumerate(h * np.eye(2 * model.nv)):
        ends = [interval(model, stages.moved(model, x, s * step), torques)[0] for s in (1, -1)]
        np.testing.assert_allclose(found.by_state[0, :, k], change(*ends, h), atol=2e-6, rtol=2e-6)
    for end in (0, 1):
        for k in range(model.layout.nt):
            step = np.zeros_like(torques)
            step[end, k] = 1e-5
            ends = [interval(model, x, torques + s * step)[0] for s in (1, -1)]
            wanted = change(*ends, 1e-5)
            np.testing.assert_allclose(
                found.by_torque[0, end, :, k], wanted, atol=1e-6 * np.abs(wanted).max()
            )
    for of, column in (("torso_mass", 1), ("tail_mount", 5)):
        value = np.array(model.parameters[of], float)
        small = 1e-6 * max(np.abs(value).max(), 1e-3)
        unit = np.eye(3)[0] if value.ndim else 1.0
        ends = []
        for sign in (1, -1):
            other = model.with_parameters(**{of: value + sign * small * unit})
            ends.append(interval(other, x, torques)[0])
        wanted = change(*ends, small)
        np.testing.assert_allclose(
            found.by_parameters[0, :, column], wanted, atol=1e-5 * np.abs(wanted).max() + 1e-9
        )
