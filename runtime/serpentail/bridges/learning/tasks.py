"""The tasks of environments: the starts of episodes, and what a model needs for them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION

from ...basics.attitude import from_angles
from ...basics.checks import number, numbers_in, refusal, whole_number
from ...basics.errors import ModelError, SimulationError, StateError
from ...model.model import Model
from ...model.state import parted

Array = np.ndarray
MOST_SUBSTEPS = 1000
LEG_ANGLES = np.radians([210.0, -40.0])  # gamma and delta of both legs, all the time
ABOVE = 1e-3  # m: how far the lowest point of an animal that lies begins above the ground
UNITS = {  # of settings, which may be texts with units
    "torque": "N m", "step": "s", "duration": "s", "angle": "rad",
    "tilt": "rad", "spin": "rad/s", "height": "m",
}  # fmt: skip
DRAWS = 5  # numbers in [0, 1) that a start takes


@dataclass(frozen=True)
class LearningTask:
    """One kind of episode: contacts that it needs, its start, and settings by default."""

    name: str
    contacts: tuple[str, ...]  # none: it flies all the time
    start: Callable[[Model, dict[str, Any], Array], tuple[Array, Array]]
    settings: dict[str, float]

    def checked(self, model: Model, given: dict[str, Any]) -> dict[str, Any]:
        """Return all settings; SimulationError or ModelError names what is wrong."""
        if not all(model.layout.driven):
            remedy = 'an agent drives all: set drive = "torque" in the scene'
            raise ModelError(f"{self.name}: {model.name} has passive coordinates: {remedy}")
        missing = [group for group in self.contacts if group not in model.contacts]
        if missing or (model.contacts and not self.contacts):
            needs = ", ".join(map(repr, self.contacts)) or "none, because it is a flight"
            has = ", ".join(map(repr, model.contacts)) or "none"
            raise ModelError(
                f"{self.name}: {model.name} has contacts {has}: needs {needs}: build it with "
                f"contacts={list(self.contacts)}, or change `contacts` of the scene"
            )
        settings: dict[str, Any] = {
            "angle": float(np.pi / np.max(np.abs(model.turns_each))),
            "start": None,
        }
        settings |= self.settings
        unknown = [name for name in given if name not in settings]
        if unknown:
            raise SimulationError(
                f"{self.name} has no setting {', '.join(map(repr, unknown))}; it has "
                f"{', '.join(settings)}"
            )
        settings |= given
        for name in ("torque", "step", "duration", "angle"):
            settings[name] = number(
                name, settings[name], SimulationError, unit=UNITS[name], above=0
            )
        for name, most in (("tilt", np.pi), ("spin", np.inf), ("height", np.inf)):
            if name in settings:
                settings[name] = _up_to(name, settings[name], most)
        if settings["start"] is not None:
            settings["start"], _ = parted(model, settings["start"])
            if [np.shape(part) for part in settings["start"]] != [(model.nq,), (model.nv,)]:
                raise refusal("start", given["start"], "a state of this model", StateError)
        settings["substeps"] = whole_number(
            "substeps", settings["substeps"], SimulationError, least=1, most=MOST_SUBSTEPS
        )
        return settings


def _up_to(name: str, value: Any, most: float) -> float:
    """Return a setting from 0 to the largest one; of an angle, the error names radians."""
    try:
        return number(name, value, SimulationError, unit=UNITS[name], least=0, most=most)
    except SimulationError as error:
        angle = numbers_in(value)
        if UNITS[name] != "rad" or angle is None or angle.shape != ():
            raise
        remedy = f', or "{angle:g} deg"' if most < angle <= np.degrees(most) else ""
        raise SimulationError(f"{error} rad{remedy}") from None


def start_in_air(model: Model, settings: dict[str, Any], draws: Array) -> tuple[Array, Array]:
    """Return states (k, nq), (k, nv) in the air, tilted and spinning as drawn."""
    q, v = np.zeros((len(draws), model.nq)), np.zeros((len(draws), model.nv))
    q[:, 2] = settings["height"]
    # a tilt about a horizontal axis, and a spin about any
    tilt, axis = settings["tilt"] * draws[:, 0], 2 * np.pi * draws[:, 1]
    q[:, QUATERNION] = np.stack(
        [np.cos(tilt / 2), *(np.sin(tilt / 2) * (np.cos(axis), np.sin(axis))), 0 * tilt], axis=1
    )
    z, angle = 2 * draws[:, 2] - 1, 2 * np.pi * draws[:, 3]
    level = np.sqrt(1 - z * z)
    direction = np.stack([level * np.cos(angle), level * np.sin(angle), z], axis=1)
    v[:, OMEGA] = settings["spin"] * draws[:, 4:] * direction
    return q, v


def start_on_back(model: Model, settings: dict[str, Any], draws: Array) -> tuple[Array, Array]:
    """Return states (k, nq), (k, nv) at rest on the back, rolled aside and pitched as drawn."""
    q, v = np.zeros((len(draws), model.nq)), np.zeros((len(draws), model.nv))
    angles = np.zeros((len(draws), 3))  # pitch, roll, yaw
    angles[:, 0] = settings["tilt"] / 3 * (2 * draws[:, 0] - 1)
    angles[:, 1] = np.pi + settings["tilt"] * (2 * draws[:, 1] - 1)
    q[:, QUATERNION] = from_angles(angles)
    points, _ = model.contact_points(q, v, standing_legs())
    q[:, 2] = ABOVE - points[..., 2].min(axis=1)
    return q, v


def standing_legs() -> Array:
    """Return legs (8,) that stand still: angles of both (rad), and their rates."""
    return np.concatenate([LEG_ANGLES, LEG_ANGLES, np.zeros(4)])


# s, N m, rad, rad/s, m: of a kangaroo rat.  step: of the integrator, of which an action has several
FLIGHT = {"torque": 0.02, "step": 1e-3, "substeps": 5}
GROUND = {"torque": 0.02, "step": 2e-4, "substeps": 25}
TASKS = {
    task.name: task
    for task in (
        LearningTask(
            "righting",
            (),
            start_in_air,
            FLIGHT | {"duration": 0.5, "tilt": np.pi / 2, "spin": 0.0, "height": 0.3},
        ),
        LearningTask(
            "landing",
            ("feet",),
            start_in_air,
            GROUND | {"duration": 0.8, "tilt": np.pi / 3, "spin": 0.0, "height": 0.4},
        ),
        LearningTask(
            "self_recovery",
            ("feet", "torso"),
            start_on_back,
            GROUND | {"duration": 1.5, "tilt": 0.3},
        ),
    )
}
