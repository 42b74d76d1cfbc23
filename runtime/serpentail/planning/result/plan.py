"""``Plan``: what the user gets, a motion with its torques and the report of its truth."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ...errors import SimulationError
from ...model.layout import TAIL_V
from ...model.model import Model
from ...motion.account import UNITS, framed, tail_of
from ...motion.origin import origin
from ...motion.trajectory import Trajectory
from ...simulation.controllers import Controller, Damping, TorqueCurve
from ..flight import flight
from ..nlp.coordinates import attitude
from ..nlp.mesh import Mesh
from ..nlp.rules import CollocationRule
from ..nlp.solver import Solution
from ..problem import PlanningProblem
from .curve import Curve
from .full_state import full_state
from .truth import planned_torques

SAMPLES = 240  # of a trajectory, at least
SHOWN = ("planned", "true", "passive")  # motions of its page
TRUTH = ("open_loop_attitude_error_deg", "open_loop_goal_error_deg")


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned motion and its truth.

    success: the solver converged, the torques, applied open loop, end within the tolerances, and
    bounds hold between nodes, too.
    trajectory: the planned motion and its torques (before damping), at and between all ends of
    intervals.
    report: JSON-ready summary; errors in degrees, times in s, energy in J, power in W.
    problem, mesh, rule, solution: what was asked and solved.
    ``torque`` and ``curve`` give values at any time.
    """

    success: bool
    trajectory: Trajectory
    report: dict[str, Any]
    problem: PlanningProblem
    curve: Curve
    mesh: Mesh
    rule: CollocationRule
    solution: Solution

    def __repr__(self) -> str:
        """On at most six lines whether it succeeded, what it costs, and how true it is."""
        told, model = self.report, self.trajectory.model
        moved = tail_of(model) if model else "without its model"
        ended = "success" if self.success else f"no success ({told['status']})"
        names = "effort", "energy_J", "peak_power_W", *TRUTH
        effort, energy, power, to_plan, to_goal = (_shown(told[name]) for name in names)
        return framed(
            [
                f"Plan of {self.trajectory.info['model']}, {moved}: {ended}",
                f"{self.duration:.6g} s, {self.mesh.intervals} intervals by {self.rule.name} of "
                f"degree {self.rule.degree}, {len(self.trajectory.t)} samples; {UNITS}",
                f"effort {effort} N^2 m^2 s, energy {energy} J, peak power {power} W",
                f"attitude its torques lead to: {to_plan} deg to the plan, {to_goal} to the goal",
                f"{told['rounds']} rounds, {told['iterations']} iterations, {told['wall_s']:.3g} s",
            ]
        )

    @property
    def warnings(self) -> list[str]:
        """What to mind about the planned motion: see ``Trajectory.warnings``."""
        return self.trajectory.warnings

    @property
    def duration(self) -> float:
        """Duration in s."""
        return self.curve.duration

    def view(self, path: str | PathLike[str] = "plan.html", model: Model | None = None) -> Path:
        """Write the page of the motion as planned, with its torques in truth, and passive.

        The last two are simulated.  model: of a plan that was pickled.  Returns the path; raises as
        ``st.view``.
        """
        from ...viewer.view import view

        own = self.trajectory.model if self.trajectory.model is not None else model
        motions = self._motions(own)
        return view(motions, path, names=SHOWN[: len(motions)], model=own)

    def _repr_html_(self) -> str:
        """For notebooks: the text, and the page."""
        from ...viewer.notebook import in_notebook

        return in_notebook(self, lambda: self._motions(self.trajectory.model), SHOWN)

    def _motions(self, model: Model | None) -> list[Trajectory]:
        """The motion as planned, and where there is a model, what its torques do, and passive."""
        if model is None:
            return [self.trajectory]
        damping = self.problem.damping
        laws = (TorqueCurve(planned_torques(self.curve), damping), Damping(damping))
        return [self.trajectory, *(self._flown(model, law) for law in laws)]

    def _flown(self, model: Model, law: Controller) -> Trajectory:
        """The motion under a law at the plan's samples, or what there is of it where it fails.

        A page interpolates nothing: samples of other times would look like errors.
        """
        start = self.problem.q0, self.problem.v0
        try:
            motion = flight(model, start, law, self.duration, method="rk4")
            return motion.resample(self.trajectory.t)
        except SimulationError as error:
            if error.trajectory is None:
                raise
            return cast(Trajectory, error.trajectory)

    def torque(self, times: ArrayLike) -> np.ndarray:
        """Planned torques (n, 2m), N m, at times (n,) s from the start."""
        return self.curve.at(np.atleast_1d(np.asarray(times, float)))["torque"]

    def controller(self, t: float, _q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Open-loop torque law for ``st.simulate``: planned torques less the problem's damping."""
        return self.torque(min(max(t, 0.0), self.duration))[0] - self.problem.damping * v[TAIL_V]


def _shown(value: float | None) -> str:
    """A number of the report, which has None for what is not finite."""
    return "no finite" if value is None else f"{value:.4g}"


def sample_times(ends: np.ndarray) -> np.ndarray:
    """Return times that divide every interval evenly, at least SAMPLES in all."""
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
    q, v = full_state(model, (problem.q0, problem.v0), attitude(problem.attitude), times, blocks)
    info = {"kind": "plan"} | origin(model)
    kinetic, potential = model.energy(q, v)
    linear, angular = model.momentum(q, v)
    measures = (kinetic, potential, linear, angular)
    return Trajectory(times, q, v, blocks["torque"], *measures, info, model=model)
