"""The information of a motion that is yet to be recorded, against that of a recorded one."""

import numpy as np
import pytest

import serpentail as st
from serpentail.identification.result import trajectory_of
from tests.identification.flights import flown, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES = np.linspace(0, 0.2, 41)
NAMES = ["tail_mass", "tail_length"]


def motion(model, torque=None):
    states = flown(model, TIMES, start(model), torque)
    tau = np.array([torque(t) for t in TIMES]) if torque else np.zeros((len(TIMES), model.nq - 7))
    return trajectory_of(model, TIMES, states, tau), states


def test_it_is_the_covariance_of_an_identification():
    model = zoo.model("m1_n3")
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
    relative = design.covariance / np.outer(values, values)
    assert design.d_optimality == pytest.approx(-np.linalg.slogdet(relative)[1], rel=1e-6)
    assert list(design.std) == NAMES


def test_more_frames_and_less_noise_tell_more():
    model = zoo.model("m1_n3")
    planned, _ = motion(model)

    def d(**changes):
        given = {"noise": 3e-4, "rate": 200.0} | changes
        return st.fisher_information(model, planned, placed(model), NAMES, **given).d_optimality

    assert d(noise=1.5e-4) == pytest.approx(d() + 2 * np.log(4), rel=1e-6)
    assert d(rate=400.0) > d() + 1.0


def test_driven_tails_tell_the_scale_of_masses_and_limp_ones_do_not():
    model = zoo.model("m1_n3")
    names = ["torso_mass", "torso_inertia", "tail_mass"]
    how = {"noise": 3e-4, "rate": 200.0}
    limp = st.fisher_information(model, motion(model)[0], placed(model), names, **how)
    assert limp.d_optimality == -np.inf and len(limp.undetermined) == 1
    driven, _ = motion(model, lambda t: 2e-3 * np.array([np.sin(40 * t), np.cos(30 * t)]))
    told = st.fisher_information(model, driven, placed(model), names, **how)
    assert np.isfinite(told.covariance).all() and np.isinf(np.diag(limp.covariance)).all()


def test_bad_arguments_are_refused():
    model = zoo.model("m1_n1")
    usual = {"motion": motion(model)[0], "estimate": ["tail_mass"], "noise": 3e-4, "rate": 200.0}
    for words, change in {
        "noise: value 0": {"noise": 0},
        "rate: value -1": {"rate": -1},
        "rate: value 10: gives 3 frames": {"rate": 10.0},
        "estimate: none": {"estimate": []},
        "motion: value None": {"motion": None},
        "motion: value": {"motion": motion(zoo.model("m2_n2"))[0]},
    }.items():
        given = usual | change
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.fisher_information(model, markers=placed(model), **given)
    assert st.fisher_information(model, markers=placed(model), **usual | {"rate": 15.0}).names
