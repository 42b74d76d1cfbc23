"""Runs a model on an emulated board and compares every result with the host's."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from checks.embedded.boards import BOARDS, ToolchainMissing
from checks.embedded.costs import deepest, flash
from checks.embedded.image import Image, build, manifest_of
from checks.embedded.results import Result, blocks, run
from serpentail_codegen.ir.program import padded

# ulp of an output's largest entry: largest difference of the fast profile
BOUND = 1e4
LEGEND = (
    "ulp: largest difference from the host, in last places of an output's largest entry",
    "flash: bytes of the function and all that it calls; stack: bytes, the sum of the frames;",
    "painted: bytes of the stack that the calls overwrote on the board",
)


@dataclass(frozen=True)
class Comparison:
    """One function on a board: whether its results equal the host's bit for bit, its largest
    difference from the host, and the cost of a call.
    """

    name: str
    same_bits: bool
    # largest difference from the host, in units in the last place of the output's largest entry
    units: float
    instructions: int
    flash: int  # bytes, of the function with all that it calls
    stack: int  # bytes, the sum of frames along the deepest chain of calls
    painted: int  # bytes, measured on the board by a painted stack

    def holds(self, profile: str) -> bool:
        """Tell if the results agree as the profile promises."""
        return self.same_bits if profile == "reproducible" else self.units <= BOUND


def compare(folder: Path, board: str, output: Path, profile: str | None = None) -> list[Comparison]:
    """Build and run the check on a board and on the host; raises ToolchainMissing or
    RuntimeError.
    """
    images = [build(folder, BOARDS[name], output / name, profile) for name in (board, "host")]
    results = [run(image) for image in images]
    depths = deepest(sorted(images[0].path.parent.glob("*.ci")))
    return [
        _compared(images[0], name, results[0][name], results[1][name], depths)
        for name in results[0]
    ]


def _compared(
    image: Image, name: str, found: Result, host: Result, depths: dict[str, int]
) -> Comparison:
    if found.statuses != host.statuses:
        raise RuntimeError(
            f"{name}: status {found.statuses} on {image.board.name}, {host.statuses} on the host"
        )
    epsilon = np.finfo(np.float32 if image.manifest["real"] == "float" else np.float64).eps
    read = _read(image.manifest, name, found.bits.shape[1])
    units = [
        _difference(found.values[:, part][:, read[part]], host.values[:, part][:, read[part]])
        for part in blocks(image, name).values()
    ]
    return Comparison(
        name,
        np.array_equal(found.bits[:, read], host.bits[:, read]),
        max(units) / epsilon,
        max(found.instructions),
        flash(image, name),
        depths[f"call_{name}"],
        max(found.depths) + depths["call_room"],
    )


def _read(manifest: dict, name: str, count: int) -> np.ndarray:
    """Tell which of a function's results are ever read: not those above the diagonals of factors.

    Vectors write there, and other ones with another width.
    """
    read = np.ones(count, bool)
    if name == "implicit_factor":
        nv, triangles = manifest["dimensions"]["nv"], 2 if manifest["contacts"] else 1
        rows = read[: triangles * nv * padded(nv)].reshape(triangles, nv, -1)
        rows[:, *np.triu_indices(nv, 1)] = False
    return read


def _difference(some: np.ndarray, others: np.ndarray) -> float:
    """Return the largest difference relative to the largest entry of each state; infinite if a
    value is not finite.
    """
    scale = np.abs(others).max(axis=1)
    difference = np.abs(some - others).max(axis=1)
    relative = difference / np.where(scale > 0, scale, 1)
    return float(relative.max()) if np.isfinite(relative).all() else float("inf")


def table(rows: list[Comparison]) -> list[str]:
    """Return the comparison as lines of text."""
    head = f"{'function':<28}{'bits':>8}{'ulp':>8}{'instructions':>14}"
    head += f"{'flash':>8}{'stack':>8}{'painted':>9}"
    lines = [
        f"{r.name:<28}{'same' if r.same_bits else 'other':>8}{r.units:>8.3g}{r.instructions:>14}"
        f"{r.flash:>8}{r.stack:>8}{r.painted:>9}"
        for r in rows
    ]
    return [head, *lines, *LEGEND]


def check(folder: Path, board: str, profile: str | None, output: Path) -> int:
    """Check one folder on one board; return the exit status."""
    try:
        rows = compare(folder.absolute(), board, output / folder.name, profile)
    except (ToolchainMissing, RuntimeError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    profile = profile or manifest_of(folder)["scene"]["profile"]
    print(f"{folder} on {BOARDS[board].title} in QEMU, {profile} profile, compared with the host:")
    print("\n".join(table(rows)))
    bad = [row.name for row in rows if not row.holds(profile)]
    promise = (
        "same bits as the host"
        if profile == "reproducible"
        else f"within {BOUND:g} units in the last place"
    )
    print(f"{'FAILED: ' + ', '.join(bad) + ' not ' if bad else ''}{promise}")
    return 1 if bad else 0
