"""``fisher_information``: how certain parameters would be, before a motion is recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..basics.checks import finite_array, number, refusal
from ..basics.errors import IdentificationError
from ..model.model import Model
from ..model.state import Quantity
from ..motion.trajectory import Trajectory
from .certainty import Combination, certainty
from .identify import check_model
from .linear import linearised
from .placement import Marker, placements
from .solve import Fit, FitPoint
from .torques import known_torques
from .tracks import MarkerTracks
from .trial import Iterate, iterate_through, trial_of
from .unknowns import unknowns

LONGEST = 0.005  # s: of the intervals


@dataclass(frozen=True, eq=False)
class Information:
    """What markers on a motion would tell about parameters.

    Attributes
    ----------
    names : tuple of str
        Names of the P parameters.
    values : ndarray, shape (P,)
        Their values, SI.
    covariance : ndarray, shape (P, P)
        Cramer-Rao bound of the covariance of every unbiased estimate, SI.
    singular_values : ndarray, shape (P,)
        Singular values of the information on relative changes.
    undetermined : tuple of Combination
        Combinations of parameters that are known to a factor at best.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    singular_values: np.ndarray
    undetermined: tuple[Combination, ...]

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each parameter by name, SI."""
        each = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, each, strict=True))

    @property
    def d_optimality(self) -> float:
        """Logarithm of the determinant of the information on relative changes.

        The larger it is, the smaller is the region in which the parameters lie; -inf if a
        combination is not determined.
        """
        if any(np.isinf(each.std) for each in self.undetermined):
            return -np.inf
        with np.errstate(divide="ignore"):
            return float(2 * np.log(self.singular_values).sum())


def fisher_information(
    model: Model,
    motion: Trajectory,
    markers: Mapping[str, Marker],
    estimate: Sequence[str] | Mapping[str, float | None],
    *,
    noise: Quantity,
    rate: Quantity,
) -> Information:
    """Compute what markers on a motion in flight would tell about parameters.

    Parameters
    ----------
    model : Model
        The model, as of ``identify``.
    motion : Trajectory
        A planned or simulated motion. Only its first state and its torques matter; the torques
        count as known, the first state as unknown.
    markers : mapping of str to Marker
        Place of each marker.
    estimate : sequence of str, or mapping of str to (float or None)
        Parameters to estimate, as of ``identify``.
    noise : float
        Standard deviation of a marker's coordinates (m).
    rate : float
        Frame rate of the cameras (Hz).

    Returns
    -------
    Information
        The Cramer-Rao bound, and what is not determined.

    Raises
    ------
    IdentificationError
        An argument is wrong.
    ModelError
        As of ``identify``.
    """
    check_model(model, estimate)
    noise = number("noise", noise, IdentificationError, unit="m", above=0)
    rate = number("rate", rate, IdentificationError, unit="1/s", above=0)
    if not isinstance(motion, Trajectory) or motion.q.shape[1] != model.nq or len(motion.t) < 2:
        raise refusal("motion", motion, "a Trajectory of this model", IdentificationError)
    placed = placements(model, markers)
    wanted = unknowns(placed, estimate)
    if not wanted.each:
        raise IdentificationError("estimate: none: name the parameters that matter")
    count = int(np.floor((motion.t[-1] - motion.t[0]) * rate * (1 + 1e-12))) + 1
    times = motion.t[0] + np.arange(count) / rate
    if count < 4:
        raise IdentificationError(f"rate: value {rate:g}: gives {count} frames: needs 4 or more")
    # frames in which every marker is seen, and the states that the torques lead to
    tracks = MarkerTracks(times, np.zeros((count, len(placed.names), 3)), placed.names, "design")
    noises = np.full(tracks.seen.shape, noise)
    trial = trial_of(tracks, noises, known_torques(motion, model.layout.nt), LONGEST)
    states = finite_array("motion", np.column_stack([motion.q, motion.v]), IdentificationError)
    rows = np.stack([np.interp(times, motion.t, column) for column in states.T], axis=1)
    iterate = iterate_through(trial, times, rows, np.zeros((0, model.layout.nt)))
    flight = _flown(model, iterate)

    linear = linearised(wanted, placed, flight)
    point, pinned = FitPoint(wanted.start, (flight,)), np.zeros(len(wanted.each), bool)
    sure = certainty(Fit(wanted, point, (linear,), pinned, iterations=0, converged=True))
    return Information(
        tuple(each.name for each in wanted.each),
        wanted.start,
        sure.covariance,
        sure.singular_values,
        sure.undetermined,
    )


def _flown(model: Model, iterate: Iterate) -> Iterate:
    """Return the flight from an iterate's first state; each pass makes one more interval exact."""
    while True:
        done = iterate.integrated(model)
        if done is None:
            raise IdentificationError("motion: cannot be integrated under its torques")
        after = np.concatenate([done.states[:1], done.ends])
        if np.allclose(after, done.states, rtol=1e-9, atol=1e-11):
            return done
        iterate = done.moved(after, done.torques)
