"""Polar coordinates of continuum segments: the paper's (phi, theta) in, bend components (a, b) out,
and back.
"""

import numpy as np

from ..checks import finite_array
from ..errors import StateError


def polar_to_bend(phi, theta, phi_dot=0.0, theta_dot=0.0):
    """Return (a, b, a_dot, b_dot) of a = -theta cos(phi), b = theta sin(phi); rad and rad/s, any
    equal shapes.

    Raises StateError where a value is no finite number, or the results are beyond numbers.
    """
    given = {"phi": phi, "theta": theta, "phi_dot": phi_dot, "theta_dot": theta_dot}
    phi, theta, phi_dot, theta_dot = _alike(given)
    c, s = np.cos(phi), np.sin(phi)
    with np.errstate(all="ignore"):
        rates = theta * phi_dot * s - theta_dot * c, theta * phi_dot * c + theta_dot * s
    return _finite_results(-theta * c, theta * s, *rates)


def bend_to_polar(a, b, a_dot=0.0, b_dot=0.0):
    """Return (phi, theta, phi_dot, theta_dot), theta > 0; StateError where a segment is straight:
    phi has no value.
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


def _alike(given: dict) -> list[np.ndarray]:
    """Return finite arrays of one shape."""
    arrays = [finite_array(name, value) for name, value in given.items()]
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(
            f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True)
        )
        raise StateError(f"shapes differ: {shapes}: give equal ones") from None


def _finite_results(*results: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return results, unless one is beyond numbers."""
    if not all(np.isfinite(x).all() for x in results):
        raise StateError(
            "the converted state is beyond numbers: is an angle or a rate too large, or theta too "
            "small?"
        )
    return results
