"""Whether errors are as large as the covariance says: e^T C^-1 e of many trials is chi-squared.

The bounds are those which a right covariance leaves once in ten thousand runs.
"""

import numpy as np
import pytest
from scipy.stats import binom, chi2

import serpentail as st
from tests.identification.flights import elastic, flown, placed, start, tracks
from tests.support import zoo

TIMES = np.linspace(0, 0.1, 21)
RARE = 1e-4 / 2
KNOWN = ["tail_mass", "tail_length"]
SPRUNG = [*KNOWN, "tail_stiffness[same]", "tail_damping[same]"]
UNKNOWN = ["tail_length", "marker:tail2"]
PRIOR = st.TorquePrior(1e-3, 0.03)


def drawn(prior, count, rng):
    """Torques of the prior, an exact Ornstein-Uhlenbeck process, as a function of time."""
    fine = np.linspace(TIMES[0], TIMES[-1], 121)
    decay = np.exp(-(fine[1] - fine[0]) / prior.time)
    tau = prior.std * rng.standard_normal((len(fine), count))
    for k in range(1, len(fine)):
        tau[k] = decay * tau[k - 1] + np.sqrt(1 - decay**2) * tau[k]
    return lambda t: np.array([np.interp(t, fine, each) for each in tau.T])


def squares(model, names, trials, prior=None):
    """Return e^T C^-1 e of each trial, its degrees of freedom, and how many intervals covered."""
    found, covered = [], []
    parts = {name: model.parameters.get(name.split("[")[0], 0.0) for name in SPRUNG}
    truth = {name: np.atleast_1d(value)[0] for name, value in parts.items()}
    passive = flown(model, TIMES, start(model))
    for seed in range(trials):
        rng = np.random.default_rng([seed, 5])
        torque = None if prior is None else drawn(prior, model.nq - 7, rng)
        states = passive if torque is None else flown(model, TIMES, start(model), torque, rtol=1e-6)
        data = tracks(model, TIMES, states, 5e-4, seed=[seed, 6], gaps=0.1)
        result = st.identify(model, data, placed(model), names, torques=prior, noise=5e-4)
        assert result.success
        off = np.array([each.value - truth.get(each.name, 0.0) for each in result.parameters])
        found.append(off @ np.linalg.solve(result.covariance, off))
        covered += [each.low < truth.get(each.name, 0.0) < each.high for each in result.parameters]
    return np.sum(found), trials * len(off), np.array(covered).reshape(trials, -1)


@pytest.mark.parametrize(("names", "prior"), [(KNOWN, None), (UNKNOWN, PRIOR)])
def test_errors_are_as_large_as_told(names, prior):
    total, freedom, _ = squares(zoo.model("m1_n3"), names, 4, prior)
    assert chi2.ppf(RARE, freedom) < total < chi2.ppf(1 - RARE, freedom)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "names", "prior"),
    [("elastic", SPRUNG, None), ("elastic_arcs", SPRUNG, None), ("arcs1", UNKNOWN, PRIOR)],
)
def test_intervals_cover_the_truth_in_many_trials(model, names, prior):
    own, trials = elastic(model) if names is SPRUNG else zoo.model(model), 60
    total, freedom, covered = squares(own, names, trials, prior)
    assert chi2.ppf(RARE, freedom) < total < chi2.ppf(1 - RARE, freedom)
    least, most = binom.ppf([RARE, 1 - RARE], trials, 0.95)
    assert (covered.sum(axis=0) >= least).all() and (covered.sum(axis=0) <= most).all()
