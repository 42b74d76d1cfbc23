"""Many episodes of one task side by side: states, observations and rewards."""

from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q, TAIL_V

from ...basics.checks import real_array, refuse_not_finite
from ...basics.errors import StateError
from ...model.model import Model
from .tasks import DRAWS, LearningTask, standing_legs

EFFORT = 0.01  # of a reward, that full torques cost
# bounds of observations, which are clipped: m, m/s, rad/s
FAR, FAST, SPIN, WHIRL = 100.0, 100.0, 1000.0, 1e5

Array = np.ndarray


class Worlds:
    """States of k episodes.

    Observations of each, SI: the world's z axis in body axes (3,), omega (3,), height and its rate,
    tail coordinates (2m,), their rates (2m,), and which part of its time is left.
    """

    def __init__(self, model: Model, task: LearningTask, count: int, settings: dict[str, Any]):
        self.model, self.task, self.settings = model, task, settings
        self.q, self.v = task.start(model, settings, np.zeros((count, DRAWS)))
        self.q = self.q.astype(model.parameter_vector.dtype)
        self.v = self.v.astype(self.q.dtype)
        self.parts = [self.q, self.v]
        self.step_settings: dict[str, Any] = {"steps": settings["substeps"]}
        if model.contacts:
            bristles = np.zeros((count, 2 * sum(model.contacts.values())), self.q.dtype)
            self.parts.append(bristles)
            self.step_settings["bristles"] = bristles
        if "feet" in model.contacts:
            self.step_settings["legs"] = standing_legs()
        self.statuses = np.zeros(count, np.intc)
        self.actions = np.zeros(count, int)  # of each since its start
        self.horizon = max(1, round(settings["duration"] / self.control_step))
        self.low, self.high = self._bounds()

    @property
    def control_step(self) -> float:
        """How long (s) an action holds."""
        return self.settings["step"] * self.settings["substeps"]

    def restart(self, which: Array, draws: Array) -> None:
        """Begin new episodes; draws (len(which), DRAWS) are from [0, 1)."""
        q, v = self.settings["start"] or self.task.start(self.model, self.settings, draws)
        for part, start in zip(self.parts, (q, v, 0.0), strict=False):
            part[which] = start
        self.actions[which] = 0

    def act(self, actions: Any) -> tuple[Array, Array, Array]:
        """Apply actions (k, 2m), parts of the largest torque, limited to -1 and 1.

        Return rewards (k,), and which episodes were terminated, or truncated after their time.
        """
        nt, count = self.model.layout.nt, len(self.q)
        actions = real_array("action", actions, StateError)
        if actions.shape != (count, nt):
            raise StateError(f"action has shape {actions.shape}, not ({count}, {nt})")
        refuse_not_finite("action", actions, StateError)
        parts = np.clip(actions, -1, 1)
        self.model.step(
            self.q,
            self.v,
            (self.settings["torque"] * parts).astype(self.q.dtype),
            self.settings["step"],
            out=self.parts,
            statuses=self.statuses,
            **self.step_settings,
        )
        self.actions += 1
        rewards = (1 + self._up()[2]) / 2 - EFFORT * np.mean(parts * parts, axis=1)
        bent = np.abs(self.q[:, TAIL_Q]).max(axis=1) > self.settings["angle"]
        return rewards, bent | (self.statuses != 0), self.actions >= self.horizon

    def observations(self) -> Array:
        """Return the observations (k, 9 + 4m), within their bounds."""
        q, v = self.q, self.v
        columns = [*self._up(), *v[:, OMEGA].T, q[:, 2], v[:, 2], *q[:, TAIL_Q].T, *v[:, TAIL_V].T]
        left = 1 - self.actions / self.horizon
        return np.clip(np.stack([*columns, left], axis=1), self.low, self.high).astype(np.float32)

    def _up(self) -> tuple[Array, Array, Array]:
        """Return the world's z axis in body axes; the last is 1 upright, -1 on the back."""
        w, x, y, z = self.q[:, QUATERNION].T
        return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)

    def _bounds(self) -> tuple[Array, Array]:
        """Return the lower and upper bounds of observations, as floats."""
        nt = self.model.layout.nt
        bend = 2 * self.settings["angle"]
        high = np.array([1] * 3 + [SPIN] * 3 + [FAR, FAST] + [bend] * nt + [WHIRL] * nt + [1])
        low = -high
        low[-1] = 0
        return low.astype(np.float32), high.astype(np.float32)
