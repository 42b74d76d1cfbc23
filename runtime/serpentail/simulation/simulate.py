"""Simulations: a model, states and what acts on them go in; a trajectory, or rollouts of many
states, come out.
"""

import ctypes
import time
from dataclasses import replace

import numpy as np

from ..errors import ModelError, SimulationError, StateError
from ..model.kernel import Rows
from ..model.parameters import RunParameters
from ..motion.trajectory import Trajectory
from .actuation import Drive
from .compiled_run import CompiledRun, Memory, Samples
from .controllers import Controller
from .ground import Ground
from .measured import judged
from .methods import SCIPY, Method, checked_method, chosen
from .records import Records
from .rollouts import Rollouts, flown
from .start import Start


def simulate(
    model,
    q0,
    v0,
    *,
    controller: Controller = None,
    t_span=(0.0, 1.0),
    method: str = "auto",
    **settings,
) -> Trajectory | Rollouts:
    """Simulate a motion: H v_dot + C = [0; tau], the quaternion kept on the unit sphere.

    q0 (nq,), v0 (nv,): start; its quaternion is normalised; (k, nq), (k, nv), or one of both: k
    starts, see below.
    controller: None (no torque), Damping, TorqueTable, TorqueCurve, Pfl, Phases of these,
    NativeTorque, or a function
    (t (s), q, v) -> tau (2m,) in N m.
    legs, bristles0, stop_at (models with contacts): Legs, where there are feet; stretch (points, 2)
    of the friction
    springs in m, zero by default; events to stop at, pairs such as ("take_off", "feet").
    t_span: (start, end) in s, or the end alone.
    method: "tsit5", "ros34pw2" (adaptive, in C), "rk4", "implicit_euler" (steps of a fixed length,
    in C),
    "dop853", "lsoda" (SciPy's, as a check), or "auto", whose choice and reason ``info`` tells.
    settings: output_step (s, default 1/200 of the span, rounded to divide it); adaptive methods:
    rtol, atol (defaults
    1e-8, 1e-4 for ros34pw2), first_step, least_step, most_step (s), most_steps; fixed steps: step
    (s, default 1e-4,
    shortened to divide output_step); SciPy's: rtol, atol (defaults 1e-10, 1e-12; 1e-6 both for a
    float model).
    Raises StateError (shapes, values), SimulationError (settings; the state left what numbers can
    hold; its
    ``trajectory`` is the motion up to there), ModelError (the scene left out rollout, energy or
    momentum).

    Many starts give Rollouts, which keep the SimulationErrors of single runs: the other runs go on.
    One method is
    chosen for all.  parameters: name -> (k,) or (k, 3), SI, what the runs have of their own;
    bristles0 may be
    (k, points, 2).  Runs are shared among all cores, so a NativeTorque must bear calls from several
    threads at once.
    Flights by "rk4" whose torques are None, Damping, a TorqueTable or a TorqueCurve fly as lanes of
    vectors where they
    take 1e6 steps or more in all: several times as fast, other last digits.  With a function of
    Python, or SciPy's
    methods, runs are made one after another in the calling thread, and what the function raises,
    unless it is a
    SimulationError, ends all.
    """
    missing = [name for name in ("rollout", "energy", "momentum") if name not in model.generated]
    if missing:
        raise model.without(*missing)
    start = Start.checked(model, (q0, v0), t_span, settings.pop("output_step", None))
    memory, drive, choice = prepared(model, start, controller, method, settings)
    begun = time.perf_counter(), time.process_time()
    found = (flown if start.many else integrate)(memory, drive, choice)
    spent = {
        "seconds": time.perf_counter() - begun[0],
        "cpu_seconds": time.process_time() - begun[1],
    }
    if start.many:
        return found.rollouts(spent)
    return judged(model, replace(found, info=found.info | choice.told | spent), memory.ground)


def end_state(
    model, q0, v0, *, controller: Controller, duration: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) where simulate's "rk4" ends after a duration (s), and measure nothing
    on the way.
    """
    start = Start.checked(model, (q0, v0), duration, duration)
    found = integrate(*prepared(model, start, controller, "rk4", {"step": step}))
    if found.failure is not None:
        raise found.failure
    return found.q[-1], found.v[-1]


def prepared(
    model, start: Start, controller: Controller, method, settings: dict
) -> tuple[Memory, Drive, Method]:
    """Return what runs need to go; SimulationError or ModelError where a setting is wrong."""
    changes = settings.pop("parameters", None)
    if changes is not None and not start.many:
        raise ModelError(
            "parameters: one start only: give q0 or v0 a row a run, or use model.with_parameters"
        )
    parameters = model.parameters_of_runs(changes, start.runs)
    ground = Ground.checked(model, start, parameters, settings)
    drive = Drive(Records(model), controller, ground.legs.curve if ground.legs else None)
    choice = choose(drive, start, parameters, method, settings)
    return Memory(drive.records, start, ground, parameters), drive, choice


def choose(drive: Drive, start: Start, parameters: RunParameters, name, settings: dict) -> Method:
    """Return the method that was asked for, or a choice and its reason."""
    model, single = drive.model, drive.records.real is ctypes.c_float
    available, reason = model.manifest["simulation"]["methods"], "asked for"
    if isinstance(name, str) and name == "auto":
        decay = None if model.contacts else fastest_decay(drive, start, parameters)
        name, reason = chosen(settings, available, decay)
    method = checked_method(name, settings, available, single)
    for each in ("step", "most_step"):
        refuse_vanishing(start, each, method.settings.get(each, np.inf))
    if name == "rk4":  # steps divide the output's
        steps = max(1, int(np.ceil(start.interval / method.settings["step"] * (1 - 1e-12))))
        return replace(method, reason=reason, settings={"step": start.interval / steps})
    return replace(method, reason=reason)


def refuse_vanishing(start: Start, name: str, step: float) -> None:
    """SimulationError where steps of at most this length (s) are too short to be seen in the
    time.
    """
    least = np.finfo(float).eps * max(abs(start.start), abs(start.end))
    if step < least:
        raise SimulationError(
            f"{name} {step:.3g}: too short to move the time: give {least:.2g} s or more"
        )


def fastest_decay(drive: Drive, start: Start, parameters: RunParameters) -> float:
    """Largest eigenvalue (1/s) of K (H^-1)_tt at the starts, K being joint damping; unit torques
    give H^-1.
    """
    damping = np.max(
        [p.damping if p.damping is not None else np.zeros(drive.nt) for p in drive.parts], axis=0
    )
    if not damping.any():
        return 0.0
    kernel, shape = drive.model.kernel("forward_dynamics"), (start.runs, drive.nt + 1)
    q = np.repeat(start.q0[:, None], shape[1], axis=1).astype(kernel.dtype)
    tau = np.tile(np.eye(drive.nt + 1, drive.nt, -1, kernel.dtype), (start.runs, 1, 1))
    v, v_dot = (np.zeros((*shape, drive.model.nv), kernel.dtype) for _ in range(2))
    evaluate = Rows(kernel, parameters.vectors, (q, v, tau), (v_dot,))
    sound = [k for k in range(start.runs) if evaluated(evaluate, k, shape[1])]
    columns = (v_dot[sound, 1:, 6:] - v_dot[sound, :1, 6:]) * np.sqrt(np.outer(damping, damping))
    return float(np.linalg.eigvalsh(columns).max(initial=0.0))


def evaluated(rows: Rows, k: int, count: int) -> bool:
    """Evaluate rows of run k; tell whether it could be done."""
    try:
        rows(k, count)
    except StateError:
        return False
    return True


def integrate(memory: Memory, drive: Drive, method: Method) -> Samples:
    """Return the samples of a single run."""
    run = CompiledRun(memory, drive, method)
    if method.name in SCIPY:
        from .scipy_methods import integrate_by_scipy

        return integrate_by_scipy(run, method)
    return run.samples(run.go())
