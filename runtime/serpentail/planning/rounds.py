"""Rounds: a problem and a method go in; solutions on finer and finer meshes, and the best one's
plan, come out.
"""

import time
from dataclasses import dataclass

import numpy as np

from .settings import PlanSettings
from .nlp.bounds import limits
from .nlp.coordinates import attitude
from .nlp.guess import Motion, of_trajectory, passive, pushes, unknowns
from .nlp.interrupt import stop_reason
from .nlp.mesh import Mesh, refined, uniform
from .nlp.multipliers import carried
from .nlp.node import Dynamics
from .nlp.rules import CollocationRule
from .nlp.solver import Solution, solve, solver
from .nlp.transcription import Transcription, program_of, torque_unit
from .problem import PlanningProblem
from .result.curve import Curve, curve
from .result.full_state import full_state
from .result.plan import Plan, sampled
from .result.report import attitude_errors, report
from .result.truth import local_errors, open_loop

SLIGHT = 0.05  # of the torques' unit: what pushes the first guess out of a plane of symmetry


@dataclass(frozen=True, eq=False)
class Round:
    """One solution on one mesh: q, v planned at the ends of intervals, and true at the end of
    all.
    """

    program: Transcription
    solution: Solution
    curve: Curve
    planned: tuple[np.ndarray, np.ndarray]
    true: tuple[np.ndarray, np.ndarray]

    @property
    def error(self) -> float:
        """True error (deg) of the attitude at the end, against the plan or the goal, the larger
        one; inf if lost.
        """
        error = max(
            attitude_errors(self.program.problem, self.planned[0][-1, 3:7], self.true[0][3:7])
        )
        return error if np.isfinite(error) else np.inf


class Search:
    """One call of ``plan``: what stays the same in all its rounds, and what they have cost."""

    def __init__(self, model, problem: PlanningProblem, settings: PlanSettings, equations: Dynamics, scheme: CollocationRule):
        self.model, self.problem, self.settings, self.equations, self.rule = (
            model,
            problem,
            method,
            equations,
            scheme,
        )
        self.start = (problem.q0, problem.v0)
        self.h = model.momentum(*self.start)[1]
        self.attitude = attitude(problem.attitude)
        self.spent = dict.fromkeys(("derive_s", "solve_cpu_s", "truth_s"), 0.0)
        self.iterations = self.attempts = 0
        self.stopped: str | None = None

    def first(self) -> Round:
        """Return the best solution on the first mesh, of as many guesses as asked for, and more if
        all fail.
        """
        settings, before = self.settings, self.settings.guess
        again = isinstance(before, Plan) and before.rule is self.rule
        program = self._transcribed(before.mesh if again else uniform(settings.intervals))
        found: list[Solution] = []
        for k in range(settings.multi_start + settings.retries):
            if found and (
                (k >= settings.multi_start and any(s.success for s in found)) or self._stopped()
            ):
                break
            found.append(self._given(program) if k == 0 else self._solved(program, self._pushed(k)))
        return self._round(program, min(found, key=lambda s: (not s.success, s.value)))

    def refined(self, first: Round) -> list[Round]:
        """Return the rounds: intervals that are wrong are split until the end is right."""
        rounds, settings = [first], self.settings
        for _ in range(settings.rounds if settings.tolerance is not None else 0):
            last = rounds[-1]
            if not last.solution.success or last.error <= settings.tolerance or self._stopped():
                break
            mesh = self._split(last)
            if mesh.intervals == last.program.mesh.intervals:
                break
            program = self._transcribed(mesh)
            motion = Motion(last.curve.duration, last.curve.at)
            multipliers = carried(last.solution.multipliers, last.program, program)
            rounds.append(self._round(program, self._near(program, motion, multipliers)))
        return rounds

    def plan(self, rounds: list[Round], wall_s: float) -> Plan:
        """Return the plan of the best round."""
        best = min(rounds, key=lambda one: (not one.solution.success, one.error))
        tolerance = self.settings.tolerance
        good = bool(best.solution.success and (tolerance is None or best.error <= tolerance))
        trajectory = sampled(self.model, self.problem, best.curve)
        own = {"rounds": len(rounds), "iterations": self.iterations, "guesses": self.attempts}
        own |= {"stopped": self.stopped}
        own |= self.spent | {"wall_s": wall_s}
        summary = {"success": good} | report(self, best, trajectory) | own
        program = best.program
        return Plan(
            good,
            trajectory,
            summary,
            self.problem,
            best.curve,
            program.mesh,
            self.rule,
            best.solution,
        )

    def _stopped(self) -> bool:
        """Tell, and note why, whether the search should end that is not done."""
        self.stopped = stop_reason()
        return self.stopped is not None

    def _transcribed(self, mesh: Mesh) -> Transcription:
        begun = time.perf_counter()
        program = program_of(self.model, self.problem, mesh, self.rule, self.equations)
        self.spent["derive_s"] += time.perf_counter() - begun
        return program

    def _given(self, program: Transcription) -> Solution:
        """Solve from the user's guess, or from passive flight."""
        guess = self.settings.guess
        if guess is None:
            return self._solved(program, self._pushed(0))
        if not isinstance(guess, Plan):
            return self._solved(
                program, of_trajectory(self.model, guess, self.attitude, self.problem.damping)
            )
        form = (guess.problem.formulation, guess.problem.attitude)
        if form != (self.problem.formulation, self.problem.attitude):
            return self._solved(
                program, of_trajectory(self.model, guess.trajectory, self.attitude), "close"
            )
        multipliers, sizes = guess.solution.multipliers, (program.places.size, program.rows)
        same = tuple(part.size for part in multipliers) == sizes
        return self._near(
            program, Motion(guess.duration, guess.curve.at), multipliers if same else None
        )

    def _near(self, program: Transcription, motion: Motion, multipliers) -> Solution:
        """Solve from a motion that is close to a solution, with multipliers or without; as from
        afar if that fails.
        """
        found = self._solved(
            program, motion, "close" if multipliers is None else "same", multipliers
        )
        return found if found.success or self.stopped else self._solved(program, motion)

    def _pushed(self, k: int) -> Motion:
        """Passive flight; the tail is pushed a little out of a plane of symmetry (k = 0), or about
        at random.
        """
        settings, (least, most) = self.settings, self.problem.duration
        duration = least + (most - least) * (1.0, 0.5, 0.75, 0.25)[k % 4]
        size = float(torque_unit(self.problem).mean()) * (SLIGHT if k == 0 else 1.0)
        push = pushes(np.random.default_rng([settings.seed, k]), size, self.model.nv - 6)
        return passive(
            self.model, self.problem, self.attitude, settings.guess_damping, duration, push
        )

    def _solved(
        self, program: Transcription, motion: Motion, near: str = "far", multipliers=None
    ) -> Solution:
        """Solve from a motion that is far from a solution, close to one, or one of the same
        program.
        """
        begun = time.perf_counter()
        engine = solver(program, self.settings.solver, self.settings.options, near)
        self.spent["derive_s"] += time.perf_counter() - begun
        w = unknowns(motion, program, float(np.clip(motion.duration, *self.problem.duration)))
        angles = motion.at(np.array([motion.duration]))["attitude"][0]
        found = solve(engine, limits(program, self._start_blocks(), angles), w, self.h, multipliers)
        self.spent["solve_cpu_s"] += found.cpu_s
        self.iterations += found.iterations
        self.attempts += 1
        if not found.success:
            self._stopped()
        return found

    def _start_blocks(self) -> dict[str, np.ndarray]:
        q, v = self.start
        blocks = {
            "position": q[:3],
            "attitude": self.attitude.coordinates(q[None])[0],
            "tail": q[7:],
        }
        return blocks | {"velocity": v[:3], "torso_rate": v[3:6], "tail_rate": v[6:]}

    def _round(self, program: Transcription, solution: Solution) -> Round:
        """Return a round: the solution's curve, and its truth."""
        found = curve(program, solution.w, self.h)
        begun = time.perf_counter()
        planned = full_state(
            self.model, self.start, self.attitude, found.ends, found.at(found.ends)
        )
        true = open_loop(self.model, found, self.problem.damping, self.start)
        self.spent["truth_s"] += time.perf_counter() - begun
        return Round(program, solution, found, planned, true)

    def _split(self, last: Round) -> Mesh:
        """Return a finer mesh, by the local errors."""
        begun = time.perf_counter()
        errors = local_errors(self.model, last.curve, self.problem.damping, *last.planned)
        self.spent["truth_s"] += time.perf_counter() - begun
        factor = min(0.3 * self.settings.tolerance / last.error, 0.3)
        return refined(
            last.program.mesh, errors, factor, self.rule.order, self.settings.most_intervals
        )
