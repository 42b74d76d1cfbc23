"""``Scenario``: a motion to simulate, as a scene describes it."""

from dataclasses import dataclass, field, replace
from typing import Any, Unpack, overload

import numpy as np

from ..basics.errors import SimulationError
from ..basics.near_names import NearNames
from ..basics.short_repr import brief
from ..model.model import Model
from ..motion.summary import Summary, summary
from ..motion.trajectory import Trajectory
from ..sequence.phase import Phase
from ..sequence.run import SequenceRun
from ..sequence.sequence import Sequence
from ..simulation.controllers.controller import Controller
from ..simulation.controllers.schedules import Legs
from ..simulation.rollouts import Rollouts
from ..simulation.settings import RunSettings
from ..simulation.simulate import simulate
from .simulate_keys import NUMBERS

OF_PHASES = ("method", *NUMBERS)  # settings of all phases


@dataclass(frozen=True, eq=False)
class Scenario(NearNames):
    """A motion to simulate: a model, its start, and further arguments of ``simulate``.

    Attributes
    ----------
    model : Model
        The model.
    q0, v0 : ndarray, shapes (nq,) and (nv,)
        State at the start.
    duration : float
        Duration from t = 0 (s); of phases, each has its own.
    controller : controller or None
        As of ``simulate``; in phases it acts where a phase has no other.
    legs : Legs or None
        Leg angles over time.
    settings : dict
        Further arguments of ``simulate``.
    phases : tuple of Phase
        Phases of a sequence; empty for a single run.
    """

    model: Model
    q0: np.ndarray
    v0: np.ndarray
    duration: float
    controller: Controller = None
    legs: Legs | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    phases: tuple[Phase, ...] = ()
    __repr__ = brief

    @overload
    def simulate(self, **changes: Unpack[RunSettings]) -> Trajectory: ...

    @overload
    def simulate(self, **changes: Any) -> Trajectory | Rollouts: ...

    def simulate(self, **changes: Any) -> Trajectory | Rollouts:
        """Make the motion.

        Parameters
        ----------
        **changes
            Arguments of ``serpentail.simulate`` that replace the scene's. With parameters of many
            runs the result is Rollouts. A scene with phases allows changes of the method and its
            settings, such as ``output_step="0.1 ms"``; others need ``changes`` of ``scenario``.

        Returns
        -------
        Trajectory or Rollouts
            The motion.

        Raises
        ------
        SimulationError
            The scene has phases, which have what is changed, or as of ``serpentail.simulate``.
        StateError, ModelError, PlanningError
            As of ``serpentail.simulate`` and ``Sequence.simulate``.
        """
        if self.phases:
            for name in changes:
                if name not in OF_PHASES:
                    remedy = 'give st.scenario changes such as {"phase.push.duration": 0.5}'
                    raise SimulationError(f"{name}: this scene has phases: {remedy}")
            return replace(self, settings=self.settings | changes).sequence().trajectory
        arguments = {"controller": self.controller, "t_span": self.duration} | self.settings
        if self.legs is not None:
            arguments["legs"] = self.legs
        return simulate(self.model, self.q0, self.v0, **arguments | changes)

    def sequence(self) -> SequenceRun:
        """Make the motion of the scene's phases.

        Returns
        -------
        SequenceRun
            The motion and the outcome of each phase.

        Raises
        ------
        SimulationError, PlanningError
            As of ``Sequence.simulate``.
        """
        settings = dict(self.settings)
        bristles = settings.pop("bristles0", None)
        gamma, delta = (None, None) if self.legs is None else self.legs.curve.at(0.0)[0][:2]
        sequence = Sequence(self.model, self.phases, gamma, delta, settings)
        return sequence.simulate(self.q0, self.v0, bristles)

    def summary(self, motion: Trajectory, errors: bool = False) -> Summary:
        """Return the numbers of a motion by name; see ``serpentail.summary``.

        Parameters
        ----------
        motion : Trajectory
            The motion.
        errors : bool, default False
            Whether to estimate the numerical error of each number.

        Returns
        -------
        Summary
            The numbers, SI.
        """
        return summary(self.model, motion, errors)
