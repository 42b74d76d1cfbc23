"""The parts of the righting study, and the use of their results."""

import json
from functools import partial
from pathlib import Path

from examples import righting
from examples.front import ROOT
from examples.studies import righting_kinds as kinds
from examples.studies.parts import Part, digest, made
from examples.studies.righting_figures import draw_rates

SOURCES = (
    "examples/righting.py",
    "examples/paper",
    "examples/studies/righting_kinds.py",
    "runtime",
)


def content(size: tuple) -> dict:
    """Build a tail's model, and return its content hash."""
    return {"content_hash": righting.model(*size).manifest["content_hash"]}


def built(folder: Path) -> dict[tuple, str]:
    """Build the tails, and return hashes that distinguish their code."""
    sizes = {str(kind.size): kind.size for kind in kinds.KINDS.values()}
    of = {"program": digest(ROOT / "codegen"), "functions": righting.FUNCTIONS}
    parts = {title: Part(partial(content, size), of) for title, size in sizes.items()}
    found = made("tails", folder / "tails", parts)
    return {size: found[title]["content_hash"] for title, size in sizes.items()}


def study(folder: Path, starts: int) -> None:
    """Compute the missing parts of the study, and write its summary and figure."""
    hashes, program = built(folder), digest(*(ROOT / s for s in SOURCES))

    def of(size: tuple) -> dict:
        return {"model": hashes[size], "program": program}

    rates = kinds.rows_of(starts, made("righting", folder / "parts", kinds.parts(starts, of)))
    draw_rates(rates, folder / "rates.png")
    (folder / "summary.json").write_text(json.dumps({"rates": rates}, indent=1) + "\n")
    print("\n".join(kinds.table(rates)))
    print(f"\nwritten: rates.png and summary.json in {folder}")
