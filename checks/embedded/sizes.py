"""Measures flash, RAM, stack and instructions of tails on boards; writes docs/embedded.md."""

from examples import front


def main() -> int:
    """Write the tables between the marks of docs/embedded.md; return the exit status."""
    from checks.embedded.size_tables import write

    return write()


if __name__ == "__main__":
    front.parser(__doc__).parse_args()
    front.run(main)
