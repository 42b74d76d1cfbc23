"""Runs the measures of one file: `.venv/bin/python -m benchmarks.FILE`; `--help` measures
nothing.
"""

from examples import front


def main(file: str, words: str) -> None:
    """Handle the command line of a file of measures, given its name and its docstring."""
    place = f"output/bench/{file.rpartition('.')[2]}"
    parser = front.parser(f"{words}\n\nMeasures, prints and writes a report.", place)
    front.run(measure, parser.parse_args().folder, file)


def measure(folder, file: str) -> None:
    """Run the measures of a file, and write their report."""
    from benchmarks.measures import MEASURES, bench

    there = [name for name, m in MEASURES.items() if m.rows.__module__ == f"benchmarks.{file}"]
    bench(folder, there)
