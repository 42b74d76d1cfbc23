"""What is known of the torques: all, or a prior on how large they are and how fast they change."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.checks import finite_array, number, refusal
from ..basics.errors import IdentificationError
from ..motion.trajectory import Trajectory

PER_TIME = 8  # knots in each correlation time


@dataclass(frozen=True)
class TorquePrior:
    """Prior on unknown joint torques: each is a stationary Ornstein-Uhlenbeck process of mean zero.

    Torques at times t apart have the correlation exp(-t / time). They are linear between knots
    ``time / 8`` apart, or one frame apart if frames are sparser.

    Parameters
    ----------
    std : float or str
        Standard deviation at any time (N m), or text such as "4 mN m".
    time : float or str
        Correlation time (s), or text such as "30 ms".

    Examples
    --------
    >>> import serpentail as st
    >>> st.TorquePrior(std=5e-3, time=0.02)
    TorquePrior(std=0.005, time=0.02)
    """

    std: float | str
    time: float | str


def checked_prior(prior: TorquePrior) -> TorquePrior:
    """Return a prior in N m and s; IdentificationError otherwise."""
    error, values = IdentificationError, []
    for name, value, unit in (("std", prior.std, "N m"), ("time", prior.time, "s")):
        field = f"torques.{name}"
        values.append(number(field, value, error, unit=unit, above=0))
    return TorquePrior(*values)


Known = Callable[[np.ndarray], np.ndarray]  # times (...) -> torques (..., 2m)


def known_torques(torques: Any, nt: int) -> Known:
    """Return known torques as a function of time; IdentificationError if they are wrong.

    torques: None for none; numbers (2m,), constant; (times, values); a Trajectory; a function of
    time.
    """
    if torques is None:
        return lambda times: np.zeros((*times.shape, nt))
    if isinstance(torques, Trajectory):
        return _sampled(torques.t, torques.tau, nt)
    if isinstance(torques, tuple) and len(torques) == 2:
        t, tau = (
            finite_array(f"torques[{k}]", x, IdentificationError) for k, x in enumerate(torques)
        )
        return _sampled(t, tau, nt)
    if callable(torques):
        return _called(torques, nt)
    constant = finite_array("torques", torques, IdentificationError)
    if constant.shape != (nt,):
        needs = f"None, {nt} numbers, (times, values), a function, a Trajectory or a TorquePrior"
        raise refusal("torques", torques, needs, IdentificationError)
    return lambda times: np.broadcast_to(constant, (*times.shape, nt))


def _sampled(t: np.ndarray, tau: np.ndarray, nt: int) -> Known:
    """Return torques between samples, linear."""
    if t.ndim != 1 or len(t) < 2 or tau.shape != (len(t), nt) or (np.diff(t) <= 0).any():
        raise IdentificationError(
            f"torques: times have shape {t.shape}, values {tau.shape}: needs times (K,) that "
            f"increase and values (K, {nt})"
        )

    def torque(times: np.ndarray) -> np.ndarray:
        if times.min() < t[0] - 1e-9 or times.max() > t[-1] + 1e-9:
            raise IdentificationError(
                f"torques: known from {t[0]:g} to {t[-1]:g} s: the markers are from "
                f"{times.min():g} to {times.max():g} s"
            )
        return np.stack([np.interp(times, t, tau[:, k]) for k in range(nt)], axis=-1)

    return torque


def _called(function: Callable[[float], Any], nt: int) -> Known:
    """Return torques of a user's function, checked."""

    def torque(times: np.ndarray) -> np.ndarray:
        rows = np.zeros((times.size, nt))
        for k, t in enumerate(times.ravel()):
            value = finite_array(f"torques({t:g})", function(float(t)), IdentificationError)
            if value.shape != (nt,):
                raise IdentificationError(f"torques({t:g}) has shape {value.shape}, not ({nt},)")
            rows[k] = value
        return rows.reshape(*times.shape, nt)

    return torque


def knots_of(times: np.ndarray, prior: TorquePrior) -> np.ndarray:
    """Return indices of the mesh's times that are knots, about an eighth of the time apart."""
    spans = max(int(np.ceil((times[-1] - times[0]) * PER_TIME / float(prior.time))), 1)
    even = np.linspace(times[0], times[-1], spans + 1)
    return np.unique(np.abs(times[:, None] - even).argmin(axis=0))


def prior_rows(times: np.ndarray, prior: TorquePrior) -> np.ndarray:
    """Return W (U, U): W u are independent with variance 1 if u (U,) at knots obeys the prior."""
    spans = np.diff(times) / float(prior.time)
    decay, fresh = np.exp(-spans), np.sqrt(-np.expm1(-2 * spans))
    W = np.diag(np.concatenate([[1.0], 1 / fresh]))
    W[range(1, len(times)), range(len(times) - 1)] = -decay / fresh
    return W / float(prior.std)
