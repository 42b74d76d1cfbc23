"""Generate a model from a scene file, or from a tail and its sizes."""

import argparse
import gc
import hashlib
import json
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from serpentail_scene.digest import generator_digest
from serpentail_scene.keys import KINDS
from serpentail_scene.signatures.table import ALL
from serpentail_scene.source import tables_of

from .scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from .scene.problems import Problem, SceneError
from .scene.scene import Scene


def parser() -> argparse.ArgumentParser:
    """Return the argument parser."""
    p = argparse.ArgumentParser(prog="serpentail generate", description=__doc__)
    p.add_argument(
        "scene",
        nargs="?",
        type=Path,
        help="scene file (TOML); leave out and give --tail, --segments, --links",
    )
    p.add_argument("--tail", choices=KINDS, help="tail of a model without a scene file")
    p.add_argument("--segments", type=int, help="m")
    p.add_argument("--links", type=int, help="n, in each segment")
    names = f"comma-separated, of {', '.join(ALL)}; +NAME: besides the usual ones; all: all of them"
    p.add_argument("--functions", help=names)
    p.add_argument("--real", help="double or float")
    p.add_argument("--emission", help="auto, straight, loops, lanes or segments")
    p.add_argument("--profile", help="fast, or reproducible: the same bits on every machine")
    p.add_argument("--baked", action="store_true", help="fold the parameters into the code")
    p.add_argument("--given", type=Path, help="scene file whose parameters are only checked")
    p.add_argument("--name", help="of the model; by default the scene's, and what options change")
    p.add_argument(
        "--output", type=Path, default=Path("generated"), help="parent of the generated folder"
    )
    p.add_argument("--progress", type=Path, help="keep in this file how far it is")
    p.add_argument("--print-folder", action="store_true", help="only tell which folder it is")
    return p


def scene_of(arguments: argparse.Namespace) -> Scene:
    """Return the scene that the arguments describe; the options are part of its name."""
    chosen: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in ("real", "emission", "profile", "name")
        if getattr(arguments, name)
    }
    if arguments.functions:
        names = arguments.functions
        chosen["functions"] = names if names == "all" else names.split(",")
    if arguments.baked:
        chosen["baked"] = True
    if arguments.scene:
        own = load_scene(arguments.scene)
        scene = parse_scene(tables_of(arguments.scene) | chosen, own.name)
    else:
        size = (arguments.tail, arguments.segments, arguments.links)
        if None in size[:2]:
            missing = "give a scene file, or --tail and --segments (and --links): see --help"
            raise SceneError([Problem("scene", None, missing)])
        own, scene = scene_for(*size), scene_for(*size, **chosen)
    if arguments.name:
        return scene
    name = own.name + _suffix(scene, own, arguments.functions)
    return parse_scene(scene_to_dict(scene) | {"name": name}, name)


def _suffix(scene: Scene, own: Scene, functions: str | None = None) -> str:
    """Return what options add to the name of a scene.

    functions: as the user gave them; "all" is added as a word, other choices as a short hash.
    """
    keys = ("real", "emission", "profile")
    words = [getattr(scene, key) for key in keys if getattr(scene, key) != getattr(own, key)]
    if scene.baked != own.baked:
        words.append("baked")
    if scene.functions != own.functions:
        digest = hashlib.sha256(",".join(scene.functions).encode()).hexdigest()
        words.append("all" if functions == "all" else f"f{digest[:6]}")
    return "".join(f"_{word}" for word in words)


def main(argv: list[str] | None = None) -> int:
    """Generate the model if its folder is not up to date; return the exit status."""
    try:
        print(_answer(parser().parse_args(argv)))
    except SceneError as error:  # of the scene, or a folder that cannot be written
        print(error, file=sys.stderr)
        return 2
    return 0


def _answer(arguments: argparse.Namespace) -> str:
    """Do what the arguments ask for, and return what to print."""
    scene = scene_of(arguments)
    if arguments.given:
        load_scene(arguments.given)
    folder = arguments.output / scene.name
    if arguments.print_folder:
        return str(folder)
    start = time.perf_counter()
    changed = made(scene, folder, arguments.progress)
    outcome = f"{len(changed)} files written" if changed else "up to date"
    return f"{folder}: {outcome}, {time.perf_counter() - start:.2f} s"


def made(scene: Scene, folder: Path, progress: Path | None = None) -> list[str]:
    """Generate a scene unless its folder is up to date; return the files that changed.

    progress: a file into which the progress is written.
    """
    stamp = folder.parent / ".stamps" / folder.name  # the folder holds only generated files
    with suppress(OSError, ValueError, KeyError, TypeError):  # none, or a damaged folder
        if stamp.read_text() == stamp_of(scene, folder):
            return []
    from .pipeline import generate  # sympy is imported only now

    def tell(done: float, function: str) -> None:
        if progress is not None:
            progress.write_text(f"{done:.3f} {function}\n")

    changed = generate(scene, folder.parent, tell)
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(stamp_of(scene, folder))
    return changed


def stamp_of(scene: Scene, folder: Path) -> str:
    """Return the hash of all that a scene's folder depends on, and of all that it holds.

    Times of files would mislead: a scene file that is restored is older than the folder that was
    made of another version of it.
    """
    manifest = (folder / "manifest.json").read_bytes()
    names = json.loads(manifest)["files"]
    depends = json.dumps([scene_to_dict(scene), generator_digest()], sort_keys=True).encode()
    contents = [(folder / name).read_bytes() for name in names]
    return hashlib.sha256(b"".join([depends, manifest, *contents])).hexdigest()


if __name__ == "__main__":
    gc.disable()  # a search for cycles takes a tenth of a short run; expressions have none worth it
    status = main()
    sys.stdout.flush()
    os._exit(status)  # at once: to take all expressions apart takes a fifth of a short run
