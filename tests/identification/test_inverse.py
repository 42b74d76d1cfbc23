"""Inverse dynamics of markers against the torques that made the motion; the smoother's response."""

import numpy as np
import pytest

import serpentail as st
from serpentail.identification.inverse import smoothed
from tests.identification.flights import flown, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row


def test_the_smoother_passes_what_its_formula_says():
    """Amplitude 1 / (1 + (f / cutoff)^6), without delay; ends are left out."""
    cutoff, times, shares = 10.0, np.linspace(0, 1.5, 601), np.array([0.5, 1.0, 2.0])
    rate = 2 * np.pi * shares * cutoff
    sine, cosine = np.sin(times[:, None] * rate), np.cos(times[:, None] * rate)
    gain, middle = 1 / (1 + shares**6), slice(200, 400)
    wanted = gain * sine, gain * cosine, -gain * sine
    for order, found in enumerate(smoothed(times, sine, cutoff)):
        off = (found / rate**order - wanted[order])[middle]
        assert np.abs(off).max() < [2e-3, 3e-3, 4e-3][order], order


def test_uneven_times_with_gaps_are_smoothed_alike():
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, 2, 400))
    times[150:] += 0.03
    value, first, _ = smoothed(times, np.sin(5 * times)[:, None], 20.0)
    inner = slice(20, -20)
    np.testing.assert_allclose(value[inner, 0], np.sin(5 * times)[inner], atol=1e-4)
    np.testing.assert_allclose(first[inner, 0], 5 * np.cos(5 * times)[inner], atol=5e-3)


def test_torques_power_and_the_residual_wrench_are_those_of_the_flight():
    model = zoo.model("m1_n3")
    times = np.linspace(0, 0.4, 201)

    def torque(t):
        return 1e-3 * np.array([np.sin(30 * t), np.cos(20 * t)])

    states = flown(model, times, start(model), torque)
    found = st.joint_torques(model, tracks(model, times, states), placed(model), cutoff=80.0)
    inner = slice(20, -20)
    wanted = np.array([torque(t) for t in times])[inner]
    np.testing.assert_allclose(found.tau[inner], wanted, atol=3e-5)
    np.testing.assert_allclose(
        found.power[inner], wanted * states[inner, -2:], atol=3e-5 * np.abs(states[:, -2:]).max()
    )
    weight = 9.8 * (model.parameters["torso_mass"] + model.parameters["tail_mass"])
    assert np.abs(found.residual_force[inner]).max() < 0.01 * weight
    assert np.abs(found.residual_moment[inner]).max() < 1e-4


def test_a_push_on_the_torso_is_the_residual_wrench():
    """The reference flies with another weight: what is missing is the difference."""
    model = zoo.model("m1_n3")
    times = np.linspace(0, 0.3, 151)
    lighter = model.with_parameters(gravity=4.9)
    states = flown(lighter, times, start(model))
    found = st.joint_torques(model, tracks(model, times, states), placed(model), cutoff=80.0)
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    np.testing.assert_allclose(
        found.residual_force[20:-20], np.tile([0, 0, 4.9 * mass], (111, 1)), atol=0.01
    )


def test_bad_arguments_are_refused():
    model, marker = zoo.model("m1_n3"), {"a": st.Marker(tail=1)}
    data = st.marker_tracks(np.arange(5.0), np.ones((5, 1, 3)), ["a"], unit="m")
    for words, given, cutoff in (
        ("cutoff: value 0", data, 0),
        ("tracks: type str", "x.trc", 10),
        ("too few markers", data, 10),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.joint_torques(model, given, marker, cutoff=cutoff)
    with pytest.raises(st.ModelError, match="fixed"):
        st.joint_torques(zoo.model("fixed"), data, marker, cutoff=10)
