"""What drives a plan: torques of motors, or tensions of tendons; passive coordinates have none."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..basics.errors import PlanningError
from ..model.model import Model
from ..optimal.terms import Terms, terms_of
from .design import Design
from .program.body import BodyFunctions
from .program.cache import memoised
from .program.coordinates import IDENTITY_POSE

if TYPE_CHECKING:
    import casadi as ca

TENSION = "tension"
SLACKEST = 0.02  # of its limit, in a guess: from tensions near 0 solvers take many iterations
Blocks = Mapping[str, np.ndarray]


def input_of(model: Model) -> tuple[str, int]:
    """Return name and size of what drives the tail in plans of a model."""
    count = len(model.layout.tendons)
    return (TENSION, count) if count else ("torque", sum(model.layout.driven))


def is_direct(model: Model) -> bool:
    """Tell if what drives a model is a torque of each coordinate."""
    return input_of(model) == ("torque", model.layout.nt)


def of_motors(model: Model, values: np.ndarray) -> np.ndarray:
    """Return those of values (..., nt) that belong to coordinates with motors."""
    return values[..., np.array(model.layout.driven)]


def of_coordinates(model: Model, torques: np.ndarray) -> np.ndarray:
    """Return torques (..., motors) of all coordinates (..., nt): 0 of passive ones."""
    found = np.zeros((*torques.shape[:-1], model.layout.nt))
    found[..., np.array(model.layout.driven)] = torques
    return found


def torques_of(model: Model | None, blocks: Blocks) -> np.ndarray:
    """Return the torques (K, 2m), N m, of blocks (K, ..) of a plan."""
    if TENSION not in blocks:
        return blocks["torque"]
    if model is None:
        raise PlanningError("torque: a plan of tendons from a pickle has no model: use tension")
    return model.tendon_torques(_upright(blocks["tail"]), blocks[TENSION])


def tensions_near(model: Model, tail: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return tensions (K, tendons), N, well above 0, for torques (K, 2m) that they can give
    at tail coordinates (K, 2m); other torques are missed.
    """
    B = model.tendon_lengths(_upright(tail))[1]
    least = SLACKEST * np.atleast_1d(model.parameters["tendon_limits"])
    return np.maximum(-np.einsum("kij,ki->kj", np.linalg.pinv(B), torque), least)


def _upright(tail: np.ndarray) -> np.ndarray:
    """Return q (K, nq) of tails (K, 2m) on a torso at the origin."""
    return np.column_stack([np.tile(IDENTITY_POSE, (len(tail), 1)), tail])


def torque_expression(body: BodyFunctions, tail: "ca.SX", tension: "ca.SX") -> "ca.SX":
    """Return the torques (2m,) of tensions, or of motors (CasADi)."""
    import casadi as ca

    if not body.model.layout.tendons:
        return ca.DM(of_coordinates(body.model, np.eye(tension.numel()))).T @ tension
    return body.call("tendon_torques", ca.vertcat(ca.DM(IDENTITY_POSE), tail), tension)


def drive_terms(model: Model, states: int) -> Terms:
    """Return (x, torques) as terms of a node's states x and tensions, or torques of motors."""

    def made() -> Terms:
        import casadi as ca

        body, tail = BodyFunctions(model, Design(), None), slice(4, 4 + model.layout.nt)
        x, tension = ca.SX.sym("x", states), ca.SX.sym(*input_of(model))
        torque = torque_expression(body, x[tail], tension)
        return terms_of(ca.vertcat(x, tension), ca.SX(0, 1), ca.vertcat(x, torque))

    return memoised(("drive", model), made)


def refuse_tendons(model: Model, what: str) -> None:
    """PlanningError if tendons pull the tail of a model."""
    if model.layout.tendons:
        raise PlanningError(f"{what}: tendons pull the tail: this needs a model without them")
