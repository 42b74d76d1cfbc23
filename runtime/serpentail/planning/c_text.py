"""Numbers and files of the C that controllers of plans write for machines without Python."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..basics.checks import refusal
from ..basics.errors import PlanningError
from ..basics.files import refuse_unwritable, replacing

A_LINE = 4  # numbers


def literal(value: float, real: str) -> str:
    """Return a number as C of its type, "double" or "float"."""
    return repr(float(value)) if real == "double" else f"{float(np.float32(value))!r}f"


def array_text(name: str, values: np.ndarray, real: str, kind: str) -> str:
    """Return numbers as an array in C; an empty one as a single 0 that is never read.

    kind: the name of its type in C, which is real.
    """
    flat = [literal(value, real) for value in values.ravel().tolist()] or ["0"]
    rows = (", ".join(flat[k : k + A_LINE]) for k in range(0, len(flat), A_LINE))
    return f"static const {kind} {name}[{len(flat)}] = {{\n    " + ",\n    ".join(rows) + "};\n"


def write_texts(folder: str | os.PathLike[str], texts: Mapping[str, str]) -> list[Path]:
    """Write texts by the names of their files to a folder; return their paths.

    A missing folder is made.  PlanningError if it is not a path, NotWritten if the system refuses.
    """
    try:
        target = Path(folder)
    except TypeError:
        needs = "the path of a folder"
        raise refusal("write_c: folder", folder, needs, PlanningError) from None
    for name, text in texts.items():
        refuse_unwritable(target / name)
        with replacing(target / name) as part:
            part.write_text(text, encoding="utf-8")
    return [target / name for name in texts]
