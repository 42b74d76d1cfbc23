"""``PathPoint``: a node, as objectives and path constraints receive it."""

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import OMEGA, VELOCITY

from ...basics.checks import did_you_mean, needed
from ...basics.errors import PlanningError
from ...model.model import Model
from ..air import in_air
from .body import BodyFunctions
from .coordinates import COM_ENTRIES, IDENTITY_POSE, rotated

if TYPE_CHECKING:
    import casadi as ca

    from ...simulation.controllers.schedules import Legs


class PathPoint(SimpleNamespace):
    """CasADi blocks of a node by name, in SI units.

    They are attitude and quaternion (4,), which are the same, torso_rate (3,), tail, tail_rate and
    torque (2m,), time and duration (s), and parameters (numbers by name).

    Further blocks are made when they are used, in world axes (m): center_of_mass (3,); position
    (3,) of B and its height; tail_points (K, 3) of all chains, and the tip (3,) of the tail; with
    contacts, contact_points (K, 3), which need the plan's legs if the model has feet, and
    body_points (K, 3), those without feet.
    """

    def __getattr__(self, name: str) -> Any:
        makers = vars(self).get("makers", {})
        if name in makers:
            setattr(self, name, makers[name](self))
            return getattr(self, name)
        has = sorted((vars(self).keys() | makers.keys()) - {"makers"})
        remedy = did_you_mean(name, has) or "choose one of these"
        raise AttributeError(
            f"a point has no {name!r}, it has {', '.join(has)}; {remedy}", name=name, obj=self
        )


def asked(
    field: str, function: Callable[[Any], Any], point: PathPoint, single: bool = False
) -> "ca.SX":
    """Return the result of a user's function of a point, a matrix.

    single: it has to be one number. PlanningError if the function uses a block that the point
    lacks, or its result is something else.
    """
    import casadi as ca

    try:
        value = function(point)
    except AttributeError as error:
        if error.obj is not point:
            raise
        raise PlanningError(f"{field}: {error}") from error
    try:
        found = ca.SX(value)
    except (NotImplementedError, RuntimeError):
        needs = "a result of numbers or of CasADi expressions of the point"
        raise PlanningError(needed(field, value, needs)) from None
    if _has_nan(found):
        raise PlanningError(
            f"{field}: a part of the result is nan, as float(...) of a block is: use operations of "
            "CasADi on the point's blocks"
        )
    if single and found.shape != (1, 1):
        raise PlanningError(
            f"{field}: a result of shape {found.shape}: needs one number, such as "
            "casadi.sumsqr(point.torque)"
        )
    return found


def _has_nan(expression: "ca.SX") -> bool:
    """Tell if a constant of an expression is no number."""
    import casadi as ca

    tape = ca.Function("tape", [ca.vertcat(*ca.symvar(expression))], [expression])
    constants = (k for k in range(tape.n_instructions()) if tape.instruction_id(k) == ca.OP_CONST)
    return any(np.isnan(tape.instruction_constant(k)) for k in constants)


def point_of(
    body: BodyFunctions, blocks: dict[str, Any], start: "ca.SX", legs: "Legs | None" = None
) -> PathPoint:
    """Return the point of a node's blocks; start (6,): position and velocity of the COM then."""
    import casadi as ca

    model = body.model

    def center_of_mass(point: PathPoint) -> "ca.SX":
        t = point.time
        return start[:3] + start[3:] * t - body.gravity() * t**2 / 2

    def position(point: PathPoint) -> "ca.SX":
        return point.center_of_mass - rotated(
            point.quaternion, center_of_mass_offset(body, point.tail)
        )

    def tail_points(point: PathPoint) -> "ca.SX":
        own = point.tail_from_torso
        rows = [point.position + rotated(point.quaternion, own[k, :].T) for k in range(own.size1())]
        return ca.horzcat(*rows).T

    def contact_points(point: PathPoint) -> "ca.SX":
        if "feet" in model.contacts and legs is None:
            raise PlanningError(
                "contact_points: give the plan `legs`, such as st.Legs.fixed(gamma, delta)"
            )
        still = () if legs is None else (np.append(legs.curve.at(0.0)[0], np.zeros(4)),)
        return _touching(body, point, still)

    def body_points(point: PathPoint) -> "ca.SX":
        return _touching(body, point, any_legs(model))[model.contacts.get("feet", 0) :, :]

    makers: dict[str, Callable[[PathPoint], Any]]
    makers = {
        "drift": lambda point: drift_of(body, vars(point)),
        "tail_from_torso": lambda point: body.call("tail_points", at_identity(point)),
    }
    if in_air(model):  # where the animal is depends on all the air before
        return PathPoint(makers=makers, parameters=dict(body.parameters), **blocks)
    makers |= {
        "center_of_mass": center_of_mass,
        "position": position,
        "height": lambda point: point.position[2],
    }
    if "tail_points" in model.generated:
        tip = model.layout.chains[0].points.stop - 1
        makers |= {"tail_points": tail_points, "tip": lambda point: point.tail_points[tip, :].T}
    if model.contacts:
        makers |= {"contact_points": contact_points, "body_points": body_points}
    return PathPoint(makers=makers, parameters=dict(body.parameters), **blocks)


def any_legs(model: Model) -> tuple[np.ndarray, ...]:
    """Return angles and rates of the legs for calls whose feet do not matter."""
    return (np.zeros(8),) if "feet" in model.contacts else ()


def body_heights(point: PathPoint) -> "ca.SX":
    """Heights (K,) of the points of tail and torso that may touch the ground."""
    return point.body_points[:, 2]


def at_identity(point: PathPoint) -> "ca.SX":
    """q of the tail on a torso at the origin that is not rotated."""
    import casadi as ca

    return ca.vertcat(ca.DM(IDENTITY_POSE), point.tail)


def _touching(body: BodyFunctions, point: PathPoint, legs: tuple[np.ndarray, ...]) -> "ca.SX":
    """Points (K, 3) that may touch the ground, world."""
    import casadi as ca

    unit = point.quaternion / ca.norm_2(point.quaternion)
    q = ca.vertcat(point.position, unit, point.tail)
    return body.call("contact_points", q, np.zeros(body.model.nv), *legs)[0]


def center_of_mass_offset(body: BodyFunctions, tail: "ca.SX") -> "ca.SX":
    """Return the COM from B (3,), body axes."""
    import casadi as ca

    H = body.call("mass_matrix", ca.vertcat(ca.DM(IDENTITY_POSE), tail))
    return ca.vertcat(*(H[i, j] for i, j in COM_ENTRIES)) / H[0, 0]


def drift_of(body: BodyFunctions, blocks: Mapping[str, Any]) -> "ca.SX":
    """Return the velocity (3,) of B relative to the COM, body axes: no linear momentum."""
    import casadi as ca

    H = body.call("mass_matrix", ca.vertcat(ca.DM(IDENTITY_POSE), blocks["tail"]))
    rates = ca.vertcat(blocks["torso_rate"], blocks["tail_rate"])
    return -ca.mtimes(H[VELOCITY, OMEGA.start :], rates) / H[0, 0]
