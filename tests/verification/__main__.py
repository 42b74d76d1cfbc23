"""`make verify`: the laws, and the model against other derivations of it, in one report."""

from pathlib import Path

from examples import front


def main(folder: Path, output: Path) -> int:
    """Verify a folder, write the reports, print a short table; 1 if a check failed."""
    from tests.verification.verify_model import report

    return report(folder, output)


if __name__ == "__main__":
    parser = front.parser(__doc__)
    parser.add_argument("folder", type=Path, help="a generated folder")
    told = "folder of the reports (default: output/verify)"
    parser.add_argument("--output", type=front.usable, default="output/verify", help=told)
    given = parser.parse_args()
    front.run(main, given.folder, given.output)
