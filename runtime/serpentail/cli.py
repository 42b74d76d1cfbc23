"""The command `serpentail`: what a model is, whether it obeys its laws, its motions and plans."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from .errors import SerpentailError, SimulationError
from .files import refuse_unwritable

if TYPE_CHECKING:
    from .motion.trajectory import Trajectory
    from .scenes.simulate import Scenario

INTERRUPTED = 130  # status of a command that Ctrl-C ended: 128 and the signal's number


def info(folder: str) -> dict[str, Any]:
    """Return what a model is: sizes, functions, how each was emitted, what it costs."""
    from .model.model import load
    from .model.parameters import json_ready

    model = load(folder)
    functions = {}
    for name, entry in model.manifest["functions"].items():
        functions[name] = {
            "inputs": {port["name"]: port["shape"] for port in entry["inputs"]},
            "outputs": {port["name"]: port["shape"] for port in entry["outputs"]},
            "emission": entry["emission"],
            "operations": entry["operations"],
        }
    return {
        "name": model.name,
        "real": model.manifest["real"],
        "kind": model.kind,
        "segments": model.segments,
        "links": model.links,
        "samples": model.samples,
        "nq": model.nq,
        "nv": model.nv,
        "parameters": json_ready(model.parameters),
        "functions": functions,
    }


def describe(report: dict[str, Any]) -> str:
    """Return an info report as text."""
    shape = "{segments} continuum segments"
    if report["links"]:
        shape = "{segments} segments x {links} links"
    head = ("{name}: " + shape + ", nq {nq}, nv {nv}, {real}").format(**report)
    rows = [
        f"  {name:<28}{entry['emission']:<10}{entry['operations']:>8} operations"
        for name, entry in report["functions"].items()
    ]
    return "\n".join([head, *rows])


def parser() -> argparse.ArgumentParser:
    """Return the argument parser."""
    about = "Work with generated models of tailed animals and robots."
    root = argparse.ArgumentParser(prog="serpentail", description=about)
    verbs = root.add_subparsers(dest="verb", required=True)
    # of a scene
    plan = verbs.add_parser("plan", help="plan the motion of a scene's table [plan]")
    _add_scene(plan, "scenes/righting_m1_n3.toml")
    plan.add_argument("--save", help="write the planned motion to this .npz file")
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
            "another value of a parameter (mu=0.5) or of a key below "
            "[simulate] (duration=2, start.height=0.1)"
        ),
    )
    simulate.add_argument("--save", help="write the motion to this .npz file")
    film = "draw it to this file: .mp4, .gif move, .png, .svg, .pdf are filmstrips, .html a page"
    simulate.add_argument("--film", help=film)
    for verb in (plan, simulate):
        verb.add_argument("--view", metavar="PAGE", help="show it in a page, this .html file")
    # of a motion
    view = verbs.add_parser("view", help="show saved motions in a page, over each other")
    view.add_argument("files", nargs="+", help="what --save wrote: .npz files")
    view.add_argument("--folder", help="the generated folder, by default the one in generated/")
    view.add_argument("--output", help="the page, by default the first file's name with .html")
    # of a generated folder
    about_model = verbs.add_parser("info", help="what a generated model is")
    verify = verbs.add_parser("verify", help="check the laws that a model must obey")
    for verb in (about_model, verify):
        verb.add_argument("folder", help="a generated folder, such as generated/articulated_m3_n4")
    # of this machine
    cache = verbs.add_parser("cache", help="what the cache of compiled models holds, and where")
    cache.add_argument("--clean", action="store_true", help="empty it")
    for verb in (plan, simulate, view, about_model, verify, cache):
        text = "print one JSON object on stdout instead of text"
        verb.add_argument("--json", choices=["-"], help=text)
    return root


def _add_scene(verb: argparse.ArgumentParser, example: str) -> None:
    """Let a verb take a scene and its folder."""
    verb.add_argument("scene", help=f"a scene file, such as {example}")
    folder = "its generated folder, by default generated/ and the scene's name"
    verb.add_argument("--folder", help=folder)


Files = Mapping[str, Callable[[str], object]]  # option that names each -> what writes it


class Outcome(NamedTuple):
    """What a verb came to: a report as data and as text, whether all is well, files to write."""

    report: dict[str, Any]
    text: str
    good: bool
    files: Files = MappingProxyType({})


def main(argv: list[str] | None = None) -> int:
    """Run a verb; 0 if it went well, 1 if a check or a file failed, 2 if the input was refused, 130
    after Ctrl-C.
    """
    arguments = parser().parse_args(argv)
    try:
        refuse_targets(arguments)
        outcome = run(arguments)
    except SerpentailError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("serpentail: interrupted", file=sys.stderr)
        return INTERRUPTED
    except OSError as error:  # a path that the system refuses, a disk that is full
        print(f"{arguments.verb}: {error!s:.300}", file=sys.stderr)
        return 2
    tell(json.dumps(outcome.report) if arguments.json else outcome.text)
    written = [write(arguments, *entry) for entry in outcome.files.items()]
    if outcome.report.get("stopped") == "interrupt":
        print("serpentail: interrupted; this is what there was until then", file=sys.stderr)
        return INTERRUPTED
    return 0 if outcome.good and all(written) else 1


def refuse_targets(arguments: argparse.Namespace) -> None:
    """SerpentailError where a file could not be written after the work is done."""
    if getattr(arguments, "view", None) is not None:
        from .viewer.view import template

        template()
    for option in ("save", "film", "view"):
        path = getattr(arguments, option, None)
        try:
            if path is not None:
                refuse_unwritable(target(option, path))
        except (OSError, ValueError) as error:
            raise SerpentailError(f"--{option} {path}: {error}; name another file") from error


def target(option: str, path: str) -> Path:
    """Return where the file of an option goes; ValueError where its name is of no known kind."""
    if option == "film":
        from .pictures.film import film_path

        return film_path(path)
    if option == "view":
        from .viewer.view import checked_path

        return checked_path(path)
    return Path(path)


def tell(text: str) -> None:
    """Print a report; whoever reads it may stop to."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def write(arguments: argparse.Namespace, option: str, make: Callable[[str], object]) -> bool:
    """Write the file that an option asks for; tell whether it could be, and on stderr why not."""
    path = getattr(arguments, option)
    if path is None:
        return True
    try:
        make(path)
    except Exception as error:  # whatever a picture or a disk fails by, the report is out
        reason = " ".join(str(error).split()) or type(error).__name__
        print(f"--{option} {path}: could not be written: {reason:.300}", file=sys.stderr)
        return False
    return True


def run(arguments: argparse.Namespace) -> Outcome:
    """Return the outcome of a verb."""
    verbs = {"info": informed, "plan": planned, "simulate": simulated, "verify": verified}
    verbs |= {"cache": cached, "view": viewed}
    return verbs[arguments.verb](arguments)


def informed(arguments: argparse.Namespace) -> Outcome:
    """Return what a model is."""
    report = info(arguments.folder)
    return Outcome(report, describe(report), True)


def planned(arguments: argparse.Namespace) -> Outcome:
    """Return the report of a scene's plan, and whether it converged."""
    from .scenes import plan as scenes

    plan = scenes.planned(arguments.scene, arguments.folder)
    files: Files = {"save": plan.trajectory.save, "view": plan.view}
    return Outcome(plan.report, _rows(plan.report), plan.success, files)


def simulated(arguments: argparse.Namespace) -> Outcome:
    """Return the report of a scene's motion."""
    from .scenes.overrides import parsed
    from .scenes.simulate import scenario

    scene = scenario(arguments.scene, arguments.folder, parsed(arguments.changes))
    motion, stopped = _motion(scene, arguments.view)
    report = scene.summary(motion) | stopped
    files: Files = {"save": motion.save, "film": motion.film, "view": motion.view}
    return Outcome(report, _rows(report), True, files)


def _motion(scene: "Scenario", page: str | None) -> tuple["Trajectory", dict[str, str]]:
    """Return a motion, after Ctrl-C as far as it came, and whether that stopped it.

    Where it fails, a page of it is written up to there.
    """
    try:
        return scene.simulate(), {}
    except SimulationError as error:
        if page is not None and error.trajectory is not None:
            error.trajectory.view(page)
        raise
    except KeyboardInterrupt as stop:
        motion = getattr(stop, "motion", None)
        if motion is None or len(motion.t) < 2:
            raise
        return motion, {"stopped": "interrupt"}


def viewed(arguments: argparse.Namespace) -> Outcome:
    """Write the page of saved motions, and return where it is."""
    from .viewer.saved import read
    from .viewer.view import view

    motions = [read(file, arguments.folder) for file in arguments.files]
    names = list(arguments.files) if len(motions) > 1 else None
    page = view(
        motions, arguments.output or Path(arguments.files[0]).with_suffix(".html"), names=names
    )
    return Outcome({"page": str(page)}, str(page), True)


def verified(arguments: argparse.Namespace) -> Outcome:
    """Return which laws a model obeys, and whether it obeys all of them."""
    from .model.model import load
    from .verification.report import as_text, laws, summary

    model = load(arguments.folder)
    checks = laws(model)
    return Outcome(summary(model, checks), as_text(model, checks), all(c.passed for c in checks))


def cached(arguments: argparse.Namespace) -> Outcome:
    """Return what the cache of compiled models holds, emptied before where that is asked for."""
    from .model.bound import contents, empty
    from .model.cache import cache_folder

    folder = cache_folder(None)
    if arguments.clean:
        empty(folder)
    report = contents(folder)
    return Outcome(report, _rows(report), True)


def _rows(report: dict[str, Any]) -> str:
    """Return a report as lines of names and values."""
    return "\n".join(f"{name:<30}{value}" for name, value in report.items())


if __name__ == "__main__":
    sys.exit(main())
