"""``joint_torques``: inverse dynamics of marker tracks.

This is the usual way of biomechanics: configurations are fitted to each frame, smoothed,
differentiated twice, and put into the equations of motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, VELOCITY

from ..basics.attitude import sign_continuous
from ..basics.checks import number
from ..basics.errors import IdentificationError
from ..basics.near_names import NearNames
from ..model.model import Model
from ..model.state import Quantity
from ..model.state_space import product_matrix
from ..motion.trajectory import Trajectory
from .data_checks import refuse_scale, refuse_too_few, warn_of_residuals
from .identify import refuse_unlike
from .placement import Marker, placements, world_points
from .result import trajectory_of
from .start import configurations
from .tracks import MarkerTracks

DEGREE = 5
ROUGH = 3  # the derivative whose square is penalised


@dataclass(frozen=True, eq=False)
class JointTorques(NearNames):
    """Inverse dynamics at the F frames of marker tracks.

    Attributes
    ----------
    times : ndarray, shape (F,)
        Times (s).
    tau : ndarray, shape (F, 2m)
        Torques (N m), conjugate to the tail coordinates.
    power : ndarray, shape (F, 2m)
        Torque times the rate of its coordinate (W).
    residual_force : ndarray, shape (F, 3)
        Force (N, world) that would have to act on the torso besides gravity; zero in flight
        except for errors.
    residual_moment : ndarray, shape (F, 3)
        The same for the moment about B (N m, body).
    trajectory : Trajectory
        The smoothed motion.
    modelled : ndarray, shape (F, M, 3)
        Positions of the markers by the model (m, world).
    """

    times: np.ndarray
    tau: np.ndarray
    power: np.ndarray
    residual_force: np.ndarray
    residual_moment: np.ndarray
    trajectory: Trajectory
    modelled: np.ndarray


def joint_torques(
    model: Model, tracks: MarkerTracks, markers: Mapping[str, Marker], *, cutoff: Quantity
) -> JointTorques:
    """Compute joint torques and powers of a motion from marker tracks, by inverse dynamics.

    Parameters
    ----------
    model : Model
        The model, with a free base.
    tracks : MarkerTracks
        The tracks.
    markers : mapping of str to Marker
        Place of each marker, as of ``identify``.
    cutoff : float
        Cutoff frequency of the smoothing (Hz). Quintic splines pass the part
        1 / (1 + (f / cutoff)^6) of an oscillation of frequency f, without delay, for frames at
        any times and over gaps.

    Returns
    -------
    JointTorques
        Torques, powers, residuals and the smoothed motion.

    Raises
    ------
    IdentificationError
        An argument is wrong, or too few markers are seen.
    ModelError
        The base is fixed, or the model uses polar coordinates or computes with float.

    Warns
    -----
    DoubtfulMarkers
        Markers fit badly.

    Notes
    -----
    Torques contain second derivatives: their noise grows with the cutoff, and faster motion is
    lost.
    """
    cutoff = number("cutoff", cutoff, IdentificationError, unit="1/s", above=0)
    refuse_unlike(model, "joint_torques")
    placed = placements(model, markers)
    if not isinstance(tracks, MarkerTracks):
        raise IdentificationError(
            f"tracks: type {type(tracks).__name__}: needs what read_markers returns"
        )
    tracks = tracks.of(placed.names)
    refuse_too_few(tracks, model.nq)
    refuse_scale(placed, tracks)

    # configurations, smoothed and differentiated twice
    q = configurations(placed, tracks)
    q[:, QUATERNION] = sign_continuous(q[:, QUATERNION])
    q, first, second = smoothed(tracks.times, q, cutoff)
    v, v_dot = rates(q, first, second)
    q[:, QUATERNION] /= np.linalg.norm(q[:, QUATERNION], axis=1, keepdims=True)
    force = model.inverse_dynamics(q, v, v_dot)
    tau = force[:, TAIL_V]
    modelled = world_points(placed, q)
    warn_of_residuals(tracks, modelled)
    motion = trajectory_of(model, tracks.times, np.column_stack([q, v]), tau)
    return JointTorques(
        tracks.times, tau, tau * v[:, TAIL_V], force[:, VELOCITY], force[:, OMEGA], motion, modelled
    )


def smoothed(
    times: np.ndarray, values: np.ndarray, cutoff: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values (F, C) smoothed, and their first two derivatives.

    The spline minimises the sum of squared deviations, each weighted by the time between frames,
    plus (2 pi cutoff)^-6 times the integral of the squared third derivative.
    """
    # B-splines with a knot at each frame
    knots = np.concatenate([[times[0]] * DEGREE, times, [times[-1]] * DEGREE])
    count = len(knots) - DEGREE - 1
    spans = np.gradient(times)
    B = BSpline.design_matrix(times, knots, DEGREE).toarray()
    # the third derivative is of degree 2: three Gauss points a span are exact
    nodes, weights = np.polynomial.legendre.leggauss(3)
    half, middle = np.diff(times) / 2, (times[1:] + times[:-1]) / 2
    at = (middle[:, None] + half[:, None] * nodes).ravel()
    each = BSpline(knots, np.eye(count), DEGREE).derivative(ROUGH)(at)
    W = (half[:, None] * weights).ravel()
    penalty = (each.T * W) @ each * (2 * np.pi * cutoff) ** (-2 * ROUGH)

    # normal equations, whose matrix is banded
    square = (B.T * spans) @ B + penalty
    banded = np.zeros((DEGREE + 1, count))
    for k in range(DEGREE + 1):
        banded[k, : count - k] = np.diag(square, -k)
    spline = BSpline(knots, solveh_banded(banded, (B.T * spans) @ values, lower=True), DEGREE)
    return spline(times), spline.derivative(1)(times), spline.derivative(2)(times)


def rates(q: np.ndarray, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return v and v_dot (F, nv) of configurations (F, nq) and their derivatives.

    omega = 2 vec(conj(Q) Q_dot) / (Q . Q) for a quaternion Q of any norm.
    """
    Q, Q1, Q2 = (each[:, QUATERNION] for each in (q, first, second))
    square = (Q**2).sum(axis=1, keepdims=True)

    def vector(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (np.swapaxes(product_matrix(a), -1, -2) @ b[..., None])[..., 0]

    omega = 2 * vector(Q, Q1) / square
    growth = 2 * (Q * Q1).sum(axis=1, keepdims=True) / square
    omega_dot = 2 * (vector(Q, Q2) + vector(Q1, Q1)) / square - growth * omega
    v = np.concatenate([first[:, POSITION], omega, first[:, TAIL_Q]], axis=1)
    v_dot = np.concatenate([second[:, POSITION], omega_dot, second[:, TAIL_Q]], axis=1)
    return v, v_dot
