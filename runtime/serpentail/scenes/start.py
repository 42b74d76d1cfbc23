"""The start that a scene's table [simulate.start] describes: q0 and v0 before it settles."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, VELOCITY

from ..basics.checks import finite_array, number, refusal
from ..basics.errors import SimulationError
from ..model.model import Model
from ..simulation.controllers.schedules import shared_among_links
from ..simulation.settle import check_settling
from .simulate_keys import ANGLES


def start_of(model: Model, table: Mapping, reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return q0 and v0, before the model settles."""
    tail = _tail(model, table, reference)
    if model.fixed:
        of_torso = [f"simulate.start.{name}" for name in table if name != "bends"]
        if of_torso:
            raise SimulationError(
                f"{of_torso[0]}: this scene has a fixed base, whose start has `bends` alone: "
                'remove it, or set base = "free"'
            )
        return tail, np.zeros(model.nv)
    q = np.concatenate([_pose(table), tail])
    v = np.zeros(model.nv)
    v[VELOCITY] = _three("simulate.start.velocity", table.get("velocity", (0, 0, 0)))
    v[OMEGA] = _three("simulate.start.rate", table.get("rate", (0, 0, 0)))
    if "settle" in table:
        check_settling(model, **table["settle"])
        if v.any():
            raise SimulationError(
                "simulate.start.settle: a start that settles has no velocity and no rate: remove "
                "them"
            )
    return q, v


def _pose(table: Mapping) -> np.ndarray:
    """Return position and quaternion of R = Rz(yaw) Rx(pitch) Ry(roll)."""
    from scipy.spatial.transform import Rotation

    height, pitch, roll, yaw = (
        number(f"simulate.start.{name}", table.get(name, 0.0), SimulationError)
        for name in ("height", *ANGLES)
    )
    rotation = Rotation.from_euler("ZXY", [yaw, pitch, roll])
    return np.array([0, 0, height, *np.roll(rotation.as_quat(), 1)])


def _tail(model: Model, table: Mapping, reference: Any) -> np.ndarray:
    """Return the tail coordinates: of given bends, else of the reference at t = 0, else zeros."""
    if "bends" in table:
        bends = finite_array("simulate.start.bends", table["bends"], SimulationError)
        return shared_among_links(model, bends[None])[0]
    curve = getattr(reference, "curve", None)
    return np.zeros(model.layout.nt) if curve is None else curve.at(0.0)[0]


def _three(name: str, value: Any) -> np.ndarray:
    array = finite_array(name, value, SimulationError)
    if array.shape != (3,):
        raise refusal(name, value, "three numbers", SimulationError)
    return array
