"""Flights in air: no momentum is conserved, so the torso's velocities are states of a plan."""

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, VELOCITY

from ..basics.attitude import rotation_matrix
from ..basics.errors import PlanningError
from ..model.model import Model

DRIFT = (("airspeed", 3), ("spin", 3))  # velocity of B against the air (m/s), omega: torso axes


def in_air(model: Model) -> bool:
    """Tell if air acts on a model."""
    return "air_density" in model.parameters


def drift_of_states(model: Model, q: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
    """Return the blocks of ``DRIFT`` (K, 3) of states q (K, nq), v (K, nv)."""
    R, gone = rotation_matrix(q[:, QUATERNION]), v[:, VELOCITY] - model.parameters["wind"]
    return {"airspeed": np.einsum("kji,kj->ki", R, gone), "spin": v[:, OMEGA]}


def world_velocity(model: Model, blocks: dict[str, np.ndarray]) -> np.ndarray:
    """Return the velocity (..., 3) of B, world, from quaternions of any norm and ``airspeed``."""
    c = blocks["attitude"]
    R = rotation_matrix(c / np.linalg.norm(c, axis=-1, keepdims=True))
    return (R @ blocks["airspeed"][..., None])[..., 0] + np.array(model.parameters["wind"])


def refuse_air(model: Model, what: str) -> None:
    """PlanningError if air acts on a model."""
    if in_air(model):
        raise PlanningError(
            f"{what}: the model has air (parameters.air_density): this needs a model without it"
        )
