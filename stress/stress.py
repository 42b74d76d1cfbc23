"""`make stress`: tests models at their limits; reports each figure with its limit, and plots."""

from examples import front


def main(folder, calls: int, duration: float | None) -> int:
    """Measure, and write the report; 1 if a figure is beyond its limit."""
    from stress.parts import stress

    return stress(folder, calls, duration)


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/stress")
    told = "random calls and mutated scene files (default: 2000)"
    parser.add_argument("--calls", type=front.count, default=2000, help=told)
    parser.add_argument("--duration", type=float, help="of the long flights, in s")
    given = parser.parse_args()
    front.run(main, given.folder, given.calls, given.duration)
