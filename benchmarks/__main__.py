"""Measures speed and accuracy, beside peers where there are any, and reports.

Without names it measures all but `forms`, in two hours of an idle machine: that is `make bench`.
An interrupted run resumes. Measures that depend on the processor are made for AVX-512 and for AVX2
if the machine has both. The report is in FOLDER: report.md and report.json.
"""

from examples import front

# in this order
NAMES = ("forward_dynamics", "jacobians", "hessians", "batches", "long_tails")
NAMES += ("python_overhead", "flights", "rollouts", "environments", "ground_batches")
NAMES += ("ground_steps", "operations", "generation", "soromox", "precisions")
NAMES += ("simulations", "contact_costs", "contact_shares", "polar_errors", "polar_times")
NAMES += ("planning",)
LONG = ("forms",)


def main(folder, names, publish) -> None:
    """Measure, and write the report."""
    from benchmarks.measures import bench
    from benchmarks.published import publish as publish_tables

    report = bench(folder, names or NAMES)
    if publish:
        publish_tables(report)


if __name__ == "__main__":
    parser = front.parser(f"{__doc__}\nNames: {', '.join((*NAMES, *LONG))}.")
    words = "what to measure; all but `forms` by default"
    parser.add_argument("names", nargs="*", metavar="NAME", help=words)
    words = "where the report goes (default: output/bench of the checkout)"
    place = front.ROOT / "output" / "bench"
    parser.add_argument("--folder", type=front.usable, default=place, help=words)
    words = "also write the tables of docs/benchmarks.md and README.md"
    parser.add_argument("--publish", action="store_true", help=words)
    given = parser.parse_args()
    if unknown := {*given.names} - {*NAMES, *LONG}:
        parser.error(f"no such measure: {', '.join(sorted(unknown))}")
    front.run(main, given.folder, given.names, given.publish, after=front.GOES_ON)
