"""The chains of a model: where the numbers of each lie, and what their parameters add up to."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.drives import drives_of
from serpentail_scene.keys import names_of_tendons
from serpentail_scene.layout import ChainLayout, Layout
from serpentail_scene.parameters import NAMES, OUT_OF_REACH, PASSIVE, name_in

from ..basics.errors import ModelError

if TYPE_CHECKING:
    from .model import Model

# coordinates of a segment by its kind
COORDINATES = {"articulated": ("alpha", "beta"), "continuum": ("a", "b"), "polar": ("phi", "theta")}
HINGE = "hinge"  # the kind of segments of limbs
# what stands for springs, damping and stops where a chain has none
NONE = dict.fromkeys(("tail_stiffness", "tail_rest", "tail_damping", "tail_stop_stiffness"), 0.0)
NONE |= {"tail_stop_lower": -OUT_OF_REACH, "tail_stop_upper": OUT_OF_REACH, "tail_stop_width": 1.0}


def entries(manifest: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the manifest's entry of each chain, also where the tail is the only one."""
    sizes = manifest["dimensions"]
    alone = {
        "name": "tail",
        "parameters": "tail",
        "mirrored": False,
        "segments": [0, sizes["segments"]],
        "points": [0, sizes["total"] + 1],
    }
    return list(manifest.get("chains") or [alone])


def owner_of(entry: Mapping[str, Any]) -> str:
    """Return what the names of a chain's parameters begin with; empty for the tail's own."""
    return "" if entry["parameters"] == "tail" else str(entry["parameters"])


def bend_ranges(manifest: Mapping[str, Any]) -> np.ndarray:
    """Return the range (m,), rad, within which the bend of each segment stays if it is an arc."""
    usual = manifest["scene"].get("bend_range", np.inf)
    parts = [
        [entry.get("bend_range", usual)] * (entry["segments"][1] - entry["segments"][0])
        for entry in entries(manifest)
    ]
    return np.concatenate(parts)


def layout_of(manifest: Mapping[str, Any], kinds: tuple[str, ...]) -> Layout:
    """Return the layout of a model whose segments are of these kinds."""
    fixed = manifest["scene"].get("base") == "fixed"
    layout = Layout(len(kinds), fixed, (), kinds.count(HINGE))
    polar = manifest["scene"]["coordinates"] == "polar"
    chains, first = [], 0
    for entry in entries(manifest):
        start = f"{entry['name']}_" if owner_of(entry) else ""
        own = kinds[slice(*entry["segments"])]
        table = manifest["scene"]["chain"][owner_of(entry)] if start else {}
        if HINGE in own:
            names = [joint["name"] for joint in table["joints"]]
        else:
            pairs = [COORDINATES["polar" if polar else kind] for kind in own]
            names = [f"{name}_{i + 1}" for i, pair in enumerate(pairs) for name in pair]
        names, drives = [f"{start}{name}" for name in names], drives_of(table)
        names, moved = ([], names) if "prescribed" in drives else (names, [])
        stop = first + len(names)
        chains.append(
            ChainLayout(
                name=entry["name"],
                owner=owner_of(entry),
                mirrored=entry["mirrored"],
                q=slice(layout.nq - layout.nt + first, layout.nq - layout.nt + stop),
                v=slice(layout.nv - layout.nt + first, layout.nv - layout.nt + stop),
                tau=slice(first, stop),
                segments=slice(*entry["segments"]),
                points=slice(*entry["points"]),
                names=tuple(names),
                driven=tuple(drives[k % len(drives)] != "passive" for k in range(len(names))),
                given=tuple(moved),
            )
        )
        first = stop
    tendons = names_of_tendons(manifest["scene"].get("tendon", {}))
    given = sum(len(chain.given) for chain in chains)
    return replace(layout, chains=tuple(chains), tendons=tendons, given=given)


def limbs_of(model: "Model") -> list[str]:
    """Return the names of the chains of hinges."""
    return [c.name for c in model.layout.chains if HINGE in model.kinds[c.segments]]


def values_of(chain: ChainLayout, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a chain under the names of the tail's."""
    names = {name_in(chain.owner, name): name for name in NAMES}
    return {names[name]: value for name, value in values.items() if name in names}


def turns_of(joints: np.ndarray, values: Mapping[str, Any]) -> np.ndarray:
    """Return by how many times its coordinates each segment turns (m,): its number of joints
    (m,), or the sum of their ratios, which only the tail's joints have; ModelError if one is 0.
    """
    if "joint_ratios" not in values:
        return joints
    own, ratios = np.ravel(values["joint_ratios"]), np.ones(joints.sum())
    ratios[: len(own)] = own
    turns = np.add.reduceat(ratios, np.cumsum(joints) - joints)
    if not turns.all():
        each = (
            f"those of segment {int(np.argmin(turns != 0)) + 1} sum to 0, so that it would not bend"
        )
        raise ModelError(f"joint_ratios: value {own.tolist()}: {each}: change one of them")
    return turns


def refuse_several(model: "Model", field: str, remedy: str, error: type[Exception]) -> None:
    """Raise an error about what works only for a tail alone, if the model has more chains."""
    names = ", ".join(chain.name for chain in model.layout.chains[1:])
    if names:
        raise error(f"{field}: needs a tail alone, and {model.name} has {names}: {remedy}")


def refuse_given(model: "Model", what: str) -> None:
    """Raise ModelError about what prescribed joints cannot do yet, if the model has any."""
    names = ", ".join(chain.name for chain in model.layout.chains if chain.given)
    if names:
        remedy = 'simulate single runs, or set drive = "torque" in the scene'
        raise ModelError(f"{what}: {model.name} has prescribed joints, in {names}: {remedy}")


def refuse_driven(model: "Model", field: str, torques: Any, error: type[Exception]) -> None:
    """Raise an error if one of torques (..., nt) that is not 0 belongs to a passive coordinate."""
    passive = ~np.array(model.layout.driven)
    if passive.any() and (wrong := np.argwhere((np.asarray(torques) != 0) & passive)).size:
        name = model.names.tail[int(wrong[0][-1])]
        remedy = 'give it 0, or set drive = "torque" in the scene'
        raise error(f"{field}: drives {name}, which is passive: {remedy}")


def of_all_coordinates(layout: Layout, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters in which those of the passive tail are of the coordinates of all chains,
    (..., nt); a chain without springs, damping or stops has none.
    """
    found = dict(values)
    for p in [p for p in PASSIVE if p.of_chain]:
        own = [values.get(name_in(chain.owner, p.name)) for chain in layout.chains]
        if len(own) == 1 or all(value is None for value in own):
            continue
        sizes = [chain.tau.stop - chain.tau.start for chain in layout.chains]
        each = [np.asarray(NONE[p.name] if x is None else x, float) for x in own]
        runs = np.broadcast_shapes(*(x.shape[:-1] for x in each))
        parts = [np.broadcast_to(x, (*runs, n)) for x, n in zip(each, sizes, strict=True)]
        found[p.name] = np.concatenate(parts, axis=-1)
    return found
