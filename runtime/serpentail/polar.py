"""Polar coordinates of continuum segments: the paper's (phi, theta) in, bend components (a, b) out, and back."""

import numpy as np

from .errors import StateError


def polar_to_bend(phi, theta, phi_dot=0.0, theta_dot=0.0):
    """Return (a, b, a_dot, b_dot) of a = -theta cos(phi), b = theta sin(phi); rad and rad/s, any equal shapes."""
    phi, theta, phi_dot, theta_dot = (np.asarray(x, float) for x in (phi, theta, phi_dot, theta_dot))
    c, s = np.cos(phi), np.sin(phi)
    a_dot, b_dot = theta * phi_dot * s - theta_dot * c, theta * phi_dot * c + theta_dot * s
    return -theta * c, theta * s, a_dot, b_dot


def bend_to_polar(a, b, a_dot=0.0, b_dot=0.0):
    """Return (phi, theta, phi_dot, theta_dot), theta > 0; StateError where a segment is straight: phi has no value."""
    a, b, a_dot, b_dot = np.broadcast_arrays(*(np.asarray(x, float) for x in (a, b, a_dot, b_dot)))
    theta = np.hypot(a, b)
    if not (theta > 0).all():
        straight = np.argwhere(~(theta > 0)).tolist()[0]
        raise StateError(f"segment {straight or ''} is straight: phi has no value there; stay with a and b")
    phi_dot = (a_dot * (b / theta) - b_dot * (a / theta)) / theta
    return np.arctan2(b, -a), theta, phi_dot, (a / theta) * a_dot + (b / theta) * b_dot
