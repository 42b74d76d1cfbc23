"""`make stress`: drives models to their limits; writes figures, each with its limit, and plots to
output/stress.
"""

import argparse
import json
import random
import sys
import tempfile
import time
import warnings
from pathlib import Path

from stress import (
    call_fuzz,
    drops,
    extremes,
    flights,
    poses,
    precision,
    scene_fuzz,
    sharing,
    sizes,
    slopes,
    stress_plots,
)
from stress.figures import Figure, table
from stress.poses import Point

ROOT = Path(__file__).resolve().parent.parent
OUTPUT = ROOT / "output" / "stress"


def arguments() -> argparse.Namespace:
    """Return the command line's arguments."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--calls", type=int, default=2000, help="random calls and mutated scene files")
    p.add_argument(
        "--duration", type=float, default=flights.DURATION, help="of the long flights, in s"
    )
    return p.parse_args()


def fuzzed(count: int) -> list[Figure]:
    """Return how many random calls, and how many mutated scene files, ended worse than by an answer
    or a refusal.
    """
    found = []
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = Path(name)
        for size in ((1, 3), (2, None)):
            model = drops.falling(*size)
            faults = call_fuzz.fuzz(call_fuzz.targets(model, folder), count, seed=12)
            found.append(
                Figure(
                    f"{model.name}: {count} calls: faults",
                    len(faults),
                    0,
                    "; ".join(map(str, faults[:3])),
                )
            )
        files, model = sorted((ROOT / "scenes").glob("*.toml")), drops.falling(3, 4)
        scenes = scene_fuzz.faults(files, count, random.Random(13), folder, model)
        found.append(Figure(f"{count} scene files: faults", len(scenes), 0, "; ".join(scenes[:3])))
    return found


def measured(options: argparse.Namespace, swept: list[Point]) -> dict[str, list[Figure]]:
    """Return all figures by part."""
    parts = {
        "Bends from 0 to 2 pi": lambda: poses.of_sweep(swept),
        "Folds and coils": poses.folded,
        "Speeds": poses.fast,
        "Quaternions of any norm": poses.attitudes,
        "Sizes": sizes.measured,
        "Parameters": extremes.measured,
        "Derivatives": slopes.measured,
        "float against double": precision.measured,
        "Long flights": lambda: flights.measured(options.duration),
        "Drops": drops.measured,
        "Threads": sharing.measured,
        "Fuzz": lambda: fuzzed(options.calls),
    }
    found = {}
    for name, part in parts.items():
        begun = time.process_time()
        found[name] = part()
        print(
            f"{name}: {len(found[name])} figures, {time.process_time() - begun:.1f} s of CPU",
            file=sys.stderr,
            flush=True,
        )
    return found


def main() -> int:
    """Measure everything, write the report; 1 if a figure is beyond its limit."""
    options = arguments()
    swept = poses.swept()
    found = measured(options, swept)
    OUTPUT.mkdir(parents=True, exist_ok=True)
    rows = {name: [figure.row() for figure in figures] for name, figures in found.items()}
    (OUTPUT / "report.json").write_text(json.dumps(rows, indent=1, default=float))
    text = "\n\n".join(
        ["# Stress", *(f"## {name}\n\n{table(figures)}" for name, figures in found.items())]
    )
    (OUTPUT / "report.md").write_text(text + "\n")
    stress_plots.draw(found, swept, OUTPUT)
    failed = [figure for figures in found.values() for figure in figures if not figure.passed]
    print(
        f"{sum(map(len, found.values()))} figures, {len(failed)} beyond their limits; "
        f"{OUTPUT / 'report.md'}"
    )
    for figure in failed:
        print(f"  {figure}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
