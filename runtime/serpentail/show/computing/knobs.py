"""What a reader may change on a page that computes: the start, parameters, gains."""

import ctypes
import math
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA

from ...basics.attitude import pitch_roll_yaw
from ...basics.errors import SerpentailError
from ...model.state import ANGLES
from ...simulation.controllers.controller import Damping
from ...simulation.controllers.pfl import Pfl
from ...simulation.runs.single import CompiledRun
from ..animal import animal_of
from .image import Image

REAL = 8  # bytes
TURN = (-180.0, 180.0)  # degrees
SPIN = 30.0  # rad/s: the least range of a slider
TIDY = 9  # decimals of degrees: what follows them is rounding
ORDERED = ("stop_lower", "stop_upper")  # ends of names of parameters that exclude each other
Knob = dict[str, Any]


def knobs(run: CompiledRun, image: Image, parameters: dict[str, tuple[int, int]]) -> list[Knob]:
    """Return the knobs of a run that lies in an image, ready for JSON.

    Places are addresses of reals, which get the number times ``scale``; ``angle``: number of the
    angle of the attitude that it is; ``words``: Python's error about a wrong value; ``slider``: its
    limits, which otherwise follow from value and rule. parameters: their addresses and sizes.
    """
    return [*_start(run, image), *_parameters(run, parameters), *_gains(run, image)]


def _knob(
    name: tuple[str, str, str], value: float, places: list[int], wrong: Any, **more: Any
) -> Knob:
    """Return a knob: its group, name and unit; wrong: a function and arguments that it refuses."""
    knob = dict(zip(("group", "name", "unit"), name, strict=True)) | {"rule": "finite", "scale": 1}
    return knob | {"value": value, "places": places, "words": refusal_of(*wrong)} | more


def refusal_of(make: Callable[..., object], arguments: dict[str, Any]) -> str:
    """Return the words of the error about nan among arguments, which ``{value}`` stands for."""
    try:
        make(**arguments)
    except SerpentailError as error:
        return re.sub(r"value nan", "value {value}", str(error))
    raise AssertionError(f"{arguments} were taken")


def _start(run: CompiledRun, image: Image) -> Iterator[Knob]:
    """The words of ``Model.state``: height, attitude, spin and bends."""
    model, start = run.model, run.runs.start
    q0, v0, wrong = start.q0[0], start.v0[0], np.diag(np.full(max(3, run.model.nu), math.nan))
    q, v = image.at(run.record.q), image.at(run.record.v)
    if not model.fixed:
        slider = (0, float(q0[2]) + 2 * animal_of(model).length)
        height = model.state, {"height": math.nan}
        yield _knob(("start", "height", "m"), q0[2], [q + 2 * REAL], height, slider=slider)
        angles = np.degrees(pitch_roll_yaw(q0[None], unwrap=True)[0]).round(TIDY)
        for k, name in enumerate(ANGLES):
            angle = model.state, {name: math.nan}
            yield _knob(("start", name, "deg"), angles[k], [], angle, angle=k, slider=TURN)
        for k, spin in enumerate(v0[OMEGA]):
            most, place = max(SPIN, 2 * abs(spin)), v + REAL * (OMEGA.start + k)
            turns = model.state, {"spin": wrong[k, :3].tolist()}
            words = ("start", f"spin {'xyz'[k]}", "rad/s")
            yield _knob(words, spin, [place], turns, slider=(-most, most))
    polar = model.manifest["scene"]["coordinates"] == "polar"
    alone, names = len(model.layout.chains) == 1, model.names.tail
    joints_of = np.repeat(model.turns_each, model.layout.widths)
    for k, joints in enumerate([] if polar else joints_of):
        at = model.layout.tail_q.start + k
        bend = model.state, {"bend": wrong[k, : model.nu].tolist()}
        which = f"{k // 2 + 1} {('pitch', 'yaw')[k % 2]}" if alone else names[k]
        words = ("start", f"bend {which}", "deg")
        value, places = np.degrees(joints * q0[at]).round(TIDY), [q + REAL * at]
        yield _knob(words, value, places, bend, scale=np.radians(1) / joints, slider=TURN)


def _parameters(run: CompiledRun, parameters: dict[str, tuple[int, int]]) -> Iterator[Knob]:
    """Parameters of one number, or of equal numbers for all tail coordinates."""
    for p in run.model.manifest["parameters"]:
        name = p["name"]
        values = np.unique(run.model.parameters.get(name, [0, 0]))
        mine = (p["in_struct"] or name.endswith("link_radius")) and not name.endswith(ORDERED)
        if not mine or len(values) > 1 or (p["size"] > 1 and "per" not in p):
            continue
        first, size = parameters.get(name, (0, 0))
        places = [first + REAL * k for k in range(size)]
        refused = run.model.with_parameters, {name: math.nan}
        more = {"rule": p["check"], "meaning": p["meaning"]}
        yield _knob(("body", name, p["unit"]), values[0], places, refused, **more)


def _gains(run: CompiledRun, image: Image) -> Iterator[Knob]:
    """Damping of the controllers, and gains of the laws that track a reference."""
    model, parts, kind = run.model, run.actuation.parts, image.types["controller"]
    records, rule = run.actuation.record.controllers, {"rule": "not_negative"}
    for k, each in enumerate(parts):
        phase = f" of phase {k + 1}" if len(parts) > 1 else ""
        if each.damping is not None and len(np.unique(each.damping)) == 1:
            start = image.at(image.found[records][k].damping)
            places = [start + REAL * i for i in range(model.nu)]
            words, refused = ("controller", f"damping{phase}", "N m s"), Damping(math.nan).parts
            yield _knob(words, each.damping[0], places, (refused, {"nt": model.nu}), **rule)
        for gain, unit in (("kp", "1/s^2"), ("kd", "1/s")) if each.pfl is not None else ():
            place = image.at(records) + k * ctypes.sizeof(kind) + getattr(kind, gain).offset
            arguments = {"model": model, "reference": None, gain: math.nan}
            words = ("controller", f"{gain}{phase}", unit)
            yield _knob(words, getattr(each.pfl, gain), [place], (Pfl, arguments), **rule)
