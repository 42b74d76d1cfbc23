"""Calls the public interface with random wrong values: each call must answer or refuse."""

import inspect
import signal
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st

from .wrong_values import values

SECONDS = 20  # s that a call may take
PIECES = 20  # characters of a message by which faults are told apart


@dataclass(frozen=True)
class Target:
    """A public function, and valid arguments for it."""

    name: str
    function: Callable
    arguments: dict


@dataclass(frozen=True)
class Fault:
    """A call that neither answered nor refused properly: another exception, a result that is not
    finite, or a hang.
    """

    kind: str
    target: str
    arguments: str
    error: str


def targets(model: st.Model, parent: Path) -> list[Target]:
    """Return all functions to call, with valid arguments."""
    found = [
        Target(f"model.{name}", getattr(model, name), inputs(model, name))
        for name in sorted(methods(model))
    ]
    nt = model.nv - 6
    found += [
        Target(
            "model.external_force",
            model.external_force,
            {"force": (0, 0, 1), "moment": (0, 0, 0), "tail": None},
        ),
        Target(
            "load",
            st.load,
            {"folder": model.folder, "parameters": {}, "profile": "fast", "compiled": True},
        ),
        Target("Legs", st.Legs, {"times": [0.0, 1.0], "gamma": 3.6, "delta": [0.0, 1.0]}),
        Target("Legs.fixed", st.Legs.fixed, {"gamma": 3.6, "delta": -0.3}),
        Target(
            "Legs.ramp",
            st.Legs.ramp,
            {"gamma": 3.6, "delta": (-0.3, -1.0), "at": 0.4, "rate": -70.0},
        ),
        Target(
            "Reference",
            st.Reference,
            {"times": [0.0, 1.0], "angles": np.zeros((2, nt)), "blend": "quintic"},
        ),
        Target("Phases", st.Phases, {"phases": [(0.0, None)]}),
        Target(
            "polar_to_bend",
            st.polar_to_bend,
            dict.fromkeys(("phi", "theta", "phi_dot", "theta_dot"), 0.3),
        ),
        Target("bend_to_polar", st.bend_to_polar, dict.fromkeys(("a", "b", "a_dot", "b_dot"), 0.3)),
        Target(
            "rotation_matrix", st.rotation_matrix, {"quaternion": np.array([0.5, 0.5, -0.5, 0.5])}
        ),
        Target("pitch_roll_yaw", st.pitch_roll_yaw, {"q": np.full(model.nq, 0.5)}),
        Target(
            "Pfl",
            st.Pfl,
            {"model": model, "reference": ([0.0, 1.0], np.zeros((2, nt))), "kp": 1.0, "kd": 2.0},
        ),
        *simulations(model),
    ]
    for name, value in model.parameters.items():
        found.append(Target("model.with_parameters", model.with_parameters, {name: value}))
    return found


def methods(model: st.Model) -> set[str]:
    """Return the compiled functions that are methods of the model."""
    return {name for name in model.kernels if callable(getattr(model, name, None))}


def inputs(model: st.Model, name: str) -> dict:
    """Return valid inputs of a compiled function."""
    entries = model.manifest["functions"][name]["inputs"]
    names = [n for n in inspect.signature(getattr(model, name)).parameters if n != "f_ext"]
    shapes = {entry["name"]: entry["shape"] for entry in entries}
    found = {n: np.full(shapes[n], 0.1) for n in names if n in shapes}
    return found


def simulations(model: st.Model) -> list[Target]:
    """Return simulations of 2 ms by every method."""
    q, v = np.zeros(model.nq), np.full(model.nv, 0.1)
    q[2:4] = 0.3, 1.0
    common = {
        "model": model,
        "q0": q,
        "v0": v,
        "controller": st.Damping(1e-5),
        "t_span": 0.002,
        "output_step": 1e-3,
    }
    legs = {"legs": st.Legs.fixed(3.6, -0.3)} if "feet" in model.contacts else {}
    ground = {
        "bristles0": np.zeros((sum(model.contacts.values()), 2)),
        "stop_at": [("touch_down", "feet")],
    }
    ground = ground if legs else {}
    settings = {
        "tsit5": {
            "rtol": 1e-6,
            "first_step": 1e-4,
            "least_step": 1e-9,
            "most_step": 1.0,
            "most_steps": 1000,
        },
        "ros34pw2": {"rtol": 1e-6, "most_step": 1.0},
        "rk4": {"step": 1e-4},
        "implicit_euler": {"step": 1e-4},
        "lsoda": {},  # SciPy's methods know no limit of their steps
        "dop853": {},
    }
    known = {*model.manifest["simulation"]["methods"], "lsoda", "dop853"}
    return [
        Target(f"simulate by {m}", st.simulate, common | legs | ground | {"method": m} | own)
        for m, own in settings.items()
        if m in known
    ]


def fuzz(found: list[Target], count: int, seed: int) -> list[Fault]:
    """Return the faults of ``count`` random calls, one of each kind."""
    rng, faults = np.random.default_rng(seed), {}
    before = signal.signal(signal.SIGALRM, _too_long)
    try:
        with warnings.catch_warnings():
            # any other warning is a fault if warnings are errors
            warnings.simplefilter("ignore", st.UnlikeBodies)
            warnings.simplefilter("ignore", st.UnusualSize)
            for _ in range(count):
                target = found[rng.integers(len(found))]
                fault = tried(target, changed(target, rng))
                if fault:
                    faults.setdefault((fault.kind, fault.target, fault.error[:PIECES]), fault)
    finally:
        signal.signal(signal.SIGALRM, before)
    return list(faults.values())


def changed(target: Target, rng) -> dict:
    """Return the arguments of a target, one to three of them replaced."""
    arguments = dict(target.arguments)
    some = [name for name in arguments if name != "model"]
    for name in rng.choice(some, min(len(some), rng.integers(1, 4)), replace=False).tolist():
        choices = values(arguments[name], rng)
        arguments[name] = choices[rng.integers(len(choices))]
    return arguments


def tried(target: Target, arguments: dict) -> Fault | None:
    """Make a call; return its fault, or None."""
    shown = ", ".join(
        f"{name}={value!r:.60}" for name, value in arguments.items() if name != "model"
    )
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        result = target.function(**arguments)
    except st.SerpentailError as refusal:
        return (
            None
            if str(refusal).strip()
            else Fault("empty message", target.name, shown, repr(refusal))
        )
    except Exception as error:
        return Fault(
            "hang" if isinstance(error, _TooLong) else "bare error", target.name, shown, repr(error)
        )
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return None if sound(result) else Fault("no number", target.name, shown, f"{result!r:.200}")


def sound(result) -> bool:
    """Tell if all numbers of a result are finite."""
    if isinstance(result, st.Trajectory):
        result = (result.t, result.q, result.v, result.tau, result.kinetic, result.potential)
    if isinstance(result, tuple):
        return all(map(sound, result))
    return not isinstance(result, np.ndarray | float) or bool(np.isfinite(result).all())


class _TooLong(Exception):
    """A call took too long."""


def _too_long(*_):
    raise _TooLong
