"""Converts the paper's polar angles (phi, theta) of continuum segments to bends (a, b) and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..basics.checks import finite_array
from ..basics.errors import StateError

Array = NDArray[np.float64]
Four = tuple[Array, Array, Array, Array]


def polar_to_bend(
    phi: ArrayLike, theta: ArrayLike, phi_dot: ArrayLike = 0.0, theta_dot: ArrayLike = 0.0
) -> Four:
    """Convert polar angles of continuum segments to bend components.

    a = -theta cos(phi) and b = theta sin(phi); the rates are the time derivatives of these.

    Parameters
    ----------
    phi, theta : array_like
        Direction and size of the bend (rad), in equal shapes.
    phi_dot, theta_dot : array_like, default 0
        Their rates (rad/s).

    Returns
    -------
    a, b : ndarray
        Bend components (rad), as ``q`` has them.
    a_dot, b_dot : ndarray
        Their rates (rad/s), as ``v`` has them.

    Raises
    ------
    StateError
        A value is not finite, the shapes differ, or a result is too large for a number.

    See Also
    --------
    bend_to_polar : The inverse.

    Examples
    --------
    >>> import serpentail as st
    >>> a, b, a_dot, b_dot = st.polar_to_bend(0.0, 0.5)
    >>> float(a), float(b)
    (-0.5, 0.0)
    """
    values = {"phi": phi, "theta": theta, "phi_dot": phi_dot, "theta_dot": theta_dot}
    phi, theta, phi_dot, theta_dot = _alike(values)
    c, s = np.cos(phi), np.sin(phi)
    with np.errstate(all="ignore"):
        a_dot = theta * phi_dot * s - theta_dot * c
        b_dot = theta * phi_dot * c + theta_dot * s
    return _finite_results(-theta * c, theta * s, a_dot, b_dot)


def bend_to_polar(
    a: ArrayLike, b: ArrayLike, a_dot: ArrayLike = 0.0, b_dot: ArrayLike = 0.0
) -> Four:
    """Convert bend components of continuum segments to polar angles, with theta > 0.

    Parameters
    ----------
    a, b : array_like
        Bend components (rad), in equal shapes.
    a_dot, b_dot : array_like, default 0
        Their rates (rad/s).

    Returns
    -------
    phi, theta : ndarray
        Direction and size of the bend (rad).
    phi_dot, theta_dot : ndarray
        Their rates (rad/s).

    Raises
    ------
    StateError
        As of ``polar_to_bend``, or a segment is straight, so that phi is not defined.

    See Also
    --------
    polar_to_bend : The inverse.
    """
    a, b, a_dot, b_dot = _alike({"a": a, "b": b, "a_dot": a_dot, "b_dot": b_dot})
    with np.errstate(over="ignore"):
        theta = np.hypot(a, b)
    if not (theta > 0).all():
        straight = np.argwhere(~(theta > 0)).tolist()[0]
        raise StateError(
            f"segment {straight or ''} is straight: phi has no value there; stay with a and b"
        )
    with np.errstate(all="ignore"):
        phi_dot = (a_dot * (b / theta) - b_dot * (a / theta)) / theta
        theta_dot = (a / theta) * a_dot + (b / theta) * b_dot
    return _finite_results(np.arctan2(b, -a), theta, phi_dot, theta_dot)


def _alike(values: dict[str, ArrayLike]) -> list[Array]:
    """Return finite arrays of one shape."""
    arrays = {name: finite_array(name, value) for name, value in values.items()}
    try:
        return [*np.broadcast_arrays(*arrays.values())]
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise StateError(f"shapes differ: {shapes}: give equal ones") from None


def _finite_results(*results: Array) -> Four:
    """Return results; StateError if one is too large for a number."""
    if not all(np.isfinite(x).all() for x in results):
        raise StateError(
            "the converted state is too large for numbers: is an angle or a rate too large, or "
            "theta too small?"
        )
    first, second, third, fourth = results
    return first, second, third, fourth
