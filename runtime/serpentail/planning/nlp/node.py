"""One node of the nonlinear program: the equations of motion at one time, in the plan's units.

Every node of every mesh evaluates the same CasADi function, from which the program is built.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import OMEGA, TAIL_V, VELOCITY

from ...model.lazy import lazy_property
from ...model.model import Model
from ...model.parameters import total_mass
from ..design import Design, refuse_unused
from .coordinates import Attitude, rotated
from .equations import Equations
from .node_calls import NodeCall, NodeDerivatives, linear_call
from .point import PathPoint, asked, at_identity, point_of
from .start import Shared, StartRows, shared_of, start_rows

if TYPE_CHECKING:
    import casadi as ca

    from ...simulation.controllers.schedules import Legs
    from ..problem import PlanningProblem

# name -> blocks of the state, which has a rate, and of the algebraic unknowns, which a node's
# equations determine
FORMULATIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "airborne": (("attitude", "tail", "tail_rate"), ("drift", "torso_rate")),
    "translation-free": (("attitude", "tail", "torso_rate", "tail_rate"), ()),
    "full": (("position", "attitude", "tail", "velocity", "torso_rate", "tail_rate"), ()),
}
# units that make unknowns of the order of 1
UNITS = {
    "position": 0.1,
    "attitude": 1.0,
    "tail": 1.0,
    "velocity": 1.0,
    "torso_rate": 10.0,
    "tail_rate": 10.0,
    "drift": 0.1,
}
UNIT_OF_BOUND = 0.05  # of a torque's bound: plans of least effort are far inside
# of a program: angular momentum (3,), position and velocity (3,) of the COM at the start, the
# softening of the objective; a node has its fraction of the duration, too
PARAMETERS = 10


@dataclass(frozen=True, eq=False)
class Variables:
    """The unknowns of a node: blocks (name, size) of states and algebraic unknowns; all units.

    The units also have those of the torques, the node's controls. common: blocks that all nodes
    share; at_start: blocks of the start that are no states; both are empty if start and parameters
    are known.
    """

    states: tuple[tuple[str, int], ...]
    algebraic: tuple[tuple[str, int], ...]
    units: dict[str, np.ndarray]
    common: tuple[tuple[str, int], ...] = ()
    at_start: tuple[tuple[str, int], ...] = ()
    design: Design = field(default_factory=Design)

    @property
    def shared(self) -> tuple[tuple[tuple[str, int], ...], ...]:
        """Blocks common to all nodes, and those of the start alone."""
        return self.common, self.at_start

    def sizes(self) -> tuple[int, int, int]:
        """Numbers of states, algebraic unknowns and controls."""
        states = sum(size for _, size in self.states)
        algebraic = sum(size for _, size in self.algebraic)
        return states, algebraic, self.units["torque"].size

    def scale(self, blocks: Iterable[tuple[str, int]]) -> np.ndarray:
        """Units of the unknowns of some blocks, in a row."""
        return np.concatenate([np.zeros(0), *(self.units[name] for name, _ in blocks)])


def variables_of(
    formulation: str, attitude: Attitude, tail: int, torque_unit: np.ndarray
) -> Variables:
    """Return a formulation's variables for 2m tail coordinates and the unit (2m,) of torques."""
    sizes = {"attitude": attitude.size, "tail": tail, "tail_rate": tail}
    states, algebraic = (
        tuple((name, sizes.get(name, 3)) for name in names) for names in FORMULATIONS[formulation]
    )
    units = {name: np.full(size, UNITS[name]) for name, size in (*states, *algebraic)}
    return Variables(states, algebraic, units | {"torque": torque_unit})


@dataclass(frozen=True, eq=False)
class Node:
    """A node's function y(zeta, p, results of calls), and the calls.

    Their inputs are linear in zeta. zeta: [duration, common unknowns, states, algebraic unknowns,
    torques] in units. p: parameters, first the angular momentum about the COM (kg m^2/s, world),
    which the airborne formulation conserves. y: duration * rates of the states, algebraic
    residuals, path constraints, duration * objective, all in units. rates, residuals: their
    numbers; paths: number of entries of each path constraint. start: rows of the program at its
    start, if that is unknown.
    """

    function: "ca.Function"
    calls: tuple[NodeCall, ...]
    rates: int
    residuals: int
    paths: tuple[int, ...]
    start: StartRows | None = None

    @lazy_property
    def derivatives(self) -> NodeDerivatives:
        """Exact derivatives, which programs on all meshes share."""
        return NodeDerivatives(self)

    @property
    def path(self) -> int:
        """Number of entries of all path constraints."""
        return sum(self.paths)

    def each_path(self, numbers: Any) -> np.ndarray:
        """Return one number for each path constraint (.., k) at all its entries (.., path)."""
        return np.repeat(np.asarray(numbers, float), self.paths, axis=-1)

    @property
    def size(self) -> int:
        """Length of y."""
        return self.rates + self.residuals + self.path + 1


def node_function(
    model: Model,
    problem: "PlanningProblem",
    attitude: Attitude,
    variables: Variables,
    equations: Equations,
) -> Node:
    """Return the function of one node; its rates are those in Eqs. 41, 42.

    The dynamics is evaluated at the identity attitude: in body axes only gravity depends on the
    attitude.
    """
    import casadi as ca

    # symbols of the unknowns, and of the results of calls
    states, algebraic, controls = variables.sizes()
    common = sum(size for _, size in variables.common)
    size = 1 + common + states + algebraic + controls
    zeta, p = ca.SX.sym("zeta", size), ca.SX.sym("p", PARAMETERS + 1)
    shared = shared_of(model, zeta, p, variables)
    point = _point(shared, zeta, p, variables, attitude, problem.legs)
    calls = _calls(shared, problem, point, zeta, equations)[: 2 if algebraic else 1]
    results = [ca.SX.sym("result", call.function.size1_out(0)) for call in calls]

    # the parts of y
    duration, rates = zeta[0], _rates(shared, point, attitude, results[0])
    state_rates = ca.vertcat(*(rates[name] for name, _ in variables.states))
    residuals = _momentum(shared, point, results[1]) if algebraic else ca.SX.zeros(0)
    constraints = [
        ca.vec(asked(f"path[{k}]", function, point))
        for k, (function, _, _) in enumerate(problem.path)
    ]
    path = ca.vertcat(ca.SX.zeros(0), *constraints)
    y = ca.vertcat(
        duration * state_rates / variables.scale(variables.states),
        residuals,
        path,
        duration * cost(problem, point, p[PARAMETERS - 1], variables.units["torque"]),
    )
    function = ca.Function("node", [zeta, p, *results], [y])
    paths = tuple(rows.size1() for rows in constraints)
    _refuse_unused(variables, function, calls)
    start = start_rows(model, problem, attitude, variables)
    return Node(function, tuple(calls), states, residuals.size1(), paths, start)


def _refuse_unused(
    variables: Variables, function: "ca.Function", calls: Iterable[NodeCall]
) -> None:
    """PlanningError if neither the dynamics nor a function of points uses a design's parameter."""
    design = variables.design
    if not design.size:
        return
    patterns = [call.function.jac_sparsity(0, call.function.n_in() - 1) for call in calls]
    own = function.jac_sparsity(0, 0)
    columns = {column for pattern in patterns for column in pattern.get_triplet()[1]}
    columns |= {column - 1 for column in own.get_triplet()[1]}
    refuse_unused(design, np.isin(np.arange(design.size), list(columns)))


def _calls(
    shared: Shared,
    problem: "PlanningProblem",
    point: PathPoint,
    zeta: "ca.SX",
    equations: Equations,
) -> list[NodeCall]:
    """Forward dynamics with the tail's damping, and H v of the motion relative to the COM.

    H v is inverse dynamics at rest with v_dot = v, gravity's H (g z, 0) taken off.
    """
    import casadi as ca

    more = (*equations.parameters, *shared.design)
    q = at_identity(point)
    v = ca.vertcat(ca.DM.zeros(3), point.torso_rate, point.tail_rate)
    applied = point.torque - problem.damping * point.tail_rate
    calls = [linear_call(equations.forward, zeta, [q, v, applied, *more])]
    if hasattr(point, "drift"):
        drift = point.drift - shared.body.gravity()
        motion = ca.vertcat(drift, point.torso_rate, point.tail_rate)
        rest = ca.DM.zeros(shared.body.model.nv)
        calls.append(linear_call(equations.inverse, zeta, [q, rest, motion, *more]))
    return calls


def _point(
    shared: Shared,
    zeta: "ca.SX",
    p: "ca.SX",
    variables: Variables,
    attitude: Attitude,
    legs: "Legs | None" = None,
) -> PathPoint:
    """Return the blocks of a node in SI units, which objectives and path constraints see."""
    blocks: dict[str, Any] = {"duration": zeta[0], "time": p[PARAMETERS] * zeta[0]}
    start = 1 + sum(size for _, size in variables.common)
    controls = ("torque", variables.units["torque"].size)
    for name, size in (*variables.states, *variables.algebraic, controls):
        blocks[name] = variables.units[name] * zeta[start : start + size]
        start += size
    blocks["quaternion"] = attitude.quaternion(blocks["attitude"])
    return point_of(shared.body, blocks, shared.com, legs)


def _rates(shared: Shared, point: PathPoint, attitude: Attitude, v_dot: "ca.SX") -> dict[str, Any]:
    """Return the rates of state blocks; p_ddot = R (p_ddot(identity) + g z) - g z."""
    gravity = shared.body.gravity()
    return {
        "position": getattr(point, "velocity", None),
        "attitude": attitude.rate(point.attitude, point.torso_rate),
        "tail": point.tail_rate,
        "velocity": rotated(point.quaternion, v_dot[VELOCITY] + gravity) - gravity,
        "torso_rate": v_dot[OMEGA],
        "tail_rate": v_dot[TAIL_V],
    }


def _momentum(shared: Shared, point: PathPoint, momentum: "ca.SX") -> "ca.SX":
    """Return H v of the motion relative to the COM less (0, R^T h), in units.

    It is zero if omega carries h. If the linear momentum is zero, the angular momentum about B is
    that about the COM.
    """
    import casadi as ca

    parameters = shared.body.model.parameters
    mass = total_mass(parameters)
    inertia = float(np.mean(parameters["torso_inertia"]))
    angular = momentum[OMEGA] - rotated(point.quaternion, shared.momentum, -1)
    return ca.vertcat(
        momentum[VELOCITY] / (mass * UNITS["drift"]), angular / (inertia * UNITS["torso_rate"])
    )


def cost(
    problem: "PlanningProblem", point: PathPoint, softening: "ca.SX", torque_unit: np.ndarray
) -> "ca.SX":
    """Return the objective's integrand (Eq. 40; CasADi), in units of the torques.

    softening: of "energy", W, below which |power| is rounded off; of "time", which is in the
    program's objective itself, s that a second with all torques at their bounds adds.
    """
    import casadi as ca

    unit, rates = torque_unit.mean(), problem.smoothing**2 * ca.sumsqr(point.tail_rate)
    effort = (ca.sumsqr(point.torque) + rates) / unit**2
    if callable(problem.objective):
        return asked("objective", problem.objective, point, single=True)
    if problem.objective == "energy":
        power = point.torque * point.tail_rate
        return ca.sum1(ca.sqrt(power**2 + softening**2) - softening) / (unit * 10)
    if problem.objective == "time":
        return softening * UNIT_OF_BOUND**2 / len(torque_unit) * effort
    return effort
