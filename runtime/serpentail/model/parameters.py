"""Parameters of a model or of each of many runs: defaults, and a caller's checked changes."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from serpentail_scene.messages import did_you_mean, one_line, shown
from serpentail_scene.parameters import Value, ellipsoid, name_in
from serpentail_scene.rules import NUMBER_RULES, ROUNDING, NumberRule
from serpentail_scene.units import in_unit

from ..basics.checks import numbers_in, satisfying
from ..basics.errors import ModelError
from ..basics.plausible_values import warn_of_sizes
from .chains import entries, owner_of
from .weight import OTHER_CHAINS, weight_of

Values = Mapping[str, Any]  # name -> number or numbers, SI; of many runs (k,) or (k, size)
# parameters that follow from the values of single links or arcs
TOTALS = {
    "tail_mass": ("link_masses", "arc_masses"),
    "tail_length": ("link_lengths", "arc_lengths"),
}
SHAPE_OF_LINKS = ("tail_mass", "tail_length", "link_radius")  # of equal links


def resolve(manifest: dict, changes: Mapping[str, object] | None) -> MappingProxyType[str, Value]:
    """Return name -> float or tuple (SI) of all parameters; ModelError lists all errors."""
    defaults = {p["name"]: p["default"] for p in manifest["parameters"]}
    defaults = {name: value for name, value in defaults.items() if value is not None}
    values = completed(manifest, merged(defaults, _checked_changes(manifest, changes, None)))
    return MappingProxyType({name: _plain(value) for name, value in values.items()})


def _plain(value: Any) -> Value:
    """Return a parameter as a float or a tuple of floats."""
    numbers = np.asarray(value, float).tolist()
    return tuple(numbers) if isinstance(numbers, list) else numbers


def json_ready(values: Mapping[str, Value]) -> dict[str, float | list[float]]:
    """Return parameters with lists in place of tuples."""
    return {name: list(x) if isinstance(x, tuple) else x for name, x in values.items()}


@dataclass(frozen=True, eq=False)
class RunParameters:
    """Parameters of k runs: the changes, all values by name, and the C structs (k, scalars)."""

    changes: dict[str, np.ndarray]
    values: Values
    vectors: np.ndarray

    @classmethod
    def checked(
        cls, manifest: dict, parameters: Values, changes: Mapping[str, object], runs: int
    ) -> "RunParameters":
        """Return a model's parameters with changes, name -> (runs,) or (runs, 3), SI.

        ModelError lists everything that is wrong, and the run.
        """
        checked = _checked_changes(manifest, changes, runs)
        values = completed(manifest, merged(parameters, checked))
        # columns of the C struct, those that no run changes repeated
        fields = [(p["name"], p["size"]) for p in manifest["parameters"] if p["in_struct"]]
        columns = (np.asarray(values[name], float).reshape(-1, size) for name, size in fields)
        vectors = np.hstack([np.broadcast_to(a, (runs, a.shape[1])) for a in columns])
        return cls(checked, values, vectors.astype(real_type(manifest), order="C"))

    def of(self, k: int) -> dict[str, np.ndarray]:
        """Return the changes of run k."""
        return {name: values[k] for name, values in self.changes.items()}


def warn_of_parameters(manifest: dict, values: Values, calls: int) -> None:
    """Warn of sizes that no animal or robot has; ``calls``: frames above this function."""
    # masses and lengths also if links decide
    units = {name: "kg" if name.endswith("_mass") else "m" for name in values}
    units |= {"gravity": "m/s^2"} | {p["name"]: p["unit"] for p in manifest["parameters"]}
    warn_of_sizes(units, values, calls + 1)


def real_type(manifest: dict) -> type[np.floating]:
    """Return the type of a model's numbers."""
    return np.float32 if manifest["real"] == "float" else np.float64


def merged(values: Values, changes: Values) -> dict[str, Any]:
    """Return values with changes; link_radius and link_inertia of a chain replace each other."""
    replaced = set()
    for end, other in (("link_inertia", "link_radius"), ("link_radius", "link_inertia")):
        replaced |= {name.removesuffix(end) + other for name in changes if name.endswith(end)}
    return {name: x for name, x in values.items() if name not in replaced} | dict(changes)


def independent(manifest: dict, values: Values) -> dict[str, Any]:
    """Return the values that others follow from."""
    own = {p["name"] for p in manifest["parameters"]}
    radii = [name for name in own if name.endswith("link_radius") and name in values]
    own -= {name.replace("link_radius", "link_inertia") for name in radii}
    return {name: x for name, x in values.items() if name in own}


def totals(values: Values, owner: str = "") -> dict[str, Any]:
    """Return mass and length of a chain whose links or arcs have their own, of each run."""
    found = {}
    for name, parts in TOTALS.items():
        names = [name_in(owner, part) for part in parts]
        own = [np.sum(values[each], axis=-1) for each in names if each in values]
        if own:
            found[name_in(owner, name)] = sum(own)
    return found


def completed(manifest: dict, values: Values) -> dict[str, Any]:
    """Return the values of each run, with those that follow from them.

    These are link_inertia from link_radius, and mass and length of a tail from those of its links
    or arcs. ModelError if the weight is not finite, or stops exclude each other.
    """
    absent = {"gravity": 0.0} if manifest["scene"].get("weightless") else {}
    chains = entries(manifest)
    values = {**absent, **values}
    for entry in chains:
        values |= totals(values, owner_of(entry))
    if len(chains) > 1:
        masses = [np.asarray(values[name_in(owner_of(e), "tail_mass")]) for e in chains[1:]]
        values[OTHER_CHAINS] = sum(masses)
    with np.errstate(over="ignore"):
        weight = weight_of(values)
    if not np.isfinite(weight).all():
        raise ModelError(
            "parameters: torso_mass, tail_mass and gravity give no finite weight: use kg and m/s^2"
        )
    for entry in chains:
        owner = owner_of(entry)
        _refuse_stops_without_room(values, owner)
        if name_in(owner, "link_radius") in values:
            first, stop = entry["points"]
            moments = np.broadcast_arrays(*link_inertia(values, stop - first - 1, owner))
            values[name_in(owner, "link_inertia")] = np.stack(moments, axis=-1)
    return values


def _refuse_stops_without_room(values: Values, owner: str) -> None:
    """ModelError unless each lower stop of a chain is below the upper one."""
    below, above = (name_in(owner, f"tail_stop_{end}") for end in ("lower", "upper"))
    if below not in values:
        return
    lower, upper = np.asarray(values[below]), np.asarray(values[above])
    wrong = np.argwhere(~(lower < upper))
    if len(wrong):
        lower, upper = (each[tuple(wrong[0])] for each in np.broadcast_arrays(lower, upper))
        raise ModelError(
            f"parameters: {below} {lower:.6g} is not below {above} {upper:.6g} of "
            f"tail coordinate {wrong[0][-1]}: stops exclude each other, move them apart"
        )


def _checked_changes(manifest: dict, changes: object, runs: int | None) -> dict[str, np.ndarray]:
    """Return a caller's changes checked, of one model or, with a leading axis, of many runs."""
    if not isinstance(changes, Mapping | None):
        raise ModelError(
            f"parameters: value {shown(changes)}: needs a mapping, such as {{'gravity': 9.8}}"
        )
    fields = {p["name"]: p for p in manifest["parameters"]}
    problems, sound = [], {}
    # each by itself, then all together
    for name, value in (changes or {}).items():
        checked = checked_value(fields, str(name), value, runs)
        if isinstance(checked, str):
            problems.append(checked)
        else:
            sound[name] = checked
    for radius in [name for name in sound if name.endswith("link_radius")]:
        inertia = radius.replace("link_radius", "link_inertia")
        if inertia in sound:
            problems.append(f"{radius} and {inertia}: give one of them, not both")
    if sound and manifest["scene"]["baked"]:
        problems.append(
            "the parameters are baked into this model: set `baked = false` in its scene and "
            "generate it again"
        )
    if problems:
        raise ModelError("parameters: " + "\n            ".join(problems))
    return sound


def link_inertia(values: Values, links: int, owner: str = "") -> tuple[Any, Any, Any]:
    """Moments of inertia (kg m^2) of one link along y; ModelError if they are not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        across, along, _ = moments = ellipsoid_moments(values, links, owner)
        sound = np.isfinite(across + along).all()
    if not sound:
        raise ModelError(
            f"parameters: {', '.join(name_in(owner, n) for n in SHAPE_OF_LINKS)} give no finite "
            "link_inertia: use kg and m"
        )
    return moments


def ellipsoid_moments(values: Values, links: int, owner: str = "") -> tuple[Any, Any, Any]:
    """Moments of inertia of one of a chain's equal links, an ellipsoid; of numbers or symbols."""
    mass, length, radius = (values[name_in(owner, name)] for name in SHAPE_OF_LINKS)
    return ellipsoid(mass / links, length / links, radius)


def flat(manifest: dict, values: Mapping[str, Value]) -> list[float]:
    """Return the scalars of the C parameter struct in order."""
    scalars: list[float] = []
    for p in manifest["parameters"]:
        if p["in_struct"]:
            value = values[p["name"]]
            scalars += value if isinstance(value, tuple) else [value]
    return scalars


def flat_names(manifest: dict) -> tuple[str, ...]:
    """Return the names of these scalars: that of the parameter, with an index if it has several."""
    names: list[str] = []
    for p in manifest["parameters"]:
        if p["in_struct"]:
            several = p["size"] > 1
            names += [f"{p['name']}[{k}]" for k in range(p["size"])] if several else [p["name"]]
    return tuple(names)


def checked_value(
    fields: dict, name: str, value: object, runs: int | None = None
) -> np.ndarray | str:
    """Return a parameter's value, of each run if there are several, or the error about it."""
    if name not in fields:
        parts = [part for part in TOTALS.get(name, ()) if part in fields]
        remedy = did_you_mean(name, fields) or f"there are {', '.join(fields)}"
        remedy = f"it is the sum of {parts[0]}, change these" if parts else remedy
        return f"{one_line(f'{name}')}: no such parameter; {remedy}"
    # the required value, in words and as a shape
    size, unit = fields[name]["size"], fields[name]["unit"]
    rule = NUMBER_RULES[fields[name]["check"]]
    pieces = fields[name].get("pieces")
    kind = "a finite number" if size == 1 else f"{size} finite numbers"
    kind += f", {size // pieces} of each piece of the tail" if pieces else ""
    of_all = "per" in fields[name] and size > 1  # one number may be given for all coordinates
    kind += ", or one for all," if of_all else ""
    needs = f"needs {kind} ({unit}){', ' if rule.words else ''}{rule.words}"
    shape = (size,) if size > 1 or pieces else ()
    if runs is not None:
        needs, shape = f"{needs}, for each of {runs} runs", (runs, *shape)
    try:
        numbers = numbers_in(in_unit(value, unit))
    except ValueError as error:
        return f"{name}: value {shown(value)}: {error}"
    if numbers is not None and pieces and numbers.shape == (*shape[:-1], pieces, size // pieces):
        numbers = numbers.reshape(shape)
    if of_all and numbers is not None and numbers.shape == shape[:-1]:
        numbers = np.repeat(numbers[..., None], size, axis=-1)
    if numbers is None or numbers.shape != shape:
        return f"{name}: value {shown(value)}: {needs}{_counted(numbers)}"
    # the first run with a wrong value
    rows = numbers.reshape(-1, size)
    wrong = np.flatnonzero(~_sound(rows, rule))
    if not len(wrong):
        return numbers
    needs += _broken(rows[wrong[0]])
    if runs is None:
        return f"{name}: value {shown(value)}: {needs}"
    return f"{name} of run {wrong[0]}: value {shown(numbers[wrong[0]].tolist())}: {needs}"


def _sound(rows: np.ndarray, rule: NumberRule) -> np.ndarray:
    """Tell which rows (K, size) are finite numbers that satisfy a rule."""
    sound: Any = satisfying(rows, rule).all(axis=1)
    if rule.of_body:
        with np.errstate(over="ignore", invalid="ignore"):
            sound = sound & (2 * rows.max(axis=1) <= rows.sum(axis=1) * ROUNDING)
    return sound


def _counted(numbers: np.ndarray | None) -> str:
    """Return the end of a line about a wrong number of numbers; "" for other values."""
    if numbers is None or numbers.ndim > 1:
        return ""
    return "; here is 1 number" if numbers.size == 1 else f"; here are {numbers.size} numbers"


def _broken(row: np.ndarray) -> str:
    """Return the end of a line about moments of inertia of no body; "" for other numbers."""
    if len(row) != 3 or not (np.isfinite(row).all() and (row > 0).all()):
        return ""
    return f"; here {row.max():g} is above {row.sum() - row.max():g}"
