"""What is wrong with arguments and doubtful in data is told by name."""

import numpy as np
import pytest

import serpentail as st
from tests.identification.flights import flown, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES, TIPS = np.linspace(0, 0.1, 21), ("tail2", "tail3")


@pytest.fixture(scope="module")
def flight():
    model = zoo.model("m1_n3")
    return model, flown(model, TIMES, start(model))


def test_arguments_are_refused(flight):
    model, states = flight
    data = tracks(model, TIMES, states, 1e-4)
    short = np.linspace(0, 0.05, 2)
    for words, change in {
        "estimate: value 'tail_mas'.*'tail_mass'": {"estimate": ["tail_mas"]},
        "estimate: value 3": {"estimate": [3]},
        "estimate: marker:nos: .*'nose'": {"estimate": ["marker:nos"]},
        r"torso_inertia\[3\]: there are entries 0 to 2": {"estimate": ["torso_inertia[3]"]},
        r"torso_inertia\[same\]: value": {"estimate": ["torso_inertia[same]"]},
        r"tail_mount\[1\] is named twice": {"estimate": ["tail_mount", "tail_mount[1]"]},
        "estimate: value 'tail_mass'": {"estimate": "tail_mass"},
        "estimate.tail_mass: value -1": {"estimate": {"tail_mass": -1.0}},
        "noise.nose: value 0": {"noise": 0.0},
        "noise.left: value 2": {"noise": dict.fromkeys(placed(model), 2) | {"nose": 1e-3}},
        "noise: no value for 'left'": {"noise": {"nose": 1e-3}},
        "confidence: value 1": {"confidence": 1.0},
        "confidence: value 0": {"confidence": 0.0},
        "torques: value .* 2 numbers": {"torques": [1.0, 2.0, 3.0]},
        "torques.std: value 0": {"torques": st.TorquePrior(0.0, 0.1)},
        "torques.time: value 0": {"torques": st.TorquePrior(0.1, 0.0)},
        "torques: known from 0 to 0.05 s": {"torques": (short, np.zeros((2, 2)))},
        "torques: known from 0.05 to": {"torques": (short + 0.05, np.zeros((2, 2)))},
        r"torques: times have shape \(2,\)": {"torques": (short, np.zeros((2, 3)))},
        "torques: times have .* increase": {"torques": (short[::-1], np.zeros((2, 2)))},
        r"torques\(0.* has shape \(3,\)": {"torques": lambda _t: np.zeros(3)},
        "torques: 2 entries: needs one of 1": {"torques": [None, None]},
        "markers: value {}": {"markers": {}},
        "markers.nose: value .*torso=": {"markers": {"nose": st.Marker()}},
        "markers.nose.tail: value 1.5": {"markers": {"nose": st.Marker(tail=1.5)}},
        "markers.nose.torso: value": {"markers": {"nose": st.Marker(torso=(1, 2))}},
        "markers of arrays: value 'ear'": {"markers": {"ear": st.Marker(tail=0.5)}},
        "data: none": {"data": []},
        "wild: no such setting": {"wild": 1},
    }.items():
        arguments = {"data": data, "markers": placed(model), "estimate": ["tail_mass"]} | change
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.identify(model, **arguments)


def test_models_that_cannot_be_identified_are_refused():
    data = st.marker_tracks(np.arange(5.0), np.ones((5, 1, 3)), ["a"], unit="m")
    for name, names, error, words in (
        ("bare", [], st.ModelError, "without 'forward_dynamics_derivatives'"),
        ("polar", [], st.ModelError, "polar"),
        ("single", [], st.ModelError, "float"),
        ("baked", ["tail_mass"], st.IdentificationError, "baked"),
        ("fixed", [], st.ModelError, "fixed"),
        (None, [], st.IdentificationError, "model: value 3"),
    ):
        with row(name), pytest.raises(error, match=words):
            st.identify(zoo.model(name) if name else 3, data, {"a": st.Marker(tail=1)}, names)
    for words, given, cutoff in (
        ("cutoff: value 0", data, 0),
        ("tracks: type str", "x.trc", 10),
        ("too few markers", data, 10),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.joint_torques(zoo.model("m1_n3"), given, {"a": st.Marker(tail=1)}, cutoff=cutoff)
    with pytest.raises(st.ModelError, match="fixed"):
        st.joint_torques(zoo.model("fixed"), data, {"a": st.Marker(tail=1)}, cutoff=10)


def test_too_few_markers_are_refused(flight):
    """Two, three on a line, and those that tell too little of the tail under unknown torques."""
    model, states = flight
    data = tracks(model, TIMES, states, 1e-2)
    two = {name: placed(model)[name] for name in ("nose", "tail3")}
    with pytest.raises(st.IdentificationError, match=r"too few markers: .* at most 2 at once"):
        st.identify(model, data, two)
    names, places = [*"abc"], data.positions[:, :1] + np.arange(3)[:, None]
    line = st.marker_tracks(TIMES, places, names, unit="m")
    with pytest.raises(st.IdentificationError, match="at most 3 at once, on a line"):
        st.identify(model, line, dict.fromkeys(names, st.Marker(torso=(0, 0, 0))))
    torso = {name: placed(model)[name] for name in ("nose", "left", "right")}
    data = tracks(model, TIMES[:8], states[:8])
    prior = st.TorquePrior(0.5, 0.02)
    assert st.identify(model, data, torso, torques=prior, noise=1e-5).success
    with pytest.raises(st.IdentificationError, match="do not determine tail coordinate"):
        st.identify(model, data, torso, torques=prior, noise=3e-5)


def swapped(data, a, b, frames=slice(None)):
    positions = data.positions.copy()
    i, j = data.names.index(a), data.names.index(b)
    positions[frames, [i, j]] = data.positions[frames, [j, i]]
    return st.marker_tracks(data.times, positions, data.names, unit="m")


def test_doubtful_markers_are_named(flight):
    model, states = flight
    data, markers = tracks(model, TIMES[:15], states[:15], 2e-4), placed(model)
    some, elsewhere = np.arange(8, 12)[:, None], {"nose": st.Marker(torso=(0, 0.06, 0.015))}
    for words, given, places in (
        (r"'tail2' .* 'tail3' .* 4 frames from 0.04 to 0.055", swapped(data, *TIPS, some), markers),
        ("'left' and 'right' .* throughout", swapped(data, "left", "right"), markers),
        ("marker 'nose' is off by", data, markers | elsewhere),
    ):
        with row(words), pytest.warns(st.DoubtfulMarkers, match=words):
            st.identify(model, given, places, noise=2e-4)
