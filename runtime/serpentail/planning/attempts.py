"""Attempts to solve a problem: by FATROP or IPOPT, from motions that are far or close."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q

from ..basics.attitude import angle_deg
from ..model.model import Model
from ..optimal import fatrop, ipopt
from ..optimal.interrupt import stop_reason
from ..optimal.mesh import TimeMesh, uniform
from ..optimal.rules import CollocationRule
from ..optimal.solution import Solution
from .free_variables import guessed
from .problem import PlanningProblem
from .program.build import PlanProgram, plan_program
from .program.guess import GuessMotion, of_trajectory, passive, pushes, samples_of
from .program.variables import torque_unit
from .result.plan import Plan
from .settings import PlanSettings

FIRST_PUSH = 0.05  # of the torques' unit: takes the first guess out of a plane of symmetry
DURATIONS = (1.0, 0.5, 0.75, 0.25)  # of guesses, in turn, from the least (0) to the most (1)
CONTROL_INTERVALS = 12
# (most segments, intervals in each control interval at first): with fewer, optima of long tails
# exploit the errors of the mesh
PIECES = ((2, 1), (4, 4), (np.inf, 12))
FINE = 12  # intervals in each, where a search begins again


class Attempts:
    """Attempts of one search, and what they and those of an earlier one have cost."""

    def __init__(
        self,
        model: Model,
        settings: PlanSettings,
        rule: CollocationRule,
        before: "Attempts | None" = None,
    ):
        self.model, self.settings, self.rule = model, settings, rule
        self.spent = dict.fromkeys(("derive_s", "solve_cpu_s", "truth_s"), 0.0)
        self.iterations = self.count = 0
        if before is not None:
            self.spent = dict(before.spent)
            self.iterations, self.count = before.iterations, before.count
        self.stopped: str | None = None

    def share(self, later: "Attempts") -> None:
        """Count what a later search, that began with what this one had cost, has cost, too."""
        self.spent, self.iterations, self.count = later.spent, later.iterations, later.count
        self.stopped = self.stopped or later.stopped

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Add the time of a part of the work to what was spent on it."""
        begun = time.perf_counter()
        yield
        self.spent[name] += time.perf_counter() - begun

    def is_stopped(self) -> bool:
        """Tell, and note why, whether the search should end that is not done."""
        self.stopped = stop_reason()
        return self.stopped is not None

    def meshes(self) -> tuple[TimeMesh, ...]:
        """Return the first mesh, and a finer one to begin with if no plan of that becomes true.

        States have a mesh of their own: one or more intervals in each control interval.
        """
        guess, asked = self.settings.guess.motion, self.settings.mesh
        if isinstance(guess, Plan) and guess.rule is self.rule:
            return (guess.mesh,)
        if isinstance(guess, GuessMotion) and guess.mesh is not None:
            return (guess.mesh,)
        if asked.intervals:
            controls = asked.controls or min(CONTROL_INTERVALS, asked.intervals)
            return (uniform(asked.intervals, controls),)
        controls = asked.controls or CONTROL_INTERVALS
        chains = (chain.segments for chain in self.model.layout.chains)
        longest = max(segments.stop - segments.start for segments in chains)
        pieces = next(count for segments, count in PIECES if longest <= segments)
        first, finer = (uniform(controls * each, controls) for each in (pieces, FINE))
        if first.intervals < finer.intervals <= asked.most_intervals:
            return first, finer
        return (first,)

    def program(self, problem: PlanningProblem, mesh: TimeMesh, softening: float) -> PlanProgram:
        """Return the program of a problem on a mesh."""
        with self.timed("derive_s"):
            return plan_program(self.model, problem, mesh, self.rule, softening)

    def given(self, problem: PlanningProblem) -> tuple[GuessMotion, str]:
        """Return the user's guess, or passive flight, and whether it is "far" or "close"."""
        guess = self.settings.guess.motion
        if guess is None or isinstance(guess, tuple | list):
            return self.pushed(problem, 0), "far"
        if isinstance(guess, GuessMotion):
            return guess, "close"
        if not isinstance(guess, Plan):
            return of_trajectory(self.model, guess, problem.damping), "far"
        return self.motion_of(guess), "close"

    def motion_of(self, plan: Plan) -> GuessMotion:
        """Return a plan as a guess."""
        model = self.model._varied(plan.design)
        return GuessMotion(plan.duration, plan.curve.at, plan.start, model)

    def nearest(self, problem: PlanningProblem) -> GuessMotion | None:
        """Return that of the user's stored plans whose start is nearest; None if there is none."""
        plans = self.settings.guess.motion
        if not isinstance(plans, tuple | list) or not plans:
            return None
        return self.motion_of(min(plans, key=lambda plan: _apart(problem, plan)))

    def pushed(self, problem: PlanningProblem, k: int) -> GuessMotion:
        """Passive flight; the tail is pushed a little for k = 0, or about at random."""
        settings, (least, most) = self.settings, problem.duration
        duration = least + (most - least) * DURATIONS[k % len(DURATIONS)]
        size = torque_unit(problem) * (FIRST_PUSH if k == 0 else 1.0)
        random = np.random.default_rng([settings.solver.seed, k])
        push = pushes(random, size, self.model)
        own = guessed(self.model, problem, random if k else None)
        return passive(*own, settings.guess.damping, duration, push)

    def solved(
        self,
        program: PlanProgram,
        motion: GuessMotion,
        guess: str = "far",
        solver: str = "fatrop",
        quick: bool = False,
    ) -> Solution:
        """Solve from a motion that is "far" from a solution or "close" to one.

        quick: with few iterations, to see whether that leads anywhere.
        """
        begin = samples_of(motion, program)
        options = self.settings.options_of(solver)
        threads = self.model.batch_library.threads
        if solver == "ipopt":
            found = ipopt.solve(program.optimal, begin, guess, options, threads, quick)
        else:
            found = fatrop.solve(program.optimal, begin, guess, options, threads, quick)
        self.spent["solve_cpu_s"] += found.cpu_s
        self.iterations += found.iterations
        self.count += 1
        if not found.success:
            self.is_stopped()
        return found

    def solved_near(
        self, program: PlanProgram, motion: GuessMotion, solver: str = "fatrop"
    ) -> Solution:
        """Solve from a motion that is close to a solution; as from afar if that fails."""
        found = self.solved(program, motion, "close", solver)
        return (
            found if found.success or self.stopped else self.solved(program, motion, solver=solver)
        )


def _apart(problem: PlanningProblem, plan: Plan) -> float:
    """Return how far two starts are apart: attitude and tail (rad), rates over 0.1 s."""
    (q, v), (q0, v0) = plan.start, (problem.q0, problem.v0)
    turn = np.radians(angle_deg(q[QUATERNION], q0[QUATERNION]))
    rates = 0.1 * np.linalg.norm(v[OMEGA.start :] - v0[OMEGA.start :])
    return float(turn + np.linalg.norm(q[TAIL_Q] - q0[TAIL_Q]) + rates)
