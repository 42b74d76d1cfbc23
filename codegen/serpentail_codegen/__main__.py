"""Generate a model from a scene file, or from a tail and its sizes."""

import argparse
import gc
import sys
import time
from pathlib import Path
from typing import Any

from .scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from .scene.problems import SceneError
from .scene.scene import KINDS, Scene
from .scene.signatures.table import ALL


def parser() -> argparse.ArgumentParser:
    """Return the argument parser."""
    p = argparse.ArgumentParser(prog="python -m serpentail_codegen", description=__doc__)
    p.add_argument(
        "scene",
        nargs="?",
        type=Path,
        help="scene file (TOML); leave out and give --tail, --segments, --links",
    )
    p.add_argument("--tail", choices=KINDS, help="tail of a model without a scene file")
    p.add_argument("--segments", type=int, help="m")
    p.add_argument("--links", type=int, help="n, in each segment")
    p.add_argument("--functions", help=f"comma-separated, of {', '.join(ALL)}; all: all of them")
    p.add_argument("--real", help="double or float")
    p.add_argument("--emission", help="auto, straight, loops, lanes or segments")
    p.add_argument("--profile", help="fast, or reproducible: the same bits on every machine")
    p.add_argument("--baked", action="store_true", help="fold the parameters into the code")
    p.add_argument(
        "--output", type=Path, default=Path("generated"), help="parent of the generated folder"
    )
    return p


def scene_of(arguments: argparse.Namespace) -> Scene:
    """Return the scene that the arguments describe."""
    chosen: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in ("real", "emission", "profile")
        if getattr(arguments, name)
    }
    if arguments.functions:
        names = arguments.functions
        chosen["functions"] = names if names == "all" else names.split(",")
    if arguments.baked:
        chosen["baked"] = True
    if arguments.scene:
        scene = load_scene(arguments.scene)
        return parse_scene(scene_to_dict(scene) | chosen, scene.name)
    if None in (arguments.tail, arguments.segments):
        raise SystemExit("give a scene file, or --tail and --segments (and --links): see --help")
    return scene_for(arguments.tail, arguments.segments, arguments.links, **chosen)


def main(argv: list[str] | None = None) -> int:
    """Generate; return the exit status."""
    try:
        arguments = parser().parse_args(argv)
        scene = scene_of(arguments)
    except SceneError as error:
        print(error, file=sys.stderr)
        return 2
    from .pipeline import generate  # sympy is imported only now

    start = time.perf_counter()
    try:
        changed = generate(scene, arguments.output)
    except SceneError as error:  # its folder cannot be written
        print(error, file=sys.stderr)
        return 2
    seconds = time.perf_counter() - start
    folder = arguments.output / scene.name
    print(
        f"{folder}: {len(changed)} files written, {seconds:.2f} s"
        if changed
        else f"{folder}: up to date, {seconds:.2f} s"
    )
    return 0


if __name__ == "__main__":
    gc.disable()  # expressions hold no cycles worth a search, which takes a tenth of a short run
    sys.exit(main())
