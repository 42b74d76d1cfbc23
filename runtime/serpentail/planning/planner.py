"""Planning: a model, a start and a goal go in; a plan comes out, refined until it is true."""

import time
from dataclasses import fields

import numpy as np

from ..checks import choice, number
from ..errors import PlanningError
from ..motion.trajectory import Trajectory
from .method import Method
from .nlp.interrupt import stoppable
from .nlp.node import dynamics
from .nlp.rules import collocation_rule
from .problem import SETTINGS, Bounds, Goal, PlanningProblem, checked_problem
from .rounds import Run


def plan(model, *, start, goal=None, duration, bounds=None, **settings):
    """Plan a motion of the tail by direct collocation (Sect. 3), and tell what its torques really
    do.

    start: (q0 (nq,), v0 (nv,)).  goal: Goal (default: upright, torso at rest).  duration: s, or
    (least, most) where it
    is free.  bounds: Bounds (default: |tau| <= 0.02 N m).
    The problem: objective "effort" (integral of tau^2 + (smoothing q_t_dot)^2), "energy" (of sum
    |tau q_t_dot|),
    "time", or a function of a point; smoothing (N m s), without which plans whirl a light tail;
    damping (N m s, Eq. 47,
    in addition to the planned torques); path, rows (function of a point, least, most); a point has
    the CasADi blocks
    tail, tail_rate, torso_rate, torque, attitude, quaternion in SI; formulation "airborne" (angular
    momentum conserved
    by construction), "translation-free", "full"; attitude "quaternion", "euler".
    The method: rule "radau" (default), "lobatto", "hermite-simpson", "trapezoidal"; degree;
    intervals; tolerance (deg)
    of the true attitude at the end, None for no demand; rounds of refinement; most_intervals;
    solver, options of
    ``casadi.nlpsol``; guess: a Plan or a Trajectory (default: passive flight); guess_damping (N m
    s); multi_start:
    guesses solved, the best is kept; retries: more guesses after failures; seed; dynamics "auto",
    "compiled",
    "symbolic"; time_limit (s) of the search; track: simulate with PFL, too.
    Programs and solvers are kept: planning again on a plan's mesh, from another start, derives
    nothing.  Ctrl-C ends
    the search, as the time limit does, and the best so far is returned; a second one raises
    KeyboardInterrupt.
    Returns a Plan; look at its ``success`` and ``report``.  Raises PlanningError (a field, its
    value, the remedy),
    ModelError (the scene lacks functions).
    """
    problem, method = _checked(model, start, goal, duration, bounds, settings)
    missing = [
        name
        for name in ("mass_matrix", "inverse_dynamics", "rollout")
        if name not in model.manifest["work"]
    ]
    if missing:
        raise model.without(*missing)
    begun = time.perf_counter()
    scheme = collocation_rule(method.rule, method.degree)
    equations = dynamics(model, method.dynamics)
    run = Run(model, problem, method, equations, scheme)
    with stoppable(method.time_limit):
        rounds = run.refined(run.first())
    return run.plan(rounds, time.perf_counter() - begun)


def _checked(model, start, goal, duration, bounds, settings) -> tuple[PlanningProblem, Method]:
    known = (*SETTINGS, *(entry.name for entry in fields(Method)))
    for name in settings:
        choice("setting", name, known)
    own = {name: value for name, value in settings.items() if name in SETTINGS}
    goal, bounds = Goal() if goal is None else goal, Bounds() if bounds is None else bounds
    problem = checked_problem(model, start, goal, duration, bounds, **own)
    method = Method(**{name: value for name, value in settings.items() if name not in SETTINGS})
    for name, least in (
        ("intervals", 1),
        ("rounds", 0),
        ("most_intervals", 1),
        ("multi_start", 1),
        ("retries", 0),
    ):
        value = getattr(method, name)
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise PlanningError(f"{name}: value {value!r}: needs a whole number from {least}")
    for name in ("tolerance", "time_limit"):
        if getattr(method, name) is not None:
            number(name, getattr(method, name))
    if not isinstance(method.options, dict):
        raise PlanningError(
            f"options: value {method.options!r}: needs a dict, such as {{'ipopt.max_iter': 500}}"
        )
    _check_guess(model, method.guess)
    number("guess_damping", method.guess_damping, above=False)
    choice("dynamics", method.dynamics, ("auto", "compiled", "symbolic"))
    return problem, method


def _check_guess(model, guess) -> None:
    """PlanningError unless a guess is None, or a motion of such a model."""
    if guess is None:
        return
    motion = getattr(guess, "trajectory", guess)
    if not isinstance(motion, Trajectory):
        raise PlanningError(f"guess: value {guess!r}: needs a Plan or a Trajectory")
    if motion.q.shape[1] != model.nq or len(motion.t) < 2:
        raise PlanningError(
            f"guess: q has shape {motion.q.shape}: needs at least two samples of {model.nq}"
        )
