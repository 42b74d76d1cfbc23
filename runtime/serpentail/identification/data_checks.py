"""Refuses tracks that no fit can use, and warns of markers that look swapped or misplaced, and of
torques that seem to be missing.
"""

import sys
import warnings
from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from serpentail_scene.layout import TAIL_Q

from ..basics.attitude import REST
from ..basics.errors import DoubtfulMarkers, IdentificationError
from .linear import Linear
from .placement import Placements, offset_axes, world_points
from .start import fitted, off_line
from .tracks import UNITS, MarkerTracks

PACKAGE = __name__.partition(".")[0] + "."

# of sound tracks
FEWEST = 3  # markers that are seen at once
NARROW = 1e-3  # of their length: narrower markers are on a line
RIGID, BENDABLE = 2.0, 5.0  # factors of distances on a torso, and on a body with its tail
ALIKE = 1.5  # factor within which a unit explains distances

# of swapped and of misplaced markers
FRAMES = 3  # at which every exchange of two markers is tried
ALWAYS = 0.8  # of the frames: a swap in more of them is one throughout
LOOSE = 0.01  # of the tail's length: swaps are checked for larger misfits
HALF = 0.5  # of the misfit that must be left once a swap is undone
CLEAR = 8.0  # times the usual residual that a swapped marker is off
WORSE = 4.0  # a marker is reported if its residual is so many times the others'
SMALL = 1e-3  # of the markers' extent: smaller residuals are not reported

# of missing torques
SMOOTH = 1.2  # squares of steps over squares of values; 2 for noise
SURE = 3.5  # standard deviations of this ratio of noise
FEWEST_STEPS = 5  # of the marker at the tip
GROWS = 1.4  # of the residual at the tip over that on the torso


def refuse_too_few(tracks: MarkerTracks, nq: int) -> None:
    """IdentificationError if no frame shows enough markers that are not on a line."""
    seen = tracks.seen.sum(axis=1)
    best = int(seen.argmax())
    if off_line(tracks.positions[best, tracks.seen[best]], NARROW):
        return
    raise IdentificationError(
        f"data: too few markers: {tracks.source} shows at most {seen[best]} at once"
        f"{', on a line' if seen[best] >= FEWEST else ''}: a configuration has {nq - 1} numbers; "
        "it needs three markers or more that are not on a line, some of them on the tail"
    )


def refuse_scale(placed: Placements, tracks: MarkerTracks, moving: Collection[int] = ()) -> None:
    """IdentificationError if markers are apart by another order of magnitude than their places.

    Those on the torso are compared, the median of all pairs and frames; if there are too few, all
    markers with a straight tail. moving: markers whose places are estimated.
    """
    straight = np.concatenate([REST, np.zeros(placed.model.layout.nt)])
    body = world_points(placed, straight[None])[0]
    fixed = np.array([k not in moving for k in range(len(body))])
    for use, most in ((fixed & placed.on_torso, RIGID), (fixed, BENDABLE)):
        ratios = [
            np.linalg.norm(tracks.positions[:, a] - tracks.positions[:, b], axis=1) / apart
            for a, b in combinations(np.flatnonzero(use), 2)
            if (apart := np.linalg.norm(body[a] - body[b])) > 0
        ]
        if np.isfinite(ratios).any():
            ratio = float(np.nanmedian(ratios))
            if not 1 / most < ratio < most:
                raise IdentificationError(_of_scale(tracks, ratio))
            return


def _of_scale(tracks: MarkerTracks, ratio: float) -> str:
    """Return in words that positions are too large or too small, and the unit that would fit."""
    right = {name: float(value / UNITS[tracks.unit]) * ratio for name, value in UNITS.items()}
    unit = min(right, key=lambda name: abs(np.log(right[name])))
    remedy = f"check the unit {tracks.unit!r}"
    if abs(np.log(right[unit])) < np.log(ALIKE):
        remedy = f'they look like {unit} read as {tracks.unit}: give unit="{unit}"'
    return (
        f"data: {tracks.source}: markers are {ratio:.4g} times as far apart as their places: "
        f"{remedy}, or check the places, which are in m"
    )


def warn_of_swaps(placed: Placements, tracks: MarkerTracks, q: np.ndarray) -> tuple[int, ...]:
    """Warn of two markers whose exchange makes frames fit much better; return them."""
    seen = tracks.seen.sum(axis=1)
    rows = np.flatnonzero(seen == seen.max())
    positions = tracks.positions[rows]
    misfits = fitted(placed, positions, q[rows])[1]
    loose = np.flatnonzero(misfits >= LOOSE * float(placed.model.parameters["tail_length"]))
    if not len(loose):
        return ()

    def exchanged(pairs: Sequence[tuple[int, ...]], frames: np.ndarray) -> np.ndarray:
        """Return misfits (pairs, frames) with pairs exchanged, from these and straight tails."""
        changed = np.stack([positions[frames]] * len(pairs))
        for k, pair in enumerate(pairs):
            changed[k][:, pair] = positions[frames][:, pair[::-1]]
        straight = q[rows[frames]]
        straight[:, TAIL_Q] = 0
        begin = np.concatenate([q[rows[frames]]] * len(pairs) + [straight] * len(pairs))
        both = np.tile(changed.reshape(-1, *positions.shape[1:]), (2, 1, 1))
        return fitted(placed, both, begin)[1].reshape(2, len(pairs), -1).min(axis=0)

    # the pair that mends some frames best, and then how many it mends
    few = loose[np.linspace(0, len(loose) - 1, min(FRAMES, len(loose))).astype(int)]
    pairs = [*combinations(range(len(tracks.names)), 2)]
    best = pairs[int(np.median(exchanged(pairs, few), axis=1).argmin())]
    (after,) = exchanged([best], loose)
    swapped = loose[after < HALF * misfits[loose]]
    if len(swapped) <= len(loose) / 2:
        return ()
    place = "throughout"
    if len(swapped) < ALWAYS * len(rows):
        first, last = tracks.times[rows[swapped[[0, -1]]]]
        place = f"in {len(swapped)} frames from {first:g} to {last:g} s"
    a, b = (tracks.names[k] for k in best)
    _warn(
        f"{tracks.source}: markers {a!r} and {b!r} look swapped {place}: with them "
        f"exchanged these frames fit to {1e3 * np.median(after):.3g} mm in place of "
        f"{1e3 * np.median(misfits[loose]):.3g} mm"
    )
    return best


def torques_missing(placed: Placements, linear: Linear) -> bool:
    """Tell whether residuals are smooth and grow to the tip, whatever the markers' offsets are.

    A marker that is elsewhere than stated leaves residuals that are constant in the axes of its
    offset. A missing torque leaves residuals that change smoothly over time, most of all at the
    tip.
    """
    iterate, trial = linear.iterate, linear.iterate.trial
    seen, rows = trial.tracks.seen, trial.coordinates
    q = iterate.states[trial.frames, : placed.model.nq]
    axes = offset_axes(placed, q) / trial.noise[..., None, None]

    # what is left of the residuals with offsets of all markers as further columns
    markers = seen.shape[1]
    offsets = np.einsum("fmij,mn->fminj", axes, np.eye(markers))[seen].reshape(rows, -1)
    columns = np.hstack([linear.rows[:rows], offsets])
    scale = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(scale > 0, scale, 1)
    residual = linear.residual[:rows]
    left = residual - columns @ np.linalg.lstsq(columns, residual, rcond=1e-9)[0]
    remainder = np.full((*seen.shape, 3), np.nan)
    remainder[seen] = left.reshape(-1, 3)

    sizes = np.sqrt(np.nanmean(remainder**2, axis=(0, 2)))
    torso, tip = placed.on_torso, int(np.argmax(placed.piece + placed.fraction))
    steps = np.diff(remainder[seen[:, tip], tip], axis=0)
    if torso[tip] or not torso.any() or len(steps) < FEWEST_STEPS:
        return False
    smooth = min(SMOOTH, 2 * (1 - SURE / np.sqrt(steps.size))) * sizes[tip] ** 2
    return bool(np.mean(steps**2) < smooth and sizes[tip] > GROWS * np.median(sizes[torso]))


def warn_of_residuals(
    tracks: MarkerTracks, modelled: np.ndarray, missing: bool = False, swapped: tuple[int, ...] = ()
) -> None:
    """Warn of markers that look swapped in some frames, and of torques or markers that fit badly.

    modelled (F, M, 3): positions of the markers by the fit; missing: residuals look as where
    torques are missing, so that no marker is to blame; swapped: markers of which it is known.
    """
    off = np.linalg.norm(tracks.positions - modelled, axis=2)
    named = _warn_of_crossings(tracks, modelled, off, set(swapped))
    rms = np.sqrt(np.nanmean(off**2, axis=0))
    small = SMALL * float(np.linalg.norm(np.ptp(modelled, axis=1), axis=-1).max())
    if missing and not named and rms.max() > small:
        worst = int(rms.argmax())
        _warn(
            f"{tracks.source}: residuals change smoothly over time and grow to the tip, to "
            f"{1e3 * rms[worst]:.3g} mm at {tracks.names[worst]!r}, as where torques are missing: "
            "if joints are driven give torques, or give torques=st.TorquePrior(std, time); if not, "
            "estimate stiffness and damping"
        )
        return
    for k, name in enumerate(tracks.names):
        others = np.median(np.delete(rms, k)) if len(rms) > 1 else np.inf
        if k not in named and rms[k] > max(WORSE * others, small):
            _warn(
                f"{tracks.source}: marker {name!r} is off by {1e3 * rms[k]:.3g} mm, others by "
                f"{1e3 * others:.3g} mm: check its name and its placement, or estimate "
                f'"marker:{name}"'
            )


def _warn_of_crossings(
    tracks: MarkerTracks, modelled: np.ndarray, off: np.ndarray, named: set[int]
) -> set[int]:
    """Warn of pairs that fit better exchanged in some frames; return all markers so named."""
    usual = float(np.nanmedian(off))
    for a, b in combinations(range(len(tracks.names)), 2):
        crossed = np.hypot(
            np.linalg.norm(tracks.positions[:, a] - modelled[:, b], axis=1),
            np.linalg.norm(tracks.positions[:, b] - modelled[:, a], axis=1),
        )
        straight = np.hypot(off[:, a], off[:, b])
        rows = np.flatnonzero((crossed < HALF * straight) & (straight > CLEAR * usual))
        if len(rows) and not named >= {a, b}:
            named = named | {a, b}
            first, last = tracks.times[rows[[0, -1]]]
            _warn(
                f"{tracks.source}: markers {tracks.names[a]!r} and {tracks.names[b]!r} look "
                f"swapped in {len(rows)} frames from {first:g} to {last:g} s: exchange them"
            )
    return named


def _warn(words: str) -> None:
    """Issue a warning at the line that calls the package."""
    frame, calls = sys._getframe(1), 2
    while frame.f_back and frame.f_globals["__name__"].startswith(PACKAGE):
        frame, calls = frame.f_back, calls + 1
    warnings.warn(words, DoubtfulMarkers, stacklevel=calls)
