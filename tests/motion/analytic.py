"""An analytic motion: a torque-free top in parabolic flight, its tail swinging in sines."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from serpentail.motion.trajectory import Trajectory

PRECESSION, TILT, SPIN = 7.0, 0.6, 11.0  # rad/s, rad, rad/s of a torque-free symmetric top


def top(t):
    """Attitude (w, x, y, z) and body rate of a torque-free symmetric top: R = Rz(a t) Rx(tilt) Rz(b
    t).
    """
    turns = np.stack([PRECESSION * t, TILT + 0 * t, SPIN * t], axis=1)
    rotation = Rotation.from_euler("ZXZ", turns)
    omega = PRECESSION * rotation.as_matrix()[:, 2, :] + [0, 0, SPIN]  # a R^T z + b z
    return rotation.as_quat(canonical=False)[:, [3, 0, 1, 2]], omega


def motion(t, segments=2):
    """A trajectory whose every entry is a known function of time."""
    attitude, omega = top(t)
    phase = 12 * t[:, None] + np.arange(2 * segments)
    position = np.stack([0 * t, 0.6 * t, 2.8 * t - 4.9 * t**2], axis=1)
    rate = np.stack([0 * t, 0.6 + 0 * t, 2.8 - 9.8 * t], axis=1)
    return Trajectory(
        t=t,
        q=np.hstack([position, attitude, 0.5 * np.sin(phase)]),
        v=np.hstack([rate, omega, 6 * np.cos(phase)]),
        tau=np.sign(np.sin(phase)),
        kinetic=1 + rate[:, 2] ** 2 / 2,
        potential=9.8 * position[:, 2],
        linear_momentum=rate,
        angular_momentum=np.tile([1e-3, 2e-3, 3e-3], (len(t), 1)),
        info={
            "method": "analytic",
            "steps": len(t),
            "parameters": {"gravity": 9.8, "torso_inertia": (1, 2, 3)},
        },
    )


def fields(trajectory):
    """The nine arrays and the info of a trajectory by name."""
    found = {
        entry.name: getattr(trajectory, entry.name) for entry in dataclasses.fields(trajectory)
    }
    return {name: value for name, value in found.items() if value is not None}


def assert_same(first, second):
    """Every array bit-equal, every info equal."""
    for name, value in fields(first).items():
        other = getattr(second, name)
        if name == "info":
            assert value == other
        else:
            assert value.dtype == other.dtype == np.float64
            assert value.tobytes() == other.tobytes()
            assert value.shape == other.shape
