"""Kicks that the tail rights in the air, onto the feet: how many land, planned and passive.

Kicks are made in parallel, as many as $SERPENTAIL_THREADS says or there are cores. Each is a row of
a store in FOLDER/parts, so that an interrupted study resumes.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for a run by the path of this file

from examples import front


def main(folder) -> None:
    """Do the study."""
    from examples.studies.landing_study import study

    study(folder)


if __name__ == "__main__":
    given = front.parser(__doc__, "output/studies/landing").parse_args()
    front.run(main, given.folder, after=front.GOES_ON)
