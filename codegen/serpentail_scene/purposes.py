"""What a scene is for, and the functions that this takes: only these are derived."""

from collections.abc import Collection, Mapping
from typing import Any

from .drives import drives_of
from .parameters import AIR_NAMES, PARTS, parts_of
from .signatures.table import (
    AIRBORNE,
    ALL,
    DERIVATIVES,
    EXACT_DERIVATIVES,
    FIXED,
    NEEDS,
    OF_GIVEN,
    OF_TREES,
)

MOTION = ("forward_dynamics", "energy", "momentum", "tail_points", "center_of_mass")
TENDONS = ("tendon_lengths", "tendon_torques")
RUNS = (*MOTION, "rollout", "implicit", "contact_points", "leg_points", "air_force", *TENDONS)
PURPOSES: dict[str, tuple[str, ...]] = {
    "simulate": RUNS,
    "plan": (*RUNS, "mass_matrix", "pfl", *AIRBORNE),
    "mpc": ("momentum", "airborne_rates", "airborne_rates_derivatives"),
    "identify": (
        *(*MOTION, "inverse_dynamics", "forward_dynamics_derivatives"),
        "forward_dynamics_parameter_derivatives",
    ),
    # all values at one state
    "evaluate": (
        *(*MOTION, "mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics_external"),
        *("tail_point_jacobians", "contact_points", "leg_points", "contact_dynamics", "pfl"),
        "air_force",
        *TENDONS,
    ),
    # what CasADi, JAX and PyTorch differentiate compiled functions by
    "derivatives": (
        *EXACT_DERIVATIVES,
        *(name for orders in EXACT_DERIVATIVES.values() for order in orders for name in order),
    ),
}
TABLES = ("simulate", "plan", "identify")  # of a scene, named as their purposes
ADDED = "+"  # before a name in `functions`: besides those of the purposes


def functions_of(tables: Mapping[str, Any]) -> Any:
    """Return the names of a scene's functions; what is wrong stays as it is, for the checks.

    "all" means all that the scene can have but gradients and loads, which are added to a model that
    is asked for them; names without "+" exactly these; keys ``purpose`` and names with "+" add to
    what the scene's tables need.
    """
    chosen = tables.get("functions", ())
    if chosen == "all":
        return possible(tables, {*ALL} - {"gradients", "loads"}, polar=False)
    if not isinstance(chosen, list | tuple) or ("functions" in tables and not chosen):
        return chosen
    added = [name[1:] for name in chosen if isinstance(name, str) and name.startswith(ADDED)]
    own = chosen if not added else ()
    if added and (len(added) < len(chosen) or not {*added} <= {*ALL}):
        return chosen
    purposes = [name for name in _entries(tables.get("purpose")) if name in list(PURPOSES)]
    names = list(own or dict.fromkeys([*needed_for(tables, purposes_of(tables)), *added]))
    return names + [name for name in needed_for(tables, purposes) if name not in names]


def purposes_of(tables: Mapping[str, Any]) -> list[str]:
    """Return what a scene is for by its tables."""
    phases = _entries(tables.get("phase"))
    found = [name for name in TABLES if tables.get(name)] + ["simulate"] * bool(phases)
    found += ["plan"] * any(phase.get("plan") for phase in phases if isinstance(phase, Mapping))
    return found or ["simulate"]


def possible(tables: Mapping[str, Any], names: Collection[str], polar: bool = True) -> list[str]:
    """Return those of some functions that a scene can have, in their order.

    polar: whether those that polar coordinates lack are left out.
    """
    contacts = _entries(tables.get("contacts"))
    present = [*contacts, *["air"] * bool({*AIR_NAMES} & {*_keys(tables.get("parameters"))})]
    present += ["tendons"] * bool(tables.get("tendon"))
    without = {name for name, group in NEEDS.items() if group not in present}
    without -= {name for name, group in NEEDS.items() if group == "contacts" and contacts}
    if polar and tables.get("coordinates") == "polar":
        without |= {*DERIVATIVES, *AIRBORNE, "gradients"}
    if tables.get("base") == "fixed":
        without |= {*ALL} - {*FIXED}
    if tables.get("chain"):
        tables_of_chains = _keys(tables["chain"]).values()
        drives = [drive for each in tables_of_chains for drive in drives_of(_keys(each))]
        without |= {*ALL} - {*(OF_GIVEN if "prescribed" in drives else OF_TREES)}
        without |= {"pfl"} if "passive" in drives else set()
    return [name for name in ALL if name in names and name not in without]


def together(tables: Mapping[str, Any], name: str) -> list[str]:
    """Return a function and those that come with it if it is the first one that is missing."""
    values = possible(tables, PURPOSES["evaluate"])
    return values if name in values else [name]


def needed_for(tables: Mapping[str, Any], purposes: Collection[str]) -> list[str]:
    """Return the functions that a scene has for purposes."""
    names = {name for purpose in purposes for name in PURPOSES[purpose]}
    # flights of a passive tail may be stiff, as the ground is
    if not tables.get("contacts") and not _passive(tables):
        names -= {"implicit"}
    acting = [tables.get("simulate"), *_entries(tables.get("phase"))]
    laws = [law for table in acting for law in _entries(_keys(table).get("controller"))]
    names |= {"pfl"} if any(_keys(law).get("kind") == "pfl" for law in laws) else set()
    names |= {"loads"} if _entries(_keys(tables.get("simulate")).get("load")) else set()
    return possible(tables, names)


def _passive(tables: Mapping[str, Any]) -> bool:
    """Tell if the tail or another chain has springs, damping or stops."""
    chains = [{f"tail_{key}" for key in _keys(t)} for t in _keys(tables.get("chain")).values()]
    return any(
        {*parts_of(names)} & {*PARTS} for names in (_keys(tables.get("parameters")), *chains)
    )


def _entries(value: Any) -> list[Any]:
    """Return the entries of an array, one of a table; none of what is neither."""
    return list(value) if isinstance(value, list | tuple) else [value] * isinstance(value, Mapping)


def _keys(value: Any) -> Mapping[str, Any]:
    """Return a table; an empty one in place of what is none."""
    return value if isinstance(value, Mapping) else {}
