"""The C target's files: the model, batches of states, and a package that builds without Python."""

from collections.abc import Iterable
from typing import Any

from ...functions.function import Function
from ...functions.tail import Tail
from ...scene.scene import Scene
from ..target import Emission, Target
from ..templating import render
from .batch import batch_entry, batch_files, batches
from .batch_rollout import batch_rollout, batch_rollout_entry, batch_rollout_file
from .form import RULE, printed_function
from .loops import LoopPrinter
from .model import c_context, model_files
from .records import layouts

PACKAGE = {  # files that a user of the C alone needs besides it
    "Makefile": "package/makefile.jinja",
    "CMakeLists.txt": "package/cmake.txt.jinja",
    "LICENSE": "package/license.txt.jinja",
    "README.md": "package/readme.md.jinja",
}


def emit(scene: Scene, tail: Tail, functions: Iterable[Function], version: str) -> Emission:
    """Return the C of a scene; the content hash is of the model's own files."""
    printed = [printed_function(scene, tail, function) for function in functions]
    context = c_context(scene, tail, printed, version)
    model = model_files(scene, context)

    # what a host uses beside the model
    batched = batches(scene, tail, printed)
    runs = batch_rollout(scene, tail, printed)
    files = model | batch_files(scene, tail, batched, context)
    files |= batch_rollout_file(scene, tail, runs, context)
    files |= {name: render("c", template, context) for name, template in PACKAGE.items()}

    entries = c_entries(context) | {"batch": batch_entry(scene, batched)}
    entries |= batch_rollout_entry(tail, runs)
    if scene.emission == "auto":
        entries["forms"] = RULE
    described = {
        f.function.name: {"emission": f.emission, "operations": f.body.operations} for f in printed
    }
    return Emission(files, tuple(model), entries, described)


def c_entries(context: dict[str, Any]) -> dict[str, Any]:
    """Return what a caller must know about the model's C: its interface, workspace, simulation."""
    work = {f["name"]: f["work"] for f in context["works"]}
    entries = {"abi_hash": context["abi_hash"], "work": work}
    if "has" in context:
        has = context["has"]
        numbers = {name: number for number, name in enumerate(context["methods"])}
        methods = {name: numbers[name] for name in has.methods}
        work["rollout"] = context["rollout_work"]
        entries["simulation"] = {
            "methods": methods,
            "ledger": list(map(list, has.ledger)),
            **({"parts": [name for name, *_ in has.parts]} if has.contacts else {}),
            "records": layouts(has),
        }
    return entries


C = Target("c", LoopPrinter, emit)
