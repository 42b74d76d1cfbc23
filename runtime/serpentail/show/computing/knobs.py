"""What a reader may change on a page that computes: the start, parameters, gains, with limits."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA
from serpentail_scene.rules import FINITE, NOT_NEGATIVE, NUMBER_RULES, NumberRule

from ...basics.attitude import pitch_roll_yaw
from ...basics.errors import SerpentailError
from ...model.state import ANGLES
from ...simulation.controllers.controller import Damping
from ...simulation.controllers.pfl import Pfl
from ...simulation.runs.single import CompiledRun
from ..animal import animal_of
from .image import Image

REAL = 8  # bytes
DEG = math.pi / 180
TURN = (-180.0, 180.0)  # degrees
# sliders go from one of these parts of the value to the other; of zero to 1
PARTS = (0.1, 3.0)
MOST_SPIN = 30.0  # rad/s: the least range of a slider
TIDY = 9  # decimals of degrees: what follows them is rounding
ORDERED = ("tail_stop_lower", "tail_stop_upper")  # which exclude each other


@dataclass(frozen=True)
class Knob:
    """A number that a reader may change: places (addresses of reals) get it times ``scale``.

    least, most: limits of the slider; those of the number are ``above`` and ``low``. angle: number
    of the angle of the attitude that it is. words: of the error about a wrong value, as Python's.
    """

    group: str
    name: str
    unit: str
    value: float
    least: float
    most: float
    words: str
    places: tuple[int, ...] = ()
    scale: float = 1.0
    angle: int | None = None
    above: float | None = None
    low: float | None = None
    meaning: str = ""


def knobs(run: CompiledRun, image: Image) -> list[dict[str, Any]]:
    """Return the knobs of a run that lies in an image, ready for JSON."""
    return [asdict(knob) for of in (_start, _parameters, _gains) for knob in of(run, image)]


def parameter_places(run: CompiledRun, image: Image) -> dict[str, tuple[int, int]]:
    """Return the address and the size of each parameter of the C struct."""
    place, found = image.array(run.runs.parameters.vectors), {}
    for p in run.model.manifest["parameters"]:
        if p["in_struct"]:
            found[p["name"]] = place, p["size"]
            place += REAL * p["size"]
    return found


def _refusal(make: Callable[[float], object]) -> str:
    """Return the words of the error about a wrong value, which ``{value}`` stands for."""
    try:
        make(math.nan)
    except SerpentailError as error:
        return re.sub(r"value \[?nan(, nan)*\]?", "value {value}", str(error))
    raise AssertionError("nan was taken")


def _limits(rule: NumberRule) -> dict[str, float | None]:
    """Return the limits of numbers under a rule."""
    limits = {"above": rule.above, "low": rule.least}
    return {name: x if math.isfinite(x) else None for name, x in limits.items()}


def _range(value: float, rule: NumberRule) -> tuple[float, float]:
    """Return the limits of a slider about a value."""
    if rule is FINITE:
        return value - max(abs(value), 1.0), value + max(abs(value), 1.0)
    least = 0.0 if rule.above < 0 else PARTS[0] * value
    return least, PARTS[1] * value or 1.0


def _start(run: CompiledRun, image: Image) -> Iterator[Knob]:
    """The words of ``Model.state``: height, attitude, spin and bends."""
    model, start = run.model, run.runs.start
    q0, v0 = start.q0[0], start.v0[0]
    q, v = (image.array(run.runs.state[name]) for name in ("q", "v"))
    if not model.fixed:
        words = _refusal(lambda x: model.state(height=x))
        height, most = float(q0[2]), float(q0[2]) + 2 * animal_of(model).length
        yield Knob("start", "height", "m", height, 0.0, most, words, (q + 2 * REAL,))
        angles = np.degrees(pitch_roll_yaw(q0[None], unwrap=True)[0]).round(TIDY)
        for k, angle in enumerate(angles.tolist()):
            words = _refusal(lambda x, k=k: model.state(**{ANGLES[k]: x}))
            yield Knob("start", ANGLES[k], "deg", angle, *TURN, words, angle=k)
        for k, spin in enumerate(v0[OMEGA].tolist()):
            most = max(MOST_SPIN, 2 * abs(spin))
            words = _refusal(lambda x, k=k: model.state(spin=_row(3, k, x)))
            places = (v + REAL * (OMEGA.start + k),)
            yield Knob("start", f"spin {'xyz'[k]}", "rad/s", spin, -most, most, words, places)
    if model.manifest["scene"]["coordinates"] == "polar":
        return
    for k, joints in enumerate(np.repeat(model.joints_each, 2).tolist()):
        at = model.layout.tail_q.start + k
        name = f"bend {k // 2 + 1} {('pitch', 'yaw')[k % 2]}"
        value, scale = round(float(joints * q0[at] / DEG), TIDY), DEG / joints
        words = _refusal(lambda x, k=k: model.state(bend=_row(model.layout.nt, k, x)))
        yield Knob("start", name, "deg", value, *TURN, words, (q + REAL * at,), scale)


def _row(size: int, k: int, x: float) -> list[float]:
    return [x if i == k else 0.0 for i in range(size)]


def _parameters(run: CompiledRun, image: Image) -> Iterator[Knob]:
    """Parameters of one number, and those of each tail coordinate."""
    model, places = run.model, parameter_places(run, image)
    for p in model.manifest["parameters"]:
        name, rule = p["name"], NUMBER_RULES[p["check"]]
        if (p["size"] > 1 and "per" not in p) or "pieces" in p or name in ORDERED:
            continue
        if name not in model.parameters or not (p["in_struct"] or name == "link_radius"):
            continue
        values = np.atleast_1d(model.parameters[name]).tolist()
        first = places.get(name, (0, 0))[0]
        each = tuple(first + REAL * k for k in range(len(values))) if first else ()
        words = _refusal(lambda x, name=name: model.with_parameters(**{name: x}))
        yield from _alike(
            Knob("body", name, p["unit"], 0.0, 0.0, 0.0, words, meaning=p["meaning"]),
            (values, each, model.names.tail),
            rule,
        )


def _gains(run: CompiledRun, image: Image) -> Iterator[Knob]:
    """Damping of the controllers, and gains of the laws that track a reference."""
    model, parts = run.model, run.actuation.parts
    nt = model.layout.nt
    controllers = image.places[run.actuation.record.controllers]
    size, offsets = image.size("controller"), image.offsets("controller")
    for k, each in enumerate(parts):
        phase = f" of phase {k + 1}" if len(parts) > 1 else ""
        if each.damping is not None:
            place, values = image.array(each.damping), each.damping.tolist()
            places = tuple(place + REAL * i for i in range(nt))
            words = _refusal(lambda x: Damping(x).parts(nt))
            knob = Knob("controller", f"damping{phase}", "N m s", 0.0, 0.0, 0.0, words)
            yield from _alike(knob, (values, places, model.names.tail), NOT_NEGATIVE)
        for gain, unit in (("kp", "1/s^2"), ("kd", "1/s")) if each.pfl is not None else ():
            place = controllers + k * size + offsets[gain][0]
            words = _refusal(lambda x, gain=gain: Pfl(model, None, **{gain: x}))
            knob = Knob("controller", f"{gain}{phase}", unit, 0.0, 0.0, 0.0, words)
            yield from _alike(knob, ([getattr(each.pfl, gain)], (place,), [""]), NOT_NEGATIVE)


def _alike(knob: Knob, numbers: tuple[Any, Any, Any], rule: NumberRule) -> Iterator[Knob]:
    """One knob for numbers that are alike, else one for each: values, places, names."""
    values, places, names = numbers
    alike = len(set(values)) == 1
    for k, value in enumerate(values[:1] if alike else values):
        least, most = _range(value, rule)
        own = {"value": value, "least": least, "most": most, **_limits(rule)}
        own["name"] = knob.name if alike else f"{knob.name} of {names[k]}"
        yield Knob(**vars(knob) | own | {"places": places if alike else places[k : k + 1]})
