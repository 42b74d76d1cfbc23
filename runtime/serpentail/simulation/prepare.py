"""Prepares runs: checks their settings, and chooses the method of "auto"."""

import ctypes
from dataclasses import replace
from typing import Any

import numpy as np

from ..basics.checks import number, shown
from ..basics.errors import ModelError, SimulationError
from ..model.model import Model
from ..model.parameters import RunParameters
from .acting import Acting
from .runs.single import CompiledRun, Memory
from .controllers.controller import Controller
from .decay import FastestDecay
from .ground import Ground
from .limits import MOST_STEPS, refuse_endless
from .methods import (
    ADAPTIVE,
    SCIPY,
    IntegrationMethod,
    checked_method,
    chosen,
    default_rtol,
    step_counts,
    usual_most_steps,
)
from .records import Records
from .start import EPS, Start

DURATIONS = ("duration", "t_end", "tf", "span", "T", "time")  # what others call t_span


def prepared(
    model: Model, start: Start, controller: Controller, method: str, settings: dict[str, Any]
) -> tuple[Memory, Acting, IntegrationMethod]:
    """Return what runs need; SimulationError or ModelError if a setting is wrong."""
    changes = settings.pop("parameters", None)
    if changes is not None and not start.many:
        raise ModelError(
            "parameters: one start only: give q0 or v0 one row for each run, or use "
            "model.with_parameters"
        )
    parameters = model.parameters_of_runs(changes, start.runs)
    ground = Ground.checked(model, start, parameters, settings)
    acting = Acting(Records(model), controller, start, ground.legs.curve if ground.legs else None)
    choice = choose(acting, start, parameters, method, settings)
    if ground.stop_at and choice.name in SCIPY:
        raise SimulationError(
            f"stop_at: {choice.name} does not detect events: use tsit5 or ros34pw2"
        )
    return Memory(acting.records, start, ground, parameters), acting, choice


def choose(
    acting: Acting,
    start: Start,
    parameters: RunParameters,
    name: str,
    settings: dict[str, Any],
) -> IntegrationMethod:
    """Return the method that was asked for, or the choice of "auto" with its reason."""
    model, single = acting.model, acting.records.real is ctypes.c_float
    available, reason = model.manifest["simulation"]["methods"], "asked for"
    if isinstance(name, str) and name == "auto":
        decay = 0.0
        if "step" not in settings:
            usual = default_rtol("switching" if "switching" in available else "tsit5", single)
            rtol = number("rtol", settings.get("rtol", usual), SimulationError, above=0)
            settings["rtol"] = rtol
            decay = FastestDecay(acting, start.runs, parameters)(start.q0)
        name, reason = chosen(settings, available, decay, place_of(model))
    refuse_misplaced(model, settings)
    span = start.end - start.start
    method = checked_method(name, settings, available, single)
    if name in ADAPTIVE:
        most: dict[str, float] = {"most_steps": usual_most_steps(span)}
        method = replace(method, settings=most | method.settings)
    most_steps = method.settings.get("most_steps", MOST_STEPS)
    for each in ("step", "most_step"):
        length = method.settings.get(each, np.inf)
        refuse_vanishing(start, each, length)
        refuse_endless(each, length, span, most_steps)
    if name == "rk4":  # steps divide the output's
        interval = np.array([start.interval])
        steps = step_counts(interval, 1e-12 * interval, method.settings["step"])
        return replace(method, reason=reason, settings={"step": start.interval / int(steps[0])})
    return replace(method, reason=reason)


def place_of(model: Model) -> str:
    """Return where runs of a model take place, in the words of ``chosen``."""
    return "ground" if model.contacts else "fixed base" if model.fixed else "flight"


def refuse_misplaced(model: Model, settings: dict[str, Any]) -> None:
    """SimulationError about a setting that belongs elsewhere."""
    for key, value in settings.items():
        if key in model.parameters:
            given = f"model.with_parameters({key}={shown(value)})"
            raise SimulationError(f"{key}: is a parameter of the model: simulate {given}")
        if key in DURATIONS:
            raise SimulationError(f"{key}: is no setting: the duration is t_span={shown(value)}")


def still_chosen(run: CompiledRun, name: str) -> bool:
    """Tell whether "auto" chooses a run's method again for a new start; store the reason."""
    if name != "auto" or "step" in run.method.settings:
        return True
    method, available = run.method, run.model.manifest["simulation"]["methods"]
    decay = run.decay(run.memory.state["q"])
    name, reason = chosen(method.settings, available, decay, place_of(run.model))
    run.method = replace(method, reason=reason)
    return name == method.name


def refuse_vanishing(start: Start, name: str, step: float) -> None:
    """SimulationError if steps of this length (s) are too short to advance the time."""
    least = EPS * max(abs(start.start), abs(start.end))
    if step < least:
        raise SimulationError(
            f"{name} {step:.3g}: too short to move the time: give {least:.2g} s or more"
        )
