"""``identify``: finds motion, torques and parameters from marker tracks."""

import time
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, TypedDict, Unpack

import numpy as np

from ..basics.checks import number, refusal
from ..basics.errors import IdentificationError, ModelError
from ..basics.progress import Stage
from ..model.chains import refuse_several
from ..model.checked import checked_model
from ..model.model import Model
from ..model.state import Quantity
from .data_checks import refuse_scale, refuse_too_few, warn_of_swaps
from .marker_files import read_markers
from .outcome import identification_of
from .placement import Marker, Placements, placements
from .refinement import refined
from .result import Identification
from .solve import FitPoint
from .start import motion_shown
from .torques import Known, TorquePrior, checked_prior, known_torques
from .tracks import MarkerTracks
from .trial import iterate_through, trial_of
from .unknowns import Unknowns, unknowns

LONGEST = 0.01  # s: of the intervals of the first mesh
FIRST_NOISE = 1e-3  # m
FUNCTIONS = (
    *("forward_dynamics", "forward_dynamics_derivatives"),
    *("energy", "momentum", "tail_points"),
)
Data = MarkerTracks | str | PathLike[str]


class IdentifySettings(TypedDict, total=False):
    """Settings of ``identify`` besides the model, the data, the markers and the unknowns."""

    torques: Any
    noise: Quantity | Mapping[str, Quantity] | None
    confidence: float
    unit: str | None
    axes: str
    zeros: str


def identify(
    model: Model,
    data: Data | Sequence[Data],
    markers: Mapping[str, Marker],
    estimate: Sequence[str] | Mapping[str, float | None] = (),
    **settings: Unpack[IdentifySettings],
) -> Identification:
    """Find the motion, torques and parameters that fit marker tracks in flight best.

    Parameters
    ----------
    model : Model
        The model, with the parameters to begin with. A loaded one needs "tail_points",
        "forward_dynamics", "forward_dynamics_derivatives", "energy", "momentum" and, if parameters
        are estimated, "forward_dynamics_parameter_derivatives".
    data : MarkerTracks, str, path, or a sequence of these
        Tracks, or TRC, CSV or C3D files; several are trials of one animal.
    markers : mapping of str to Marker
        Place of each marker. Markers of the data without a place are ignored.
    estimate : sequence of str, or mapping of str to (float or None), optional
        Parameters to estimate: "tail_mass"; "torso_inertia" for each of its numbers;
        "torso_inertia[0]"; "tail_damping[same]" for one number for all coordinates;
        "marker:NAME" for the offset of a marker. A mapping gives the standard deviation of a
        normal prior about the model's value, or None for no prior.
    torques : optional
        Known torques (N m): 2m numbers, (times, values), a function of time, or a Trajectory. With
        a ``TorquePrior`` the torques are estimated too. A list has one entry for each trial.
        Default: no torques.
    noise : float or mapping of str to float, optional
        Standard deviation of a marker's coordinates (m), of all markers or by name. Default: one
        value for all is estimated.
    confidence : float, default 0.95
        Probability of the intervals.
    unit, axes, zeros : optional
        As of ``read_markers``, for files.

    Returns
    -------
    Identification
        Parameters with intervals, motions, torques and residuals.

    Raises
    ------
    IdentificationError
        An argument or the data are wrong; the message gives field, value and remedy.
    ModelError
        The model lacks a function, has a fixed base or several chains, uses polar coordinates or
        computes with float.
    ExtraMissing
        A C3D file is read without the extra "c3d".

    Warns
    -----
    DoubtfulMarkers
        Markers look swapped, or fit badly, or torques are missing.

    Notes
    -----
    Between frames the motion obeys the equations of motion. With known torques and no priors
    this is maximum likelihood, and the intervals follow from the Fisher information. With a
    TorquePrior, or with priors on parameters, it is the maximum a posteriori motion, with
    Laplace's approximation of the covariance.

    Examples
    --------
    >>> found = st.identify(model, "flight.trc", markers, ["tail_mass"])  # doctest: +SKIP
    >>> print(found.table)  # doctest: +SKIP
    """
    began = time.perf_counter()
    known = IdentifySettings.__annotations__
    for name in settings:
        if name not in known:
            raise IdentificationError(
                f"{name}: no such setting; there are {', '.join(sorted(known))}"
            )
    confidence = number(
        "confidence", settings.get("confidence", 0.95), IdentificationError, above=0
    )
    if confidence >= 1:
        raise refusal("confidence", confidence, "a number below 1", IdentificationError)
    check_model(model, estimate)
    placed = placements(model, markers)
    wanted = unknowns(placed, estimate)
    tracks = _tracks_of(data, placed, settings)
    torques = _torques_of(settings.get("torques"), len(tracks), model.layout.nt)
    noises = _noises_of(settings.get("noise"), tracks)
    noise_known = settings.get("noise") is not None

    with Stage("identify", model.name) as stage:
        shown = [_motion_shown(wanted, each) for each in tracks]
        iterates = []
        for track, noise, torque, (states, _) in zip(tracks, noises, torques, shown, strict=True):
            trial = trial_of(track, noise, torque, LONGEST)
            no_torques = np.zeros((len(trial.knots), model.layout.nt))
            iterates.append(iterate_through(trial, track.times, states, no_torques))
        start = FitPoint(wanted.start, tuple(iterates))
        found = refined(wanted, start, noise_known, stage)
    swapped = [pair for _, pair in shown]
    return identification_of(found, noise_known, confidence, swapped, began)


def check_model(model: Any, estimate: Any) -> None:
    """Raise an error if a model cannot be identified, because of its kind or missing functions."""
    checked_model(model, IdentificationError)
    refuse_unlike(model, "identify")
    model.serve("identify")
    model.need(*FUNCTIONS)
    names = list(estimate) if isinstance(estimate, Mapping | Sequence) else []
    if any(not str(name).startswith("marker:") for name in names):
        model.need("forward_dynamics_parameter_derivatives")


def refuse_unlike(model: Model, who: str) -> None:
    """ModelError if a model has a fixed base, several chains or polar coordinates, or computes with
    float.
    """
    model.refuse_fixed(who)
    refuse_several(model, who, "leave the other chains out of the scene", ModelError)
    if model.manifest["scene"].get("coordinates") == "polar":
        raise ModelError(f'{who}: {model.name} has coordinates = "polar": generate it with "bend"')
    if model.manifest["real"] != "double":
        raise ModelError(f'{who}: {model.name} has real = "float": generate it with "double"')


def _tracks_of(data: Any, placed: Placements, settings: IdentifySettings) -> list[MarkerTracks]:
    """Return the tracks of the placed markers of each trial."""
    listed = list(data) if isinstance(data, list | tuple) else [data]
    if not listed:
        raise IdentificationError("data: none: needs marker tracks, or files of them")
    how: dict[str, Any] = {name: settings[name] for name in ("axes", "zeros") if name in settings}
    tracks = [
        each if isinstance(each, MarkerTracks) else read_markers(each, settings.get("unit"), **how)
        for each in listed
    ]
    return [each.of(placed.names) for each in tracks]


def _torques_of(torques: Any, count: int, nt: int) -> list[Known | TorquePrior]:
    """Return the known torques, or their prior, for each trial."""
    several = isinstance(torques, list) and any(not np.isscalar(each) for each in torques)
    if several and len(torques) != count:
        raise IdentificationError(f"torques: {len(torques)} entries: needs one of {count} trials")
    return [
        checked_prior(each) if isinstance(each, TorquePrior) else known_torques(each, nt)
        for each in (torques if several else [torques] * count)
    ]


def _noises_of(noise: Any, tracks: list[MarkerTracks]) -> list[np.ndarray]:
    """Return the noise (F, M) of each trial, m: of the markers, or to begin with."""
    if noise is None:
        return [np.full(each.seen.shape, FIRST_NOISE) for each in tracks]
    names = tracks[0].names
    values = noise if isinstance(noise, Mapping) else dict.fromkeys(names, noise)
    lacking = [name for name in names if name not in values]
    if lacking:
        raise IdentificationError(
            f"noise: no value for {lacking[0]!r}: give one for each marker (m)"
        )
    row = [
        number(f"noise.{name}", values[name], IdentificationError, unit="m", above=0, most=1.0)
        for name in names
    ]
    return [np.broadcast_to(np.array(row), each.seen.shape) for each in tracks]


def _motion_shown(wanted: Unknowns, tracks: MarkerTracks) -> tuple[np.ndarray, tuple[int, ...]]:
    """Return the states (F, nx) that a trial's markers show, and markers that look swapped.

    IdentificationError if they are too few, or of another scale.
    """
    placed, nq = wanted.placed, wanted.model.nq
    refuse_too_few(tracks, nq)
    refuse_scale(placed, tracks, {marker for marker, _, _ in wanted.offsets()})
    states = motion_shown(placed, tracks)
    return states, warn_of_swaps(placed, tracks, states[:, :nq])
