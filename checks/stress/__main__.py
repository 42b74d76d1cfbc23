"""Measures models at their limits, and reports each figure with its limit; 1 if one is beyond it.

Parts: poses, speeds, sizes and parameters far from an animal's, derivatives, float, flights of
1000 s, drops on the ground, threads. Wrong arguments and damaged files are tests: tests/fuzz.
"""

from examples import front


def main(folder, duration: float) -> int:
    """Measure all parts and write the report."""
    import json

    from checks.stress import bodies, derivatives, drops, flights, poses, precision, threads
    from checks.stress.figure import table
    from serpentail.basics.progress import Stage

    parts = {
        "Bends from 0 to 2 pi": poses.bent,
        "Folds and coils": poses.folded,
        "Speeds": poses.fast,
        "Quaternions of any norm": poses.attitudes,
        "Sizes": bodies.long_tails,
        "Parameters": bodies.extremes,
        "Derivatives": derivatives.measured,
        "float against double": precision.measured,
        "Long flights": lambda: flights.measured(duration),
        "Drops": drops.measured,
        "Threads": threads.measured,
    }
    found = {}
    with Stage("stress") as stage:
        for done, (name, part) in enumerate(parts.items()):
            stage.tell(done / len(parts), name)
            found[name] = part()
    folder.mkdir(parents=True, exist_ok=True)
    rows = {name: [figure.row() for figure in figures] for name, figures in found.items()}
    (folder / "report.json").write_text(json.dumps(rows, indent=1, default=float))
    tables = [f"## {name}\n\n{table(figures)}" for name, figures in found.items()]
    (folder / "report.md").write_text("\n\n".join(["# Stress", *tables]) + "\n")
    failed = [figure for figures in found.values() for figure in figures if not figure.passed]
    count = sum(map(len, found.values()))
    print(f"{count} figures, {len(failed)} beyond their limits; {folder / 'report.md'}")
    for figure in failed:
        print(f"  {figure}")
    return 1 if failed else 0


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/stress")
    words = "of the long flights, in s (default: 1000)"
    parser.add_argument("--duration", type=float, default=1000.0, help=words)
    given = parser.parse_args()
    front.run(main, given.folder, given.duration)
