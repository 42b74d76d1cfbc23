"""The arguments of the command line."""

import argparse
from pathlib import Path

from .. import __version__

FOLDER = "the generated folder of its model; by default the model is built in the cache"


def parser() -> argparse.ArgumentParser:
    """Return the argument parser."""
    about = "Work with models of tailed animals and robots: scenes, motions, plans, pages."
    root = argparse.ArgumentParser(prog="serpentail", description=about)
    root.add_argument("--version", action="version", version=f"serpentail {__version__}")
    verbs = root.add_subparsers(dest="verb", required=True, metavar="VERB")
    for add in (_of_scenes, _of_motions, _of_models, _of_this_machine):
        add(verbs)
    # output for programs
    for name, verb in verbs.choices.items():
        if name not in ("generate", "completion"):
            text = "print one JSON object on stdout instead of text"
            verb.add_argument("--json", choices=["-"], help=text)
    return root


def _of_scenes(verbs: argparse._SubParsersAction) -> None:
    """Add the verbs about scene files."""
    verbs.add_parser("examples", help="list the scenes that come with the package")
    new = verbs.add_parser("new", help="write a commented scene file, ready to simulate")
    new.add_argument("file", help="the file to write, such as rat.toml")
    new.add_argument(
        "--example", metavar="NAME", help="copy this example; other options are ignored"
    )
    new.add_argument("--tail", default="articulated", choices=["articulated", "continuum"])
    new.add_argument("--segments", type=int, default=1, help="number m of segments, by default 1")
    new.add_argument(
        "--links",
        type=int,
        help="number n of links in each segment of an articulated tail, by default 3",
    )
    new.add_argument(
        "--contacts",
        nargs="+",
        default=[],
        choices=["feet", "tail", "torso"],
        help="what can touch the ground; without it the animal flies",
    )
    verbs.add_parser("schema", help="print the JSON Schema of scene files, for editors")
    verbs.add_parser(
        "generate",
        help="write the C and CasADi of a scene to generated/: see generate --help",
        add_help=False,
    )


def _of_motions(verbs: argparse._SubParsersAction) -> None:
    """Add the verbs that make motions, or show them."""
    simulate = verbs.add_parser(
        "simulate", help="simulate the motion of a scene's table [simulate]"
    )
    _add_scene(simulate, "scenes/kick.toml")
    simulate.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="changes",
        help=(
            "a new value of a parameter (mu=0.5) or of a key of "
            "[simulate] (duration=2, start.height=0.1)"
        ),
    )
    film = "draw it to this file: .mp4 or .gif (film), .png, .svg or .pdf (filmstrip), .html (page)"
    simulate.add_argument("--film", help=film)
    words = "estimate the error of each number: the motion is made again, less exactly"
    simulate.add_argument("--errors", action="store_true", help=words)
    plan = verbs.add_parser("plan", help="plan the motion of a scene's table [plan]")
    _add_scene(plan, "scenes/righting_m1_n3.toml")
    words = "estimate parameters and torques from marker tracks, as the table [identify] says"
    identify = verbs.add_parser("identify", help=words)
    _add_scene(identify, "scenes/elastic_tail.toml")
    identify.add_argument("data", nargs="+", help="trials: .trc, .csv or .c3d files of markers")
    for verb in (plan, simulate, identify):
        verb.add_argument("--save", help="write the motion to this .npz, .csv or .nc file")
        verb.add_argument(
            "--view", metavar="PAGE", help="write a page that shows it to this .html file"
        )
    _add_sweep(verbs)
    view = verbs.add_parser("view", help="show saved motions in a page, over each other")
    view.add_argument("files", nargs="+", help="what --save wrote: .npz files")
    view.add_argument("--folder", help=FOLDER.replace("the model is built", "it is found"))
    view.add_argument("--output", help="the page, by default the first file's name with .html")


def _add_sweep(verbs: argparse._SubParsersAction) -> None:
    """Add the verb that makes many runs."""
    told = "make the runs of a scene's table [sweep]; the same command resumes where it stopped"
    sweep = verbs.add_parser("sweep", help=told)
    sweep.add_argument("scene", help="a scene file with a table [sweep], such as study.toml")
    sweep.add_argument("--store", type=Path, metavar="FOLDER", help="folder for the rows")
    where = "processes:4, dask (on this machine), dask:tcp://host:8786 or dask:scheduler.json"
    sweep.add_argument("--executor", metavar="WHERE", help=f"{where}; by default processes")
    sweep.add_argument(
        "--status", action="store_true", help="report how far it is, and run nothing"
    )
    sweep.add_argument("--retry-failed", action="store_true", help="run failed points again")
    sweep.add_argument("--export", metavar="FILE", help="write rows to a .parquet, .csv, .nc file")
    sweep.add_argument(
        "--row", type=int, default=0, metavar="K", help="the point that --view shows"
    )
    sweep.add_argument("--view", metavar="PAGE", help="show a point's motion in this .html file")


def _add_scene(verb: argparse.ArgumentParser, example: str) -> None:
    """Let a verb take a scene and its folder."""
    verb.add_argument("scene", help=f"a scene file, such as {example}, or the name of an example")
    verb.add_argument("--folder", help=FOLDER)


def _of_models(verbs: argparse._SubParsersAction) -> None:
    """Add the verbs about models."""
    info = verbs.add_parser("info", help="what a model is: sizes, functions, costs")
    verify = verbs.add_parser("verify", help="check the laws that a model must obey")
    export = verbs.add_parser("export", help="write a model to a file for another tool")
    kinds = "urdf, mjcf: articulated tails; bundle: its generated folder; fmu: FMI 2.0"
    export.add_argument("kind", choices=["urdf", "mjcf", "bundle", "fmu"], help=kinds)
    for verb in (info, verify, export):
        verb.add_argument("model", help="a generated folder, a scene file or an example's name")
    file = "the file, such as rat.urdf, rat.xml, rat.zip or rat.fmu; by default the model's name"
    export.add_argument("-o", "--output", metavar="FILE", help=file)


def _of_this_machine(verbs: argparse._SubParsersAction) -> None:
    """Add the verbs about this machine."""
    cache = verbs.add_parser("cache", help="what the cache of compiled models holds, and where")
    cache.add_argument("--clean", action="store_true", help="empty it")
    shell = verbs.add_parser("completion", help="print a completion script for a shell")
    shell.add_argument("shell", choices=["bash", "zsh", "tcsh"])
