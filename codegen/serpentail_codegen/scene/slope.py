"""The key `slope`: inclined ground. It stays the plane z = 0; gravity_vector is computed."""

from collections.abc import Mapping
from contextlib import suppress
from math import cos, sin
from typing import Any

from serpentail_scene.keys import SLOPE
from serpentail_scene.parameters import PARAMETERS
from serpentail_scene.units import in_unit

from .problems import Problem
from .segment_tables import numbers_of

UPHILL = {"x": (1, 0), "-x": (-1, 0), "y": (0, 1), "-y": (0, -1)}


def with_slope(table: Mapping[str, Any]) -> tuple[Mapping[str, Any], list[Problem]]:
    """Return a scene's table with ``gravity_vector`` in place of ``slope``, and its problems.

    The ground rises by ``angle`` towards an axis; the vector is as long as ``gravity``.
    """
    slope, named = table.get("slope"), table.get("parameters", {})
    if slope is None or not isinstance(named, Mapping):
        return table, []
    problems: list[Problem] = []
    if not isinstance(slope, Mapping):
        remedy = 'needs a table, such as { angle = "30 deg", toward = "y" }'
        return table, [Problem("slope", slope, remedy)]
    angles = {"angle": None, **{key: x for key, x in slope.items() if key != "toward"}}
    found, toward = numbers_of("slope", angles, SLOPE, 1, problems), slope.get("toward")
    uphill = UPHILL.get(toward) if isinstance(toward, str) else None
    if uphill is None:
        remedy = "needs one of " + ", ".join(f'"{name}"' for name in UPHILL)
        problems.append(Problem("slope.toward", toward, f"{remedy}: where the ground rises"))
    if "gravity_vector" in named:
        remedy = "slope computes it: remove one of the two"
        problems.append(Problem("parameters.gravity_vector", named["gravity_vector"], remedy))
    with suppress(ValueError, TypeError):  # the rule of gravity tells
        size = float(in_unit(named.get("gravity", PARAMETERS[0].default), PARAMETERS[0].unit))
        if uphill and not problems and size >= 0:
            (angle,), (x, y) = found["angle"], uphill
            vector = [-size * sin(angle) * x, -size * sin(angle) * y, -size * cos(angle)]
            rest = {name: value for name, value in named.items() if name != "gravity"}
            return {**table, "parameters": {**rest, "gravity_vector": vector}}, []
    return table, problems
