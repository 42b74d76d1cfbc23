"""``environment`` and ``environments``: check what they are given, and make Gymnasium's objects."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import one_of, shown, whole_number
from ..errors import ModelError, SimulationError
from ..extras import needed
from ..model.model import Model
from .tasks import TASKS
from .worlds import Worlds

if TYPE_CHECKING:
    from .environments import Environment, Environments

MOST = 10_000_000  # environments: more are a slip


def environment(model: Model, task: str, **settings: Any) -> "Environment":
    """Return a ``gymnasium.Env`` in which torques of the tail right a body.

    task: "righting", from any tilt in the air; "landing", the same and onto the feet; or
    "self_recovery", from the back.
    settings: torque (N m), the largest; step (s) of the integrator, substeps: how many an action
    holds; duration (s) of an episode; angle (rad) of a joint or bend, beyond which it ends; tilt
    (rad), spin (rad/s), height (m) of the start, drawn up to there.
    Actions (2m,) are parts of the largest torque.  Seen is what ``worlds.Worlds`` says.
    Raises ExtraMissing without the extra "gym", ModelError where the model's contacts are not the
    task's or it was generated without rollout (implicit on the ground), SimulationError (settings).
    """
    worlds = _worlds(model, task, 1, settings)
    from .environments import Environment

    return Environment(worlds)


def environments(model: Model, task: str, count: int, **settings: Any) -> "Environments":
    """Return a ``gymnasium.vector.VectorEnv`` of so many, stepped at once by ``model.step``.

    task and settings are those of ``environment``.  One whose episode has ended begins anew at the
    next step (autoreset mode NEXT_STEP).  Errors are those of ``environment``.
    """
    count = whole_number("count", count, SimulationError, least=1, most=MOST)
    worlds = _worlds(model, task, count, settings)
    from .environments import Environments

    return Environments(worlds, count)


def _worlds(model: Model, task: str, count: int, settings: dict[str, Any]) -> Worlds:
    """Return episodes of a task, all that is given checked."""
    needed("gymnasium", "gym")
    if not isinstance(model, Model):
        raise ModelError(f"model: value {shown(model)}: needs a model, as st.load returns it")
    chosen = TASKS[one_of("task", task, list(TASKS), SimulationError)]
    model.refuse_fixed(chosen.name)
    checked = chosen.checked(model, settings)
    worlds = Worlds(model, chosen, count, checked)
    worlds.act(np.zeros((count, model.layout.nt)))  # compiles, or tells what the scene left out
    return worlds
