"""Prepares runs: checks their settings, and chooses the method of "auto"."""

import ctypes
import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from serpentail_scene.messages import nearest

from ..basics.checks import none_of, number, shown
from ..basics.errors import ModelError, SimulationError, StateError
from ..model.chains import of_all_coordinates
from ..model.kernel import RunKernel
from ..model.model import Model
from ..model.parameters import RunParameters, Values
from .controllers.actuation import RunActuations
from .controllers.controller import Controller
from .ground import GroundSettings
from .methods import (
    FIXED,
    LONG,
    SCIPY,
    IntegrationMethod,
    checked_method,
    chosen,
    default_rtol,
    usual_most_steps,
)
from .records import Records
from .runs.single import RunSet
from .settings import RunSettings
from .start import EPS, MOST_STEPS, Start, refuse_endless

# what others call settings of ours, and what these are
T_SPAN = dict.fromkeys(("duration", "t_end", "tf", "span", "T", "time"), "the duration is t_span=")
ELSEWHERE = T_SPAN | {
    "dt": "samples are output_step= apart, steps of rk4 and implicit_euler are step= long",
    "t_eval": "samples are output_step= apart; motion.at(times) gives the states at any times",
}


def prepared(
    model: Model, start: Start, controller: Controller, method: str, settings: dict[str, Any]
) -> RunSet:
    """Return the runs to make; SimulationError or ModelError if a setting is wrong."""
    changes = settings.pop("parameters", None)
    if changes is not None and not start.many:
        raise ModelError(
            "parameters: one start only: give q0 or v0 one row for each run, or use "
            "model.with_parameters"
        )
    parameters = model.parameters_of_runs(changes, start.runs)
    ground = GroundSettings.checked(model, start, parameters, settings)
    actuations = RunActuations(Records(model), controller, start, ground)
    choice = choose(actuations, start, parameters, method, settings)
    landing = ground.legs is not None and ground.legs.landing is not None
    if choice.name in SCIPY and (ground.stop_at or landing):
        raise SimulationError(
            f"{'stop_at' if ground.stop_at else 'legs: a move at touch_down'}: {choice.name} does "
            "not detect events: use tsit5 or ros34pw2"
        )
    return RunSet(actuations, start, ground, parameters, choice)


def choose(
    actuations: RunActuations,
    start: Start,
    parameters: RunParameters,
    name: str,
    settings: dict[str, Any],
) -> IntegrationMethod:
    """Return the method that was asked for, or the choice of "auto" with its reason."""
    model, single = actuations.model, actuations.records.real is ctypes.c_float
    available, reason = model.manifest["simulation"]["methods"], "asked for"
    if isinstance(name, str) and name == "auto":
        decay, drifts = 0.0, "dp8" in available and long_and_free(actuations, start, parameters)
        if "step" not in settings:
            usual = "switching" if "switching" in available else "dp8" if drifts else "tsit5"
            rtol = settings.get("rtol", default_rtol(usual, single))
            settings["rtol"] = number("rtol", rtol, SimulationError, above=0)
            decay = fastest_decay(actuations, start, parameters)
        name, reason = chosen(settings, available, decay, place_of(model), drifts)
    refuse_misplaced(model, settings)
    span = start.end - start.start
    method = checked_method(name, settings, available, single)
    if name not in FIXED:
        most: dict[str, float] = {"most_steps": usual_most_steps(span)}
        method = replace(method, settings=most | method.settings)
    most_steps = method.settings.get("most_steps", MOST_STEPS)
    for each in ("step", "most_step"):
        length = method.settings.get(each, np.inf)
        refuse_vanishing(start, each, length)
        refuse_endless(each, length, span, most_steps)
    if name == "rk4":  # steps divide the output's
        steps = max(
            1, math.ceil((start.interval - 1e-12 * start.interval) / method.settings["step"])
        )
        return replace(method, reason=reason, settings={"step": start.interval / steps})
    return replace(method, reason=reason)


def long_and_free(actuations: RunActuations, start: Start, parameters: RunParameters) -> bool:
    """Tell whether it is a single long run in which neither damping nor torques act."""
    long = not start.many and start.end - start.start >= LONG
    values = of_all_coordinates(actuations.model.layout, parameters.values)
    if not long or np.any(values.get("tail_damping", 0.0)):
        return False
    return not any(each.acts for each in actuations.distinct)


def place_of(model: Model) -> str:
    """Return where runs of a model take place, in the words of ``chosen``."""
    return "ground" if model.contacts else "fixed base" if model.fixed else "flight"


def refuse_misplaced(model: Model, settings: dict[str, Any]) -> None:
    """SimulationError about a setting that belongs elsewhere, or is misspelt."""
    for key, value in settings.items():
        if key in model.parameters:
            given = f"model.with_parameters({key}={shown(value)})"
            raise SimulationError(f"{key}: is a parameter of the model: simulate {given}")
        if key in ELSEWHERE:
            given = shown(value) if key in T_SPAN else ""
            raise SimulationError(f"{key}: is no setting: {ELSEWHERE[key]}{given}")
        if key not in RunSettings.__annotations__ and nearest(key, RunSettings.__annotations__):
            raise SimulationError(none_of("setting", key, RunSettings.__annotations__))


def refuse_vanishing(start: Start, name: str, step: float) -> None:
    """SimulationError if steps of this length (s) are too short to advance the time."""
    least = EPS * max(abs(start.start), abs(start.end))
    if step < least:
        raise SimulationError(
            f"{name} {step:.3g}: too short to move the time: give {least:.2g} s or more"
        )


def fastest_decay(actuations: RunActuations, start: Start, parameters: RunParameters) -> float:
    """Return the fastest decay (1/s) of tails at the starts; 0 without damping.

    It is the largest eigenvalue of K (H^-1)_tt with the joint damping K; with springs, that of both
    together whose real part is least. Oscillations do not count, however fast: whoever wants their
    motion needs steps that resolve them. Starts without accelerations do not count, either.
    """
    model, runs, nt = actuations.model, start.runs, actuations.model.layout.nt
    parts = [parts for each in actuations.distinct for parts in each.parts]
    laws = [each.damping for each in parts if each.damping is not None]
    # tracking compensates the passive tail's own torques
    tracked = bool(parts) and all(each.pfl is not None for each in parts)
    values = {} if tracked else of_all_coordinates(model.layout, parameters.values)
    damping = of_tail(values, "tail_damping", (runs, nt)) + (np.max(laws, axis=0) if laws else 0.0)
    if not damping.any() or "forward_dynamics" not in model.generated:
        return 0.0
    # accelerations without torque and with unit torques: the differences are columns of H^-1
    kernel, columns = model.kernel("forward_dynamics"), nt + 1
    tau = np.tile(np.eye(columns, nt, -1, kernel.dtype), (runs, 1, 1))
    q, v, v_dot = (np.zeros((runs, columns, n), kernel.dtype) for n in (model.nq, *2 * [model.nv]))
    q[...] = start.q0[:, None]
    inputs = [q, v, tau]
    if model.layout.given:  # straight, which is near enough
        inputs.append(np.zeros((runs, columns, 3, model.layout.given), kernel.dtype))
    evaluate = RunKernel(kernel, parameters.vectors, inputs, (v_dot,))
    sound = []
    for k in range(runs):
        with suppress(StateError):
            evaluate(k, columns)
            sound.append(k)
    tail = v_dot[sound, :, model.layout.tail_v].astype(float)
    mobility, damping = tail[:, 1:] - tail[:, :1], damping[sound]
    stiffness = of_tail(values, "tail_stiffness", (runs, nt))
    if stiffness.any():
        return fastest(mobility, stiffness[sound], damping)
    root = np.sqrt(damping)
    symmetric = mobility * root[:, :, None] * root[:, None, :]
    return float(np.linalg.eigvalsh(symmetric).max(initial=0.0))


def of_tail(values: Values, name: str, shape: tuple[int, int]) -> np.ndarray:
    """Return a parameter of the passive tail in each run (runs, 2m); zeros without one."""
    if name not in values:
        return np.zeros(shape)
    return np.broadcast_to(np.asarray(values[name], float), shape)


def fastest(mobility: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> float:
    """Return the fastest decay (1/s) of q_ddot = -mobility (stiffness q + damping q_dot), mobility
    (runs, n, n).
    """
    n = mobility.shape[-1]
    rates = np.zeros((len(mobility), 2 * n, 2 * n))
    rates[:, :n, n:] = np.eye(n)
    rates[:, n:, :n] = -mobility * stiffness[:, None, :]
    rates[:, n:, n:] = -mobility * damping[:, None, :]
    return float(-np.linalg.eigvals(rates).real.min(initial=0.0))
