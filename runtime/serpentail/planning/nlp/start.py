"""A start that is not known before: what it has in common with all nodes, and what it has to obey.

The angular momentum and the flight of the COM follow from the start and from the parameters. If
these are unknowns, so are the conserved quantities, which all nodes use; rows of the program tie
them to the start.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import OMEGA, VELOCITY

from ...model.lazy import lazy_property
from ...model.model import Model
from .body import BodyFunctions
from .coordinates import COM_ENTRIES, IDENTITY_POSE, Attitude, rotated
from .point import asked, point_of

if TYPE_CHECKING:
    import casadi as ca

    from ..problem import PlanningProblem
    from .node import Variables

# angular momentum about the COM, position and velocity of the COM at the start, world
CONSERVED = (("momentum", 3), ("com", 3), ("com_velocity", 3))
AT_START = ("position", "velocity", "torso_rate")  # where they are no states


def with_start(variables: "Variables", model: Model, problem: "PlanningProblem") -> "Variables":
    """Return the variables with those that a design or a free start adds."""
    if not problem.is_free:
        return variables
    design, states = problem.design, dict(variables.states)
    conserved = () if "position" in states else CONSERVED
    inertia = float(np.mean(model.parameters["torso_inertia"]))
    units = {
        "design": design.units,
        "momentum": np.full(3, inertia * 10.0),
        "com": np.full(3, 0.1),
        "position": np.full(3, 0.1),
        "com_velocity": np.ones(3),
        "velocity": np.ones(3),
        "torso_rate": np.full(3, 10.0),
    }
    return replace(
        variables,
        common=((("design", design.size),) if design.size else ()) + conserved,
        at_start=tuple((name, 3) for name in AT_START if name not in states),
        units=units | variables.units,
        design=design,
    )


@dataclass(frozen=True, eq=False)
class Shared:
    """What all nodes share: the body, the angular momentum about the COM (3,), and position and
    velocity (6,) of the COM at the start, SI. design: its numbers, if there are any.
    """

    body: BodyFunctions
    momentum: "ca.SX"
    com: "ca.SX"
    design: "tuple[ca.SX, ...]"


def shared_of(model: Model, zeta: "ca.SX", p: "ca.SX", variables: "Variables") -> Shared:
    """Return what all nodes share; unknown parts are in zeta, known ones in p."""
    import casadi as ca

    found: dict[str, Any] = {"momentum": p[:3], "com": p[3:6], "com_velocity": p[6:9]}
    start = 1
    for name, size in variables.common:
        found[name] = variables.units[name] * zeta[start : start + size]
        start += size
    design = (found["design"],) if "design" in found else ()
    body = BodyFunctions(model, variables.design, found.get("design"))
    return Shared(body, found["momentum"], ca.vertcat(found["com"], found["com_velocity"]), design)


@dataclass(frozen=True, eq=False)
class StartRows:
    """Rows of the program at its start, a function of its first unknowns x (n,), in units.

    x: duration, common unknowns, those of the start alone, states of the start. rows: what is zero,
    then path constraints that do not depend on torques. conserved: the quantities of CONSERVED that
    x gives. paths: numbers of these constraints, one for each row.
    """

    function: "ca.Function"
    conserved: "ca.Function"
    zeros: int
    paths: np.ndarray

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.zeros + len(self.paths)

    @property
    def unknowns(self) -> np.ndarray:
        """Places (n,) of x in w."""
        return np.arange(self.function.size1_in(0))

    @lazy_property
    def jacobian(self) -> "ca.Function":
        """Derivatives (rows, n)."""
        import casadi as ca

        x = self.function.sx_in(0)
        return ca.Function("jacobian", [x], [ca.jacobian(self.function(x), x)])

    @lazy_property
    def hessian(self) -> "ca.Function":
        """The Hessian of mu^T rows."""
        import casadi as ca

        x, mu = self.function.sx_in(0), ca.SX.sym("mu", self.rows)
        return ca.Function("hessian", [x, mu], [ca.hessian(ca.dot(mu, self.function(x)), x)[0]])


def start_rows(
    model: Model, problem: "PlanningProblem", attitude: Attitude, variables: "Variables"
) -> StartRows | None:
    """Return the rows at the start; None if the start and all parameters are known."""
    import casadi as ca

    if not problem.is_free:
        return None
    parts = (*variables.common, *variables.at_start, *variables.states)
    x, first = ca.SX.sym("x", 1 + sum(size for _, size in parts)), 1
    blocks: dict[str, Any] = {}
    for name, size in parts:
        blocks[name] = variables.units[name] * x[first : first + size]
        first += size
    body = BodyFunctions(model, variables.design, blocks.pop("design", None))
    blocks["quaternion"] = attitude.quaternion(blocks["attitude"])
    momentum, com, com_velocity = conserved_of(body, blocks)

    # what is conserved is what the start has
    names = [name for name, _ in CONSERVED if name in blocks]
    units = np.concatenate([np.zeros(0), *(variables.units[name] for name in names)])
    found = ca.vertcat(momentum, com, com_velocity)[: len(units)] / units
    residuals = ca.vertcat(ca.SX.zeros(0), *(blocks.pop(name) for name in names)) / units - found

    # path constraints, for rules whose first node is later
    torque = ca.SX.sym("torque", variables.units["torque"].size)
    blocks |= {"torque": torque, "duration": x[0], "time": ca.SX(0)}
    blocks["drift"] = rotated(blocks["quaternion"], blocks["velocity"] - com_velocity, -1)
    point = point_of(body, blocks, ca.vertcat(com, com_velocity), problem.legs)
    rows, paths = [residuals], np.zeros(0, int)
    for k, (function, _, _) in enumerate(problem.path):
        values = ca.vec(asked(f"path[{k}]", function, point))
        if not ca.depends_on(values, torque):
            rows.append(values)
            paths = np.append(paths, np.full(values.numel(), k))
    return StartRows(
        ca.Function("start", [x], [ca.vertcat(*rows)]),
        ca.Function("conserved", [x], [found]),
        residuals.numel(),
        paths,
    )


def conserved_of(body: BodyFunctions, blocks: dict[str, Any]) -> "tuple[ca.SX, ca.SX, ca.SX]":
    """Return the quantities of CONSERVED, from H v in body axes."""
    import casadi as ca

    quaternion = blocks["quaternion"]
    H = body.call("mass_matrix", ca.vertcat(ca.DM(IDENTITY_POSE), blocks["tail"]))
    own = rotated(quaternion, blocks["velocity"], -1)
    P = ca.mtimes(H, ca.vertcat(own, blocks["torso_rate"], blocks["tail_rate"]))
    offset = ca.vertcat(*(H[i, j] for i, j in COM_ENTRIES)) / H[0, 0]  # the COM from B
    angular = P[OMEGA] - ca.cross(offset, P[VELOCITY])
    return (
        rotated(quaternion, angular),
        blocks["position"] + rotated(quaternion, offset),
        rotated(quaternion, P[VELOCITY]) / H[0, 0],
    )
