"""`make bench`: measures speed beside peers, generation, drift and precision, and reports.

It needs an idle machine and takes about half an hour. What hangs on the processor is measured for
AVX-512 and for AVX2 where the machine has both. One file of measures runs alone as
`.venv/bin/python -m benchmarks.batches`, say.
"""

from examples import front


def main(folder) -> None:
    """Measure, and write the report."""
    from benchmarks.measures import bench

    bench(folder)


if __name__ == "__main__":
    given = front.parser(__doc__, "output/bench").parse_args()
    front.run(main, given.folder)
