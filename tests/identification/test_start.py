"""The first guess: attitudes that hidden torsos leave open, its time, and scales that are wrong;
markers that look swapped or are elsewhere than stated, and missing torques, are told apart.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.identification.placement import placements
from serpentail.identification.start import motion_shown
from tests.identification.flights import TORSO, flown, hidden, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES = np.linspace(0, 0.15, 31)


def turned_by(a, b):
    """Angles (F,) in degrees between the attitudes of configurations."""
    one, other = (Rotation.from_quat(each[:, [4, 5, 6, 3]]) for each in (a, b))
    return np.degrees((one.inv() * other).magnitude())


@pytest.mark.parametrize(
    "seeds",
    [range(24), pytest.param(range(24, 60), marks=pytest.mark.slow)],
    ids=["some", "others"],
)
def test_the_torso_may_be_hidden_in_the_first_frames(seeds):
    """Flights of any attitude; all or some of the torso is hidden in frames 0 to 5."""
    for seed in seeds:
        model = zoo.model(("m1_n3", "m2_n2", "arcs2")[seed % 3])
        x, rng = start(model, seed), np.random.default_rng([seed, 7])
        x[3:7] = Rotation.random(random_state=seed).as_quat()
        states = flown(model, TIMES, x, rtol=1e-6)
        names = list(TORSO) if seed % 2 else rng.choice(list(TORSO), 2 + seed % 4 // 2, False)
        data = tracks(model, TIMES, states, 5e-4, seed=seed, gaps=0.1)
        data = hidden(data, names, slice(1 + seed % 6))
        shown = motion_shown(placements(model, placed(model)), data)
        with row(seed):
            assert turned_by(shown, states).max() < 45
            assert np.abs(shown[:, 7 : model.nq] - states[:, 7 : model.nq]).max() < 0.7


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
def test_positions_in_a_wrong_unit_are_refused_before_a_fit():
    model = zoo.model("m1_n3")
    data = tracks(model, TIMES, flown(model, TIMES, start(model)), 2e-4)
    tail = {name: each for name, each in placed(model).items() if name not in list(TORSO)[1:]}
    for words, factor, unit, markers in (
        (r"0\.00\d* times .* m read as mm: .*unit=\"m\"", 1, "mm", placed(model)),
        (r"(99\d|1000)\S* times .* mm read as m: .*unit=\"mm\"", 1e3, "m", placed(model)),
        (r"9\.\d* times .* mm read as cm: .*unit=\"mm\"", 1e3, "cm", placed(model)),
        (r"0\.039\d* times .* in read as mm: .*unit=\"in\"", 1 / 0.0254, "mm", placed(model)),
        (r"0\.39\d* times .* in read as cm: .*unit=\"in\"", 1 / 0.0254, "cm", placed(model)),
        (r"0\.003\d* times .* check the unit 'mm'", 1 / 0.3048, "mm", placed(model)),
        (r"9\d\d\S* times .* mm read as m", 1e3, "m", tail),
    ):
        given = st.marker_tracks(TIMES, factor * data.positions, data.names, unit=unit)
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.identify(model, given, markers, ["tail_mass"])
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.joint_torques(model, given, markers, cutoff=20)
    # a place that is estimated does not count
    rough = {name: st.Marker(torso=(0, 1e-3, 0)) for name in list(TORSO)[:2]}
    names = [f"marker:{name}" for name in rough]
    assert st.identify(model, data, placed(model) | rough, names).success


def test_masses_and_their_intervals_are_never_negative():
    """Noise drives one of them to its bound; the search did not converge there."""
    model = zoo.model("m1_n3")
    for seed in (1, 2):
        states = flown(model, TIMES, start(model, seed), rtol=1e-8)
        data = tracks(model, TIMES, states, 5e-4, seed=seed)
        found = st.identify(model, data, placed(model), ["tail_mass"])
        mass = found["tail_mass"]
        assert found.success and mass.at_bound == (seed == 1)
        assert 0 < mass.value < mass.high
        assert 0 <= mass.low < model.parameters["tail_mass"] < mass.high


TIPS = ("tail2", "tail3")
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
