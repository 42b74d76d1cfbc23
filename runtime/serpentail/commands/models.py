"""The verbs about models: what one is, whether it obeys its laws, what the cache holds."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .outcome import Outcome, rows

if TYPE_CHECKING:
    from ..model.model import Model


def info(arguments: argparse.Namespace) -> Outcome:
    """Return what a model is."""
    report = described(model_of(arguments.model))
    return Outcome(report, as_text(report))


def model_of(place: str) -> "Model":
    """Return the model of a generated folder, else of a scene file or an example."""
    from ..building.build import build
    from ..building.examples import examples
    from ..model.model import load

    scene = Path(place).suffix == ".toml" or (place in examples() and not Path(place).exists())
    return build(place) if scene else load(place)


def described(model: "Model") -> dict[str, Any]:
    """Return what a model is: sizes, functions, how each was emitted, what it costs."""
    from ..model.parameters import json_ready

    functions = {}
    for name, entry in model.manifest["functions"].items():
        functions[name] = {
            "inputs": {port["name"]: port["shape"] for port in entry["inputs"]},
            "outputs": {port["name"]: port["shape"] for port in entry["outputs"]},
            "emission": entry["emission"],
            "operations": entry["operations"],
        }
    return {
        "name": model.name,
        "real": model.manifest["real"],
        "kind": model.kind,
        "segments": model.segments,
        "links": model.links,
        "samples": model.samples,
        "nq": model.nq,
        "nv": model.nv,
        "parameters": json_ready(model.parameters),
        "functions": functions,
    }


def as_text(report: dict[str, Any]) -> str:
    """Return an info report as text."""
    shape = "{segments} continuum segments"
    if report["links"]:
        shape = "{segments} segments x {links} links"
    head = ("{name}: " + shape + ", nq {nq}, nv {nv}, {real}").format(**report)
    lines = [
        f"  {name:<28}{entry['emission']:<10}{entry['operations']:>8} operations"
        for name, entry in report["functions"].items()
    ]
    return "\n".join([head, *lines])


def verify(arguments: argparse.Namespace) -> Outcome:
    """Return which laws a model obeys, and whether it obeys all of them."""
    from ..verification.report import as_text, laws, summary

    model = model_of(arguments.model)
    checks = laws(model)
    return Outcome(summary(model, checks), as_text(model, checks), all(c.passed for c in checks))


def cache(arguments: argparse.Namespace) -> Outcome:
    """Return what the cache of compiled models holds, emptied before where that is asked for."""
    from ..model.bound import contents, empty
    from ..model.cache import cache_folder

    folder = cache_folder(None)
    if arguments.clean:
        empty(folder)
    report = contents(folder)
    return Outcome(report, rows(report))
