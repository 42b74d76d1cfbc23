"""Nodes of a plan: airborne rates, path constraints and cost, in C or as expressions of CasADi."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import OMEGA, TAIL_V, VELOCITY

from ...basics.attitude import quaternion_rate
from ...model.model import Model
from ...optimal.problem import OcpNode
from ...optimal.terms import Terms, terms_of
from ..air import DRIFT, in_air
from ..problem import PlanningProblem
from ..tendons import drive_terms, is_direct, torque_expression
from .body import BodyFunctions
from .coordinates import IDENTITY_POSE, rotated
from .point import PathPoint, point_of
from .variables import CONSERVED, Blocks, PlanVariables

if TYPE_CHECKING:
    import casadi as ca

FUNCTIONS = {  # of a model, by the names of Node in optimal/native/node.h
    "rates": "airborne_rates",
    "slopes": "airborne_rates_derivatives",
    "curvature": "airborne_rates_hessian",
}


def is_compiled(model: Model, problem: PlanningProblem) -> bool:
    """Tell if a plan's dynamics is the model's C: not with free parameters or a free start."""
    fit = model.manifest["real"] == "double" and model.library is not None
    return fit and not problem.is_free and model.has(*FUNCTIONS.values())


@dataclass(frozen=True, eq=False)
class NodeSymbols:
    """Symbols (SX) of what terms depend on: e and given numbers; blocks: their parts in SI."""

    e: "ca.SX"
    given: "ca.SX"
    blocks: dict[str, Any]
    body: BodyFunctions

    def point(self, problem: PlanningProblem) -> PathPoint:
        """Return the point that objectives and path constraints see."""
        import casadi as ca

        own = ("design", "momentum", "com", "com_velocity", "softening", "numbers", "torque_rate")
        start = ca.vertcat(self.blocks["com"], self.blocks["com_velocity"])
        hidden = {*own, *dict(DRIFT)}
        seen = {name: part for name, part in self.blocks.items() if name not in hidden}
        return point_of(self.body, seen, start, problem.legs)


def symbols_of(
    model: Model, variables: PlanVariables, compiled: bool, extra: Blocks = ()
) -> NodeSymbols:
    """Return the symbols of a node; without ``compiled``, omega follows from the momentum.

    extra: numbers that terms are given beside those that are conserved.
    """
    import casadi as ca

    turn: Blocks = (("torso_rate", 3),) if compiled else ()
    parts: Blocks = (*variables.states, *turn, *variables.controls, *variables.constants)
    blocks = {name: ca.SX.sym(name, size) for name, size in parts}
    e, fraction = ca.vertcat(*blocks.values()), ca.SX.sym("fraction")
    numbers = {name: ca.SX.sym(name, size) for name, size in (*extra, *CONSERVED)}
    blocks = numbers | blocks  # what is conserved may be a constant of the program
    body = BodyFunctions(model, variables.design, blocks.get("design"))
    blocks |= {"quaternion": blocks["attitude"], "time": fraction * blocks["duration"]}
    if not is_direct(model):
        own = blocks[variables.input]
        blocks["torque"] = torque_expression(body, blocks["tail"], own)
    if not compiled:
        blocks["torso_rate"] = carried_turn(body, blocks)
    return NodeSymbols(e, ca.vertcat(fraction, *numbers.values()), blocks, body)


def carried_turn(body: BodyFunctions, blocks: dict[str, Any]) -> "ca.SX":
    """Return omega (3,), body axes, that carries the angular momentum about the COM with the tail.

    H_bb (d, omega) + H_bt q_t_dot = (0, R^T h), d being the velocity of B relative to the COM.
    """
    import casadi as ca

    H = body.call("mass_matrix", ca.vertcat(ca.DM(IDENTITY_POSE), blocks["tail"]))
    ww, wt, vw, vt = (
        H[rows, columns]
        for rows, columns in (
            (OMEGA, OMEGA),
            (OMEGA, TAIL_V),
            (VELOCITY, OMEGA),
            (VELOCITY, TAIL_V),
        )
    )
    inertia = ww - ca.mtimes(vw.T, vw) / H[0, 0]
    coupling = wt - ca.mtimes(vw.T, vt) / H[0, 0]
    own = rotated(blocks["attitude"], blocks["momentum"], -1)
    return ca.mtimes(ca.inv(inertia), own - ca.mtimes(coupling, blocks["tail_rate"]))


def rates_of(symbols: NodeSymbols, problem: PlanningProblem, variables: PlanVariables) -> "ca.SX":
    """Return the rates of the states (Eqs. 41, 42) where the dynamics is not compiled.

    It is evaluated at the identity attitude: in body axes only gravity depends on the attitude.
    """
    import casadi as ca

    blocks = symbols.blocks
    q = ca.vertcat(ca.DM(IDENTITY_POSE), blocks["tail"])
    v = ca.vertcat(ca.DM.zeros(3), blocks["torso_rate"], blocks["tail_rate"])
    applied = blocks["torque"] - problem.damping * blocks["tail_rate"]
    v_dot = symbols.body.call("forward_dynamics", q, v, applied)
    c, omega = blocks["attitude"], blocks["torso_rate"]
    turning = quaternion_rate([c[k] for k in range(4)], [omega[k] for k in range(3)])
    rates = [ca.vertcat(*turning), blocks["tail_rate"], v_dot[TAIL_V]]
    return ca.vertcat(*rates, *([blocks["torque_rate"]] if variables.torque_is_state else []))


@dataclass(frozen=True, eq=False)
class NodeTerms:
    """Terms of a node, entries of each part of its rows, and whether they use omega."""

    terms: Terms
    entries: tuple[int, ...]
    uses_turn: bool

    @property
    def rows(self) -> int:
        """Number of rows."""
        return sum(self.entries)


def terms_with(
    symbols: NodeSymbols, parts: "list[ca.SX]", rates: "ca.SX", cost: "ca.SX"
) -> NodeTerms:
    """Return terms: rates (n,), rows in parts, and cost, in SI."""
    import casadi as ca

    values = ca.vertcat(rates, *parts, cost)
    turn = symbols.blocks["torso_rate"]
    uses = bool(turn.is_valid_input() and ca.depends_on(values, turn))
    entries = tuple(part.numel() for part in parts)
    return NodeTerms(terms_of(symbols.e, symbols.given, values), entries, uses)


def no_rates(variables: PlanVariables, compiled: bool) -> "ca.SX":
    """Return the rates that terms give of a node whose rates do not matter."""
    import casadi as ca

    return ca.SX.zeros(0 if compiled else variables.size(variables.states))


@dataclass(frozen=True, eq=False)
class FlightDynamics:
    """What all nodes of a plan share; conserved (9,): numbers of CONSERVED of the given start."""

    model: Model
    problem: PlanningProblem
    variables: PlanVariables
    conserved: np.ndarray
    compiled: bool

    def symbols(self, extra: Blocks = ()) -> NodeSymbols:
        """Return the symbols of a node."""
        return symbols_of(self.model, self.variables, self.compiled, extra)

    def node(self, made: NodeTerms, row_units: np.ndarray, extra: np.ndarray) -> OcpNode:
        """Return a node with terms, their rows' units, and further numbers that they are given."""
        model, variables = self.model, self.variables
        airborne: dict[str, Any] = {}
        arrays: dict[str, np.ndarray] = {}
        if self.compiled:
            for name, function in FUNCTIONS.items():
                airborne[name] = getattr(model.library, f"{model.name}_{function}")
            airborne |= {
                "tail": model.layout.nt,
                "drift": variables.size(DRIFT) if in_air(model) else 0,
                "uses_turn": int(made.uses_turn),
                "damping": float(self.problem.damping),
                "work": max(model.manifest["work"][name] for name in FUNCTIONS.values()),
            }
            if not is_direct(model):
                drive = drive_terms(model, variables.size(variables.states)).functions.values()
                airborne |= zip(("drive", "drive_slopes", "drive_twice"), drive, strict=True)
                airborne["inputs"] = len(variables.units[variables.input])
            arrays = {"parameters": model.parameter_vector, "momentum": self.conserved[:3]}
        parts = (*variables.states, *variables.controls, *variables.constants)
        return OcpNode(
            states=variables.size(variables.states),
            controls=variables.size(variables.controls),
            constants=variables.size(variables.constants),
            rows=made.rows,
            units=variables.scale(parts),
            y_units=np.concatenate([variables.scale(variables.states), row_units, [1.0]]),
            terms=made.terms,
            numbers=np.concatenate([extra, self.conserved]),
            airborne=airborne,
            arrays=arrays,
        )

    @property
    def key(self) -> tuple:
        """All that terms depend on beside their rows."""
        problem, variables = self.problem, self.variables
        own = (variables.states, variables.constants, problem.design.key, self.compiled)
        return (self.model, *own, None if self.compiled else problem.damping)
