"""What functions cost on boards: flash, RAM, stack and instructions, in tables of Markdown."""

import re
import sys
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from checks.embedded.boards import BOARDS, ToolchainMissing
from checks.embedded.costs import deepest, flash
from checks.embedded.image import Image, build
from checks.embedded.results import blocks, run
from serpentail.basics.progress import Stage
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

DOCUMENT = Path(__file__).parents[2] / "docs" / "embedded.md"
TAILS = ((1, 3), (3, 4), (1, None))  # segments, links; None: continuum
FUNCTIONS = ("mass_matrix", "forward_dynamics", "pfl", "contact_dynamics")
DERIVATIVES = "forward_dynamics_derivatives"
STRAIGHT_DERIVATIVES = ((1, 3), (1, None))
# the first one gives factors without a meaning of their own to the second one
IMPLICIT = ("implicit_factor", "implicit_solve")
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


def costs(tail: tuple, form: str, board: str, parent: Path) -> tuple[list[tuple], Image]:
    """Generate, build and run one model on one board; return the rows of its table."""
    folder = made(parent, tail, form, REAL[board])
    image = build(folder, BOARDS[board], folder / "build" / board)
    depths, prefix = deepest(sorted(image.path.parent.glob("*.ci"))), image.manifest["prefix"]
    size, rows = {"float": 4, "double": 8}[image.manifest["real"]], []
    for name, result in run(image).items():
        work, stack = size * image.manifest["work"][name], depths[f"{prefix}_{name}"]
        cells = flash(image, name), work, stack, max(result.instructions)
        rows.append((label(*tail), form, f"`{name}`", *cells))
    return rows, image


def float_errors(image: Image, parent: Path) -> list[tuple]:
    """Return (quantity, largest relative error of float on the board) against double on the host,
    same states.
    """
    prefix = image.manifest["prefix"]
    folder = parent / "loops" / "double" / prefix
    found, exact = run(image), run(build(folder, BOARDS["host"], folder / "build" / "host"))
    rows = []
    for name, result in found.items():
        for output, part in blocks(image, name).items() if name not in IMPLICIT else ():
            both = result.values[:, part], exact[name].values[:, part]
            rows += _block_errors(name, output, *both, image)
    return rows


def _block_errors(
    function: str, name: str, some: np.ndarray, exact: np.ndarray, image: Image
) -> list[tuple]:
    nv = image.manifest["dimensions"]["nv"]
    if name == "H":
        scale = np.sqrt(np.einsum("sii->si", exact.reshape(-1, nv, nv)))
        error = np.abs(some - exact).reshape(-1, nv, nv) / scale[:, :, None] / scale[:, None, :]
        return [("H, relative to sqrt(H_ii H_jj)", error.max())]
    if name == "v_dot":
        parts = {"p_ddot": slice(0, 3), "omega_dot": slice(3, 6), "q_t_ddot": slice(6, nv)}
        where = " in contact" if function == "contact_dynamics" else ""
        return [
            (quantity + where, relative(some[:, part], exact[:, part]))
            for quantity, part in parts.items()
        ]
    return [(name, relative(some, exact))]


def relative(some: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest error relative to the largest entry of each state."""
    scale = np.abs(exact).max(axis=1)
    return float((np.abs(some - exact).max(axis=1) / np.where(scale > 0, scale, 1)).max())


def soft_double(parent: Path) -> str:
    """Return a sentence on double on the Cortex-M4F, whose FPU has single precision only."""
    folder = parent / "loops" / "double" / "articulated_m1_n3"
    found = run(build(folder, BOARDS["m4"], folder / "build" / "m4"))["forward_dynamics"]
    return (
        "A Cortex-M4F computes `double` in software: the forward dynamics of (1, 3) in loops take "
        f"{max(found.instructions):,} instructions. Use `REAL=float` there."
    )


def markdown(head: tuple, rows: list[tuple]) -> list[str]:
    """Return a table."""
    return [
        "| " + " | ".join(map(cell, line)) + " |" for line in (head, ["---"] * len(head), *rows)
    ]


def cell(value) -> str:
    """Return a cell: whole numbers with separators, others to two digits."""
    if isinstance(value, float):
        return f"{value:.1e}"
    return f"{value:,}" if isinstance(value, int) else value


def report(parent: Path) -> str:
    """Return all tables."""
    lines, errors = [], {}
    wanted = list(product(REAL, TAILS, ("loops", "straight")))
    rows = {board: [] for board in REAL}
    with Stage("size report") as stage:
        for done, (board, tail, form) in enumerate(wanted):
            stage.tell(done / len(wanted), f"{label(*tail)} {form} {board}")
            found, image = costs(tail, form, board, parent)
            rows[board] += found
            if (board, form) == ("m4", "loops"):
                errors[label(*tail)] = image
    for board, real in REAL.items():
        lines += [f"### {BOARDS[board].title}, `{real}`", "", *markdown(HEAD, rows[board]), ""]
    by_tail = {tail: dict(float_errors(image, parent)) for tail, image in errors.items()}
    quantities = list(next(iter(by_tail.values())))
    worst = [(q, *(by_tail[tail][q] for tail in by_tail)) for q in quantities]
    lines += [
        "### Error of `float`",
        "",
        "Largest error of `float` on the Cortex-M4F against `double` on the host, relative to the "
        "largest entry of each state.",
        "",
        *markdown(("quantity", *by_tail), worst),
        "",
        soft_double(parent),
        "",
    ]
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
