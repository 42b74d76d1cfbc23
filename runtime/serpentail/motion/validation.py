"""Checks of a motion's arrays: shapes, times, unit quaternions, plain data."""

import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import Layout

from ..basics.attitude import Array
from ..basics.checks import finite_array, shown

# entries of info on which others build, and what each entry of these lists has
LISTS: dict[str, tuple[type, tuple[str, ...]]] = {
    "warnings": (str, ()),
    "doubts": (str, ()),
    "coordinates": (str, ()),
    "tensions": (dict, ("begin",)),
    "events": (dict, ("time", "group", "kind")),
    "phases": (dict, ()),
}
UNIT_TOLERANCE = 1e-3  # how far a stored quaternion's norm may drift from 1


def real(name: str, value: ArrayLike) -> Array:
    """Return a finite, read-only float64 copy of a value."""
    array = finite_array(name, value, ValueError).copy()
    array.setflags(write=False)
    return array


def layout_of(q: Array, v: Array) -> Layout:
    """Return the layout of configurations (K, nq) and velocities (K, nv); ``shapes`` has checked
    that they have one.
    """
    layout = Layout.of_width(q.shape[1], v.shape[1])
    assert layout is not None
    return layout


def shapes(t: Array, q: Array, like: tuple[Array, ...]) -> dict[str, tuple[int, ...]]:
    """Return the shape that each array must have; on a fixed base v and tau have that of q."""
    samples = len(t) if t.ndim == 1 else 0
    if not samples:
        raise ValueError(f"t has shape {t.shape}: give one row of at least one time")
    wide = q.ndim == like[0].ndim == 2
    layout = Layout.of_width(q.shape[1], like[0].shape[1]) if wide else None
    if layout is None or (layout.fixed and any(each.shape != q.shape for each in like)):
        raise ValueError(
            f"q has shape {q.shape}: give ({samples}, 7 + nt), position, quaternion and tail "
            f"coordinates, or ({samples}, 2m) of a tail on a fixed base"
        )
    return {
        "q": (samples, layout.nq),
        "v": (samples, layout.nv),
        "tau": (samples, layout.nt),
        "kinetic": (samples,),
        "potential": (samples,),
        "linear_momentum": (samples, 3),
        "angular_momentum": (samples, 3),
    }


def check_time(t: Array) -> None:
    """ValueError unless the times increase."""
    backward = np.flatnonzero(np.diff(t) <= 0)
    if backward.size:
        k = int(backward[0]) + 1
        raise ValueError(
            f"t has shape {t.shape} and t[{k}] = {t[k]} follows {t[k - 1]}: give strictly "
            "increasing times"
        )


def check_unit(attitude: Array) -> None:
    """ValueError unless the quaternions have unit norm."""
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(attitude, axis=1)
    k = int(np.argmax(np.abs(norm - 1)))
    if abs(norm[k] - 1) > UNIT_TOLERANCE:
        raise ValueError(f"q[{k}, 3:7] has norm {norm[k]:.6g}: give unit quaternions (w, x, y, z)")


def json_text(info: Any) -> str:
    """Return the text of info, a dict of plain JSON values; ValueError otherwise."""
    if not isinstance(info, dict):
        raise ValueError(f"info is a {type(info).__name__}: give a dict of plain JSON values")
    _check_lists(info)
    try:
        return json.dumps(info, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"info is not JSON-ready ({error}): convert arrays by tolist(), use None for nan"
        ) from error


def _check_lists(info: dict[str, Any]) -> None:
    """ValueError unless the lists of info that others read are such lists."""
    for name, (kind, keys) in LISTS.items():
        entries = info.get(name, [])
        listed = isinstance(entries, list) and all(isinstance(each, kind) for each in entries)
        if not listed or not all(key in each for each in entries for key in keys):
            what = "tables" if kind is dict else "texts"
            of = f" with {', '.join(keys)}" if keys else ""
            raise ValueError(
                f"info[{name!r}] has value {shown(entries)}: give a list of {what}{of}"
            )
