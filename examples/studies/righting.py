"""Airborne righting (Sects. 4.2, 4.3): the paper's Figs. 9 to 13 and Table 2, and ours.

Plans are made in parallel, as many as $SERPENTAIL_THREADS says or there are cores. Each is a row of
a store in FOLDER/parts: a second run only draws, and an interrupted one resumes.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for a run by the path of this file

from examples import front


def main(folder, starts: int) -> None:
    """Do the study."""
    from examples.studies.righting_study import righted

    righted(folder, starts)


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/studies/righting")
    told = "random starts of the tail (1, 3) (default: 200)"
    parser.add_argument("--starts", type=front.count, default=200, help=told)
    given = parser.parse_args()
    front.run(main, given.folder, given.starts, after=front.GOES_ON)
