"""Parameters: a manifest's parameters and a caller's changes go in, checked values come out."""

import math
import warnings
from collections.abc import Mapping
from difflib import get_close_matches
from types import MappingProxyType

import numpy as np

from .errors import ModelError, UnlikeBodies

Value = float | tuple[float, ...]
CHECKS = {
    "positive": (lambda x: min(x) > 0, "above 0"),
    "not_negative": (lambda x: min(x) >= 0, "0 or above"),
    "finite": (lambda x: True, "finite"),
    "body_inertia": (
        lambda x: min(x) > 0 and 2 * max(x) <= sum(x) * (1 + 1e-12),
        "above 0, none above the sum of the other two",
    ),
}

UNLIKE = 1e4  # from here on H may be off by 1e-12 of its diagonal: docs/stability.md


def resolve(manifest: dict, changes: Mapping[str, object] | None) -> MappingProxyType:
    """Return name -> float or tuple (SI) of all parameters; ModelError lists everything that is wrong."""
    if not isinstance(changes, Mapping | None):
        raise ModelError(f"parameters: value {changes!r:.60}: needs a mapping, such as {{'gravity': 9.8}}")
    fields = {p["name"]: p for p in manifest["parameters"]}
    values = {name: p["default"] for name, p in fields.items() if p["default"] is not None}
    problems, given = [], {}
    for name, value in (changes or {}).items():
        checked = _checked(fields, str(name), value)
        if isinstance(checked, str):
            problems.append(checked)
        else:
            given[name] = checked
    if {"link_radius", "link_inertia"} <= given.keys():
        problems.append("link_radius and link_inertia: give one of them, not both")
    if given and manifest["scene"]["baked"]:
        problems.append(
            "the parameters are baked into this model: set `baked = false` in its scene and generate it again"
        )
    if problems:
        raise ModelError("parameters: " + "\n            ".join(problems))
    values |= given
    if "link_inertia" in given:
        values.pop("link_radius", None)
    elif "link_radius" in values:
        values["link_inertia"] = ellipsoid(values, manifest["dimensions"]["total"])
    return MappingProxyType(
        {n: tuple(map(float, v)) if isinstance(v, list | tuple) else float(v) for n, v in values.items()}
    )


def ellipsoid(values: Mapping[str, Value], links: int) -> tuple[float, float, float]:
    """Moments of inertia (kg m^2) of one link, an ellipsoid with semi-axes (r, L / 2, r) and the link along y."""
    m, length, r = values["tail_mass"] / links, values["tail_length"] / links, values["link_radius"]
    across, along = m / 5 * (length * length / 4 + r * r), m / 5 * (2 * r * r)
    if not math.isfinite(across + along):
        raise ModelError("parameters: tail_mass, tail_length and link_radius give no finite link_inertia: use kg and m")
    return across, along, across


def disparity(values: Mapping[str, Value]) -> float:
    """Return how unlike torso and tail are: moments of inertia that cancel in H over what is left, or their lengths.

    That is the larger of m (|b2t| + L)^2 / min I_b and |b2t| / L, m and L being the tail's mass and length.
    """
    mount, length = math.hypot(*values["tail_mount"]), values["tail_length"]
    reach = mount + length
    return max(values["tail_mass"] * reach * reach / min(values["torso_inertia"]), mount / length)


def warn_of_unlike(values: Mapping[str, Value]) -> None:
    """Warn the caller's caller where H loses digits by bodies of unlike size."""
    found = disparity(values)
    if found > UNLIKE:
        sizes = "tail_mass, tail_length, tail_mount, torso_inertia"
        words = f"torso and tail are unlike by {found:.1e} ({sizes}): H may be off by as many roundings"
        warnings.warn(f"{words}; are the units kg and m?", UnlikeBodies, stacklevel=3)


def flat(manifest: dict, values: Mapping[str, Value]) -> list[float]:
    """Return the scalars of the C parameter struct in order."""
    out = []
    for p in manifest["parameters"]:
        if p["in_struct"]:
            value = values[p["name"]]
            out += value if isinstance(value, tuple) else [value]
    return out


def _checked(fields: dict, name: str, value: object) -> Value | str:
    """Return the value, or what is wrong with it."""
    if name not in fields:
        near = get_close_matches(name, fields, 1)
        return f"{name}: no such parameter; " + (
            f"did you mean {near[0]!r}?" if near else f"there are {', '.join(fields)}"
        )
    size = fields[name]["size"]
    numbers = _numbers(value, (size,) if size > 1 else ())
    holds, words = CHECKS[fields[name]["check"]]
    if len(numbers) != size or not all(map(math.isfinite, numbers)) or not holds(numbers):
        kind = "a finite number" if size == 1 else f"{size} finite numbers"
        return f"{name}: value {value!r}: needs {kind} ({fields[name]['unit']}), {words}"
    return tuple(numbers) if size > 1 else numbers[0]


def _numbers(value: object, shape: tuple[int, ...]) -> list[float]:
    """Return the real numbers of an array of this shape; none where it is something else."""
    try:
        array = np.asarray(value)
    except ValueError:
        return []
    fits = array.dtype.kind in "fiu" and array.shape == shape
    return [float(x) for x in array.ravel()] if fits else []
