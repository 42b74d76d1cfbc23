"""Flights of bodies that differ from the planned one, with noise, delay and pushes.

Three laws are compared: the plan's torques, PFL along the plan, and predictive control. Each start
is kept in FOLDER/parts, so that an interrupted study resumes.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for a run by the path of this file

from examples import front


def main(folder, starts) -> None:
    """Do the study."""
    from examples.studies.replanning_study import study

    study(folder, starts)


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/studies/replanning")
    parser.add_argument("--starts", type=front.count, default=12, help="how many (default: 12)")
    given = parser.parse_args()
    front.run(main, given.folder, given.starts, after=front.GOES_ON)
