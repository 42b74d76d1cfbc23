"""The verbs about models: info, verify, export, cache."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..motion.text import as_text
from .outcome import VerbOutcome

if TYPE_CHECKING:
    from ..model.model import Model


def info(arguments: argparse.Namespace) -> VerbOutcome:
    """Return a description of a model."""
    from ..model.info import described
    from ..model.info import info as report

    model = model_of(arguments.model)
    return VerbOutcome(report(model), described(model))


def model_of(place: str) -> "Model":
    """Return the model of a generated folder, else of a scene file or an example."""
    from ..building.build import build
    from ..building.examples import example_paths, scene_path
    from ..model.load import load

    scene = Path(place).suffix == ".toml" or (place in example_paths() and not Path(place).exists())
    if not scene and not Path(place).exists():
        scene_path(place)  # names what is like it
    return build(place) if scene else load(place)


def verify(arguments: argparse.Namespace) -> VerbOutcome:
    """Return which laws a model obeys, and whether it obeys all of them."""
    from ..verification.report import as_text as laws_text
    from ..verification.report import laws, summary

    model = model_of(arguments.model)
    model.serve("evaluate")  # most laws are about these
    checks = laws(model)
    return VerbOutcome(
        summary(model, checks), laws_text(model, checks), all(c.passed for c in checks)
    )


def export(arguments: argparse.Namespace) -> VerbOutcome:
    """Write a model to a file for another tool, and return its path."""
    from ..bridges.exporting.export import checked_path
    from ..bridges.exporting.export import export as written

    if arguments.output is not None:
        checked_path(arguments.kind, arguments.output)  # before the work
    path = written(model_of(arguments.model), arguments.kind, arguments.output)
    return VerbOutcome({"file": str(path)}, str(path))


def cache(arguments: argparse.Namespace) -> VerbOutcome:
    """Return what the cache of compiled models holds; empty it first if asked to."""
    from ..compiling.cache import cache_folder
    from ..compiling.cache_limit import contents, empty

    folder = cache_folder()
    if arguments.clean:
        empty(folder)
    report = contents(folder)
    return VerbOutcome(report, as_text(report))
