"""The variables of a plan's program: blocks of states, controls and constants, and their units."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import TAIL_Q

from ...model.model import Model
from ..air import DRIFT, in_air
from ..design import Design
from ..problem import PlanningProblem
from ..tendons import TENSION, input_of, of_motors

Blocks = tuple[tuple[str, int], ...]  # (name, size) of blocks
UNIT_OF_BOUND = 0.05  # of a torque's bound: plans of least effort are far inside
UNIT_OF_RATE = 1.0  # of a bound of torques' rates
USUAL_TORQUE = 1e-3  # N m, the unit of torques without a bound
# units that make variables of the order of 1
UNITS = {"attitude": 1.0, "tail": 1.0, "tail_rate": 10.0, "torso_rate": 10.0}
CONSERVED: Blocks = (("momentum", 3), ("com", 3), ("com_velocity", 3))


@dataclass(frozen=True, eq=False)
class PlanVariables:
    """Blocks (name, size) of a node's states, controls and constants, and the units of all.

    Torques are controls, or states if their rates are bounded. Constants are numbers of the design,
    what flight conserves if the start or the parameters are free (angular momentum about the COM,
    kg m^2/s, world; position and velocity of the COM at the start), and the duration, s.
    """

    states: Blocks
    controls: Blocks
    constants: Blocks
    units: dict[str, np.ndarray]
    design: Design

    @property
    def input(self) -> str:
        """What drives the tail: "torque" or "tension"."""
        return TENSION if TENSION in self.units else "torque"

    @property
    def torque_is_state(self) -> bool:
        """Whether torques are states, whose rates are the controls."""
        return "torque" in dict(self.states)

    def size(self, blocks: Iterable[tuple[str, int]]) -> int:
        """Number of entries of some blocks."""
        return sum(size for _, size in blocks)

    def scale(self, blocks: Iterable[tuple[str, int]]) -> np.ndarray:
        """Units of some blocks, in a row."""
        return np.concatenate([np.zeros(0), *(self.units[name] for name, _ in blocks)])

    def places(self, blocks: Blocks) -> dict[str, slice]:
        """Where each of some blocks is in their row."""
        ends = np.cumsum([0, *(size for _, size in blocks)]).tolist()
        return {name: slice(a, b) for (name, _), a, b in zip(blocks, ends, ends[1:], strict=False)}

    def split(self, blocks: Blocks, row: np.ndarray) -> dict[str, np.ndarray]:
        """Return blocks in SI of rows (.., n) in the program's units."""
        values = row * self.scale(blocks)
        return {name: values[..., place] for name, place in self.places(blocks).items()}


def variables_of(model: Model, problem: PlanningProblem, falls: bool) -> PlanVariables:
    """Return the variables of a problem; falls: whether anything depends on the COM's flight."""
    tail, unit = model.layout.nt, of_motors(model, torque_unit(problem))
    states: Blocks = (("attitude", 4), ("tail", tail), ("tail_rate", tail))
    units = {name: np.full(size, UNITS[name]) for name, size in states}
    units |= {"torque": unit, "torso_rate": np.full(3, UNITS["torso_rate"]), "duration": np.ones(1)}
    if in_air(model):
        states += DRIFT
        units |= {"airspeed": np.ones(3), "spin": np.full(3, UNITS["torso_rate"])}
    controls: Blocks = (input_of(model),)
    if problem.bounds.tension is not None:
        units[TENSION] = UNIT_OF_BOUND * problem.bounds.tension
    if problem.bounds.torque_rate is not None:
        states, controls = (*states, *controls), (("torque_rate", tail),)
        units["torque_rate"] = UNIT_OF_RATE * problem.bounds.torque_rate
    design = problem.design
    constants: Blocks = ()
    if design.size:
        constants = (("design", design.size),)
        units["design"] = design.units
    if problem.is_free:
        constants += CONSERVED if falls else CONSERVED[:1]
        inertia = float(np.mean(model.parameters["torso_inertia"]))
        units |= {"momentum": np.full(3, 10.0 * inertia), "com": np.full(3, 0.1)}
        units["com_velocity"] = np.ones(3)
    return PlanVariables(states, controls, (*constants, ("duration", 1)), units, design)


def torque_unit(problem: PlanningProblem) -> np.ndarray:
    """Unit (2m,) of torques: a fraction of their bound."""
    bound = problem.bounds.torque
    if bound is None:
        return np.full(len(problem.q0[TAIL_Q]), USUAL_TORQUE)
    return UNIT_OF_BOUND * bound
