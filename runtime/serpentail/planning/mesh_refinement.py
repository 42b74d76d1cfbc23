"""The search for a plan: a first solution, then rounds on finer meshes until the plan is true.

A round is one solved program. Its torques are applied to the model, and intervals in which the
model deviates from the plan are split for the next round.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..model.model import Model
from ..simulation.simulate import spent
from .backends import Begin, way_of
from .free_variables import chosen, flown, guessed
from .nlp.coordinates import attitude
from .nlp.equations import Equations
from .nlp.guess import GuessMotion, of_trajectory, passive, pushes, unknowns
from .nlp.interrupt import stop_reason, time_left
from .nlp.mesh import Mesh, refined
from .nlp.multipliers import Multipliers
from .nlp.program import NonlinearProgram
from .nlp.rules import collocation_rule
from .nlp.solver import Solution
from .nlp.transcription import torque_unit
from .problem import PlanningProblem
from .result.curve import curve
from .result.excess import SLACK, exceeded, excess, largest
from .result.full_state import com_at_start, full_state
from .result.plan import Plan, sampled
from .result.report import report
from .result.truth import end_errors, local_errors, open_loop
from .round import Round
from .settings import PlanSettings
from .softening import softening_of

FIRST_PUSH = 0.05  # of the torques' unit: takes the first guess out of a plane of symmetry
DURATIONS = (1.0, 0.5, 0.75, 0.25)  # of guesses, in turn, from the least (0) to the most (1)
OVERRUN = 0.1  # of a time limit: how far work after the search may exceed it


class Search:
    """What all rounds share, and what they and an earlier search have cost."""

    def __init__(
        self,
        model: Model,
        problem: PlanningProblem,
        settings: PlanSettings,
        equations: Equations,
        before: "Search | None" = None,
    ):
        self.model, self.problem, self.settings = model, problem, settings
        self.equations, self.rule = equations, collocation_rule(settings.rule, settings.degree)
        start = (problem.q0, problem.v0)
        momentum, com = model.momentum(*start)[1], com_at_start(model, start)
        self.conserved = np.concatenate([momentum, *com])
        self.way = way_of(self)
        self.softening = softening_of(problem, settings.guess)
        self.attitude = attitude(problem.attitude)
        self.spent = dict.fromkeys(("derive_s", "solve_cpu_s", "truth_s"), 0.0)
        self.iterations = self.attempts = 0
        if before is not None:
            self.spent = dict(before.spent)
            self.iterations, self.attempts = before.iterations, before.attempts
        self.stopped: str | None = None

    @property
    def parameters(self) -> np.ndarray:
        """Parameters of the program."""
        return np.append(self.conserved, self.softening[0])

    def _first_meshes(self) -> tuple[Mesh, ...]:
        """Return the first mesh, and finer ones to begin with if no plan of that becomes true."""
        guess = self.settings.guess
        if isinstance(guess, Plan) and guess.rule is self.rule:
            return (guess.mesh,)
        return self.way.meshes(self)

    def _first(self, mesh: Mesh) -> Round:
        """Return the best solution on a mesh, from all guesses, and more if these fail."""
        settings, nlp = self.settings, self._transcribed(mesh)
        solutions = [self._solved_given(nlp)]
        for k in range(1, settings.multi_start + settings.retries):
            enough = k >= settings.multi_start and any(entry.success for entry in solutions)
            if enough or self._stopped():
                break
            solutions.append(self._solved(nlp, self._pushed(k)))
        return self._round(nlp, min(solutions, key=lambda entry: (not entry.success, entry.value)))

    def rounds(self) -> Iterator[Round]:
        """Make rounds on one first mesh after the other until a plan is true."""
        softening = self.softening
        for mesh in self._first_meshes():
            self.softening = softening
            for last in self._rounds(mesh):
                yield last
            if self._is_true(last) or self._stopped():
                break

    def _rounds(self, mesh: Mesh) -> Iterator[Round]:
        """Make rounds: intervals that are wrong are split until the end is right."""
        last = self._first(mesh)
        yield last
        for _ in range(self.settings.rounds + len(self.softening) - 1):
            if not last.solution.success or self._stopped():
                break
            mesh = last.nlp.mesh if self._wrong(last) <= 1 else self._finer(last)
            if mesh.same(last.nlp.mesh) and len(self.softening) == 1:
                break
            self.softening = self.softening[1:] or self.softening
            nlp = self._transcribed(mesh)
            motion = GuessMotion(
                last.curve.duration, last.curve.at, last.start, last.model.parameters
            )
            multipliers = self.way.carried(last.solution.multipliers, last.nlp, nlp)
            last = self._round(nlp, self._solved_near(nlp, motion, multipliers))
            yield last

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
            "iterations": self.iterations,
            "guesses": self.attempts,
            "stopped": self.stopped,
        }
        taken = spent(begun)
        whole = {"call_cpu_s": taken["cpu_seconds"], "wall_s": taken["seconds"]}
        return Plan(
            success=success,
            trajectory=trajectory,
            report=summary | self.spent | whole,
            problem=best.problem,
            curve=best.curve,
            mesh=best.nlp.mesh,
            rule=self.rule,
            solution=best.solution,
            design=chosen(best.problem, best.model),
        )

    def leaves_no_time(self, needed: float) -> bool:
        """Tell, and note, whether work that needs so long (s) would end far beyond the limit."""
        limit = self.settings.time_limit
        if limit is None or needed <= time_left() + OVERRUN * limit:
            return False
        self.stopped = self.stopped or "time limit"
        return True

    def _stopped(self) -> bool:
        """Tell, and note why, whether the search should end that is not done."""
        self.stopped = stop_reason()
        return self.stopped is not None

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        """Add the time of a part of the work to what was spent on it."""
        begun = time.perf_counter()
        yield
        self.spent[name] += time.perf_counter() - begun

    def _transcribed(self, mesh: Mesh) -> NonlinearProgram:
        with self._timed("derive_s"):
            return self.way.program(self, mesh)

    def _solved_given(self, nlp: NonlinearProgram) -> Solution:
        """Solve from the user's guess, or from passive flight."""
        guess = self.settings.guess
        if guess is None:
            return self._solved(nlp, self._pushed(0))
        if not isinstance(guess, Plan):
            motion = of_trajectory(self.model, guess, self.attitude, self.problem.damping)
            return self._solved(nlp, motion)

        # a plan in other variables is a motion, too
        variables = (guess.problem.formulation, guess.problem.attitude)
        if variables != (self.problem.formulation, self.problem.attitude):
            model = self.model._varied(guess.design)
            motion = of_trajectory(model, guess.trajectory, self.attitude)
            return self._solved(nlp, motion, "close")

        # a plan of the same size has multipliers for this one
        multipliers = guess.solution.multipliers
        same_size = [part.size for part in multipliers] == [nlp.indices.size, nlp.rows]
        parameters = {**self.model.parameters, **guess.design}
        motion = GuessMotion(guess.duration, guess.curve.at, guess.start, parameters)
        return self._solved_near(nlp, motion, multipliers if same_size else None)

    def _solved_near(
        self, nlp: NonlinearProgram, motion: GuessMotion, multipliers: Multipliers | None
    ) -> Solution:
        """Solve from a motion that is close to a solution; as from afar if that fails."""
        guess = "close" if multipliers is None else "warm"
        solution = self._solved(nlp, motion, guess, multipliers)
        return solution if solution.success or self.stopped else self._solved(nlp, motion)

    def _pushed(self, k: int) -> GuessMotion:
        """Passive flight; the tail is pushed a little for k = 0, or about at random."""
        settings, (least, most) = self.settings, self.problem.duration
        duration = least + (most - least) * DURATIONS[k % len(DURATIONS)]
        size = float(torque_unit(self.problem).mean()) * (FIRST_PUSH if k == 0 else 1.0)
        random = np.random.default_rng([settings.seed, k])
        push = pushes(random, size, self.model)
        own = guessed(self.model, self.problem, random if k else None)
        return passive(*own, settings.guess_damping, duration, push)

    def _solved(
        self,
        nlp: NonlinearProgram,
        motion: GuessMotion,
        guess: str = "far",
        multipliers: Multipliers | None = None,
    ) -> Solution:
        """Solve from a motion that is far from a solution, close to one, or has multipliers."""
        with self._timed("derive_s"):
            engine = self.way.engine(self, nlp, guess)
        w = unknowns(motion, nlp, float(np.clip(motion.duration, *self.problem.duration)))
        angles = motion.at(np.array([motion.duration]))["attitude"][0]
        solution = self.way.solved(self, nlp, engine, Begin(w, guess, angles, multipliers))
        self.spent["solve_cpu_s"] += solution.cpu_s
        self.iterations += solution.iterations
        self.attempts += 1
        if not solution.success:
            self._stopped()
        return solution

    def _round(self, nlp: NonlinearProgram, solution: Solution) -> Round:
        """Return a round: the solution's curve, and its truth."""
        motion = curve(nlp, solution.w, self.parameters)
        model, problem = flown(self.model, self.problem, nlp, solution.w)
        start = problem.q0, problem.v0
        with self._timed("truth_s"):
            blocks = motion.at(motion.ends)
            planned = full_state(model, start, self.attitude, motion.ends, blocks)
            true = open_loop(model, motion, problem.damping, start)
            errors = end_errors(problem, (planned[0][-1], planned[1][-1]), true)
            beyond = excess(nlp, motion, self.parameters, solution.w)
        truth = (planned, true, errors, beyond, self.softening[0])
        return Round(model, problem, nlp, solution, motion, *truth)

    def _finer(self, last: Round) -> Mesh:
        """Return the next mesh.

        It has guards where torques exceed bounds. It is finer where the true motion is wrong, or
        else where other bounds are exceeded.
        """
        mesh, off = last.nlp.mesh, self._off(last)
        most = self.settings.most_intervals or self.way.most
        far = {name: exceeded(part) for name, part in last.excess.items()}
        no_interval = np.zeros(mesh.intervals, bool)
        mesh = mesh.with_guards(far.pop("torque", no_interval))
        if off <= 1:
            return mesh.halved(np.any([no_interval, *far.values()], axis=0), most)
        with self._timed("truth_s"):
            errors = local_errors(last.model, last.curve, self.problem.damping, *last.planned)
        return refined(mesh, errors, min(0.3 / off, 0.3), self.rule.order, most)
