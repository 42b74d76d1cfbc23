"""The verbs about scene files: which there are, a new one, the C of one."""

import argparse
import json
import subprocess
from pathlib import Path

from ..basics.errors import SerpentailError
from ..basics.files import replacing
from .outcome import VerbOutcome


def examples(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the scenes that come with the package."""
    from serpentail_scene.source import tables_of

    from ..building.examples import example_paths, examples

    found, lines = examples(), []
    for name, path in example_paths().items():
        tables = tables_of(path)
        verbs = [verb for verb in ("simulate", "plan", "identify") if verb in tables]
        lines.append(f"{name:<30}{found[name]} ({', '.join(verbs) or 'model only'})")
    return VerbOutcome(found, "\n".join(lines))


def new(arguments: argparse.Namespace) -> VerbOutcome:
    """Write a scene file: of options, or a copy of an example."""
    from ..building.examples import scene_path
    from ..building.new_scene import new_scene

    path = Path(arguments.file)
    if path.suffix != ".toml":
        raise SerpentailError(f"file: value {arguments.file!r:.200}: needs a name ending in .toml")
    if path.exists():
        raise SerpentailError(f"file: value {arguments.file!r:.200}: is there; name another one")
    if arguments.example:
        text = scene_path(arguments.example).read_text(encoding="utf-8")
    else:
        options = ("tail", "segments", "links", "contacts")
        text = new_scene(**{name: getattr(arguments, name) for name in options})
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return VerbOutcome({"scene": str(path)}, f"{path}: try `serpentail simulate {path}`")


def generate(arguments: argparse.Namespace) -> int:
    """Run the generator's own command line, and return its status."""
    from ..building.examples import example_paths, scene_path
    from ..building.generator import command

    known = example_paths()
    words = [str(scene_path(word)) if word in known else word for word in arguments.words]
    return subprocess.run([*command(), *words], check=False).returncode


def schema(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the JSON Schema of scene files, for editors."""
    from ..scenes.schema import scene_schema

    found = scene_schema()
    return VerbOutcome(found, json.dumps(found, indent=1))


def completion(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the script by which a shell completes the command line."""
    from ..basics.extras import needed
    from .arguments import parser

    script = needed("shtab", "completion").complete(parser(), arguments.shell)
    return VerbOutcome({"script": script}, script)
