"""Parameters: a manifest's parameters and a caller's changes go in, checked values come out."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from ..checks import did_you_mean, numbers_in
from ..errors import ModelError, UnlikeBodies

Value = float | tuple[float, ...]
CHECKS = {  # of rows (K, size), for each one
    "positive": (lambda x: (x > 0).all(axis=1), "above 0"),
    "not_negative": (lambda x: (x >= 0).all(axis=1), "0 or above"),
    "finite": (lambda x: np.ones(len(x), bool), "finite"),
    "body_inertia": (
        lambda x: (x > 0).all(axis=1) & (2 * x.max(axis=1) <= x.sum(axis=1) * (1 + 1e-12)),
        "above 0, none above the sum of the other two",
    ),
}
UNLIKE = 1e4  # from here on H may be off by 1e-12 of its diagonal: docs/stability.md


def resolve(manifest: dict, changes: Mapping[str, object] | None) -> MappingProxyType:
    """Return name -> float or tuple (SI) of all parameters; ModelError lists everything that is
    wrong.
    """
    values = {p["name"]: p["default"] for p in manifest["parameters"] if p["default"] is not None}
    given = _given(manifest, changes, None)
    values = completed(manifest, merged(values, given))
    return MappingProxyType(
        {
            n: float(v) if np.ndim(v) == 0 else tuple(np.asarray(v, float).tolist())
            for n, v in values.items()
        }
    )


@dataclass(frozen=True, eq=False)
class RunParameters:
    """Parameters of k runs: what is changed, all values by name, numbers or arrays (k,), (k, 3),
    and the C structs.
    """

    changes: dict[str, np.ndarray]
    values: dict[str, object]
    vectors: np.ndarray

    @classmethod
    def checked(
        cls, manifest: dict, own: Mapping[str, Value], changes, runs: int
    ) -> "RunParameters":
        """Return a model's own parameters, others where they change: name -> (runs,) or (runs, 3),
        SI.

        ModelError lists everything that is wrong, and the run.
        """
        given = _given(manifest, changes, runs)
        values = completed(manifest, merged(own, given))
        fields = [(p["name"], p["size"]) for p in manifest["parameters"] if p["in_struct"]]
        columns = (np.asarray(values[name], float).reshape(-1, size) for name, size in fields)
        vectors = np.hstack([np.broadcast_to(a, (runs, a.shape[1])) for a in columns])
        return cls(
            given,
            values,
            vectors.astype(np.float32 if manifest["real"] == "float" else np.float64, order="C"),
        )

    def of(self, k: int) -> dict[str, np.ndarray]:
        """Return the changes of run k."""
        return {name: values[k] for name, values in self.changes.items()}


def total_mass(values: Mapping[str, Any]) -> Any:
    """Return the mass (kg) of torso and tail, or one of each run."""
    return values["torso_mass"] + values["tail_mass"]


def merged(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with changes; link_radius and link_inertia replace each other."""
    other = {"link_inertia": "link_radius", "link_radius": "link_inertia"}
    replaced = {other[name] for name in changes if name in other}
    return {name: x for name, x in values.items() if name not in replaced} | dict(changes)


def completed(manifest: dict, values: Mapping) -> dict:
    """Return the values with link_inertia where it follows from link_radius, numbers or one of each
    run.
    """
    if "link_radius" not in values:
        return dict(values)
    moments = np.broadcast_arrays(*ellipsoid(values, manifest["dimensions"]["total"]))
    return dict(values) | {"link_inertia": np.stack(moments, axis=-1)}


def _given(manifest: dict, changes, runs: int | None) -> dict:
    """Return a caller's changes checked, of one model or, with a leading axis, of many runs."""
    if not isinstance(changes, Mapping | None):
        raise ModelError(
            f"parameters: value {changes!r:.60}: needs a mapping, such as {{'gravity': 9.8}}"
        )
    fields = {p["name"]: p for p in manifest["parameters"]}
    problems, given = [], {}
    for name, value in (changes or {}).items():
        checked = _checked(fields, str(name), value, runs)
        if isinstance(checked, str):
            problems.append(checked)
        else:
            given[name] = checked
    if {"link_radius", "link_inertia"} <= given.keys():
        problems.append("link_radius and link_inertia: give one of them, not both")
    if given and manifest["scene"]["baked"]:
        problems.append(
            "the parameters are baked into this model: set `baked = false` in its scene and "
            "generate it again"
        )
    if problems:
        raise ModelError("parameters: " + "\n            ".join(problems))
    return given


def ellipsoid(values: Mapping[str, Value], links: int) -> tuple[float, float, float]:
    """Moments of inertia (kg m^2) of one link, an ellipsoid with semi-axes (r, L / 2, r) and the
    link along y.
    """
    m, length, r = values["tail_mass"] / links, values["tail_length"] / links, values["link_radius"]
    with np.errstate(over="ignore", invalid="ignore"):
        across, along = m / 5 * (length * length / 4 + r * r), m / 5 * (2 * r * r)
        sound = np.isfinite(across + along).all()
    if not sound:
        raise ModelError(
            "parameters: tail_mass, tail_length and link_radius give no finite link_inertia: use "
            "kg and m"
        )
    return across, along, across


def disparity(values: Mapping[str, Value]) -> float:
    """Return how unlike torso and tail are: moments of inertia that cancel in H over what is left,
    or their lengths.

    That is the larger of m (|b2t| + L)^2 / min I_b and |b2t| / L, m and L being the tail's mass and
    length; of many runs the largest.
    """
    with np.errstate(all="ignore"):
        mount, length = (
            np.linalg.norm(values["tail_mount"], axis=-1),
            np.asarray(values["tail_length"]),
        )
        moments = (
            np.asarray(values["tail_mass"])
            * (mount + length) ** 2
            / np.min(values["torso_inertia"], axis=-1)
        )
        return float(np.max(np.maximum(moments, mount / length)))


def warn_of_unlike(values: Mapping[str, Value], calls: int = 2) -> None:
    """Warn who called so many calls above where H loses digits by bodies of unlike size."""
    found = disparity(values)
    if found > UNLIKE:
        sizes = "tail_mass, tail_length, tail_mount, torso_inertia"
        words = (
            f"torso and tail are unlike by {found:.1e} ({sizes}): H may be off by as many roundings"
        )
        warnings.warn(f"{words}; are the units kg and m?", UnlikeBodies, stacklevel=calls + 1)


def flat(manifest: dict, values: Mapping[str, Value]) -> list[float]:
    """Return the scalars of the C parameter struct in order."""
    out = []
    for p in manifest["parameters"]:
        if p["in_struct"]:
            value = values[p["name"]]
            out += value if isinstance(value, tuple) else [value]
    return out


def _checked(fields: dict, name: str, value: object, runs: int | None) -> np.ndarray | str:
    """Return the value, of every run where there are many, or what is wrong with it."""
    if name not in fields:
        remedy = did_you_mean(name, fields) or f"there are {', '.join(fields)}"
        return f"{name}: no such parameter; {remedy}"
    size = fields[name]["size"]
    shape = (() if runs is None else (runs,)) + ((size,) if size > 1 else ())
    numbers = numbers_in(value)
    holds, words = CHECKS[fields[name]["check"]]
    kind = "a finite number" if size == 1 else f"{size} finite numbers"
    needs = f"needs {kind} ({fields[name]['unit']}), {words}" + (
        "" if runs is None else f", for each of {runs} runs"
    )
    if numbers is None or numbers.shape != shape:
        return f"{name}: value {value!r:.200}: {needs}"
    rows = numbers.reshape(-1, size)
    with np.errstate(over="ignore"):
        wrong = np.flatnonzero(~(np.isfinite(rows).all(axis=1) & holds(rows)))
    if not len(wrong):
        return numbers
    which, found = (
        ("", value) if runs is None else (f" of run {wrong[0]}", numbers[wrong[0]].tolist())
    )
    return f"{name}{which}: value {found!r}: {needs}"
