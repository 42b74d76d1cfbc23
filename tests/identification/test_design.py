"""The information of a motion that is yet to be recorded, against that of a recorded one."""

import numpy as np
import pytest

import serpentail as st
from serpentail.identification.result import trajectory_of
from tests.identification.flights import elastic, flown, placed, start, tracks

TIMES = np.linspace(0, 0.2, 41)
NAMES = ["tail_mass", "tail_length", "tail_damping[same]"]


def motion(model, torque=None):
    states = flown(model, TIMES, start(model), torque)
    tau = np.array([torque(t) for t in TIMES]) if torque else np.zeros((len(TIMES), 2))
    return trajectory_of(model, TIMES, states, tau), states


def test_it_is_the_covariance_of_an_identification():
    model = elastic(1, 3)
    planned, states = motion(model)
    design = st.fisher_information(model, planned, placed(model), NAMES, noise=3e-4, rate=200.0)
    data = tracks(model, TIMES, states)
    found = st.identify(model, data, placed(model), NAMES, noise=3e-4)
    scale = np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(
        design.covariance / np.outer(scale, scale),
        found.covariance / np.outer(scale, scale),
        atol=1e-3,
    )
    values = np.array([model.parameters["tail_mass"], model.parameters["tail_length"]])
    relative = design.covariance / np.outer(*[np.r_[values, 5e-5]] * 2)
    assert design.d_optimality == pytest.approx(-np.linalg.slogdet(relative)[1], rel=1e-6)
    assert list(design.std) == NAMES


def test_more_frames_and_less_noise_tell_more():
    model = elastic(1, 3)
    planned, _ = motion(model)

    def d(**changes):
        given = {"noise": 3e-4, "rate": 200.0} | changes
        return st.fisher_information(model, planned, placed(model), NAMES, **given).d_optimality

    assert d(noise=1.5e-4) == pytest.approx(d() + 3 * np.log(4), rel=1e-6)
    assert d(rate=400.0) > d() + 1.0


def test_driven_tails_tell_the_scale_of_masses_and_limp_ones_do_not():
    model = elastic(1, 3)
    names = [
        "torso_mass",
        "torso_inertia",
        "tail_mass",
        "tail_stiffness[same]",
        "tail_damping[same]",
    ]
    how = {"noise": 3e-4, "rate": 200.0}
    limp = st.fisher_information(model, motion(model)[0], placed(model), names, **how)
    assert limp.d_optimality == -np.inf and len(limp.undetermined) == 1
    driven, _ = motion(model, lambda t: 2e-3 * np.array([np.sin(40 * t), np.cos(30 * t)]))
    told = st.fisher_information(model, driven, placed(model), names, **how)
    assert np.isfinite(told.covariance).all() and np.isinf(np.diag(limp.covariance)).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"noise": 0}, "noise: value 0"),
        ({"rate": -1}, "rate: value -1"),
        ({"rate": 10.0}, "gives 3 frames: needs 4"),
        ({"estimate": []}, "estimate: none"),
        ({"motion": None}, "motion: value None: needs a Trajectory"),
    ],
)
def test_bad_arguments_are_refused(change, words):
    model = elastic(1, 3)
    given = {"noise": 3e-4, "rate": 200.0, "estimate": NAMES, "motion": motion(model)[0]} | change
    with pytest.raises(st.IdentificationError, match=words):
        st.fisher_information(
            model,
            given["motion"],
            placed(model),
            given["estimate"],
            noise=given["noise"],
            rate=given["rate"],
        )
