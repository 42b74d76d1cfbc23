"""Mass and weight of all that moves, and where it falls, from a model's parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

Values = Mapping[str, Any]  # name -> number or numbers, SI; of many runs (k,) or (k, size)
OTHER_CHAINS = "other_chains_mass"  # kg, of all chains but the tail; it follows from their masses


def total_mass(values: Values) -> Any:
    """Return the mass (kg) of torso and chains, or one of each run; of the tail on a fixed base."""
    others = values.get(OTHER_CHAINS, 0.0)
    return values.get("torso_mass", 0.0) + values["tail_mass"] + others


def fall(values: Values) -> np.ndarray:
    """Return the acceleration of gravity (3,), m/s^2, world, or (k, 3) of k runs."""
    if "gravity_vector" in values:
        return np.asarray(values["gravity_vector"], float)
    return np.asarray(values["gravity"], float)[..., None] * [0.0, 0.0, -1.0]


def weight_of(values: Values) -> Any:
    """Return the weight (N) of torso and chains, or one of each run; 0 without gravity."""
    return total_mass(values) * np.linalg.norm(fall(values), axis=-1)
