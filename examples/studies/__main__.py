"""Computes a study of what a tail is worth. The paper's own figures are `examples.paper`.

righting        righting in the air from many random starts, as the paper plans and as we do
contact         motions on the ground (Sects. 4, 4.4): films, plots and a table
landing         kicks that the tail rights onto the feet, planned and passive
leaps           jumps that are made for a soft landing: 20 bodies, 30 tails, 10 with legs of mass
ground          friction and stiffness of the ground from one landing: 60 landings
morphology      plans of righting for tails of many shapes, from many tumbles: 20400
replanning      bodies unlike the planned one: the plan's torques, PFL, predictive control
pushed          hard pushes in flight: predictive control, and new plans where its flags ask
identification  how often the intervals of identified parameters cover the truth
air             righting of 1000 tumbles with a bare tail and a tuft, by plans with air and without

The work is done in parallel, as many processes as $SERPENTAIL_THREADS says or there are cores. Each
part is kept in FOLDER, so that an interrupted study resumes. The options are those of one study.
"""

from importlib import import_module

from examples import front

OPTIONS = {
    "righting": {"starts": (front.count, 200, "random starts of the tail (1, 3)")},
    "replanning": {"starts": (front.count, 12, "tumbling starts")},
    "pushed": {"starts": (front.count, 100, "tumbling starts")},
    "morphology": {
        "points": (front.count, 6800, "tails and tumbles, each with three numbers of segments"),
        "executor": (str, None, "where to run, such as processes:4 or dask:HOST:PORT"),
    },
    "identification": {
        "trials": (front.count, 400, "trials of each case"),
        "segments": (front.count, 1, "segments of the tail"),
        "links": (int, 3, "links of each; 0: a continuum"),
    },
    "air": {"tumbles": (front.count, 1000, "tumbling starts")},
}
NAMES = ("contact", "landing", "leaps", "ground", *OPTIONS)


def main(name: str, folder, options: dict) -> int | None:
    """Do a study."""
    return import_module(f"examples.studies.{name}").study(folder, **options)


if __name__ == "__main__":
    parser = front.parser(__doc__)
    studies = parser.add_subparsers(dest="name", metavar="NAME", required=True)
    for name in NAMES:
        one = studies.add_parser(name, allow_abbrev=False)
        place = front.ROOT / "output" / "studies" / name
        words = f"where results go (default: output/studies/{name} of the checkout)"
        one.add_argument("folder", nargs="?", type=front.usable, default=place, help=words)
        for option, (kind, default, meaning) in OPTIONS.get(name, {}).items():
            words = f"{meaning} (default: {default})"
            one.add_argument(f"--{option}", type=kind, default=default, help=words)
    options = vars(parser.parse_args())
    name, folder = options.pop("name"), options.pop("folder")
    front.run(main, name, folder, options, after=front.GOES_ON)
