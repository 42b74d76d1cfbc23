"""What ``identify`` finds in generated flights, and how certain it says that it is."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import binom, chi2

import serpentail as st
from serpentail.identification.result import trajectory_of
from serpentail.identification.torques import known_torques, prior_rows
from tests.identification.flights import elastic, flown, placed, seen, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES = np.linspace(0, 0.15, 31)
LATER = np.linspace(0, 0.2, 41)
slow = partial(pytest.param, marks=pytest.mark.slow)
WANTED = ["tail_mass", "tail_length", "tail_stiffness[same]", "tail_damping[same]"]
FEW = np.linspace(0, 0.1, 21)
RARE = 1e-4 / 2  # bounds that a right covariance leaves once in ten thousand runs
KNOWN = ["tail_mass", "tail_length"]
UNKNOWN, PRIOR = ["tail_length", "marker:tail2"], st.TorquePrior(1e-3, 0.03)
ALL_MASSES = ["torso_mass", "torso_inertia", "tail_mass"]


def waves(t):
    return 2e-3 * np.array([np.sin(40 * t), np.cos(30 * t)])


@pytest.mark.parametrize("name", ["elastic", slow("elastic_arcs")])
def test_exact_tracks_give_the_exact_parameters(name):
    model = elastic(name)
    off = {"tail_mass": 0.0042, "tail_length": 0.185, "tail_stiffness": 3e-3, "tail_damping": 2e-5}
    states = flown(model, TIMES, start(model))
    data = tracks(model, TIMES, states)
    found = st.identify(model.with_parameters(**off), data, placed(model), WANTED)
    assert found.success and found.noise < 2e-6
    truth = [np.atleast_1d(model.parameters[each.split("[")[0]])[0] for each in WANTED]
    np.testing.assert_allclose([each.value for each in found.parameters], truth, rtol=2e-4)
    assert [each.begin for each in found.parameters] == list(off.values())
    np.testing.assert_allclose(found.trajectory.q, states[:, : model.nq], atol=1e-5)


def test_covariance_is_the_inverse_of_the_fisher_information():
    """The reference flies single shots from changed states and parameters, by differences."""
    model = zoo.model("m1_n3")
    noise, x0 = 3e-4, start(model)
    data = tracks(model, TIMES, flown(model, TIMES, x0), noise, gaps=0.1)
    names = ["tail_mass", "tail_length", "torso_inertia[0]"]
    found = st.identify(model, data, placed(model), names, noise=noise)
    values = np.array([each.value for each in found.parameters])
    q0 = np.concatenate([found.trajectory.q[0], found.trajectory.v[0]])

    def shot(change):
        own = values * (1 + change[2 * model.nv :])
        inertia = np.array(model.parameters["torso_inertia"])
        inertia[0] = own[2]
        other = model.with_parameters(tail_mass=own[0], tail_length=own[1], torso_inertia=inertia)
        x = q0 + np.concatenate([change[:3], np.zeros(4), change[6 : 2 * model.nv]])
        w, u = q0[3], q0[4:7]
        turn = change[3:6] / 2
        x[3:7] = q0[3:7] + np.concatenate([[-u @ turn], w * turn + np.cross(u, turn)])
        x[3:7] /= np.linalg.norm(x[3:7])
        return seen(other, flown(other, TIMES, x))[data.seen].ravel()

    size, h = 2 * model.nv + len(names), 1e-5
    J = np.stack([(shot(h * e) - shot(-h * e)) / (2 * h) for e in np.eye(size)], axis=1)
    C = np.linalg.inv(J.T @ J)[2 * model.nv :, 2 * model.nv :] * noise**2
    C *= np.outer(values, values)
    std = np.sqrt(np.diag(C))
    np.testing.assert_allclose((found.covariance - C) / np.outer(std, std), 0, atol=2e-3)
    reach = [(each.high - each.low) / 2 for each in found.parameters]
    np.testing.assert_allclose(reach, 1.959964 * std, rtol=2e-3)


def test_information_of_several_trials_adds_up():
    model = zoo.model("m1_n3")
    data = [
        tracks(model, TIMES, flown(model, TIMES, start(model, seed)), 5e-4, seed=seed)
        for seed in (0, 3)  # neither mass is at its bound, where the covariance has no part of it
    ]
    one, other, both = (
        np.linalg.inv(st.identify(model, each, placed(model), KNOWN, noise=5e-4).covariance)
        for each in (*data, data)
    )
    scale = np.sqrt(np.diag(one + other))
    np.testing.assert_allclose((both - one - other) / np.outer(scale, scale), 0, atol=0.05)


def test_without_torques_the_scale_of_all_masses_is_undetermined():
    """Masses and inertias times any factor: the same motion; known torques or a prior tell it."""
    model = zoo.model("m1_n3")
    data = tracks(model, TIMES, flown(model, TIMES, start(model)), 3e-4)
    found = st.identify(model, data, placed(model), ALL_MASSES)
    (combination,) = [each for each in found.undetermined if np.isinf(each.std)]
    assert set(combination.parts) == {each.name for each in found.parameters}
    np.testing.assert_allclose(list(combination.parts.values()), 1.0, rtol=0.05)
    assert all(np.isinf(each.std) for each in found.parameters)
    assert "tail_mass" in str(combination)
    torque = np.array([1e-3, -5e-4])
    driven = tracks(model, TIMES, flown(model, TIMES, start(model), lambda _t: torque), 3e-4)
    found = st.identify(model, driven, placed(model), ALL_MASSES, torques=torque)
    assert all(np.isfinite(each.std) for each in found.parameters)
    believed = dict.fromkeys(ALL_MASSES) | {"torso_mass": 1e-3}
    found = st.identify(model, data, placed(model), believed)
    assert found["torso_mass"].std == pytest.approx(1e-3, rel=0.02)
    assert found["torso_mass"].value == pytest.approx(model.parameters["torso_mass"], rel=1e-3)


def test_known_torques_may_be_numbers_samples_functions_or_motions():
    """And a prior on unknown ones has the stated correlations."""
    model, torque = zoo.model("m1_n1"), np.array([1e-3, -5e-4])
    wanted, times = np.outer(1 + TIMES, torque), np.reshape(TIMES[:30], (10, 3))
    motion = trajectory_of(model, TIMES, np.tile(start(model), (len(TIMES), 1)), wanted)
    for known in ((TIMES, wanted), lambda t: (1 + t) * torque, motion):
        found = known_torques(known, 2)(times)
        np.testing.assert_allclose(found[3, 2], wanted[11], rtol=1e-12)
    for known, value in ((torque, torque), (None, 0 * torque)):
        assert (known_torques(known, 2)(times) == value).all()
    times = np.array([0.0, 0.01, 0.05, 0.06, 0.2])
    W = prior_rows(times, st.TorquePrior(std=2e-3, time=0.03))
    correlated = 2e-3**2 * np.exp(-np.abs(times[:, None] - times) / 0.03)
    np.testing.assert_allclose(np.linalg.inv(W.T @ W), correlated, rtol=1e-12)


@pytest.mark.parametrize("name", ["m1_n3", slow("arcs1")])
def test_unknown_torques_are_found_with_parameters(name):
    model = zoo.model(name)
    data = tracks(model, TIMES, flown(model, TIMES, start(model), waves), 2e-4)
    given, names = model.with_parameters(tail_length=0.185), ["tail_length", "marker:tail1"]
    prior = st.TorquePrior(std=2e-3, time=0.05)
    found = st.identify(given, data, placed(model), names, torques=prior)
    trial, length = found.trials[0], found["tail_length"]
    wanted = np.array([waves(t) for t in trial.torques.times])
    assert ((trial.torques.low < wanted) & (wanted < trial.torques.high)).mean() > 0.8
    assert found.success and length.low < model.parameters["tail_length"] < length.high
    assert 1.7e-4 < found.noise < 2.3e-4
    np.testing.assert_allclose(trial.power, found.trajectory.tau * found.trajectory.v[:, 6:])


def test_damping_that_is_not_there_is_at_its_bound():
    """Noise drives it below zero in half of all cases; then it is 0, up to some upper end."""
    model, name, bound = elastic(), "tail_damping[same]", []
    still = model.with_parameters(tail_damping=0.0)
    states = flown(still, TIMES, start(model))
    for seed in (4, 5, 7):
        data = tracks(still, TIMES, states, 5e-4, seed=seed)
        found = st.identify(model, data, placed(model), [name])[name]
        assert found.low <= 0 <= found.high or found.low < 2e-7
        bound.append(found.at_bound)
        if found.at_bound:
            assert found.value == found.low == 0 < found.high
    assert any(bound) and not all(bound)


def drawn(prior, count, rng):
    """Torques of the prior, an exact Ornstein-Uhlenbeck process, as a function of time."""
    fine = np.linspace(FEW[0], FEW[-1], 121)
    decay = np.exp(-(fine[1] - fine[0]) / prior.time)
    tau = prior.std * rng.standard_normal((len(fine), count))
    for k in range(1, len(fine)):
        tau[k] = decay * tau[k - 1] + np.sqrt(1 - decay**2) * tau[k]
    return lambda t: np.array([np.interp(t, fine, each) for each in tau.T])


@pytest.mark.parametrize(
    ("model", "names", "prior", "trials"),
    [
        ("m1_n3", KNOWN, None, 3),
        ("m1_n3", UNKNOWN, PRIOR, 3),
        slow("elastic", WANTED, None, 40),
        slow("elastic_arcs", WANTED, None, 40),
        slow("arcs1", UNKNOWN, PRIOR, 40),
    ],
)
def test_errors_are_as_large_as_told_and_intervals_cover_the_truth(model, names, prior, trials):
    """e^T C^-1 e of many trials is chi-squared."""
    model = elastic(model) if names is WANTED else zoo.model(model)
    squares, covered = [], []
    parts = {name: model.parameters.get(name.split("[")[0], 0.0) for name in WANTED}
    truth = {name: np.atleast_1d(value)[0] for name, value in parts.items()}
    passive = flown(model, FEW, start(model))
    for seed in range(trials):
        rng = np.random.default_rng([seed, 5])
        torque = None if prior is None else drawn(prior, model.nq - 7, rng)
        states = passive if torque is None else flown(model, FEW, start(model), torque, rtol=1e-6)
        data = tracks(model, FEW, states, 5e-4, seed=[seed, 6], gaps=0.1)
        found = st.identify(model, data, placed(model), names, torques=prior, noise=5e-4)
        assert found.success
        off = np.array([each.value - truth.get(each.name, 0.0) for each in found.parameters])
        squares.append(off @ np.linalg.solve(found.covariance, off))
        covered.append([p.low < truth.get(p.name, 0.0) < p.high for p in found.parameters])
    least, most = chi2.ppf([RARE, 1 - RARE], trials * len(off))
    assert least < np.sum(squares) < most
    least, most = binom.ppf([RARE, 1 - RARE], trials, 0.95)
    often = np.sum(covered, axis=0)
    assert (often >= least).all() and (often <= most).all()


def motion(model, torque=None):
    states = flown(model, LATER, start(model), torque)
    tau = np.array([torque(t) if torque else np.zeros(model.nq - 7) for t in LATER])
    return trajectory_of(model, LATER, states, tau), states


def test_information_of_a_plan_is_the_covariance_of_an_identification():
    model = zoo.model("m1_n3")
    (planned, states), how = motion(model), {"noise": 3e-4, "rate": 200.0}
    design = st.fisher_information(model, planned, placed(model), KNOWN, **how)
    found = st.identify(model, tracks(model, LATER, states), placed(model), KNOWN, noise=3e-4)
    std = np.sqrt(np.diag(found.covariance))
    off = (design.covariance - found.covariance) / np.outer(std, std)
    np.testing.assert_allclose(off, 0, atol=1e-3)
    values = np.array([model.parameters[name] for name in KNOWN])
    relative = design.covariance / np.outer(values, values)
    assert design.d_optimality == pytest.approx(-np.linalg.slogdet(relative)[1], rel=1e-6)
    assert list(design.std) == KNOWN

    limp = st.fisher_information(model, planned, placed(model), ALL_MASSES, **how)
    driven = motion(model, waves)[0]
    told = st.fisher_information(model, driven, placed(model), ALL_MASSES, **how)
    assert np.isfinite(told.covariance).all() and np.isinf(np.diag(limp.covariance)).all()
    assert limp.d_optimality == -np.inf and len(limp.undetermined) == 1


def test_bad_arguments_of_the_information_are_refused():
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
