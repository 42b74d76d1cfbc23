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
    add = new.add_argument
    add("file", help="the file to write, such as rat.toml")
    add("--example", metavar="NAME", help="copy this example; other options are ignored")
    add("--tail", default="articulated", choices=["articulated", "continuum"])
    add("--segments", type=int, default=1, help="number m of segments, by default 1")
    links = "number n of links in each segment of an articulated tail, by default 3"
    add("--links", type=int, help=links)
    touch = "what can touch the ground; without it the animal flies"
    add("--contacts", nargs="+", default=[], choices=["feet", "tail", "torso"], help=touch)
    verbs.add_parser("schema", help="print the JSON Schema of scene files, for editors")
    text = "write the C and CasADi of a scene to generated/: see generate --help"
    verbs.add_parser("generate", help=text, add_help=False)


def _of_motions(verbs: argparse._SubParsersAction) -> None:
    """Add the verbs that make motions, or show them."""
    text = "simulate the motion of a scene's table [simulate]"
    simulate = _scene_verb(verbs, "simulate", "scenes/kick.toml", text)
    text = "a new value of a parameter (mu=0.5) or of a key of [simulate] (duration=2, "
    text += "start.height=0.1)"
    simulate.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", dest="changes", help=text
    )
    film = "draw it to this file: .mp4 or .gif (film), .png, .svg or .pdf (filmstrip), .html (page)"
    simulate.add_argument("--film", help=film)
    text = "estimate the error of each number: the motion is made again, less exactly"
    simulate.add_argument("--errors", action="store_true", help=text)
    text = "let the page of --view compute the motion again, with sliders"
    simulate.add_argument("--live", action="store_true", help=text)
    text = "plan the motion of a scene's table [plan]"
    plan = _scene_verb(verbs, "plan", "scenes/righting_m1_n3.toml", text)
    text = "estimate parameters and torques from marker tracks, as the table [identify] says"
    identify = _scene_verb(verbs, "identify", "scenes/elastic_tail.toml", text)
    identify.add_argument("data", nargs="+", help="trials: .trc, .csv or .c3d files of markers")
    for verb in (plan, simulate, identify):
        verb.add_argument("--save", help="write the motion to this .npz, .csv or .nc file")
        page = "write a page that shows it to this .html file"
        verb.add_argument("--view", metavar="PAGE", help=page)
    _add_sweep(verbs)
    view = verbs.add_parser("view", help="show saved motions in a page, over each other")
    view.add_argument("--output", help="the page, by default the first file's name with .html")
    text = "print the numbers of saved motions beside each other, and their differences"
    compare = verbs.add_parser("compare", help=text)
    compare.add_argument("--view", metavar="PAGE", help="write a page of them to this .html file")
    compare.add_argument("--plot", metavar="FIGURE", help="draw them to this .png, .svg, .pdf file")
    for verb in (view, compare):
        verb.add_argument("files", nargs="+", help="what --save wrote: .npz files")
        verb.add_argument("--folder", help=FOLDER.replace("the model is built", "it is found"))


def _scene_verb(
    verbs: argparse._SubParsersAction, name: str, example: str, text: str
) -> argparse.ArgumentParser:
    """Add a verb that takes a scene and the folder of its model."""
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text)
    verb.add_argument("scene", help=f"a scene file, such as {example}, or the name of an example")
    verb.add_argument("--folder", help=FOLDER)
    return verb


def _add_sweep(verbs: argparse._SubParsersAction) -> None:
    """Add the verb that makes many runs."""
    text = "make the runs of a scene's table [sweep]; the same command resumes where it stopped"
    add = verbs.add_parser("sweep", help=text).add_argument
    add("scene", help="a scene file with a table [sweep], such as study.toml")
    add("--store", type=Path, metavar="FILE", help="file for the rows")
    place = "processes:4, dask (on this machine), dask:tcp://host:8786 or dask:scheduler.json"
    add("--executor", metavar="WHERE", help=f"{place}; by default processes")
    add("--status", action="store_true", help="report how far it is, and run nothing")
    add("--retry-failed", action="store_true", help="run failed points again")
    add("--export", metavar="FILE", help="write rows to a .parquet, .csv, .nc file")
    add("--row", type=int, default=0, metavar="K", help="the point that --view shows")
    add("--view", metavar="PAGE", help="show a point's motion in this .html file")


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
