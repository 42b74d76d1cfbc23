"""Inverse dynamics of markers against the torques that made the motion; the smoother's response."""

import numpy as np
import pytest

import serpentail as st
from serpentail.identification.inverse import smoothed
from tests.identification.flights import elastic, flown, placed, start, tracks


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_the_smoother_passes_what_its_formula_says(share):
    """Amplitude 1 / (1 + (f / cutoff)^6), without delay; ends are left out."""
    cutoff, times = 10.0, np.linspace(0, 4, 1601)
    angle = 2 * np.pi * share * cutoff * times
    value, first, second = smoothed(times, np.sin(angle)[:, None], cutoff)
    middle = slice(500, 1100)
    gain = 1 / (1 + share**6)
    rate = 2 * np.pi * share * cutoff
    np.testing.assert_allclose(value[middle, 0], gain * np.sin(angle)[middle], atol=2e-3)
    np.testing.assert_allclose(
        first[middle, 0], gain * rate * np.cos(angle)[middle], atol=3e-3 * rate
    )
    np.testing.assert_allclose(
        second[middle, 0], -gain * rate**2 * np.sin(angle)[middle], atol=4e-3 * rate**2
    )


def test_uneven_times_with_gaps_are_smoothed_alike():
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, 2, 400))
    times[150:] += 0.03
    value, first, _ = smoothed(times, np.sin(5 * times)[:, None], 20.0)
    inner = slice(20, -20)
    np.testing.assert_allclose(value[inner, 0], np.sin(5 * times)[inner], atol=1e-4)
    np.testing.assert_allclose(first[inner, 0], 5 * np.cos(5 * times)[inner], atol=5e-3)


@pytest.mark.parametrize(("segments", "links"), [(1, 3), (1, None)])
def test_torques_power_and_the_residual_wrench_are_those_of_the_flight(segments, links):
    model = elastic(segments, links)
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
    model = elastic(1, 3)
    times = np.linspace(0, 0.3, 151)
    lighter = model.with_parameters(gravity=4.9)
    states = flown(lighter, times, start(model))
    found = st.joint_torques(model, tracks(model, times, states), placed(model), cutoff=80.0)
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    np.testing.assert_allclose(
        found.residual_force[20:-20], np.tile([0, 0, 4.9 * mass], (111, 1)), atol=0.01
    )


def test_bad_arguments_are_refused():
    model = elastic(1, 3)
    data = st.marker_tracks(np.arange(5.0), np.ones((5, 1, 3)), ["a"], unit="m")
    with pytest.raises(st.IdentificationError, match="cutoff: value 0"):
        st.joint_torques(model, data, {"a": st.Marker(tail=1)}, cutoff=0)
    with pytest.raises(st.IdentificationError, match="needs what read_markers returns"):
        st.joint_torques(model, "x.trc", {"a": st.Marker(tail=1)}, cutoff=10)
    with pytest.raises(st.IdentificationError, match="too few markers"):
        st.joint_torques(model, data, {"a": st.Marker(tail=1)}, cutoff=10)
