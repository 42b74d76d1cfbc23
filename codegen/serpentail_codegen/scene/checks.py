"""The rules for a scene's table. A broken rule becomes a problem with a remedy."""

from collections.abc import Collection, Mapping
from typing import Any

from serpentail_scene.keys import CONTACTS, GROUPS, KEYS, ONLY, foreign_to
from serpentail_scene.parameters import (
    AIR_NAMES,
    NAMES,
    PARAMETERS,
    PASSIVE_NAMES,
    WIDTHS,
    Parameter,
    Value,
)
from serpentail_scene.purposes import ADDED
from serpentail_scene.rules import COUNT
from serpentail_scene.signatures.table import AIRBORNE, ALL, DERIVATIVES, FIXED, NEEDS
from serpentail_scene.units import words_of

from .problems import Problem, suggest

# Larger models would take more than about a minute: the work grows with the cube of the
# number of segments, and the text of straight lines with every piece.
MOST_SEGMENTS = 100
MOST_LINKS = 10_000  # or samples, of all segments
MOST_STRAIGHT = (20, 100)  # segments, and pieces in all, of straight lines
GIVEN = {  # what functions need besides contacts
    "air": "needs air: give parameters.air_density",
    "tendons": "needs tendons: give a table [tendon.NAME]",
}
SINGLE = (2.0**-126, (2 - 2.0**-23) * 2.0**127)  # least normal and largest number of a float


def plain(value: Value) -> float | list[float]:
    """Return a value in the types of TOML and JSON."""
    return list(value) if isinstance(value, tuple) else value


def fits(parameter: Parameter, value: Any) -> bool:
    """Tell if a value has as many finite numbers as the parameter, and satisfies its rule."""
    if (parameter.size > 1) != isinstance(value, list | tuple):
        return False
    numbers = value if parameter.size > 1 else [value]
    return len(numbers) == parameter.size and parameter.rule.holds(numbers)


def number_problem(parameter: Parameter, value: object) -> Problem:
    """Say what the parameter needs: size, rule, unit and default."""
    shape = (
        "a finite number" if parameter.size == 1 else f"an array of {parameter.size} finite numbers"
    )
    default = "computed" if parameter.default is None else plain(parameter.default)
    hint = f"(default: {default})"
    if parameter.spread:
        of = "tail coordinate"
        if parameter.name == WIDTHS:
            of = f"end of the {parameter.size - 1} links or arcs, the root's first"
        shape, hint = f"{shape} or one for all", f"(one for each {of})"
    words = f", {parameter.rule.words}" if parameter.rule.words else ""
    remedy = f"needs {shape}{words}{words_of(parameter.unit)} {hint}"
    return Problem(f"parameters.{parameter.name}", value, remedy)


def key_problems(values: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each key whose rule is broken, and for a tail that is too long."""
    broken = [name for name, key in KEYS.items() if not key.rule.holds(values[name])]
    problems = [Problem(name, values[name], f"needs {KEYS[name].rule.text}") for name in broken]
    return problems + size_problems(values)


def size_problems(values: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each size that could not be generated in reasonable time."""
    most, of = (MOST_SEGMENTS, MOST_LINKS), ""
    if values["emission"] == "straight":
        most, of = MOST_STRAIGHT, ' of emission "straight"'
    segments = values["segments"] if COUNT.holds(values["segments"]) else 1
    problems = []
    if segments > most[0]:
        remedy = f"more than {most[0]} segments{of} would take hours; choose fewer"
        problems.append(Problem("segments", segments, remedy))
    for key in ("links", "samples"):
        pieces = tail_pieces(values, key)
        if pieces > most[1]:
            remedy = f"more than {most[1]} {key}{of} in all; choose fewer segments or {key}"
            problems.append(Problem(f"segments * {key}", pieces, remedy))
    return problems


def kind_problems(table: Mapping[str, Any], kind: str) -> list[Problem]:
    """Return a problem for each key and parameter that this kind of tail does not have."""
    problems, parameters, rules = [], parameters_in(table), ONLY[kind]

    # keys and parameters of the other kinds
    remedy = "this kind of tail has none; remove it, or choose another kind"
    keys, names = foreign_to(kind)
    problems += [Problem(key, table[key], remedy) for key in keys if key in table]
    wrong = [key for key in names if key in parameters]
    problems += [Problem(f"parameters.{key}", parameters[key], remedy) for key in wrong]

    # coordinates
    if table.get("coordinates", rules.coordinates[0]) not in rules.coordinates:
        choices = " or ".join(f'"{name}"' for name in rules.coordinates)
        remedy = f"needs {choices}; polar angles are singular at theta = 0, convert states"
        problems.append(Problem("coordinates", table["coordinates"], remedy))
    return problems


def polar_problems(
    table: Mapping[str, Any], kind: str, contacts: Collection[str], wanted: Any
) -> list[Problem]:
    """Return a problem for each entry that polar coordinates do not have."""
    if table.get("coordinates") != "polar":
        return []
    problems, parameters = [], parameters_in(table)
    listed = wanted if isinstance(wanted, list | tuple) else ()
    derivatives = [name for name in listed if name in (*DERIVATIVES, *AIRBORNE, "gradients")]
    if derivatives and "polar" in ONLY[kind].coordinates:
        remedy = f'has no derivatives, such as {derivatives[0]}: use "bend", which has'
        problems.append(Problem("coordinates", "polar", remedy))
    remedy = 'polar coordinates have no springs, damping, stops, motors or air: use "bend"'
    wrong = [name for name in (*PASSIVE_NAMES, *AIR_NAMES) if name in parameters]
    problems += [Problem(f"parameters.{name}", parameters[name], remedy) for name in wrong]
    if contacts:
        remedy = 'polar coordinates have no contacts: use "bend"'
        problems.append(Problem("contacts", list(contacts), remedy))
    return problems


def lacking(needs: str, contacts: Collection[str]) -> str:
    """Return the group of contact points to add if a need is not met; feet if any group
    would do.
    """
    if not needs or needs in contacts or (needs == "contacts" and contacts):
        return ""
    return "feet" if needs == "contacts" else needs


def contacts_in_order(
    contacts: Collection[str], chains: Any
) -> tuple[tuple[str, ...], list[Problem]]:
    """Return the groups of contact points in their order, and a problem for each that is none;
    ``chains``: tables by name.
    """
    groups = (*GROUPS[:2], *(chains if isinstance(chains, Mapping) else ()), *GROUPS[2:])
    unknown = [
        Problem("contacts", name, f"needs {CONTACTS.text}; {suggest(name, groups)}")
        for name in contacts
        if name not in groups
    ]
    return tuple(group for group in groups if group in contacts), unknown


def contact_problems(
    table: Mapping[str, Any], values: Mapping[str, Any], contacts: Collection[str]
) -> list[Problem]:
    """Return a problem for each entry that needs contacts which the scene does not have."""
    problems, parameters = [], parameters_in(table)

    # parameters of groups that do not touch the ground
    lacks = {p.name: lacking(p.needs, contacts) for p in PARAMETERS if p.name in parameters}
    for name, group in [(name, group) for name, group in lacks.items() if group]:
        remedy = f'nothing touches the ground by it; add "{group}" to `contacts`, or remove it'
        problems.append(Problem(f"parameters.{name}", parameters[name], remedy))

    # where a point may be within a step is bounded for joints that turn alike
    if values["shape"].ratios and "tail" in contacts:
        remedy = "a tail whose joints have ratios does not touch the ground: remove tail"
        problems.append(Problem("contacts", list(contacts), remedy))

    # a flight has no friction and no functions of the ground; some need one group of points
    remedy = 'needs points that touch the ground: add contacts = ["feet"]'
    if "friction" in table and not contacts:
        problems.append(Problem("friction", table["friction"], remedy))
    wanted = values["functions"] if isinstance(values["functions"], list | tuple) else ()
    present = [*contacts, *["air"] * any(name in parameters for name in AIR_NAMES)]
    present += ["tendons"] * bool(values["tendon"])
    lacks = {name: lacking(needs, present) for name, needs in NEEDS.items() if name in wanted}
    for name, group in [(name, group) for name, group in lacks.items() if group]:
        other = GIVEN.get(group, f'needs {group}: add "{group}" to `contacts`')
        problems.append(Problem("functions", name, other if contacts or group in GIVEN else remedy))
    return problems


def fixed_problems(values: Mapping[str, Any], contacts: Collection[str]) -> list[Problem]:
    """Return a problem for each entry that a tail on a fixed base does not have."""
    if values["base"] != "fixed":
        return []
    remedy = 'a fixed base has none; remove it, or set base = "free"'
    problems = [Problem("contacts", list(contacts), remedy)] if contacts else []
    wanted = values["functions"] if isinstance(values["functions"], list | tuple) else ()
    others = [name for name in wanted if name in ALL and name not in FIXED]
    return problems + [Problem("functions", name, remedy) for name in others]


def parameters_in(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the table of parameters; an empty one if it is no table, which another check
    reports.
    """
    parameters = table.get("parameters", {})
    return parameters if isinstance(parameters, Mapping) else {}


def single_problems(parameters: Mapping[str, Value]) -> list[Problem]:
    """Return a problem for each parameter that single precision cannot hold."""
    least, largest = SINGLE
    remedy = 'beyond single precision, 1.2e-38 to 3.4e38; set real = "double"'
    problems = []
    for name, value in parameters.items():
        numbers = value if isinstance(value, tuple) else (value,)
        if any(x and not least <= abs(x) <= largest for x in numbers):
            problems.append(Problem(f"parameters.{name}", plain(value), remedy))
    return problems


def segments_in(values: Mapping[str, Any]) -> int:
    """Return m, or 1 if it is wrong, and at most what can be generated."""
    m = values["segments"]
    return min(m, MOST_SEGMENTS) if COUNT.holds(m) else 1


def tail_pieces(values: Mapping[str, Any], key: str = "links") -> int:
    """Return N = m n, or 1 if m or n is wrong; n counts the links or the samples of a segment."""
    m, n = values["segments"], values[key]
    return m * n if COUNT.holds(m) and COUNT.holds(n) else 1


def function_problems(wanted: Any) -> list[Problem]:
    """Return a problem for each unknown or repeated function, or for a value that is no array."""
    if not isinstance(wanted, list | tuple) or not wanted:
        remedy = (
            'needs an array of names, such as ["mass_matrix"]; leave it out for the usual ones, or '
            '"all"'
        )
        return [Problem("functions", wanted, remedy)]
    problems = []
    for i, name in enumerate(wanted):
        bare = name.removeprefix(ADDED) if isinstance(name, str) else name
        if bare not in ALL:
            problems.append(Problem(f"functions[{i}]", name, f"unknown; {suggest(bare, ALL)}"))
        elif name in wanted[:i]:
            problems.append(
                Problem(f"functions[{i}]", name, "listed before; remove one of the two")
            )
    if not problems and any(name.startswith(ADDED) for name in wanted):
        remedy = 'give all a "+", which adds to what the scene is for, or none, for exactly these'
        problems.append(Problem("functions", list(wanted), remedy))
    return problems


def unknown_keys(table: Mapping[str, Any], prefix: str, names: Collection[str]) -> list[Problem]:
    """Return a problem for each unknown key, with its correct place or spelling."""
    elsewhere, place = (KEYS, "above") if prefix else (NAMES, "below")
    problems = []
    for key in [key for key in table if key not in names]:
        hint = f"belongs {place} the line [parameters]" if key in elsewhere else suggest(key, names)
        problems.append(Problem(f"{prefix}{key}", table[key], f"unknown here; {hint}"))
    return problems
