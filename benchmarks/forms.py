"""Times the forms of functions on both kinds of processor: the results decide the emitted form.

Each function of each tail is generated in every form that it has, and compiled twice: for this
processor, and for x86-64-v3, which has 16 vector registers of 4 numbers each. On an AVX-512 machine
the first has 32 registers of 8. All run in interleaved rounds of one process.
"""

import argparse

from examples import front


def grid(text: str) -> tuple[int, int]:
    """Return (m, n) from "m,n"; ArgumentTypeError for any other text."""
    numbers = text.split(",")
    if len(numbers) != 2:
        raise argparse.ArgumentTypeError(f"{text!r}: needs segments and links, such as 3,4")
    return front.count(numbers[0]), front.count(numbers[1])


def main(folder, functions, sizes) -> None:
    """Measure, print each row when it is ready, and write them all."""
    from benchmarks.form_times import FUNCTIONS, SIZES, measured

    measured(folder, functions or FUNCTIONS, sizes or SIZES)


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/forms")
    parser.add_argument("--function", action="append", help="a function; all by default")
    parser.add_argument("--size", action="append", type=grid, help="m,n of a tail; all by default")
    given = parser.parse_args()
    front.run(main, given.folder, given.function, given.size)
