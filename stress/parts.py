"""What `make stress` measures, and its report."""

import json
import random
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

from serpentail.basics.progress import Stage
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

ROOT = Path(__file__).resolve().parent.parent
Parts = dict[str, Callable[[], list[Figure]]]


def fuzzed(count: int) -> list[Figure]:
    """Return how many random calls, and how many mutated scene files, ended with neither an
    answer nor a refusal.
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


def parts(swept: list[poses.Point], calls: int, duration: float) -> Parts:
    """Return the functions that measure the figures of each part."""
    return {
        "Bends from 0 to 2 pi": lambda: poses.of_sweep(swept),
        "Folds and coils": poses.folded,
        "Speeds": poses.fast,
        "Quaternions of any norm": poses.attitudes,
        "Sizes": sizes.measured,
        "Parameters": extremes.measured,
        "Derivatives": slopes.measured,
        "float against double": precision.measured,
        "Long flights": lambda: flights.measured(duration),
        "Drops": drops.measured,
        "Threads": sharing.measured,
        "Fuzz": lambda: fuzzed(calls),
    }


def measured(wanted: Parts) -> dict[str, list[Figure]]:
    """Return all figures by part."""
    found = {}
    with Stage("stress") as stage:
        for done, (name, part) in enumerate(wanted.items()):
            stage.tell(done / len(wanted), name)
            found[name] = part()
    return found


def stress(output: Path, calls: int, duration: float | None) -> int:
    """Measure everything, write the report; 1 if a figure is beyond its limit."""
    swept = poses.swept()
    found = measured(parts(swept, calls, flights.DURATION if duration is None else duration))
    output.mkdir(parents=True, exist_ok=True)
    rows = {name: [figure.row() for figure in figures] for name, figures in found.items()}
    (output / "report.json").write_text(json.dumps(rows, indent=1, default=float))
    text = "\n\n".join(
        ["# Stress", *(f"## {name}\n\n{table(figures)}" for name, figures in found.items())]
    )
    (output / "report.md").write_text(text + "\n")
    stress_plots.draw(found, swept, output)
    failed = [figure for figures in found.values() for figure in figures if not figure.passed]
    print(
        f"{sum(map(len, found.values()))} figures, {len(failed)} beyond their limits; "
        f"{output / 'report.md'}"
    )
    for figure in failed:
        print(f"  {figure}")
    return 1 if failed else 0
