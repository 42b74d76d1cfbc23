"""`make bench`: measures speed beside peers, generation, drift and precision, and reports.

It needs an idle machine and takes about 45 minutes; an interrupted run resumes. Measures that
depend on the processor are made for AVX-512 and for AVX2 if the machine has both. One file of
measures runs alone, for example as `.venv/bin/python -m benchmarks.batches`.
"""

from examples import front


def main(folder) -> None:
    """Measure, and write the report."""
    from benchmarks.measures import bench

    bench(folder)


if __name__ == "__main__":
    given = front.parser(__doc__, "output/bench").parse_args()
    front.run(main, given.folder, after=front.GOES_ON)
