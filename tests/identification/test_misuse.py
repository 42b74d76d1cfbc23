"""What is wrong with data and arguments is told by name, with the remedy."""

import numpy as np
import pytest

import serpentail as st
from tests.identification.flights import FUNCTIONS, elastic, flown, placed, start, tracks
from tests.support.models import model_folder

TIMES = np.linspace(0, 0.15, 31)


@pytest.fixture(scope="module")
def flight():
    model = elastic(1, 3)
    return model, flown(model, TIMES, start(model))


def arrays(count=6):
    positions = np.random.default_rng(0).normal(size=(count, 2, 3))
    return np.arange(float(count)), positions, ["a", "b"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, x, n: (t, x, n, {"unit": None}), 'unit: none is stated: give unit="mm"'),
        (lambda t, x, n: (t, x, n, {"unit": "inch"}), "unit: value 'inch': needs one of m, cm, mm"),
        (lambda t, x, n: (np.r_[t[:3], t[2:-1]], x, n, {}), "frame 3 .* has 2 s, repeated"),
        (lambda t, x, n: (t[::-1], x, n, {}), "before the last"),
        (lambda t, x, n: (t, x[:, :1], n, {}), r"shape \(6, 1, 3\): needs \(6, 2, 3\)"),
        (lambda t, x, n: (t, x, ["a", "a"], {}), "two markers are called 'a'"),
        (lambda t, x, n: (t, x * [[[1], [0]]], n, {}), "'b' is at exactly .* in 6 frames.*zeros="),
        (lambda t, x, n: (t, x * [[[1], [np.nan]]], n, {}), "never seen: b"),
        (lambda t, x, n: (t, x * np.inf, n, {}), "infinite: use nan for a gap"),
        (lambda t, x, n: (t[:2], x[:2], n, {}), "needs 4 frames or more"),
        (lambda t, x, n: (t, x, n, {"axes": "xzy"}), "axes: value 'xzy'?.*right-handed"),
        (lambda t, x, n: (t, x, n, {"zeros": "maybe"}), "zeros: value 'maybe'"),
    ],
)
def test_arrays_are_refused(change, words):
    t, x, names, how = change(*arrays())
    with pytest.raises(st.IdentificationError, match=words):
        st.marker_tracks(t, x, names, **({"unit": "m"} | how))


def test_zeros_can_be_read_as_gaps():
    t, x, names = arrays()
    x[2, 1] = 0
    found = st.marker_tracks(t, x, names, unit="mm", zeros="gap")
    assert not found.seen[2, 1] and found.seen.sum() == 11
    np.testing.assert_allclose(found.positions[3], 1e-3 * x[3], rtol=1e-15)


def test_axes_turn_the_world():
    t, x, names = arrays()
    found = st.marker_tracks(t, x, names, unit="m", axes="zxy").positions
    np.testing.assert_array_equal(found, x[..., [2, 0, 1]])
    found = st.marker_tracks(t, x, names, unit="m", axes="-yxz").positions
    np.testing.assert_array_equal(found, x[..., [1, 0, 2]] * [-1, 1, 1])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"estimate": ["tail_mas"]}, "estimate: value 'tail_mas': did you mean 'tail_mass'"),
        ({"estimate": ["marker:nos"]}, "no such marker; did you mean 'nose'"),
        ({"estimate": ["torso_inertia[3]"]}, "there are entries 0 to 2"),
        ({"estimate": ["torso_inertia[same]"]}, "needs entries that are equal"),
        ({"estimate": ["tail_mount", "tail_mount[1]"]}, r"tail_mount\[1\] is named twice"),
        ({"estimate": "tail_mass"}, "estimate: value 'tail_mass': needs names"),
        ({"estimate": {"tail_mass": -1.0}}, "estimate.tail_mass: value -1.0"),
        ({"noise": 0.0}, "noise.nose: value 0.0: needs a number above 0"),
        ({"noise": {"nose": 1e-3}}, "noise: no value for 'left'"),
        ({"confidence": 1.0}, "confidence: value 1.0: needs a number below 1"),
        ({"torques": [1.0, 2.0, 3.0]}, "torques: value .*needs None, 2 numbers"),
        ({"torques": st.TorquePrior(0.0, 0.1)}, "torques.std: value 0.0"),
        ({"torques": (np.array([0, 0.1]), np.zeros((2, 2)))}, "known from 0 to 0.1 s"),
        ({"markers": {}}, "markers: value {}: needs a Marker"),
        ({"markers": {"nose": st.Marker()}}, "markers.nose: value .*torso=.*or with tail"),
        ({"markers": {"nose": st.Marker(tail=1.5)}}, "markers.nose.tail: value 1.5"),
        ({"markers": {"ear": st.Marker(tail=0.5)}}, "markers of arrays: value 'ear'"),
        ({"data": []}, "data: none"),
        ({"data": "tracks.xlsx"}, "needs a file whose name ends in .trc, .csv, .c3d"),
        ({"wild": 1}, "wild: no such setting"),
    ],
)
def test_arguments_are_refused(flight, change, words):
    model, states = flight
    data = tracks(model, TIMES, states, 1e-4)
    arguments = {"data": data, "markers": placed(model), "estimate": ["tail_mass"]} | change
    with pytest.raises(st.IdentificationError, match=words):
        st.identify(model, **arguments)


def test_too_few_markers_are_refused(flight):
    model, states = flight
    data = tracks(model, TIMES, states, 1e-4)
    two = {name: placed(model)[name] for name in ("nose", "tail3")}
    with pytest.raises(st.IdentificationError, match=r"too few markers: .* at most 2 at once"):
        st.identify(model, data, two)


def test_a_tail_that_nothing_shows_is_refused(flight):
    """Under unknown torques the torso's markers tell too little of the tail."""
    model, states = flight
    data = tracks(model, TIMES, states, 1e-2)
    torso = {name: placed(model)[name] for name in ("nose", "left", "right")}
    with pytest.raises(st.IdentificationError, match=r"do not determine.*tail coordinate"):
        st.identify(model, data, torso, torques=st.TorquePrior(0.5, 0.02))


def swapped(data, a, b, frames=slice(None)):
    positions = data.positions.copy()
    i, j = data.names.index(a), data.names.index(b)
    positions[frames, i], positions[frames, j] = (
        data.positions[frames, j],
        data.positions[frames, i],
    )
    return st.marker_tracks(data.times, positions, data.names, unit="m")


def test_markers_swapped_in_some_frames_are_named(flight):
    model, states = flight
    data = swapped(tracks(model, TIMES, states, 2e-4), "tail2", "tail3", slice(10, 14))
    words = "'tail2' and 'tail3' look swapped in 4 frames from 0.05 to 0.065 s"
    with pytest.warns(st.DoubtfulMarkers, match=words):
        st.identify(model, data, placed(model), noise=2e-4)


def test_markers_swapped_throughout_are_named(flight):
    model, states = flight
    data = swapped(tracks(model, TIMES, states, 2e-4), "left", "right")
    with pytest.warns(st.DoubtfulMarkers) as told:
        st.identify(model, data, placed(model), noise=2e-4)
    assert any("'left' and 'right' look swapped throughout" in str(each.message) for each in told)


def test_a_model_without_the_derivatives_is_refused():
    bare = st.load(model_folder(1, 3, functions=FUNCTIONS[:-1]))
    data = st.marker_tracks(np.arange(5.0), np.ones((5, 1, 3)), ["a"], unit="m")
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_parameter_derivatives'"):
        st.identify(bare, data, {"a": st.Marker(tail=1)}, ["tail_mass"])
