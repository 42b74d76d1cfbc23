"""``OptimalProblem``: a phase of a motion as stages of C take it: its mesh, nodes and limits."""

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from .control_mesh import Cut, cut
from .mesh import TimeMesh
from .rules import CollocationRule
from .terms import Terms

_pointer, _double, _int = ctypes.c_void_p, ctypes.c_double, ctypes.c_int


class NodeRecord(ctypes.Structure):
    """``Node`` of native/node.h."""

    _fields_ = (
        *((name, _int) for name in ("states", "controls", "constants", "rows")),
        *((name, _int) for name in ("tail", "drift", "uses_turn")),
        *((name, _pointer) for name in ("rates", "slopes", "curvature", "parameters", "momentum")),
        ("damping", _double),
        ("work", _int),
        ("given", _int),
        ("numbers", _pointer),
        *((name, _pointer) for name in ("values", "by_zeta", "twice", "units", "y_units")),
        ("inputs", _int),
        *((name, _pointer) for name in ("drive", "drive_slopes", "drive_twice")),
    )


class PhaseRecord(ctypes.Structure):
    """``Phase`` of native/stage.h."""

    _fields_ = (
        *((name, _int) for name in ("stages", "intervals", "nodes", "coefficients")),
        *((name, _pointer) for name in ("first", "widths", "fractions", "basis")),
        *((name, _pointer) for name in ("states", "weights", "node")),
        ("bounded", _int),
        ("bounded_states", _pointer),
    )


class OcpRecord(ctypes.Structure):
    """``Ocp`` of native/ocp.h."""

    _fields_ = (
        ("phase", PhaseRecord),
        *((name, _pointer) for name in ("start", "constants")),
        ("free", _int),
        *(
            (f"{which}_{name}", _pointer)
            for name in ("control", "state", "row", "constant")
            for which in ("least", "most")
        ),
        *((name, _pointer) for name in ("at_start", "at_end")),
        ("start_equalities", _int),
        *(
            (name, _pointer)
            for name in (
                *("start_values", "end_values", "end_room"),
                *("least_start", "most_start", "fixed"),
            )
        ),
        *((name, _double) for name in ("give", "scale")),
    )


@dataclass(frozen=True, eq=False)
class OcpNode:
    """A node: sizes, terms and, with ``airborne``, a model's emitted functions.

    units of zeta = (states, controls, constants), y_units of (rates, rows, cost), SI. numbers: what
    terms are given. airborne: fields of NodeRecord that its emitted functions need; arrays: what
    they point to.
    """

    states: int
    controls: int
    constants: int
    rows: int
    units: np.ndarray
    y_units: np.ndarray
    terms: Terms | None
    numbers: np.ndarray = field(default_factory=lambda: np.zeros(0))
    airborne: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)

    def record(self) -> NodeRecord:
        """Return the node as C takes it; the node has to outlive it."""
        functions = {} if self.terms is None else self.terms.functions
        pointers = {
            name: ctypes.cast(function, _pointer)
            for name, function in {**functions, **self.airborne}.items()
            if not isinstance(function, int | float)
        }
        numbers = {k: v for k, v in self.airborne.items() if isinstance(v, int | float)}
        return NodeRecord(
            states=self.states,
            controls=self.controls,
            constants=self.constants,
            rows=self.rows,
            units=self.units.ctypes.data,
            y_units=self.y_units.ctypes.data,
            given=len(self.numbers),
            numbers=self.numbers.ctypes.data,
            **pointers,
            **numbers,
            **{name: array.ctypes.data for name, array in self.arrays.items()},
        )


def _nothing() -> np.ndarray:
    return np.zeros((2, 0))


@dataclass(frozen=True, eq=False)
class OptimalProblem:
    """Nodes, mesh and limits of one phase, in the program's units.

    start (states,): None if it is free; constants (c,), the last of which is the duration;
    duration_is_free; limits, each (2, n), least and most: control_limits, state_limits of the
    states whose indices are bounded, row_limits of the node's rows, constant_limits, start_limits
    of rows at the start after the first start_equalities, which are start_values. at_end: its
    rows are end_values at the end, or as far off as end_room; fixed (bounded,): bounded states that
    the goal gives there.
    """

    node: OcpNode
    mesh: TimeMesh
    rule: CollocationRule
    coefficients: int
    start: np.ndarray | None
    constants: np.ndarray
    duration_is_free: bool
    control_limits: np.ndarray
    bounded: np.ndarray
    state_limits: np.ndarray
    constant_limits: np.ndarray
    row_limits: np.ndarray = field(default_factory=_nothing)
    at_start: OcpNode | None = None
    start_equalities: int = 0
    start_values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    start_limits: np.ndarray = field(default_factory=_nothing)
    at_end: OcpNode | None = None
    end_values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    end_room: np.ndarray = field(default_factory=lambda: np.zeros(0))
    fixed: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))

    @cached_property
    def cut(self) -> Cut:
        """The stages."""
        return cut(self.mesh, self.rule, self.coefficients)

    @property
    def free(self) -> int:
        """Number of constants that are variables."""
        return self.node.constants - (not self.duration_is_free)

    @property
    def stages(self) -> int:
        """Number of stages."""
        return self.cut.stages

    @property
    def threads(self) -> bool:
        """Whether several threads may evaluate stages."""
        return self.node.terms is None or self.node.terms.compiled


class OcpInC:
    """A problem as C takes it; give: what squares of the goal's rows cost, twice."""

    def __init__(self, problem: OptimalProblem, give: float, scale: float):
        own, rule, mesh = problem.cut, problem.rule, problem.mesh
        fractions = np.ascontiguousarray(mesh.points(rule)[1:])
        self.arrays = {
            "first": own.first.astype(np.intc),
            "widths": mesh.widths,
            "fractions": fractions,
            "basis": own.basis,
            "states": rule.states,
            "weights": rule.weights,
            "bounded_states": problem.bounded.astype(np.intc),
        }
        self.arrays = {k: np.ascontiguousarray(v) for k, v in self.arrays.items()}
        nodes = {"node": problem.node, "at_start": problem.at_start, "at_end": problem.at_end}
        self.nodes = {k: node.record() for k, node in nodes.items() if node is not None}
        at = {name: ctypes.addressof(record) for name, record in self.nodes.items()}
        phase = PhaseRecord(
            stages=own.stages,
            intervals=mesh.intervals,
            nodes=len(rule.nodes),
            coefficients=problem.coefficients,
            node=at.pop("node"),
            bounded=len(problem.bounded),
            **{name: array.ctypes.data for name, array in self.arrays.items()},
        )
        self.more = {
            "constants": problem.constants,
            "fixed": problem.fixed.astype(np.intc),
            "start_values": problem.start_values,
            "end_values": problem.end_values,
            "end_room": problem.end_room,
        }
        for name in ("control", "state", "row", "constant", "start"):
            least, most = getattr(problem, f"{name}_limits")
            self.more |= {f"least_{name}": least, f"most_{name}": most}
        if problem.start is not None:
            self.more["start"] = problem.start
        self.more = {k: np.ascontiguousarray(v) for k, v in self.more.items()}
        self.record = OcpRecord(
            phase=phase,
            free=problem.free,
            start_equalities=problem.start_equalities,
            give=give * scale,
            scale=scale,
            **at,
            **{name: array.ctypes.data for name, array in self.more.items()},
        )
        self.problem = problem
