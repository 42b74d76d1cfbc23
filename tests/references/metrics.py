"""Dimensionless errors of a mass matrix or a (force, torque, tail) vector against its reference."""

import numpy as np

BLOCKS = (slice(0, 3), slice(3, 6), slice(6, None))
NEGLIGIBLE = 1e-6


def mass_matrix_error(mass, mass_ref):
    """Largest |dH_ij| / sqrt(H_ii H_jj), so that the torso's mass does not hide the tail."""
    scale = np.sqrt(np.diag(mass_ref))
    return float(np.max(np.abs(mass - mass_ref) / np.outer(scale, scale)))


def block_error(x, x_ref):
    """Largest max|d| / max|ref| over (force, torque, tail); a zero block: by the others."""
    x, x_ref = np.asarray(x), np.asarray(x_ref)
    floor = NEGLIGIBLE * np.max(np.abs(x_ref)) or 1.0
    return float(max(_scaled_error(x[block], x_ref[block], floor) for block in BLOCKS))


def force_error(force, force_ref, mass_ref):
    """Return the largest |dC_i| / sqrt(H_ii) over the largest |C_i| / sqrt(H_ii).

    C_i sums products of a Jacobian's column with accelerations, both weighted by masses. By Cauchy
    and Schwarz no term is above sqrt(H_ii) times the norm of the accelerations, however much the
    terms cancel.
    """
    scale = np.sqrt(np.diag(mass_ref))
    return float(
        np.max(np.abs(force - force_ref) / scale) / (np.max(np.abs(force_ref) / scale) or 1.0)
    )


def equilibrated_condition(mass):
    """2-norm condition number of H after the symmetric scaling to a unit diagonal."""
    scale = np.sqrt(np.diag(mass))
    return float(np.linalg.cond(mass / np.outer(scale, scale)))


def near(found, expected, limit):
    """Compare arrays with a limit of the largest entry."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=limit * np.abs(expected).max())


def _scaled_error(x, x_ref, floor):
    """Return max|d| / max|ref|, with a scale never below the floor."""
    scale = np.max(np.abs(x_ref), initial=0.0)
    return np.max(np.abs(x - x_ref), initial=0.0) / max(scale, floor)
