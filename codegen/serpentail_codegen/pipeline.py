"""The stages of a generation in order, from a scene to its folder."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path

from serpentail_scene.keys import KINDS
from serpentail_scene.parameters import PARTS

from . import __version__
from .functions.catalogue import CATALOGUE, function_of
from .functions.function import Function
from .functions.tail import Tail
from .scene.scene import Scene
from .scene.variant import Shape
from .targets.c.target import C
from .targets.casadi.target import CASADI
from .targets.manifest import FORMAT, manifest
from .targets.target import SEAL, Emission
from .targets.write import digest, write_folder

TARGETS = {target.name: target for target in (C, CASADI)}
Tell = Callable[[float, str], object]  # which part is done, and the function that comes now


def generate(scene: Scene, output: Path, tell: Tell | None = None) -> list[str]:
    """Derive, emit and write what a scene asks for to ``output/<scene>``; return the files that
    changed.

    tell: called when each function is begun for each target.
    """
    tail = tail_of(scene)
    functions = [function_of(name, tail) for name in needed(scene)]
    emissions = []
    for k, name in enumerate(scene.targets):
        one_by_one = reported(functions, tell, (k, len(scene.targets)))
        emissions.append(TARGETS[name].emit(scene, tail, one_by_one, __version__))

    # the hash is computed from the texts without it, then put into them
    content_hash = hash_of(emissions[0])
    files = {
        path: text.replace(SEAL, content_hash)
        for emission in emissions
        for path, text in emission.files.items()
    }
    head = {"format": FORMAT, "generator": __version__, "content_hash": content_hash}
    described = head | manifest(scene, tail, functions, emissions)
    return write_folder(output / scene.name, files, described)


def reported(
    functions: Collection[Function], tell: Tell | None, place: tuple[int, int]
) -> Iterator[Function]:
    """Yield the functions of target number ``place[0]`` of ``place[1]``, and report each one."""
    k, targets = place
    for j, function in enumerate(functions):
        if tell is not None:
            tell((k + j / len(functions)) / targets, function.name)
        yield function


def hash_of(emission: Emission) -> str:
    """Return the content hash of a model, computed from what its first target derived."""
    texts = "".join(emission.files[path] for path in emission.derivation)
    return digest(texts.replace(SEAL, ""))[:16]


def tail_of(scene: Scene) -> Tail:
    """Return the sizes of a scene's tail, or of the tree of its chains."""
    tail = _chain_of(scene)
    if not scene.chains:
        return tail
    chains = [tail]
    for described in scene.chains:
        sloped = scene.shape.sloped
        shape = replace(described.scene.shape, weightless=scene.weightless, sloped=sloped)
        one = replace(_chain_of(described.scene), shape=shape, owner=described.name)
        one = replace(one, prescribed=described.prescribed)
        for name in described.names:
            last = chains[-1]
            chains.append(
                replace(
                    one,
                    name=name,
                    mirrored=described.pair and name != described.names[0],
                    segments_before=last.segments_before + last.segments,
                    coordinates_before=sum(
                        c.nt + c.given for c in chains if c.prescribed == one.prescribed
                    ),
                    points_before=last.points_before + last.tail_points,
                )
            )
    return _tree(tail, tuple(chains))


def _tree(tail: Tail, chains: tuple[Tail, ...]) -> Tail:
    """Return the sizes of an animal of several chains: those of all segments, one after another."""
    stretches = [stretch for chain in chains for stretch in chain.stretches]
    each = [stretch for stretch in stretches for _ in range(stretch.stop - stretch.first)]
    own = [replace(s, kind=s.kind if s.kind in KINDS else "hinge") for s in each]
    kinds, counts = (tuple(getattr(s, name) for s in own) for name in ("kind", "points"))
    mixed = len(set(kinds)) > 1
    owned = {name: [c.name for c in chains if c.owner == name] for name in tail.contacts}
    fall = Shape(weightless=tail.shape.weightless, sloped=tail.shape.sloped)
    return replace(
        tail,
        segments=len(each),
        links=max(counts),
        kind="mixed" if mixed else kinds[0],
        bend_range=max(chain.bend_range for chain in chains),
        contacts=tuple(group for name, own in owned.items() for group in own or [name]),
        shape=replace(fall, counts=counts, kinds=kinds * mixed),
        passive=tuple(part for part in PARTS if any(part in chain.passive for chain in chains)),
        branches=chains,
    )


def _chain_of(scene: Scene) -> Tail:
    """Return the sizes of one chain, described as a tail."""
    pieces = scene.links if scene.kind == "articulated" else scene.samples
    polar = scene.coordinates == "polar"
    return Tail(
        segments=scene.segments,
        links=pieces,
        kind=scene.kind,
        bend_range=scene.bend_range,
        polar=polar,
        contacts=scene.contacts,
        friction=scene.friction,
        shape=scene.shape,
        passive=scene.passive,
        widths=scene.widths,
    )


def needed(scene: Scene) -> list[str]:
    """Return the functions to derive: those asked for, and those that rollouts and solves call."""
    names = scene.functions
    flight = ["forward_dynamics", *["tracked_dynamics"] * ("pfl" in names)]
    called = ["contact_points", "contact_rates"] if scene.contacts else flight
    called += ["inverse_dynamics"] * any(chain.prescribed for chain in scene.chains)
    called += ["air_force"] * bool(scene.widths) + ["tendon_torques"] * bool(scene.shape.tendons)
    margins = ["margins", "margins_vjp"] * bool(scene.contacts)
    transposed = ["implicit_solve_transposed"] * ("implicit" in names)
    parts = {
        "rollout": called,
        "loads": ["push_rates"],
        "implicit": ["implicit_factor", "implicit_solve"],
        "gradients": ["rates_vjp", "rates_jvp", *margins, *transposed],
    }
    wanted = {*names, *(part for name in names for part in parts.get(name, ()))}
    return [name for name in CATALOGUE if name in wanted]
