"""``environment`` and ``environments``: check their arguments and make Gymnasium environments."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.checks import one_of, whole_number
from ...basics.errors import ModelError, SimulationError
from ...basics.extras import needed
from ...model.chains import refuse_given
from ...model.checked import checked_model
from ...model.model import Model
from .tasks import TASKS
from .worlds import Worlds

if TYPE_CHECKING:
    from .environments import Environment, Environments

MOST = 10_000_000  # environments: more are a slip


def environment(model: Model, task: str, **settings: Any) -> "Environment":
    """Make a ``gymnasium.Env`` in which torques of the tail right a body.

    Parameters
    ----------
    model : Model
        The model; its contacts must be those of the task.
    task : {"righting", "landing", "self_recovery"}
        "righting": in the air, from any tilt; "landing": the same, and onto the feet;
        "self_recovery": on the ground, from the back.
    torque : float or str, default 0.02
        Largest torque (N m); an action of 1 asks for it. This and the settings below with a unit
        may be texts, such as "20 mN m" or "90 deg".
    step : float
        Step of the integrator (s). Default: 1e-3 in flight, 2e-4 with contacts.
    substeps : int
        Steps during which an action is held, at most 1000. Default: 5 in flight, 25 with
        contacts.
    duration : float
        Duration of an episode (s). Default: 0.5, 0.8 and 1.5 for the three tasks.
    angle : float
        Tail coordinate (rad) beyond which an episode ends. Default: pi divided by the largest
        number of joints of a segment.
    tilt : float
        Largest tilt at the start (rad). Default: pi/2, pi/3 and 0.3.
    spin : float, default 0
        Largest angular velocity at the start (rad/s), of the tasks in the air.
    height : float
        Height of B at the start (m), of the tasks in the air. Default: 0.3 and 0.4.
    start : State, optional
        State in which every episode begins, in place of drawn ones.

    Returns
    -------
    gymnasium.Env
        The environment.

    Raises
    ------
    ExtraMissing
        Gymnasium is not installed; it comes with the extra "gym".
    ModelError
        The model's contacts are not those of the task, or the scene left out "rollout" or, with
        contacts, "implicit".
    SimulationError
        The task or a setting is wrong.

    Notes
    -----
    An action (2m,) is in parts of the largest torque, from -1 to 1. An observation (9 + 4m,) has,
    in SI: the world's z axis in body axes (3), omega (3), height and its rate, the tail
    coordinates (2m), their rates (2m), and the part of the duration that is left.

    Examples
    --------
    >>> env = st.environment(model, "righting", tilt=1.0)  # doctest: +SKIP
    >>> observation, info = env.reset(seed=0)  # doctest: +SKIP
    """
    worlds = _worlds(model, task, 1, settings)
    from .environments import Environment

    return Environment(worlds)


def environments(model: Model, task: str, count: int, **settings: Any) -> "Environments":
    """Make a ``gymnasium.vector.VectorEnv`` of many environments that are stepped at once.

    An environment whose episode has ended begins a new one at the next step (autoreset mode
    NEXT_STEP).

    Parameters
    ----------
    model : Model
        As of ``environment``.
    task : str
        As of ``environment``.
    count : int
        Number of environments.
    **settings
        Settings of ``environment``.

    Returns
    -------
    gymnasium.vector.VectorEnv
        The environments.

    Raises
    ------
    ExtraMissing, ModelError, SimulationError
        As of ``environment``.
    """
    count = whole_number("count", count, SimulationError, least=1, most=MOST)
    worlds = _worlds(model, task, count, settings)
    from .environments import Environments

    return Environments(worlds, count)


def _worlds(model: Model, task: str, count: int, settings: dict[str, Any]) -> Worlds:
    """Return the episodes of a task, once all arguments are checked."""
    needed("gymnasium", "gym")
    checked_model(model, ModelError)
    chosen = TASKS[one_of("task", task, list(TASKS), SimulationError)]
    model.refuse_fixed(chosen.name)
    refuse_given(model, chosen.name)
    checked = chosen.checked(model, settings)
    worlds = Worlds(model, chosen, count, checked)
    worlds.act(
        np.zeros((count, model.layout.nt))
    )  # compiles, or raises the error about a missing function
    return worlds
