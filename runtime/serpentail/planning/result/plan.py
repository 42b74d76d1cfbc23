"""``Plan``: a planned motion with its torques, and a report on the true motion."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...basics.errors import PlanningError, SimulationError
from ...basics.near_names import NearNames
from ...model.chains import refuse_several
from ...model.model import Model
from ...motion.archive import origin
from ...motion.text import SI, framed
from ...motion.trajectory import Trajectory
from ...optimal.mesh import TimeMesh
from ...optimal.rules import CollocationRule
from ...optimal.solution import Solution
from ...simulation.controllers.controller import Controller, Damping
from ..air import refuse_air
from ..flight import flight
from ..problem import PlanningProblem
from ..tendons import TENSION, refuse_tendons, torques_of
from .curve import Curve
from .full_state import full_state
from .truth import planned_law

if TYPE_CHECKING:
    from ..gains.gains import Gains

SAMPLES = 240  # of a trajectory, at least
SHOWN = ("planned", "true", "passive")  # motions of its page
TRUTH = ("open_loop_attitude_error_deg", "open_loop_goal_error_deg")


@dataclass(frozen=True, eq=False)
class Plan(NearNames):
    """A planned motion, its torques, and a report on the motion that these cause.

    Attributes
    ----------
    success : bool
        Whether the solver converged, the torques applied open loop end within the tolerances,
        and bounds hold between nodes.
    trajectory : Trajectory
        The planned motion and torques, before damping. Its samples include all ends of
        intervals.
    report : dict
        JSON-ready summary: errors at the end, effort (N^2 m^2 s; of tensions N^2 s), energy (J),
        peak power (W), times (s), counts; docs/planning.md lists its keys.
    problem : PlanningProblem
        What was asked.
    curve : Curve
        The planned motion as polynomials; ``curve.at(times)`` evaluates them.
    mesh : TimeMesh
        Its intervals.
    rule : CollocationRule
        Its collocation rule.
    solution : Solution
        What the solver returned.
    design : dict
        Parameters that the planner chose: name to a number or numbers, SI.

    Examples
    --------
    >>> plan = st.plan(model, start=(q0, v0), duration=0.3)  # doctest: +SKIP
    >>> true = st.simulate(model, q0, v0, controller=plan.controller, t_span=0.3)  # doctest: +SKIP
    """

    success: bool
    trajectory: Trajectory
    report: dict[str, Any]
    problem: PlanningProblem
    curve: Curve
    mesh: TimeMesh
    rule: CollocationRule
    solution: Solution
    design: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        """At most seven lines: whether it succeeded, what it costs, and how true it is."""
        told, model = self.report, self.trajectory.model
        moved = model.tail_words() if model else "without its model"
        ended = "success" if self.success else f"no success ({told['status']})"
        chosen = ", ".join(f"{name} {_digits(x)}" for name, x in self.design.items())
        names = "effort", "energy_J", "peak_power_W", *TRUTH
        squared = "N^2 s" if TENSION in self.curve.nodes else "N^2 m^2 s"
        effort, energy, power, to_plan, to_goal = (_shown(told[name]) for name in names)
        return framed(
            [
                f"Plan of {self.trajectory.info['model']}, {moved}: {ended}",
                f"{self.duration:.6g} s, {self.mesh.intervals} intervals by Radau's rule of "
                f"degree {self.rule.degree}, {len(self.trajectory.t)} samples; {SI}",
                f"effort {effort} {squared}, energy {energy} J, peak power {power} W",
                f"true attitude at the end: {to_plan} deg from the plan, {to_goal} from the goal",
                f"rounds: {told['rounds']}, iterations: {told['iterations']}; processor time "
                f"{told['call_cpu_s']:.3g} s, of it {told['solve_cpu_s']:.3g} s in the solver",
                *([f"design: {chosen}"] if chosen else []),
                *([str(told["advice"])] if told.get("advice") else []),
            ]
        )

    @property
    def warnings(self) -> list[str]:
        """Doubts about the planned motion; see ``Trajectory.warnings``."""
        return self.trajectory.warnings

    @property
    def model(self) -> Model | None:
        """The model that flies the plan, with the parameters of its design; None if unpickled."""
        return self.trajectory.model

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """State (q0, v0) at the start; its free parts are those that the planner chose."""
        return self.problem.q0, self.problem.v0

    @property
    def duration(self) -> float:
        """Duration (s)."""
        return self.curve.duration

    @property
    def controller(self) -> Controller:
        """The planned torques or tensions, less the problem's damping: open loop, in C.

        They are held after the end.
        """
        return planned_law(self.curve, self.problem.damping)

    @cached_property
    def gains(self) -> "Gains":
        """Feedback along the plan, a controller for ``simulate``; made when it is first needed.

        PlanningError if the model lacks a function, or the plan was pickled: see ``Gains``.
        """
        from ..gains.gains import Gains

        return Gains(self)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the gains, which belong to the model's compiled code."""
        return {name: value for name, value in vars(self).items() if name != "gains"}

    def view(self, path: str | PathLike[str] = "plan.html", model: Model | None = None) -> Path:
        """Write a page with the planned motion, the true one, and passive flight.

        Parameters
        ----------
        path : str or path, default "plan.html"
            The .html file.
        model : Model, optional
            The model of a plan that was pickled; the true and the passive motion are simulated.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ViewError, ModelError
            As of ``view``.
        """
        from ...show.page.view import view

        own = self.trajectory.model if self.trajectory.model is not None else model
        motions = self._motions(own)
        return view(motions, path, names=SHOWN[: len(motions)], model=own)

    def _repr_html_(self) -> str:
        """Text and page, for notebooks."""
        from ...show.page.view import in_notebook

        return in_notebook(self, lambda: self._motions(self.trajectory.model), SHOWN)

    def _motions(self, model: Model | None) -> list[Trajectory]:
        """Return the planned motion and, if the model is known, the true and the passive one."""
        if model is None:
            return [self.trajectory]
        laws = (self.controller, Damping(self.problem.damping))
        return [self.trajectory, *(self._flown(model, law) for law in laws)]

    def _flown(self, model: Model, law: Controller) -> Trajectory:
        """Return the motion under a law at the plan's samples, or up to its failure.

        A page interpolates nothing: samples at other times would look like errors.
        """
        start = self.problem.q0, self.problem.v0
        try:
            motion = flight(model, start, law, self.duration, method="rk4")
            return motion.resample(self.trajectory.t)
        except SimulationError as error:
            if error.trajectory is None:
                raise
            return error.trajectory

    def torque(self, times: ArrayLike) -> np.ndarray:
        """Evaluate the planned torques, without damping.

        Parameters
        ----------
        times : array_like, shape (n,)
            Times from the start (s).

        Returns
        -------
        ndarray, shape (n, 2m)
            Torques (N m).
        """
        return torques_of(self.trajectory.model, self._at(times))

    def tension(self, times: ArrayLike) -> np.ndarray:
        """Evaluate the planned tensions (n, tendons), N, at times (n,) from the start, s.

        PlanningError is raised about a plan of a tail without tendons.
        """
        if TENSION not in self.curve.nodes:
            raise PlanningError("tension: this plan has no tendons: use torque")
        return self._at(times)[TENSION]

    def _at(self, times: ArrayLike) -> dict[str, np.ndarray]:
        return self.curve.at(np.atleast_1d(np.asarray(times, float)))


def refuse_unfit(name: str, model: Model, plan: Plan, functions: Iterable[str]) -> None:
    """ModelError or PlanningError if a model cannot fly a plan by a controller of this name."""
    model.refuse_fixed(name)
    refuse_air(model, name)
    refuse_tendons(model, name)
    refuse_several(model, name, "fly the plan by its controller", PlanningError)
    if "airspeed" in plan.curve.starts:
        raise PlanningError(f"{name}: the plan was made in air: give one of a model without air")
    model.need(*functions)
    if model.library is None:
        raise PlanningError(
            f"{name}: the model was loaded with compiled=False: load it again with C"
        )
    tail = plan.curve.starts["tail"].shape[1]
    if tail != model.layout.nt:
        raise PlanningError(
            f"{name}: the plan has {tail} tail coordinates, the model {model.layout.nt}"
        )


def _digits(value: Any) -> str:
    """Return a number or numbers with four digits."""
    return np.array2string(np.asarray(value), precision=4, separator=", ", threshold=4)


def _shown(value: float | None) -> str:
    """Return a number of the report as text; None stands for what is not finite."""
    return "no finite" if value is None else f"{value:.4g}"


def sample_times(ends: np.ndarray) -> np.ndarray:
    """Return times that divide each interval evenly, at least SAMPLES in all."""
    parts = np.ceil(np.diff(ends) / ends[-1] * SAMPLES).astype(int)
    rows = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)
    ]
    return np.append(np.concatenate(rows), ends[-1])


def sampled(model: Model, problem: PlanningProblem, curve: Curve) -> Trajectory:
    """Return the planned motion as a trajectory."""
    times = sample_times(curve.ends)
    blocks = curve.at(times)
    q, v = full_state(model, (problem.q0, problem.v0), times, blocks)
    info = {"kind": "plan"} | origin(model)
    kinetic, potential = model.energy(q, v)
    linear, angular = model.momentum(q, v)
    measures = (kinetic, potential, linear, angular)
    return Trajectory(times, q, v, torques_of(model, blocks), *measures, info, model=model)
