"""The search for a plan: a first solution, then rounds on finer meshes until the plan is true.

A round is one solved program. Its torques are applied to the model, and intervals in which the
model deviates from the plan are split for the next round.
"""

from collections.abc import Iterator

import numpy as np

from ..model.model import Model
from ..optimal.interrupt import time_left
from ..optimal.mesh import TimeMesh, refined
from ..optimal.rules import collocation_rule
from ..optimal.solution import Solution
from ..optimal.violation import violation
from ..simulation.simulate import spent
from .attempts import Attempts
from .continuation import Led, led
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

LARGER_BOUND = "Solved_With_Larger_Bound"  # the status of a plan that explains a failed search
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
        self.rule = collocation_rule(settings.mesh.degree)
        spent_before = None if before is None else before.attempts
        self.attempts: Attempts = Attempts(model, settings, self.rule, spent_before)
        self.softening = softening_of(problem, settings.guess.motion)
        self.solver = settings.first_solver
        self.led: Led | None = None
        self.advice: str | None = None

    @property
    def stopped(self) -> str | None:
        """Why the search was stopped before it was done."""
        return self.attempts.stopped

    def _first(self, mesh: TimeMesh) -> Round:
        """Return the best solution on a mesh: from the guesses, else by continuation, from the
        nearest stored plan, from more guesses, or by IPOPT.
        """
        settings, program, attempts = self.settings, self._program(mesh), self.attempts
        motion, near = attempts.given(self.problem)
        if near == "close":
            solutions = [attempts.solved_near(program, motion, self.solver)]
        else:
            quick = settings.solver.retries > 0  # what follows leads further than many iterations
            solutions = [attempts.solved(program, motion, "far", self.solver, quick)]
        for k in range(1, settings.solver.multi_start):
            if attempts.is_stopped():
                break
            solutions.append(self._from_push(program, k))
        if settings.solver.retries and not self._is_done(solutions):
            led_to = self._retried(program, mesh, solutions)
            if led_to is not None:
                return led_to
        best = min(solutions, key=lambda entry: (not entry.success, self._cost(program, entry)))
        return self._round(program, best)

    def _is_done(self, solutions: list[Solution]) -> bool:
        return any(entry.success for entry in solutions) or self.attempts.is_stopped()

    def _cost(self, program: PlanProgram, found: Solution) -> float:
        """Return the objective of a solution; of a failure how much it violates."""
        return found.value if found.success else violation(program.optimal, found.samples)

    def _retried(
        self, program: PlanProgram, mesh: TimeMesh, solutions: list[Solution]
    ) -> Round | None:
        """Try further, and add what is found; return a round where a continuation leads to one."""
        settings, attempts = self.settings, self.attempts
        stored = attempts.nearest(self.problem)
        if stored is not None:
            solutions.append(attempts.solved_near(program, stored, self.solver))
        if self._is_done(solutions):
            return None
        if settings.solver.name == "ipopt":
            self._pushed_on(program, solutions)
            return None
        found = led(attempts, self.problem, mesh, self.softening[0], self.motion)
        if found is not None and found.bracket is None:
            return self._round(found.program, found.solution)
        self.led = found
        self._pushed_on(program, solutions)
        if settings.solver.name == "auto":
            guesses = settings.solver.multi_start + settings.solver.retries
            self._try_ipopt(program, solutions, guesses if found is None else 1)
        return None

    def _pushed_on(self, program: PlanProgram, solutions: list[Solution]) -> None:
        """Add what is found from further guesses, up to a first solution."""
        first = self.settings.solver.multi_start
        for k in range(first, first + self.settings.solver.retries):
            if self._is_done(solutions):
                return
            solutions.append(self._from_push(program, k))

    def _try_ipopt(self, program: PlanProgram, solutions: list[Solution], guesses: int) -> None:
        """Add what IPOPT finds from so many of the same guesses, up to a first solution."""
        for k in range(guesses):
            if self._is_done(solutions):
                return
            motion = self.attempts.given(self.problem)[0]
            if k > 0:
                motion = self.attempts.pushed(self.problem, k)
            solutions.append(self.attempts.solved(program, motion, solver="ipopt"))

    def _from_push(self, program: PlanProgram, k: int) -> Solution:
        return self.attempts.solved(
            program, self.attempts.pushed(self.problem, k), solver=self.solver
        )

    def motion(self, program: PlanProgram, found: Solution) -> GuessMotion:
        """Return the motion of a solution, as a guess."""
        motion = curve(program, found.samples)
        model, problem = flown(self.model, self.problem, program, found.samples)
        start = problem.q0, problem.v0
        return GuessMotion(motion.duration, motion.at, start, model, program.mesh)

    def rounds(self) -> Iterator[Round]:
        """Make rounds on one first mesh after the other until a plan is true, or one has none."""
        softening = self.softening
        for mesh in self.attempts.meshes():
            self.softening = softening
            found = False
            for last in self._rounds(mesh):
                found = found or last.solution.success
                yield last
            if not found or self.is_true(last) or self.attempts.is_stopped():
                break

    def _rounds(self, mesh: TimeMesh) -> Iterator[Round]:
        """Make rounds: intervals that are wrong are split until the end is right."""
        last = self._first(mesh)
        yield last
        for _ in range(self.settings.mesh.rounds + len(self.softening) - 1):
            if not last.solution.success or self.attempts.is_stopped():
                break
            mesh = last.program.mesh if self._wrong(last) <= 1 else self._finer(last)
            if mesh.same(last.program.mesh) and len(self.softening) == 1:
                break
            self.softening = self.softening[1:] or self.softening
            program = self._program(mesh)
            motion = self.motion(last.program, last.solution)
            last = self._round(program, self._solved_on(program, motion, last.solution.solver))
            yield last

    def _solved_on(self, program: PlanProgram, motion: GuessMotion, solver: str) -> Solution:
        """Solve from the motion of the round before; by the other solver if its own fails."""
        found = self.attempts.solved_near(program, motion, solver)
        if found.success or self.settings.solver.name != "auto" or self.attempts.is_stopped():
            return found
        other = "fatrop" if solver == "ipopt" else "ipopt"
        again = self.attempts.solved(program, motion, "close", other, quick=True)
        return again if again.success else found

    def _program(self, mesh: TimeMesh) -> PlanProgram:
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
        if self.settings.tolerances.attitude is None:
            return 0.0
        return max(self._off(found), largest(found.excess)[0] / SLACK)

    def is_true(self, found: Round) -> bool:
        """Tell whether a round is solved and nothing in it is wrong."""
        return bool(found.solution.success and self._wrong(found) <= 1)

    def plan(self, best: Round, rounds: int, begun: tuple[float, float]) -> Plan:
        """Return the plan of a round; rounds: their number; begun: what ``read_clocks`` gave."""
        success = self.is_true(best) and self.advice is None
        trajectory = sampled(best.model, best.problem, best.curve)
        summary = {"success": success} | report(self, best, trajectory)
        summary |= {
            "rounds": rounds,
            "iterations": self.attempts.iterations,
            "guesses": self.attempts.count,
            "stopped": self.stopped,
            "advice": self.advice,
        }
        if self.advice is not None:
            summary |= {"converged": False, "status": LARGER_BOUND}
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
        limit = self.settings.solver.time_limit
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

    def _finer(self, last: Round) -> TimeMesh:
        """Return the next mesh: finer where the true motion is wrong, or else where bounds are
        exceeded.
        """
        mesh, off = last.program.mesh, self._off(last)
        most = self.settings.mesh.most_intervals
        if off <= 1:
            far = [exceeded(part) for part in last.excess.values()]
            return mesh.halved(np.any(far, axis=0), most)
        with self.attempts.timed("truth_s"):
            errors = local_errors(last.model, last.curve, self.problem.damping, *last.planned)
        return refined(mesh, errors, min(0.3 / off, 0.3), self.rule.order, most)
