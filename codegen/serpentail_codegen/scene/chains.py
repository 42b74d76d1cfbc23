"""Reads the tables `[chain.NAME]` of a scene: chains besides the tail, each read as a tail is."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from serpentail_scene.drives import DRIVE, DRIVES, drives_of
from serpentail_scene.keys import CHAIN, KINDS, NAME, OF_LIMB
from serpentail_scene.parameters import AIR_NAMES, NAMED, NAMES, key_in_chain, name_in
from serpentail_scene.rules import one_of
from serpentail_scene.signatures.table import ALL, OF_GIVEN, OF_TREES

from .checks import MOST_SEGMENTS, MOST_STRAIGHT, plain, segments_in
from .limbs import limb
from .problems import Problem, SceneError, suggest
from .scene import Chain, Parameters, Scene

Parse = Callable[[Mapping[str, Any], str], Scene]
FOUND = [p for p in NAMED if p.of_chain]
OF_CHAINS = {key_in_chain(p.name): p for p in FOUND}
# keys of a scene with several chains that do not work yet: which values, and what to do
REFUSED: dict[str, tuple[Callable[[Any], bool], str]] = {
    "contacts": (
        lambda x: isinstance(x, list | tuple) and "feet" in x,
        '"feet" are legs without mass: name the chain that touches the ground',
    ),
    "coordinates": (lambda x: x == "polar", 'use "bend", or remove the chains'),
    "base": (lambda x: x == "fixed", 'set base = "free", or remove the chains'),
    "baked": (lambda x: x is True, "set baked = false, or remove the chains"),
    "identify": (bool, "remove the table [identify], or the chains"),
}
ENDS = ("", "_dot")  # of the names of coordinates and of their rates
REQUIRED = ("tail_mount", "tail_mass", "tail_length")  # where a chain has them
TAKEN = ("tail", "torso", "feet", "tau", "omega")  # words that other names begin with


@dataclass(frozen=True)
class Chains:
    """The chains that a scene describes, the parameters left for the tail, and problems."""

    chains: tuple[Chain, ...] = ()
    parameters: Any = None
    problems: tuple[Problem, ...] = ()


def chains_of(values: Mapping[str, Any], parse: Parse) -> Chains:
    """Return the chains of a scene; ``parse`` reads a table as that of a tail.

    Parameters named after a chain, such as `hind_mass`, replace what its table says.
    """
    tables, named = values["chain"], values["parameters"]
    if not isinstance(tables, Mapping) or not tables:
        return Chains(parameters=named)
    given = dict(named) if isinstance(named, Mapping) else {}
    chains: list[Chain] = []
    problems: list[Problem] = []
    for name, table in tables.items():
        place = f"chain.{name}"
        if not NAME.holds(name) or name in TAKEN:
            remedy = f"needs a name of a-z, 0-9 and _, none of {', '.join(TAKEN)}"
            problems.append(Problem(place, name, remedy))
        elif not isinstance(table, Mapping):
            remedy = 'needs a table, such as {kind = "articulated", segments = 1, links = 1, ...}'
            problems.append(Problem(place, table, remedy))
        else:
            own = {n: given.pop(n) for n in [n for n in given if _belongs(n, name)]}
            problems += _key_problems(place, table)
            try:
                chains.append(_driven(_chain(name, table, own, parse), drives_of(table)))
            except SceneError as error:
                problems += [_in_table(place, p) for p in error.problems]
    problems += _clashes(chains, tables)
    problems += tree_problems(values, chains)
    return Chains(tuple(chains), given if isinstance(named, Mapping) else named, tuple(problems))


def _belongs(parameter: str, chain: str) -> bool:
    """Tell if a parameter's name is that of a chain."""
    return parameter.removeprefix(f"{chain}_") in OF_CHAINS and parameter not in NAMES


def _in_table(place: str, problem: Problem) -> Problem:
    """Return a problem of a tail as that of the table of a chain, where sizes have no default."""
    name = problem.field.removeprefix("parameters.")
    key = key_in_chain(name) if name != problem.field else name
    sizes = name in REQUIRED and " (default" in problem.remedy
    remedy = problem.remedy.partition(" (default")[0] if sizes else problem.remedy
    return replace(problem, field=f"{place}.{key}", remedy=remedy)


def _key_problems(place: str, table: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each key that no chain has, and for a wrong place or pair."""
    known = OF_LIMB if table.get("kind") == "limb" else (*CHAIN, *OF_CHAINS)
    problems = [
        Problem(f"{place}.{key}", value, f"unknown; {suggest(key, known)}")
        for key, value in table.items()
        if key not in known
    ]
    if table.get("on", "torso") != "torso":
        remedy = 'needs "torso": chains on the tips of others do not exist yet'
        problems.append(Problem(f"{place}.on", table["on"], remedy))
    if not DRIVE.holds(table.get("drive", DRIVES[0])):
        problems.append(Problem(f"{place}.drive", table["drive"], f"needs {DRIVE.text}"))
    if not isinstance(table.get("pair", False), bool):
        problems.append(Problem(f"{place}.pair", table["pair"], "needs true or false"))
    return problems


def _chain(name: str, table: Mapping[str, Any], own: Mapping[str, Any], parse: Parse) -> Chain:
    """Return a chain, read as a tail without torso; what a chain must say has no default."""
    if table.get("kind") not in (*KINDS, "limb"):
        needs = f"needs {one_of((*KINDS, 'limb')).text}"
        raise SceneError([Problem("kind", table.get("kind"), needs)])
    if table["kind"] == "limb":
        named = {OF_CHAINS[n.removeprefix(f"{name}_")].name: value for n, value in own.items()}
        return Chain(name, table.get("pair") is True, limb(name, table, named))
    keys = {key: table[key] for key in CHAIN if key in table and key not in ("on", "pair", "drive")}
    values = {p.name: table[key] for key, p in OF_CHAINS.items() if key in table}
    values |= {OF_CHAINS[n.removeprefix(f"{name}_")].name: value for n, value in own.items()}
    inner = {**keys, "functions": ["mass_matrix"], "parameters": values}
    scene = parse(inner, name)
    if scene.shape.ratios:
        ratios = plain(scene.parameters["joint_ratios"])
        remedy = "only joints of the tail have ratios: remove them"
        raise SceneError([Problem("parameters.joint_ratios", ratios, remedy)])
    needed = [p for p in FOUND if p.name in REQUIRED and p.name in scene.parameters]
    missing = [
        Problem(f"parameters.{p.name}", None, f"has no default: give it in {p.unit}")
        for p in needed
        if p.name not in values
    ]
    if missing:
        raise SceneError(missing)
    return Chain(name, table.get("pair") is True, scene)


def _driven(chain: Chain, drives: list[str]) -> Chain:
    """Return a chain with its drives; SceneError if only some angles are given, or forces act on
    them.
    """
    if "prescribed" not in drives:
        return chain
    remedy = f"these do nothing to angles that are given: remove {', '.join(chain.scene.passive)}"
    if any(drive != "prescribed" for drive in drives):
        remedy = "needs to be the drive of all joints of a chain: set it beside `joints`"
    elif not chain.scene.passive:
        return replace(chain, prescribed=True)
    raise SceneError([Problem("drive", "prescribed", remedy)])


def _clashes(chains: Collection[Chain], tables: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each chain whose name, or that of a parameter or of a joint and its
    rate, another one has, too.
    """
    problems, seen = [], {*NAMES}
    names: list[str] = []
    for chain in chains:
        parameters = [name_in(chain.name, p.name) for p in OF_CHAINS.values()]
        twice = [n for n in chain.names if n in names or (chain.pair and n in tables)]
        joints = [joint["name"] for joint in tables[chain.name].get("joints", ())]
        own = [f"{name}_{joint}{end}" for name in chain.names for joint in joints for end in ENDS]
        twice += [n for n in parameters if n in seen]
        twice += [n for n in own if n in names or own.count(n) > 1]
        if twice:
            remedy = f"{twice[0]} would mean two things: give the chain another name"
            problems.append(Problem(f"chain.{chain.name}", chain.name, remedy))
        seen |= {*parameters}
        names += [*chain.names, *own]
    return problems


def tree_problems(values: Mapping[str, Any], chains: Collection[Chain]) -> list[Problem]:
    """Return a problem for each entry that a model with several chains does not have yet."""
    names = ", ".join(name for chain in chains for name in chain.names)
    this = f"this needs a tail alone; the model has {names}: "
    problems = [
        Problem(key, None if isinstance(values[key], Mapping) else values[key], this + remedy)
        for key, (has, remedy) in REFUSED.items()
        if has(values[key])
    ]
    listed = values["functions"] if isinstance(values["functions"], list | tuple) else ()
    known = OF_GIVEN if any(chain.prescribed for chain in chains) else OF_TREES
    others = [name for name in listed if name in ALL and name not in known]
    this = this if known is OF_TREES else "joints of the model are prescribed: "
    remedy = f"{this}leave it out; there are {', '.join(known)}"
    problems += [Problem("functions", name, remedy) for name in others]
    passive = [
        n
        for n, t in values["chain"].items()
        if isinstance(t, Mapping) and "passive" in drives_of(t)
    ]
    if passive and "pfl" in listed:
        remedy = f"needs a torque for each coordinate, and chain.{passive[0]} has passive ones"
        problems.append(Problem("functions", "pfl", f"{remedy}: leave it out"))
    named = values["parameters"] if isinstance(values["parameters"], Mapping) else {}
    problems += [
        Problem(f"parameters.{name}", named[name], f"{this}remove it")
        for name in (*AIR_NAMES, "tail_stop_damping")
        if name in named
    ]
    segments = values["segments"]
    total = len(segments) if isinstance(segments, list | tuple) else segments_in(values)
    total += sum(chain.scene.segments * len(chain.names) for chain in chains)
    most = MOST_STRAIGHT[0] if values["emission"] == "straight" else MOST_SEGMENTS
    if total > most:
        remedy = f"more than {most} segments of all chains would take hours; choose fewer"
        problems.append(Problem("chain", total, remedy))
    return problems


def all_parameters(own: Parameters, chains: Collection[Chain]) -> Parameters:
    """Return the parameters of torso and tail, then those of each chain under its own names."""
    found = list(own.entries)
    for chain in chains:
        entries = dict(chain.scene.parameters.entries)
        found += [(p.owned(chain.name).name, entries[p.name]) for p in FOUND if p.name in entries]
    return Parameters(tuple(found))
