"""`make bench`: measures generation, speed, drift and precision in one run, and reports.

It needs an idle machine and takes about an hour.
"""

from examples import front


def main(folder) -> None:
    """Measure, and write the report."""
    from benchmarks.measures import bench

    bench(folder)


if __name__ == "__main__":
    given = front.parser(__doc__, "output/bench").parse_args()
    front.run(main, given.folder)
