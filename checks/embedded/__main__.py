"""Runs a model on an emulated board and compares every result with the host's.

What functions cost on boards, in the tables of docs/embedded.md: `python -m checks.embedded.sizes`.
"""

from pathlib import Path

from checks.embedded.boards import BOARDS, PROFILES
from examples import front


def main(*given) -> int:
    """Check one folder on one board; return the exit status."""
    from checks.embedded.comparison import check

    return check(*given)


if __name__ == "__main__":
    parser = front.parser(__doc__)
    parser.add_argument("folder", type=Path, help="generated folder")
    boards = [name for name in BOARDS if name != "host"]
    parser.add_argument("--board", choices=boards, default="m4")
    parser.add_argument(
        "--profile", choices=PROFILES, help="how to compile (default: as the scene says)"
    )
    words = "parent of the folder of what is built (default: output/embedded)"
    parser.add_argument("--output", type=front.usable, default="output/embedded", help=words)
    given = parser.parse_args()
    front.run(main, given.folder, given.board, given.profile, given.output)
