"""What functions cost on boards: flash, RAM, stack and instructions, in tables of Markdown."""

import re
import sys
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from checks.embedded.boards import BOARDS, ToolchainMissing
from checks.embedded.costs import deepest, flash
from checks.embedded.image import build
from checks.embedded.mpc_costs import HEAD as TICK_HEAD
from checks.embedded.mpc_costs import tick_costs
from checks.embedded.results import run
from serpentail.basics.progress import Stage
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

DOCUMENT = Path(__file__).parents[2] / "docs" / "embedded.md"
TAILS = ((1, 3), (3, 4), (1, None))  # segments, links; None: continuum
FUNCTIONS = ("mass_matrix", "forward_dynamics", "pfl", "contact_dynamics")
DERIVATIVES = "forward_dynamics_derivatives"
STRAIGHT_DERIVATIVES = ((1, 3), (1, None))
CONTACTS = ["feet", "tail"]
REAL = {"m4": "float", "m7": "double"}
HEAD = ("tail", "form", "function", "flash, bytes", "workspace, bytes", "stack, bytes")
HEAD += ("instructions",)


def label(segments: int, links: int | None) -> str:
    """Return a tail's name in the tables."""
    return f"({segments}, {links})" if links else f"continuum {segments}"


def made(parent: Path, tail: tuple, form: str, real: str) -> Path:
    """Generate one model; return its folder."""
    wanted = [*FUNCTIONS]
    if form == "loops" or tail in STRAIGHT_DERIVATIVES:
        wanted.append(DERIVATIVES)
    if form == "loops":  # without loops, every point is computed, in the ground or not
        wanted.append("implicit")
    options = {"functions": wanted, "contacts": CONTACTS, "emission": form, "real": real}
    scene = scene_for("articulated" if tail[1] else "continuum", *tail, **options)
    generate(scene, parent / form / real)
    return parent / form / real / scene.name


def costs(tail: tuple, form: str, board: str, parent: Path) -> list[tuple]:
    """Generate, build and run one model on one board; return the rows of its table."""
    folder = made(parent, tail, form, REAL[board])
    image = build(folder, BOARDS[board], folder / "build" / board)
    depths, prefix = deepest(sorted(image.path.parent.glob("*.ci"))), image.manifest["prefix"]
    size, rows = {"float": 4, "double": 8}[image.manifest["real"]], []
    for name, result in run(image).items():
        work, stack = size * image.manifest["work"][name], depths[f"{prefix}_{name}"]
        cells = flash(image, name), work, stack, max(result.instructions)
        rows.append((label(*tail), form, f"`{name}`", *cells))
    return rows


def markdown(head: tuple, rows: list[tuple]) -> list[str]:
    """Return a table."""
    return [
        "| " + " | ".join(map(cell, line)) + " |" for line in (head, ["---"] * len(head), *rows)
    ]


def cell(value: int | str) -> str:
    """Return a cell; numbers have separators."""
    return f"{value:,}" if isinstance(value, int) else value


def report(parent: Path) -> str:
    """Return all tables."""
    lines, wanted = [], list(product(REAL, TAILS, ("loops", "straight")))
    rows: dict[str, list[tuple]] = {board: [] for board in REAL}
    with Stage("size report") as stage:
        for done, (board, tail, form) in enumerate(wanted):
            stage.tell(done / len(wanted), f"{label(*tail)} {form} {board}")
            rows[board] += costs(tail, form, board, parent)
    for board, real in REAL.items():
        lines += [f"### {BOARDS[board].title}, `{real}`", "", *markdown(HEAD, rows[board]), ""]
    lines += ["### A tick of predictive control, (1, 3)", ""]
    lines += [*markdown(TICK_HEAD, tick_costs(parent)), ""]
    return "\n".join(lines)


def write() -> int:
    """Write the tables between the marks of docs/embedded.md; return the exit status."""
    try:
        with TemporaryDirectory(prefix="serpentail_size_") as folder:
            text = report(Path(folder))
    except (ToolchainMissing, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 2
    document = DOCUMENT.read_text(encoding="utf-8")
    marks = r"(<!-- size-report -->\n).*?(<!-- /size-report -->)"
    document = re.sub(marks, lambda m: f"{m[1]}{text}{m[2]}", document, flags=re.DOTALL)
    DOCUMENT.write_text(document, encoding="utf-8")
    print(text)
    return 0
