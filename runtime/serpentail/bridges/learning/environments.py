"""Gymnasium environments, a single one and many at once."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ...basics.checks import refusal
from ...basics.errors import SimulationError
from .tasks import DRAWS
from .worlds import Worlds

MOST_SEED = 2**63 - 1


class Environment(gymnasium.Env):
    """One episode at a time; see ``serpentail.environment``."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  as Gymnasium has it

    def __init__(self, worlds: Worlds):
        self.worlds = worlds
        self.observation_space, self.action_space = spaces_of(worlds)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; without a seed, its start continues the random sequence."""
        _refuse_options(options)
        super().reset(seed=seed)
        self.worlds.restart(np.zeros(1, int), self.np_random.random((1, DRAWS)))
        return self.worlds.observations()[0], {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Apply an action (2m,) for the time that an action is held."""
        rewards, terminated, truncated = self.worlds.act(np.asarray(action)[None])
        ends = bool(terminated[0]), bool(truncated[0])
        return self.worlds.observations()[0], float(rewards[0]), *ends, {}


class Environments(VectorEnv):
    """Many episodes at once; one that has ended begins anew at the next step, without its action.

    Environment i draws its starts as ``Environment`` does with the seed ``seed + i``.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  as Gymnasium has it
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(self, worlds: Worlds, count: int):
        self.worlds, self.num_envs = worlds, count
        self.single_observation_space, self.single_action_space = spaces_of(worlds)
        self.observation_space = batch_space(self.single_observation_space, count)
        self.action_space = batch_space(self.single_action_space, count)
        self.generators: list[np.random.Generator] = []
        self.over = np.zeros(count, bool)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin all episodes: number i with ``seed + i``, or with its own of a list of seeds."""
        _refuse_options(options)
        seeds = self._seeds(seed)
        if seeds is not None or not self.generators:
            each = seeds or [None] * self.num_envs
            self.generators = [np.random.default_rng(seed) for seed in each]
        self._restart(np.arange(self.num_envs))
        return self.worlds.observations(), {}

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Apply actions (count, 2m) for the time that an action is held."""
        if not self.generators:
            raise SimulationError("step: no episode has begun: call reset() first")
        rewards, terminated, truncated = self.worlds.act(actions)
        begun = self.over.nonzero()[0]
        if len(begun):
            self._restart(begun)
            for array in (rewards, terminated, truncated):
                array[begun] = 0
        self.over = terminated | truncated
        return self.worlds.observations(), rewards, terminated, truncated, {}

    def _restart(self, which: np.ndarray) -> None:
        """Begin new episodes, each from its own generator."""
        draws = np.array([self.generators[k].random(DRAWS) for k in which.tolist()])
        self.worlds.restart(which, draws)
        self.over[which] = False

    def _seeds(self, seed: int | list[int | None] | None) -> list[int | None] | None:
        """Return a seed for each; None if none was given."""
        if seed is None:
            return None
        if isinstance(seed, int | np.integer) and 0 <= seed <= MOST_SEED:
            return [int(seed) + k for k in range(self.num_envs)]
        if isinstance(seed, list) and len(seed) == self.num_envs:
            return seed
        needs = f"a whole number from 0, or a list of {self.num_envs}"
        raise refusal("seed", seed, needs, SimulationError)


def spaces_of(worlds: Worlds) -> tuple[spaces.Box, spaces.Box]:
    """Return the spaces of one observation and of one action."""
    nt = worlds.model.layout.nt
    return (
        spaces.Box(worlds.low, worlds.high, dtype=np.float32),
        spaces.Box(-1.0, 1.0, (nt,), np.float32),
    )


def _refuse_options(options: dict[str, Any] | None) -> None:
    """SimulationError if a reset is given options; it has none."""
    if options:
        raise refusal("options", options, "none: pass settings to st.environment", SimulationError)
