"""Formulations: a model's dynamics and a problem go in; a CasADi function of one node comes out."""

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace

import numpy as np

from ...errors import ModelError
from .coordinates import Attitude
from .node_calls import Call, NodeDerivatives, linear_call

# name -> blocks of the state, which has a rate, and of the algebraic unknowns, which a node's
# equations determine
FORMULATIONS = {
    "airborne": (("attitude", "tail", "tail_rate"), ("drift", "torso_rate")),
    "translation-free": (("attitude", "tail", "torso_rate", "tail_rate"), ()),
    "full": (("position", "attitude", "tail", "velocity", "torso_rate", "tail_rate"), ()),
}
# units in which unknowns are of the order of 1
UNITS = {
    "position": 0.1,
    "attitude": 1.0,
    "tail": 1.0,
    "velocity": 1.0,
    "torso_rate": 10.0,
    "tail_rate": 10.0,
}
UNITS |= {"drift": 0.1}
SMOOTH = 1e-4  # W, below which |power| is rounded off


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Equations of motion as CasADi functions, and where they come from: "compiled" or
    "symbolic".
    """

    forward: object
    inverse: object
    more: tuple  # what they take after their usual inputs
    source: str


def dynamics(model, source: str = "auto") -> Dynamics:
    """Return the compiled functions where the scene has their exact second derivatives, else the SX
    ones.
    """
    names = ("forward_dynamics", "inverse_dynamics")
    if source != "symbolic":
        try:
            compiled = [model.casadi.external(name, derivatives=2) for name in names]
            return Dynamics(*compiled, (model.casadi.parameter_vector,), "compiled")
        except ModelError:
            if source == "compiled":
                raise
    return Dynamics(*(getattr(model.casadi, name) for name in names), (), "symbolic")


@dataclass(frozen=True, eq=False)
class Layout:
    """The unknowns of a node: names and sizes of the blocks of state, algebraic unknowns and
    controls, with units.
    """

    states: tuple[tuple[str, int], ...]
    algebraic: tuple[tuple[str, int], ...]
    units: dict[str, np.ndarray]

    def sizes(self) -> tuple[int, int, int]:
        """Numbers of states, algebraic unknowns and controls."""
        return (
            sum(n for _, n in self.states),
            sum(n for _, n in self.algebraic),
            self.units["torque"].size,
        )

    def scale(self, blocks) -> np.ndarray:
        """Units of the unknowns of some blocks, in a row."""
        return np.concatenate([np.zeros(0), *(self.units[name] for name, _ in blocks)])


def layout(formulation: str, attitude: Attitude, tail: int, torque: np.ndarray) -> Layout:
    """Return the layout of a formulation for 2m tail coordinates and the unit (2m,) of torques."""
    sizes = {"attitude": attitude.size, "tail": tail, "tail_rate": tail}
    states, algebraic = (
        [(name, sizes.get(name, 3)) for name in part] for part in FORMULATIONS[formulation]
    )
    units = {name: np.full(size, UNITS[name]) for name, size in (*states, *algebraic)} | {
        "torque": torque
    }
    return Layout(tuple(states), tuple(algebraic), units)


@dataclass(frozen=True, eq=False)
class Node:
    """A node's function y(zeta, h, results of calls), calls of inputs linear in zeta, and the sizes
    in y.

    zeta: [duration, states, algebraic unknowns, torques] in units.  h (3,): angular momentum about
    the COM (kg m^2/s,
    world), which the airborne formulation conserves.  y: duration * rates of the states, algebraic
    residuals, path
    constraints, duration * objective, all in units.
    """

    function: object
    calls: tuple[Call, ...]
    rates: int
    residuals: int
    path: int

    @cached_property
    def derivatives(self) -> NodeDerivatives:
        """Exact derivatives, which programs on all meshes share."""
        return NodeDerivatives(self)

    @property
    def size(self) -> int:
        """Length of y."""
        return self.rates + self.residuals + self.path + 1


def node(model, problem, attitude: Attitude, form: Layout, equations: Dynamics) -> Node:
    """Return the function of one node.

    The dynamics is evaluated at the identity attitude: in body axes only gravity depends on the
    attitude.
    """
    import casadi as ca

    nx, na, nu = form.sizes()
    zeta, h = ca.SX.sym("zeta", 1 + nx + na + nu), ca.SX.sym("h", 3)
    point = _point(zeta, form, attitude, nu)
    calls = _calls(model, problem, point, zeta, equations)[: 2 if na else 1]
    results = [ca.SX.sym("result", call.function.size1_out(0)) for call in calls]
    rates = _rates(model, point, attitude, results[0])
    parts = [
        zeta[0] * ca.vertcat(*(rates[name] for name, _ in form.states)) / form.scale(form.states)
    ]
    parts.append(_momentum(model, point, h, results[1]) if na else ca.SX.zeros(0))
    parts.append(
        ca.vertcat(
            ca.SX.zeros(0), *(ca.vec(ca.SX(function(point))) for function, _, _ in problem.path)
        )
    )
    parts.append(zeta[0] * cost(problem, point, form.units["torque"]))
    function = ca.Function("node", [zeta, h, *results], [ca.vertcat(*parts)])
    return Node(function, tuple(calls), nx, parts[1].size1(), parts[2].size1())


def _calls(model, problem, point, zeta, equations: Dynamics) -> list[Call]:
    """Forward dynamics with the tail's damping, and H v of the motion relative to the COM, at the
    identity attitude.

    H v is inverse dynamics at rest with v_dot = v, gravity's H (g z, 0) taken off.
    """
    import casadi as ca

    q = ca.vertcat(ca.DM([0, 0, 0, 1, 0, 0, 0]), point.tail)
    v = ca.vertcat(ca.DM.zeros(3), point.torso_rate, point.tail_rate)
    applied = point.torque - problem.damping * point.tail_rate
    calls = [linear_call(equations.forward, zeta, [q, v, applied, *equations.more])]
    if hasattr(point, "drift"):
        gravity = ca.DM([0, 0, model.parameters["gravity"]])
        motion = ca.vertcat(point.drift - gravity, point.torso_rate, point.tail_rate)
        calls.append(
            linear_call(
                equations.inverse, zeta, [q, ca.DM.zeros(model.nv), motion, *equations.more]
            )
        )
    return calls


def _point(zeta, form: Layout, attitude: Attitude, nu: int) -> SimpleNamespace:
    """Return the blocks of a node in SI units, which objectives and path constraints see."""
    blocks, start = {}, 1
    for name, size in (*form.states, *form.algebraic, ("torque", nu)):
        blocks[name] = form.units[name] * zeta[start : start + size]
        start += size
    blocks["quaternion"] = attitude.quaternion(blocks["attitude"])
    return SimpleNamespace(**blocks)


def _rates(model, point, attitude: Attitude, v_dot) -> dict:
    """Return the rates of state blocks; p_ddot = R (p_ddot(identity) + g z) - g z."""
    import casadi as ca

    gravity = ca.DM([0, 0, model.parameters["gravity"]])
    return {
        "position": getattr(point, "velocity", None),
        "attitude": attitude.rate(point.attitude, point.torso_rate),
        "tail": point.tail_rate,
        "velocity": turned(point.quaternion, v_dot[:3] + gravity) - gravity,
        "torso_rate": v_dot[3:6],
        "tail_rate": v_dot[6:],
    }


def _momentum(model, point, h, found):
    """Momentum H v of the motion relative to the COM less (0, R^T h), in units: where it is zero,
    omega carries h.

    Where the linear momentum is zero, the angular momentum about B is that about the COM.
    """
    import casadi as ca

    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    inertia = float(np.mean(model.parameters["torso_inertia"]))
    body = turned(point.quaternion, h, -1)
    return ca.vertcat(
        found[:3] / (mass * UNITS["drift"]), (found[3:6] - body) / (inertia * UNITS["torso_rate"])
    )


def turned(quaternion, x, sense: int = 1):
    """R x, or R^T x for the sense -1, of a quaternion of any norm but zero."""
    import casadi as ca

    w, u = sense * quaternion[0], quaternion[1:]
    return ((w**2 - ca.dot(u, u)) * x + 2 * ca.dot(u, x) * u + 2 * w * ca.cross(u, x)) / ca.sumsqr(
        quaternion
    )


def cost(problem, point, unit: np.ndarray):
    """Return the objective's integrand (CasADi), in units of the torques."""
    import casadi as ca

    if callable(problem.objective):
        return problem.objective(point)
    if problem.objective == "effort":
        return (
            ca.sumsqr(point.torque) + problem.smoothing**2 * ca.sumsqr(point.tail_rate)
        ) / unit.mean() ** 2
    if problem.objective == "energy":
        return ca.sum1(ca.sqrt((point.torque * point.tail_rate) ** 2 + SMOOTH**2) - SMOOTH) / (
            unit.mean() * 10
        )
    return ca.SX(0)
