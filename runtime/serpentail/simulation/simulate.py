"""Simulates a motion, or many of one model at once: `simulate` checks, prepares and runs."""

import ctypes
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ModelError, SimulationError
from ..model.cores import checked_threads
from ..model.model import Model
from ..model.parameters import RunParameters
from ..motion.trajectory import Trajectory
from ..stages import Stage
from .acting import Acting
from .compiled_run import CompiledRun, Memory, Samples
from .controllers import Controller
from .decay import FastestDecay
from .ground import Ground
from .limits import MOST_STEPS, refuse_endless
from .measured import trajectory_or_error
from .methods import SCIPY, IntegrationMethod, checked_method, chosen, step_counts
from .parallel_runs import run_parallel
from .records import Records
from .rollouts import Rollouts
from .start import EPS, Start
from .waiting import asked_for, let_wait, taken
from .watched import Watch, Watched, checked_watch


def simulate(
    model: Model,
    q0: ArrayLike,
    v0: ArrayLike,
    *,
    controller: Controller = None,
    t_span: ArrayLike = (0.0, 1.0),
    method: str = "auto",
    **settings: Any,
) -> Trajectory | Rollouts:
    """Simulate a motion: H v_dot + C = [0; tau], the quaternion kept on the unit sphere; on a fixed
    base H v_dot + C = tau of the tail alone.

    q0 (nq,), v0 (nv,): start; its quaternion is normalised; (k, nq), (k, nv), or one of both: k
    starts, see below.
    controller: None (no torque), Damping, TorqueTable, TorqueCurve, Pfl, Mpc, Phases of these,
    NativeTorque, or a function (t (s), q, v) -> tau (2m,) in N m.
    legs, bristles0, stop_at (models with contacts): Legs, where there are feet; stretch (points, 2)
    of the friction springs in m, zero by default; events to stop at, pairs such as ("take_off",
    "feet").
    t_span: (start, end) in s, or the end alone.
    method: "tsit5", "ros34pw2" (adaptive, in C), "rk4", "implicit_euler" (steps of a fixed length,
    in C), "dop853", "lsoda" (SciPy's, as a check), or "auto", whose choice and reason ``info``
    tells.
    settings: output_step (s, default 1/200 of the span, rounded to divide it); adaptive methods:
    rtol, atol (defaults 1e-8, 1e-4 for ros34pw2), first_step, least_step, most_step (s),
    most_steps; fixed steps: step (s, default 1e-4, shortened to divide output_step); SciPy's: rtol,
    atol (defaults 1e-10, 1e-12; 1e-6 both for a float model).

    watch: a function that is given the samples as they come, at most ten times a second, each once:
    Trajectories that follow on one another, the last at the end.  What it raises ends the run.

    Raises StateError (shapes, values), SimulationError (settings; the state left what numbers can
    hold; its ``trajectory`` is the motion up to there), ModelError (the scene left out rollout,
    energy or momentum).  Ctrl-C raises KeyboardInterrupt, whose ``motion`` is what there was: the
    Trajectory, or Rollouts in which runs without an end have errors.

    Many starts give Rollouts, which keep the SimulationErrors of single runs: the other runs go on.
    One method is chosen for all.  controller may be a list, one of any kind a run; or a TorqueTable
    with torques (k, K, 2m), or a Damping of (k, 2m), one a run.  parameters: name -> (k,) or (k,
    3), SI, what the runs have of their own; bristles0 may be (k, points, 2).  threads: that take up
    the runs; None: the model's, see ``load``.  A NativeTorque must bear calls from several threads
    at once.

    Eight flights or more by "tsit5" or "rk4" whose torques are None, Damping, a TorqueTable or a
    TorqueCurve (for "tsit5" also Phases of these, for "rk4" with kinks at the same times) fly as
    lanes of vectors where the C of that is compiled, or its compilation pays: several times as
    fast, other last digits.

    With a function of Python, or SciPy's methods, runs are made one after another in the calling
    thread, and what the function raises, unless it is a SimulationError, ends all.
    """
    missing = [name for name in ("rollout", "energy", "momentum") if name not in model.generated]
    if missing:
        raise model.without(*missing)
    asked = asked_for(controller, t_span, method, settings)
    run = taken(model, asked, (q0, v0))
    watch = None
    if run is None or not still_chosen(run, method):
        start = Start.checked(model, (q0, v0), t_span, settings.pop("output_step", None))
        watch = checked_watch(settings.pop("watch", None), start.many)
        threads = _threads(model, start, settings.pop("threads", None))
        parts = prepared(model, start, controller, method, settings)
        if start.many:
            clocks = read_clocks()
            return run_parallel(*parts, threads).rollouts(spent(clocks))
        run = CompiledRun(*parts)
    clocks = read_clocks()
    samples = integrate(run, watch)
    info = samples.info | run.method.info | spent(clocks)
    motion = trajectory_or_error(model, replace(samples, info=info), run.ground)
    let_wait(model, asked, run)
    return motion


def _threads(model: Model, start: Start, asked: int | None) -> int | None:
    """Return how many threads many runs may take up, as asked here, or else of the model."""
    if asked is None:
        return model.batch_library.threads
    if not start.many:
        raise SimulationError(
            f"threads: value {asked!r:.60}: one start only, which takes one: leave it out, or give "
            "q0 or v0 a row a run"
        )
    return checked_threads("threads", asked, SimulationError)


def read_clocks() -> tuple[float, float]:
    """Return wall and processor time (s)."""
    return time.perf_counter(), time.process_time()


def spent(clocks: tuple[float, float]) -> dict[str, float]:
    """Return the times (s) that passed since clocks were read."""
    seconds, cpu_seconds = time.perf_counter() - clocks[0], time.process_time() - clocks[1]
    return {"seconds": seconds, "cpu_seconds": cpu_seconds}


def end_state(
    model: Model,
    q0: ArrayLike,
    v0: ArrayLike,
    *,
    controller: Controller,
    duration: float,
    step: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) where "rk4" ends after a duration (s), with nothing measured."""
    start = Start.checked(model, (q0, v0), duration, duration)
    samples = integrate(CompiledRun(*prepared(model, start, controller, "rk4", {"step": step})))
    if samples.failure is not None:
        raise samples.failure
    return samples.q[-1], samples.v[-1]


def prepared(
    model: Model, start: Start, controller: Controller, method: str, settings: dict[str, Any]
) -> tuple[Memory, Acting, IntegrationMethod]:
    """Return what runs need to go; SimulationError or ModelError where a setting is wrong."""
    changes = settings.pop("parameters", None)
    if changes is not None and not start.many:
        raise ModelError(
            "parameters: one start only: give q0 or v0 a row a run, or use model.with_parameters"
        )
    parameters = model.parameters_of_runs(changes, start.runs)
    start.refuse_behind_stops(parameters.values)
    ground = Ground.checked(model, start, parameters, settings)
    acting = Acting(Records(model), controller, start, ground.legs.curve if ground.legs else None)
    choice = choose(acting, start, parameters, method, settings)
    if ground.stop_at and choice.name in SCIPY:
        raise SimulationError(
            f"stop_at: {choice.name} does not look for events: take tsit5 or ros34pw2"
        )
    return Memory(acting.records, start, ground, parameters), acting, choice


def choose(
    acting: Acting,
    start: Start,
    parameters: RunParameters,
    name: str,
    settings: dict[str, Any],
) -> IntegrationMethod:
    """Return the method that was asked for, or a choice and its reason."""
    model, single = acting.model, acting.records.real is ctypes.c_float
    available, reason = model.manifest["simulation"]["methods"], "asked for"
    if isinstance(name, str) and name == "auto":
        decay = None
        if not model.contacts:
            decay = FastestDecay(acting, start.runs, parameters)(start.q0)
        name, reason = chosen(settings, available, decay)
    method = checked_method(name, settings, available, single)
    span, most_steps = start.end - start.start, method.settings.get("most_steps", MOST_STEPS)
    for each in ("step", "most_step"):
        length = method.settings.get(each, np.inf)
        refuse_vanishing(start, each, length)
        refuse_endless(each, length, span, most_steps)
    if name == "rk4":  # steps divide the output's
        interval = np.array([start.interval])
        steps = step_counts(interval, 1e-12 * interval, method.settings["step"])
        return replace(method, reason=reason, settings={"step": start.interval / int(steps[0])})
    return replace(method, reason=reason)


def still_chosen(run: CompiledRun, name: str) -> bool:
    """Tell whether a run from a new start has the method that is asked for, and note why."""
    if name != "auto" or run.ground.points:  # on the ground "auto" asks for no start
        return True
    method, available = run.method, run.model.manifest["simulation"]["methods"]
    name, reason = chosen(method.settings, available, run.decay(run.memory.state["q"]))
    run.method = replace(method, reason=reason)
    return name == method.name


def refuse_vanishing(start: Start, name: str, step: float) -> None:
    """SimulationError where steps of at most this length (s) are too short to move the time."""
    least = EPS * max(abs(start.start), abs(start.end))
    if step < least:
        raise SimulationError(
            f"{name} {step:.3g}: too short to move the time: give {least:.2g} s or more"
        )


def integrate(run: CompiledRun, watch: Watch | None = None) -> Samples:
    """Return the samples of a single run, of which a function is told meanwhile."""
    method = run.method
    watched = None if watch is None else Watched(watch, run.model, run.ground)
    with Stage("simulate", run.model.name) as stage:
        if method.name in SCIPY:
            from .scipy_methods import integrate_by_scipy

            samples = integrate_by_scipy(run, method, watched)
        else:
            samples = run.samples(run.go(look=partial(_look, run, stage, watched)))
    if watched is not None:
        watched.end(samples)
    return samples


def _look(run: CompiledRun, stage: Stage, watched: Watched | None) -> None:
    """Let a run in C be looked at."""
    done = run.record.done
    stage.tell(done / len(run.start.times))
    if watched is not None:
        watched.look(done, lambda first: run.memory.part(run.k, first, done))
