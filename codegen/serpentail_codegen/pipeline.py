"""The stages in order: a scene goes in, its generated folder comes out."""

from pathlib import Path

from . import __version__
from .functions.catalogue import CATALOGUE, SYMBOLIC
from .functions.tail import Tail
from .scene.scene import Scene
from .targets.c.batch import batch_entry, batch_file, batches
from .targets.c.batch_rollout import flights, flights_entry, flights_file
from .targets.c.form import emit
from .targets.c.model import c_context, c_files
from .targets.c.package import package_files
from .targets.casadi.module import casadi_module
from .targets.manifest import manifest
from .targets.write import digest, write_folder


def generate(scene: Scene, output: Path) -> list[str]:
    """Derive, lower, emit and write what the scene asks for into ``output/<scene>``; return the
    changed files.
    """
    tail = tail_of(scene)
    wanted = [CATALOGUE[name].of(tail) for name in needed(scene.functions, bool(scene.contacts))]
    emitted = [emit(scene, tail, function) for function in wanted]
    context = c_context(scene, tail, emitted, __version__)
    context["content_hash"] = digest("".join(c_files(scene, context).values()))[:16]
    batched = batches(scene, tail, emitted)
    together = flights(scene, tail, emitted)
    files = (
        c_files(scene, context) | batch_file(scene, tail, batched, context) | package_files(context)
    )
    files |= flights_file(scene, together, context)
    module = casadi_module(
        scene, tail, [f for f in wanted if f.name in SYMBOLIC], __version__, context["content_hash"]
    )
    files[f"{scene.name}_casadi.py"] = module
    described = (
        manifest(scene, context, emitted)
        | {"batch": batch_entry(scene, batched)}
        | flights_entry(together)
    )
    return write_folder(output / scene.name, files, described)


def tail_of(scene: Scene) -> Tail:
    """Return the sizes of a scene's tail."""
    pieces = scene.links if scene.kind == "articulated" else scene.samples
    polar = scene.coordinates == "polar"
    return Tail(
        scene.segments, pieces, scene.kind, scene.bend_range, polar, scene.contacts, scene.friction
    )


def needed(names: tuple[str, ...], contacts: bool = False) -> list[str]:
    """Return the functions to derive: those asked for, those that a rollout calls, the parts of an
    implicit solve.
    """
    flight = ("forward_dynamics", "tracked_dynamics") if "pfl" in names else ("forward_dynamics",)
    called = ("contact_points", "contact_dynamics") if contacts else flight
    parts = {"rollout": called, "implicit": ("implicit_factor", "implicit_solve")}
    names = {*names, *(part for name in names for part in parts.get(name, ()))}
    return [name for name in CATALOGUE if name in names]
