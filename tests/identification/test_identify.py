"""What ``identify`` finds in generated flights, and how certain it says that it is."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import binom, chi2

import serpentail as st
from serpentail.identification import torques as room
from serpentail.identification.result import trajectory_of
from tests.identification.flights import elastic, flown, placed, seen, start, tracks
from tests.support import zoo

TIMES = np.linspace(0, 0.15, 31)
slow = partial(pytest.param, marks=pytest.mark.slow)
WANTED = ["tail_mass", "tail_length", "tail_stiffness[same]", "tail_damping[same]"]
FEW = np.linspace(0, 0.1, 21)
RARE = 1e-4 / 2  # bounds that a right covariance leaves once in ten thousand runs
KNOWN = ["tail_mass", "tail_length"]
UNKNOWN, PRIOR = ["tail_length", "marker:tail2"], st.TorquePrior(1e-3, 0.03)
ALL_MASSES = ["torso_mass", "torso_inertia", "tail_mass"]


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

    size = 2 * model.nv + len(names)
    h = 1e-5
    J = np.stack([(shot(h * e) - shot(-h * e)) / (2 * h) for e in np.eye(size)], axis=1)
    C = np.linalg.inv(J.T @ J)[2 * model.nv :, 2 * model.nv :] * noise**2
    C *= np.outer(values, values)
    std = np.sqrt(np.diag(C))
    np.testing.assert_allclose(
        found.covariance / np.outer(std, std), C / np.outer(std, std), atol=2e-3
    )
    reach = [(each.high - each.low) / 2 for each in found.parameters]
    np.testing.assert_allclose(reach, 1.959964 * std, rtol=2e-3)


def test_several_trials_share_the_parameters():
    model, names = zoo.model("m1_n3"), ["tail_mass", "tail_length"]
    data = [
        tracks(model, TIMES, flown(model, TIMES, start(model, seed)), 5e-4, seed=seed)
        for seed in (0, 1)
    ]
    alone = [st.identify(model, each, placed(model), names, noise=5e-4) for each in data]
    both = st.identify(model, data, placed(model), names, noise=5e-4)
    # information adds up
    added = sum(np.linalg.inv(each.covariance) for each in alone)
    scale = np.outer(*[np.sqrt(np.diag(added))] * 2)
    np.testing.assert_allclose(np.linalg.inv(both.covariance) / scale, added / scale, atol=0.05)
    assert len(both.trials) == 2


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
    model, torque = zoo.model("m1_n1"), np.array([1e-3, -5e-4])
    wanted, times = np.outer(1 + TIMES, torque), np.reshape(TIMES[:30], (10, 3))
    states = np.tile(start(model), (len(TIMES), 1))
    motion = trajectory_of(model, TIMES, states, wanted)
    for known in ((TIMES, wanted), lambda t: (1 + t) * torque, motion):
        np.testing.assert_allclose(
            room.known_torques(known, 2)(times)[3, 2], wanted[11], rtol=1e-12
        )
    for known, value in ((torque, torque), (None, 0 * torque)):
        assert (room.known_torques(known, 2)(times) == value).all()


def test_a_prior_on_torques_has_the_stated_correlations():
    prior = st.TorquePrior(std=2e-3, time=0.03)
    times = np.array([0.0, 0.01, 0.05, 0.06, 0.2])
    W = room.prior_rows(times, prior)
    wanted = prior.std**2 * np.exp(-np.abs(times[:, None] - times) / prior.time)
    np.testing.assert_allclose(np.linalg.inv(W.T @ W), wanted, rtol=1e-12)


@pytest.mark.parametrize("name", ["m1_n3", slow("arcs1")])
def test_unknown_torques_are_found_with_parameters(name):
    model = zoo.model(name)

    def torque(t):
        return 2e-3 * np.array([np.sin(40 * t), np.cos(30 * t)])

    states = flown(model, TIMES, start(model), torque)
    found = st.identify(
        model.with_parameters(tail_length=0.185),
        tracks(model, TIMES, states, 2e-4),
        placed(model),
        ["tail_length", "marker:tail1"],
        torques=st.TorquePrior(std=2e-3, time=0.05),
    )
    assert found.success
    bands = found.trials[0].torques
    wanted = np.array([torque(t) for t in bands.times])
    inside = (bands.low < wanted) & (wanted < bands.high)
    assert inside.mean() > 0.8
    assert found["tail_length"].low < model.parameters["tail_length"] < found["tail_length"].high
    assert 1.7e-4 < found.noise < 2.3e-4
    np.testing.assert_allclose(
        found.trials[0].power, found.trajectory.tau * found.trajectory.v[:, 6:]
    )


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


# Whether errors are as large as the covariance says: e^T C^-1 e of many trials is chi-squared.


def drawn(prior, count, rng):
    """Torques of the prior, an exact Ornstein-Uhlenbeck process, as a function of time."""
    fine = np.linspace(FEW[0], FEW[-1], 121)
    decay = np.exp(-(fine[1] - fine[0]) / prior.time)
    tau = prior.std * rng.standard_normal((len(fine), count))
    for k in range(1, len(fine)):
        tau[k] = decay * tau[k - 1] + np.sqrt(1 - decay**2) * tau[k]
    return lambda t: np.array([np.interp(t, fine, each) for each in tau.T])


def squares(model, names, trials, prior=None):
    """Return e^T C^-1 e of each trial, its degrees of freedom, and how many intervals covered."""
    found, covered = [], []
    parts = {name: model.parameters.get(name.split("[")[0], 0.0) for name in WANTED}
    truth = {name: np.atleast_1d(value)[0] for name, value in parts.items()}
    passive = flown(model, FEW, start(model))
    for seed in range(trials):
        rng = np.random.default_rng([seed, 5])
        torque = None if prior is None else drawn(prior, model.nq - 7, rng)
        states = passive if torque is None else flown(model, FEW, start(model), torque, rtol=1e-6)
        data = tracks(model, FEW, states, 5e-4, seed=[seed, 6], gaps=0.1)
        result = st.identify(model, data, placed(model), names, torques=prior, noise=5e-4)
        assert result.success
        off = np.array([each.value - truth.get(each.name, 0.0) for each in result.parameters])
        found.append(off @ np.linalg.solve(result.covariance, off))
        covered += [each.low < truth.get(each.name, 0.0) < each.high for each in result.parameters]
    return np.sum(found), trials * len(off), np.array(covered).reshape(trials, -1)


@pytest.mark.parametrize(("names", "prior"), [(KNOWN, None), (UNKNOWN, PRIOR)])
def test_errors_are_as_large_as_told(names, prior):
    total, freedom, _ = squares(zoo.model("m1_n3"), names, 3, prior)
    assert chi2.ppf(RARE, freedom) < total < chi2.ppf(1 - RARE, freedom)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "names", "prior"),
    [("elastic", WANTED, None), ("elastic_arcs", WANTED, None), ("arcs1", UNKNOWN, PRIOR)],
)
def test_intervals_cover_the_truth_in_many_trials(model, names, prior):
    own, trials = elastic(model) if names is WANTED else zoo.model(model), 40
    total, freedom, covered = squares(own, names, trials, prior)
    assert chi2.ppf(RARE, freedom) < total < chi2.ppf(1 - RARE, freedom)
    least, most = binom.ppf([RARE, 1 - RARE], trials, 0.95)
    assert (covered.sum(axis=0) >= least).all() and (covered.sum(axis=0) <= most).all()
