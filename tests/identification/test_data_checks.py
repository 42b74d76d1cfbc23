"""Markers that look swapped or are elsewhere than stated, and missing torques, are told apart."""

from dataclasses import replace

import numpy as np
import pytest

import serpentail as st
from tests.identification.flights import flown, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES, TIPS = np.linspace(0, 0.15, 31), ("tail2", "tail3")
MISSING, OFF = r"torques are missing: .*TorquePrior\(", "marker '{}' is off by"


def seen(torque=None, seed=0):
    model = zoo.model("m1_n3")
    states = flown(model, TIMES, start(model, seed), torque, rtol=1e-7)
    return model, tracks(model, TIMES, states, 5e-4, seed=seed, gaps=0.1)


@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 20), marks=pytest.mark.slow)])
def test_sound_trials_are_not_doubted(seeds):
    for seed in seeds:
        model, data = seen(seed=seed)
        with row(seed):  # warnings are errors
            st.identify(model, data, placed(model), ["tail_mass"])


def test_missing_torques_are_named_and_no_marker_is_blamed():
    for size, torque in (
        (1e-3, lambda t: 1e-3 * np.array([np.sin(40 * t), np.cos(30 * t)])),
        (3e-3, lambda t: 3e-3 * np.array([np.sin(40 * t), np.cos(30 * t)])),
        ("constant", lambda _t: np.array([1e-3, -2e-3])),
    ):
        model, data = seen(torque)
        with row(size), pytest.warns(st.DoubtfulMarkers, match=MISSING) as told:
            st.identify(model, data, placed(model), ["tail_mass"])
        assert len(told) == 1


def test_a_marker_that_is_elsewhere_is_still_blamed():
    model, data = seen()
    for name in ("nose", "tail1"):
        places = placed(model)
        places[name] = replace(places[name], offset=(0.0, 0.01, 0.0))
        with row(name), pytest.warns(st.DoubtfulMarkers, match=OFF.format(name)) as told:
            st.identify(model, data, places)
            st.joint_torques(model, data, places, cutoff=60.0)
        assert [each.filename for each in told] == [__file__, __file__]


def swapped(data, a, b, frames=slice(None)):
    positions = data.positions.copy()
    i, j = data.names.index(a), data.names.index(b)
    positions[frames, [i, j]] = data.positions[frames, [j, i]]
    return st.marker_tracks(data.times, positions, data.names, unit="m")


def test_markers_that_look_swapped_or_misplaced_are_named_once():
    model, times = zoo.model("m1_n3"), np.linspace(0, 0.07, 15)
    data, markers = tracks(model, times, flown(model, times, start(model)), 2e-4), placed(model)
    some, elsewhere = np.arange(8, 12)[:, None], {"nose": st.Marker(torso=(0, 0.06, 0.015))}
    third = np.arange(5)[:, None]  # of 15 frames: not throughout
    for words, given, places in (
        (r"'tail2' .* 'tail3' .* 4 frames from 0.04 to 0.055", swapped(data, *TIPS, some), markers),
        (r"'left' .* 'right' .* in 5 frames", swapped(data, "left", "right", third), markers),
        ("'left' and 'right' .* throughout", swapped(data, "left", "right"), markers),
        ("marker 'nose' is off by", data, markers | elsewhere),
    ):
        with row(words), pytest.warns(st.DoubtfulMarkers, match=words) as told:
            st.identify(model, given, places, noise=2e-4)
        assert len(told) == 1
