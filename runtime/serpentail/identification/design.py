"""Design of experiments: how certain a motion would make parameters, before it is recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import finite_array, number, refusal
from ..errors import IdentificationError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from .certainty import Combination, certainty
from .identify import check_model
from .placement import Marker, placements
from .point import Point
from .search import first_iterate
from .solve import Fit, triangle
from .torques import known_torques
from .tracks import MarkerTracks
from .trial import Iterate, Trial, linearised, solved, trial_of
from .unknowns import unknowns

LONGEST = 0.005  # s: of the intervals


@dataclass(frozen=True, eq=False)
class Information:
    """What markers on a motion would tell of parameters: their names; covariance (P, P), SI, the
    Cramer-Rao bound of every unbiased estimate; singular_values (P,) of relative changes;
    undetermined combinations.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    singular_values: np.ndarray
    undetermined: tuple[Combination, ...]

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each parameter by name."""
        each = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, each, strict=True))

    @property
    def d_optimality(self) -> float:
        """Logarithm of the determinant of the information about relative changes: the more, the
        smaller the volume in which the parameters are; -inf where one is undetermined.
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
    noise: float,
    rate: float,
) -> Information:
    """Return what markers on a motion in flight would tell of parameters.

    motion: planned or simulated, its torques are taken as known; only its first state and its
    torques matter.  markers, estimate: as of ``identify``.  noise: standard deviation (m) of a
    marker's coordinates.  rate: of the cameras, Hz.  The first state is unknown, too.
    Raises IdentificationError.
    """
    check_model(model, estimate)
    noise = number("noise", noise, IdentificationError, above=0)
    rate = number("rate", rate, IdentificationError, above=0)
    if not isinstance(motion, Trajectory) or motion.q.shape[1] != model.nq or len(motion.t) < 2:
        raise refusal("motion", motion, "a Trajectory of this model", IdentificationError)
    placed = placements(model, markers)
    wanted = unknowns(model, placed, estimate)
    if not wanted.each:
        raise IdentificationError("estimate: none: name the parameters that matter")
    count = int(np.floor((motion.t[-1] - motion.t[0]) * rate * (1 + 1e-12))) + 1
    times = motion.t[0] + np.arange(count) / rate
    if count < 4:
        raise IdentificationError(f"rate: value {rate:g}: gives {count} frames: needs 4 or more")
    # frames in which every marker is seen, and the states that the torques lead to
    nothing = np.zeros((count, len(placed.names), 3))
    tracks = MarkerTracks(times, nothing, placed.names, "design")
    trial = trial_of(
        tracks,
        np.full(tracks.seen.shape, noise),
        known_torques(motion, model.layout.nt),
        (model.layout.nt, LONGEST),
    )
    states = finite_array("motion", np.column_stack([motion.q, motion.v]), IdentificationError)
    rows = np.stack([np.interp(times, motion.t, column) for column in states.T], axis=1)
    iterate = first_iterate(model, trial, rows)
    done = _flown(model, trial, iterate)
    linear = linearised(wanted, model, placed, trial, done)
    fit = Fit(
        Point(wanted.start, (done,)),
        (linear,),
        (triangle(linear.rows, linear.right),),
        np.zeros(len(wanted.each), bool),
        0,
        True,
    )
    sure = certainty(wanted, fit, (1.0, np.inf))
    return Information(
        tuple(each.name for each in wanted.each),
        wanted.start,
        sure.covariance,
        sure.singular_values,
        sure.undetermined,
    )


def _flown(model: Model, trial: Trial, iterate: Iterate) -> Iterate:
    """Return the flight from an iterate's first state: each pass makes one more interval exact."""
    while True:
        done = solved(model, trial, iterate)
        if done is None:
            raise IdentificationError("motion: cannot be integrated under its torques")
        after = np.concatenate([done.states[:1], done.ends])
        if np.allclose(after, done.states, rtol=1e-9, atol=1e-11):
            return done
        iterate = done.followed(after)
