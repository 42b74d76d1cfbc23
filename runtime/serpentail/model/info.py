"""Descriptions of a model, as data and as text: sizes, functions, arguments, costs."""

from typing import Any

from .model import Model
from .parameters import json_ready


def info(model: Model) -> dict[str, Any]:
    """Return a description of a model as data: sizes, functions, their form and cost."""
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


def described(model: Model) -> str:
    """Return a description of a model as text: sizes, functions, arguments with units."""
    real = model.manifest["real"]
    lines = [f"{model.name}: {model.tail_words()}, nq {model.nq}, nv {model.nv}, {real}"]

    # each function, then its arguments; columns as wide as their widest entry
    functions = model.manifest["functions"]
    heads = [
        (name, f["emission"], f"{f['operations']} operations") for name, f in functions.items()
    ]
    widths = [max(map(len, column), default=0) for column in zip(*heads, strict=True)]
    ports = [port for f in functions.values() for port in (*f["inputs"], *f["outputs"])]
    sizes = [max((len(word(p)) for p in ports), default=0) for word in (_name, _shape)]
    for head, function in zip(heads, functions.values(), strict=True):
        name, emission, work = head
        lines.append(f"  {name:<{widths[0]}}  {emission:<{widths[1]}}  {work:>{widths[2]}}")
        for way, entries in (("in ", function["inputs"]), ("out", function["outputs"])):
            for port in entries:
                words = f"{_name(port):<{sizes[0]}}  {_shape(port):<{sizes[1]}}  {port['meaning']}"
                lines.append(f"    {way} {words}")
    return "\n".join(lines)


def _name(port: dict[str, Any]) -> str:
    return str(port["name"])


def _shape(port: dict[str, Any]) -> str:
    """Return the shape of an argument, as 3 x 8."""
    return " x ".join(map(str, port["shape"]))
