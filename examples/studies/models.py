"""The paper's comparison of tail models (Sect. 4.1): one motion by both tails, Fig. 8 and its cost.

Tails are built in parallel, as many as $SERPENTAIL_THREADS says or there are cores, then timed
alone. Each result is a row of a store in FOLDER/parts, so that an interrupted study resumes.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for a run by the path of this file

from examples import front


def main(folder) -> int | None:
    """Do the study; return status 1 if the timer cannot be built."""
    from benchmarks.peers.build import PeerUnavailable
    from examples.studies.models_study import study

    try:
        return study(folder)
    except PeerUnavailable as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    given = front.parser(__doc__, "output/studies/models").parse_args()
    front.run(main, given.folder, after=front.GOES_ON)
