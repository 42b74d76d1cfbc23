"""How the time of forward dynamics grows with the tail, and which share of the core's peak it
reaches.
"""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("scaling", __doc__)

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from benchmarks.fixtures import built, fixture, label
from benchmarks.peak import peak
from benchmarks.peers import timing

SWEEPS = {
    "links of one segment": [(1, n) for n in (1, 2, 4, 8, 16, 32, 64)],
    "segments of four links": [(m, 4) for m in (1, 2, 3, 4, 6, 8, 12)],
    "segments of a continuum": [(m, None) for m in (1, 2, 3, 4, 6, 8)],
}
ROUNDS, CALLS = 100, 64


def scaling(folder: Path) -> list[dict]:
    """Nanoseconds of forward dynamics against the size of the tail, and its share of the peak of
    multiply-adds. Operations are additions, multiplications and divisions, counted for each lane,
    so that a sweep in lanes does more of them, and faster. The peak is measured in this run, of
    scalars (of vectors in brackets).
    """
    scalar, vector = peak()
    rows = []
    for sweep, sizes in SWEEPS.items():
        for size in sizes:
            ours = fixture(built(*size, functions=["forward_dynamics"]), folder)
            least, _ = timing.time_rounds(
                [ours.closure], timing.random_states(size[0]), ROUNDS, CALLS
            )[0]
            entry = ours.model.manifest["functions"]["forward_dynamics"]
            share = (
                f"{entry['operations'] / least / scalar:.0%} "
                f"({entry['operations'] / least / vector:.0%})"
            )
            row = {
                "sweep": sweep,
                "model": label(*size),
                "ns": least,
                "operations": entry["operations"],
            }
            rows.append(row | {"emission": entry["emission"], "of the peak": share})
    return rows


def draw(rows: list[dict], path: Path) -> None:
    """Draw nanoseconds against the number of links or segments."""
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for (sweep, sizes), marker in zip(SWEEPS.items(), "os^", strict=True):
        times = [row["ns"] for row in rows if row["sweep"] == sweep]
        counts = [n if sweep.startswith("links") else m for m, n in sizes]
        axes.loglog(counts, times, marker=marker, label=sweep)
    axes.set(
        xlabel="number of links or segments",
        ylabel="forward dynamics, ns",
        title="Run time against size",
    )
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(loc="upper left")
    figure.savefig(path, dpi=150)
    plt.close(figure)
