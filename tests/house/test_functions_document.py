"""docs/functions.md lists every function as the table of signatures has it.

``make golden`` writes it anew.
"""

from pathlib import Path

from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.signatures.table import ALL, SIGNATURES

DOCUMENT = Path(__file__).parents[2] / "docs" / "functions.md"
HEAD = """\
# Functions

This page lists every function that a model can have, with its arguments, shapes, units and frames.

Name the functions that you need in the scene's key `functions`. Without that key a model gets the
functions marked "emitted always" and, if the scene has contacts, also those marked "emitted with
contacts". A function marked "emitted where named" must be named; `functions = "all"` names all that
the tail can have.

All units are SI. B is the torso's centre of mass; "world" and "body" are the axes of the world and
of the torso. "q in its tangent space" means that a derivative has nv columns, not nq: a rotation of
the torso about its own axes takes the place of the four numbers of the quaternion. Equation numbers
are those of the paper ([theory.md](theory.md)).

`make golden` writes this page from the generator's table of signatures.

## Sizes

The shapes below use these names:
"""


def text() -> str:
    """The page."""
    groups = dict.fromkeys(SIGNATURES[name].group for name in ALL)
    return "\n".join([HEAD, sizes(), *(section(group) for group in groups)])


def sizes() -> str:
    """What the names in shapes mean, as the tail's sizes say it."""
    arguments = [a for name in ALL for a in (*SIGNATURES[name].inputs, *SIGNATURES[name].outputs)]
    names = dict.fromkeys(n for a in arguments for n in a.sizes if isinstance(n, str))
    lines = [f"- `{name}`: {' '.join(getattr(Tail, name).__doc__.split())}" for name in names]
    return "\n".join([*lines, ""])


def section(group: str) -> str:
    """The functions of a group that a scene may name."""
    lines = [f"## {group.capitalize()}", ""]
    for name in ALL:
        signature = SIGNATURES[name]
        if signature.group == group:
            needs = f"; needs {signature.needs}" if signature.needs else ""
            emitted = f"(emitted {signature.emitted}{needs})"
            lines += [f"### `{name}`", "", f"{signature.doc} {emitted}", ""]
            lines += [row("in", a) for a in signature.inputs]
            lines += [row("out", a) for a in signature.outputs]
            lines += [""] if signature.outputs else []
    return "\n".join(lines)


def row(kind: str, argument) -> str:
    """One argument: its name, shape and meaning."""
    shape = ", ".join(map(str, argument.sizes)) + ("," if len(argument.sizes) == 1 else "")
    return f"- {kind} `{argument.name}` ({shape}): {argument.meaning}"


def test_document_has_every_function(request):
    if request.config.getoption("--update-golden"):
        DOCUMENT.write_text(text(), encoding="utf-8")
    assert DOCUMENT.read_text(encoding="utf-8") == text(), "run `make golden`"
