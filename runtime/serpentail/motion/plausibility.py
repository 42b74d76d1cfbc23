"""What cannot be true of an animal in a motion: parts in the ground or in each other, blows, bends.

Found in the samples when somebody asks, never while a run is simulated.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION

from ..basics.attitude import Array, rotation_matrix
from ..basics.errors import StateError
from ..model.model import Model
from ..model.weight import total_mass, weight_of
from .body import semi_axes
from .ground import peaks

if TYPE_CHECKING:
    from .trajectory import Trajectory

DEEP = 0.1  # of the torso's length, below the ground: as deep as a torso rests in it by contact
SUNK = 0.1  # of the way from the torso's centre to its surface
# Body weights, kg: of a triple jumper's leg, Perttunen et al., J. Sports Sci. 18 (2000) 363.
# Bodies of one shape bear, at equal stress, forces like mass^(2/3): body weights like mass^(-1/3).
BORNE, BEARER = 15.2, 75.0
# rad, of a segment: beyond half a turn its end points back into it, and plans may go just so far
MOST_BEND = 1.02 * np.pi
DEGREES = 4 * np.pi  # rad, of a segment: two whole turns; degrees are the likely cause
KNEES = 3  # hip, D and knee come first in a leg, and are no contacts
AT_ONCE = 4096  # samples

WORDS = {  # of doubts; a page that computes tells them, too
    "buried": "{part}: {depth:.3g} mm below the ground at t = {time:.4g} s, more than "
    "{allowed:.3g} mm, and no contact there: {remedy}",
    "add": 'add "{part}" to `contacts` of the scene',
    "knees": "above the ankle they touch nothing: start higher, or bend the legs less",
    "sunk": "tail: goes through the torso at t = {time:.4g} s, {depth:.2g} of the way from its "
    "surface to its centre too deep, more than {allowed:.3g}: bend the tail less, or damp it more",
    "pushed": "ground: pushes with {force:.4g} N at t = {time:.4g} s, {weights:.3g} body weights, "
    "more than {most:.3g}, which legs of this size bear: let the legs move, or the animal land, "
    "more slowly, or make the ground softer by K_n and D_n",
    "bent": "tail: segment {segment} is bent by {bend:.3g} rad at t = {time:.4g} s, more than "
    "{most:.3g}: {remedy}",
    "damp": "damp it more, or give its reference smaller bends",
    "degrees": "are degrees given in place of radians (np.radians)? If not, damp it more",
}

Moment = tuple[float, float]  # value, time (s)
Measure = Callable[[slice], Array]  # samples -> (K,)


def warnings_of(model: Model | None, motion: "Trajectory") -> list[str]:
    """Return all doubts about a motion; without a model, those of when it was saved among them."""
    books: list[str] = motion.info.get("warnings", [])
    impossible = motion.info.get("doubts", []) if model is None else doubts(model, motion)
    return [*books, *impossible]


def doubts(model: Model, motion: "Trajectory") -> list[str]:
    """Return a sentence with value, time and remedy for everything that no animal can do.

    Checks of tail or legs need the functions ``tail_points`` and ``leg_points`` of the scene.
    """
    with np.errstate(all="ignore"):  # of a run that blows up
        return [
            *_in_the_ground(model, motion),
            *_through_the_torso(model, motion),
            *_blows(model, motion),
            *_bends(model, motion),
        ]


def _in_the_ground(model: Model, motion: "Trajectory") -> list[str]:
    """Return parts that are deep in the ground, because the scene gives them no contact."""
    if motion.contact is None:
        return []
    allowed, warnings = DEEP * 2 * float(semi_axes(model).max()), []
    keys = {chain.name: chain.owner or chain.name for chain in model.layout.chains}
    for part, (depth, time) in _depths(model, motion).items():
        if depth > allowed:
            remedy = WORDS["knees" if part == "legs" else "add"].format(part=keys.get(part, part))
            lengths = {"depth": 1e3 * depth, "allowed": 1e3 * allowed}
            warnings.append(WORDS["buried"].format(part=part, time=time, remedy=remedy, **lengths))
    return warnings


def _depths(model: Model, motion: "Trajectory") -> dict[str, Moment]:
    """Return the largest depth (m) of each part without contact, and its time."""
    contact = motion.contact
    assert contact is not None
    q, axes, depths = motion.q, semi_axes(model), {}
    if "torso" not in contact.groups:
        depths["torso"] = _largest(motion, lambda rows: _depth_of_torso(q[rows], axes))
    for chain in model.layout.chains if "tail_points" in model.kernels else ():
        if chain.name not in contact.groups:
            depth = partial(_depth_of_chain, model, motion, chain.points)
            depths[chain.name] = _largest(motion, depth)
    legs = contact.legs
    if legs is not None and "leg_points" in model.kernels:
        depths["legs"] = _largest(
            motion,
            lambda rows: -model.leg_points(q[rows], legs[rows])[..., :KNEES, 2].min(axis=(1, 2)),
        )
    return depths


def _depth_of_chain(model: Model, motion: "Trajectory", points: slice, rows: slice) -> Array:
    """Depth (K,) in m of the lowest point of a chain in some samples."""
    given = (each[rows] for each in motion.given)
    return -model.tail_points(motion.q[rows], *given)[:, points, 2].min(axis=1)


def _depth_of_torso(q: Array, axes: Array) -> Array:
    """Depth (K,) in m of the lowest point of the torso's ellipsoid."""
    up = rotation_matrix(q[:, QUATERNION])[:, 2]
    return np.linalg.norm(axes * up, axis=1) - q[:, 2]


def _through_the_torso(model: Model, motion: "Trajectory") -> list[str]:
    """A tail that bends into the torso, or comes back into it."""
    if not torso_is_known(model):
        return []

    known = motion.q, *motion.given

    def depth(rows: slice) -> Array:
        return depth_in_torso(model, *(each[rows] for each in known))

    deepest, time = _largest(motion, depth)
    if not deepest > SUNK:
        return []
    return [WORDS["sunk"].format(time=time, depth=deepest, allowed=SUNK)]


def torso_is_known(model: Model) -> bool:
    """Tell if it can be found whether the tail is in the torso."""
    return "tail_points" in model.kernels and bool(semi_axes(model).all())


def depth_in_torso(model: Model, q: Array, *given: Array) -> Array:
    """Return how far chains go into the torso, (K,), of states q (K, nq); see ``sunk``."""
    from_b = model.tail_points(q, *given) - q[:, None, POSITION]
    own = np.einsum("kij,kpi->kpj", rotation_matrix(q[:, QUATERNION]), from_b)
    scaled = own / semi_axes(model)
    return np.max([sunk(scaled[:, chain.points]) for chain in model.layout.chains], axis=0)


def sunk(points: Array) -> Array:
    """Return how far tails (K, P, 3) go into the torso, (K,): 0 not at all, 1 to its centre.

    points: from the mount to the tip, joined by straight lines, from the torso's centre in its axes
    and divided by its semi-axes, so that the torso is the unit ball. Until the tail has left the
    ball once, it may be as near to the centre as its mount; from then on it must stay outside.
    """
    distance = np.linalg.norm(points, axis=2)
    outside = np.maximum.accumulate(distance, axis=1)[:, :-1] > 1
    allowed = np.where(outside, 1, distance[:, :1])
    return np.asarray(np.max(allowed - _nearest(points), axis=1, initial=0))


def _nearest(points: Array) -> Array:
    """Least distances (K, P - 1) from the centre of the lines between neighbours."""
    starts, ways = points[:, :-1], np.diff(points, axis=1)
    lengths = np.maximum((ways**2).sum(axis=2), np.finfo(float).tiny)
    parts = np.clip(-(starts * ways).sum(axis=2) / lengths, 0, 1)
    return np.asarray(np.linalg.norm(starts + parts[..., None] * ways, axis=2))


def borne(model: Model) -> float:
    """Return the largest force of the ground (body weights) that legs of the body's size bear."""
    return float(BORNE * (BEARER / total_mass(model.parameters)) ** (1 / 3))


def _blows(model: Model, motion: "Trajectory") -> list[str]:
    """A force of the ground that no legs of the animal's size bear."""
    largest, whole = peaks(motion), weight_of(model.parameters)
    if not largest or not whole:
        return []
    force, time = largest["all"]
    most = borne(model)
    if not force > most * whole:
        return []
    return [WORDS["pushed"].format(force=force, time=time, weights=force / whole, most=most)]


def _bends(model: Model, motion: "Trajectory") -> list[str]:
    """Segments that are bent by clearly more than half a turn."""
    bends = _bend(model, motion.tail)
    warnings = []
    for segment, k in enumerate(bends.argmax(axis=0)):
        if bends[k, segment] > MOST_BEND:
            numbers = {"bend": bends[k, segment], "time": motion.t[k], "most": MOST_BEND}
            remedy = WORDS["degrees" if bends[k, segment] > DEGREES else "damp"]
            warnings.append(WORDS["bent"].format(segment=segment + 1, remedy=remedy, **numbers))
    return warnings


def _bend(model: Model, tail: Array) -> Array:
    """How far the segments are bent, (K, m), rad: of joints the larger of pitch and yaw; hinges may
    turn on and on.
    """
    firsts, widths = np.array(model.layout.firsts), np.array(model.layout.widths)
    free = np.pad(tail, ((0, 0), (0, 1)))  # prescribed segments have no numbers
    first, second = free[:, firsts], free[:, firsts + widths - 1]
    joints = model.turns_each * (widths > 1)
    if model.manifest["scene"]["coordinates"] == "polar":
        return np.abs(second)
    jointed = np.array(model.kinds) != "continuum"
    of_joints = joints * np.maximum(np.abs(first), np.abs(second))
    return np.where(jointed, of_joints, (widths > 1) * np.hypot(first, second))


def _largest(motion: "Trajectory", measure: Measure) -> Moment:
    """The largest value of a measure of samples, and its time; some samples at once."""
    try:
        values = np.concatenate(
            [measure(slice(k, k + AT_ONCE)) for k in range(0, len(motion.t), AT_ONCE)]
        )
    except StateError:  # a run that blows up has points that no number holds
        return -np.inf, float(motion.t[0])
    k = int(values.argmax())
    return float(values[k]), float(motion.t[k])
