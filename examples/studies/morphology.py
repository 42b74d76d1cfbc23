"""The value of a tail: plans of righting for tails of many shapes, from many tumbles.

Each plan is a row of FOLDER/rows; the same command resumes an interrupted study. --executor uses
the workers of a cluster: see docs/sweeps.md.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for a run by the path of this file

from examples import front


def main(folder, points: int, executor: str | None) -> None:
    """Do the study."""
    from examples.studies.morphology_study import study

    study(folder, points, executor)


if __name__ == "__main__":
    parser = front.parser(__doc__, "output/studies/morphology")
    told = "tails and tumbles, each with three numbers of segments"
    parser.add_argument("--points", type=front.count, default=6800, help=f"{told} (default: 6800)")
    parser.add_argument("--executor", help="where to run, such as processes:4 or dask:HOST:PORT")
    given = parser.parse_args()
    front.run(main, given.folder, given.points, given.executor, after=front.GOES_ON)
