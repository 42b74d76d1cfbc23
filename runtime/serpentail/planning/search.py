"""The search for a plan: a first solution, then rounds on finer meshes until the plan is true.

A round is one solved program. Its torques are applied to the model, and intervals in which the
model deviates from the plan are split for the next round.
"""

from collections.abc import Iterator

import numpy as np

from ..model.model import Model
from ..optimal.interrupt import time_left
from ..optimal.mesh import Mesh, refined
from ..optimal.rules import collocation_rule
from ..optimal.solution import Solution
from ..simulation.simulate import spent
from .attempts import Attempts
from .free_variables import chosen, flown
from .problem import PlanningProblem
from .program.build import PlanProgram
from .program.guess import GuessMotion
from .result.curve import curve
from .result.excess import SLACK, exceeded, excess, largest
from .result.full_state import full_state
from .result.plan import Plan, sampled
from .result.report import report
from .result.truth import end_errors, local_errors, open_loop
from .round import Round
from .settings import PlanSettings
from .softening import softening_of

OVERRUN = 0.1  # of a time limit: how far work after the search may exceed it


class Search:
    """What all rounds share, and what they and an earlier search have cost."""

    def __init__(
        self,
        model: Model,
        problem: PlanningProblem,
        settings: PlanSettings,
        before: "Search | None" = None,
    ):
        self.model, self.problem, self.settings = model, problem, settings
        self.rule = collocation_rule(settings.degree)
        self.attempts = Attempts(model, settings, self.rule, before and before.attempts)
        self.softening = softening_of(problem, settings.guess)
        self.solver = settings.first_solver

    @property
    def stopped(self) -> str | None:
        """Why the search was stopped before it was done."""
        return self.attempts.stopped

    def _first(self, mesh: Mesh) -> Round:
        """Return the best solution on a mesh, from all guesses, and more if these fail."""
        settings, program = self.settings, self._program(mesh)
        motion, near = self.attempts.given(self.problem)
        if near == "close":
            solutions = [self.attempts.solved_near(program, motion, self.solver)]
        else:
            solutions = [self.attempts.solved(program, motion, solver=self.solver)]
        for k in range(1, settings.multi_start + settings.retries):
            enough = k >= settings.multi_start and any(entry.success for entry in solutions)
            if enough or self.attempts.is_stopped():
                break
            pushed = self.attempts.pushed(self.problem, k)
            solutions.append(self.attempts.solved(program, pushed, solver=self.solver))
        if settings.solver == "auto" and not any(entry.success for entry in solutions):
            self._try_ipopt(program, solutions)
        best = min(solutions, key=lambda entry: (not entry.success, entry.value))
        return self._round(program, best)

    def _try_ipopt(self, program: PlanProgram, solutions: list[Solution]) -> None:
        """Add what IPOPT finds from the same guesses, up to its first solution."""
        count = len(solutions)
        for k in range(count):
            if self.attempts.is_stopped():
                return
            motion = self.attempts.given(self.problem)[0]
            if k > 0:
                motion = self.attempts.pushed(self.problem, k)
            solutions.append(self.attempts.solved(program, motion, solver="ipopt"))
            if solutions[-1].success:
                return

    def rounds(self) -> Iterator[Round]:
        """Make rounds on one first mesh after the other until a plan is true."""
        softening = self.softening
        for mesh in self.attempts.meshes():
            self.softening = softening
            for last in self._rounds(mesh):
                yield last
            if self._is_true(last) or self.attempts.is_stopped():
                break

    def _rounds(self, mesh: Mesh) -> Iterator[Round]:
        """Make rounds: intervals that are wrong are split until the end is right."""
        last = self._first(mesh)
        yield last
        for _ in range(self.settings.rounds + len(self.softening) - 1):
            if not last.solution.success or self.attempts.is_stopped():
                break
            mesh = last.program.mesh if self._wrong(last) <= 1 else self._finer(last)
            if mesh.same(last.program.mesh) and len(self.softening) == 1:
                break
            self.softening = self.softening[1:] or self.softening
            program = self._program(mesh)
            motion = GuessMotion(last.curve.duration, last.curve.at, last.start, last.model)
            found = self.attempts.solved_near(program, motion, last.solution.solver)
            last = self._round(program, found)
            yield last

    def _program(self, mesh: Mesh) -> PlanProgram:
        return self.attempts.program(self.problem, mesh, self.softening[0])

    def best(self, rounds: list[Round]) -> Round:
        """Return the round that is solved, whose objective is the one that was asked for, and whose
        end is nearest to the truth.
        """
        return min(
            rounds,
            key=lambda entry: (not entry.solution.success, entry.softening, self._wrong(entry)),
        )

    def _off(self, found: Round) -> float:
        """Return the largest true error relative to its tolerance."""
        allowed = self.settings.allowed
        return max((found.errors[name] / most for name, most in allowed.items()), default=0.0)

    def _wrong(self, found: Round) -> float:
        """Return the larger of ``_off`` and the excess over bounds relative to its tolerance."""
        if self.settings.tolerance is None:
            return 0.0
        return max(self._off(found), largest(found.excess)[0] / SLACK)

    def _is_true(self, found: Round) -> bool:
        """Tell whether a round is solved and nothing in it is wrong."""
        return bool(found.solution.success and self._wrong(found) <= 1)

    def plan(self, best: Round, rounds: int, begun: tuple[float, float]) -> Plan:
        """Return the plan of a round; rounds: their number; begun: what ``read_clocks`` gave."""
        success = self._is_true(best)
        trajectory = sampled(best.model, best.problem, best.curve)
        summary = {"success": success} | report(self, best, trajectory)
        summary |= {
            "rounds": rounds,
            "iterations": self.attempts.iterations,
            "guesses": self.attempts.count,
            "stopped": self.stopped,
        }
        taken = spent(begun)
        whole = {"call_cpu_s": taken["cpu_seconds"], "wall_s": taken["seconds"]}
        return Plan(
            success=success,
            trajectory=trajectory,
            report=summary | self.attempts.spent | whole,
            problem=best.problem,
            curve=best.curve,
            mesh=best.program.mesh,
            rule=self.rule,
            solution=best.solution,
            design=chosen(best.problem, best.model),
        )

    def leaves_no_time(self, needed: float) -> bool:
        """Tell, and note, whether work that needs so long (s) would end far beyond the limit."""
        limit = self.settings.time_limit
        if limit is None or needed <= time_left() + OVERRUN * limit:
            return False
        self.attempts.stopped = self.attempts.stopped or "time limit"
        return True

    def _round(self, program: PlanProgram, solution: Solution) -> Round:
        """Return a round: the solution's curve, and its truth."""
        motion = curve(program, solution.samples)
        model, problem = flown(self.model, self.problem, program, solution.samples)
        start = problem.q0, problem.v0
        with self.attempts.timed("truth_s"):
            planned = full_state(model, start, motion.ends, motion.at(motion.ends))
            true = open_loop(model, motion, problem.damping, start)
            errors = end_errors(problem, (planned[0][-1], planned[1][-1]), true)
            beyond = excess(program, motion, solution.samples, start)
        truth = (planned, true, errors, beyond, self.softening[0])
        return Round(model, problem, program, solution, motion, *truth)

    def _finer(self, last: Round) -> Mesh:
        """Return the next mesh: finer where the true motion is wrong, or else where bounds are
        exceeded.
        """
        mesh, off = last.program.mesh, self._off(last)
        most = self.attempts.most_intervals
        if off <= 1:
            far = [exceeded(part) for part in last.excess.values()]
            return mesh.halved(np.any(far, axis=0), most)
        with self.attempts.timed("truth_s"):
            errors = local_errors(last.model, last.curve, self.problem.damping, *last.planned)
        return refined(mesh, errors, min(0.3 / off, 0.3), self.rule.order, most)
