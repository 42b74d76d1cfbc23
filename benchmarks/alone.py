"""Runs the measures of one file: `.venv/bin/python -m benchmarks.FILE`; `--help` costs nothing."""

from examples import front


def main(file: str, words: str) -> None:
    """Answer the command line of a file of measures, by its name and docstring, and end."""
    place = f"output/bench/{file.rpartition('.')[2]}"
    parser = front.parser(f"{words}\n\nMeasures, prints and writes a report.", place)
    front.run(measure, parser.parse_args().folder, file)


def measure(folder, file: str) -> None:
    """Measure what a file of measures has, and write the report of that."""
    from benchmarks.measures import MEASURES, bench

    there = [name for name, m in MEASURES.items() if m.rows.__module__ == f"benchmarks.{file}"]
    bench(folder, there)
