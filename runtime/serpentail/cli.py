"""The command `serpentail`: what a model is, whether it obeys its laws, its motions and plans."""

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import SerpentailError, SimulationError

if TYPE_CHECKING:
    from .motion.trajectory import Trajectory
    from .scenes.simulate import Scenario


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
    simulate.add_argument("--film", help="draw it as a filmstrip, to this .png, .svg or .pdf file")
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
    for verb in (plan, simulate, view, about_model, verify):
        text = "print one JSON object on stdout instead of text"
        verb.add_argument("--json", choices=["-"], help=text)
    return root


def _add_scene(verb: argparse.ArgumentParser, example: str) -> None:
    """Let a verb take a scene and its folder."""
    verb.add_argument("scene", help=f"a scene file, such as {example}")
    folder = "its generated folder, by default generated/ and the scene's name"
    verb.add_argument("--folder", help=folder)


def main(argv: list[str] | None = None) -> int:
    """Run a verb; 0 if it went well, 1 if a check failed, 2 if the input was refused."""
    arguments = parser().parse_args(argv)
    try:
        report, text, good = run(arguments)
    except SerpentailError as error:
        print(error, file=sys.stderr)
        return 2
    print(json.dumps(report) if arguments.json else text)
    return 0 if good else 1


def run(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Return the report of a verb, as data and as text, and whether all is well."""
    verbs = {
        "info": informed,
        "plan": planned,
        "simulate": simulated,
        "verify": verified,
        "view": viewed,
    }
    return verbs[arguments.verb](arguments)


def informed(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Return what a model is."""
    report = info(arguments.folder)
    return report, describe(report), True


def planned(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Return the report of a scene's plan, and whether it converged."""
    from .scenes import plan as scenes

    if arguments.view:
        _refuse_early(arguments.view)
    plan = scenes.planned(arguments.scene, arguments.folder)
    if arguments.save:
        plan.trajectory.save(arguments.save)
    if arguments.view:
        plan.view(arguments.view)
    return plan.report, _rows(plan.report), plan.success


def simulated(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Return the report of a scene's motion."""
    from .scenes.overrides import parsed
    from .scenes.simulate import scenario

    scene = scenario(arguments.scene, arguments.folder, parsed(arguments.changes))
    motion = _moved(scene, arguments.view)
    if arguments.save:
        motion.save(arguments.save)
    if arguments.film:
        scene.film(motion, arguments.film)
    report = scene.summary(motion)
    return report, _rows(report), True


def _moved(scene: "Scenario", page: str | None) -> "Trajectory":
    """Return a scene's motion; its page is written also where it fails."""
    if not page:
        return scene.simulate()
    _refuse_early(page)
    try:
        motion = scene.simulate()
    except SimulationError as error:
        if error.trajectory is not None:
            error.trajectory.view(page)
        raise
    motion.view(page)
    return motion


def _refuse_early(page: str) -> None:
    """Raise what would keep a page from being written, before the work that it is to show."""
    from .viewer.view import checked_path, template

    checked_path(page)
    template()


def viewed(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Write the page of saved motions, and return where it is."""
    from .viewer.saved import read
    from .viewer.view import view

    motions = [read(file, arguments.folder) for file in arguments.files]
    names = list(arguments.files) if len(motions) > 1 else None
    page = view(
        motions, arguments.output or Path(arguments.files[0]).with_suffix(".html"), names=names
    )
    return {"page": str(page)}, str(page), True


def verified(arguments: argparse.Namespace) -> tuple[dict[str, Any], str, bool]:
    """Return which laws a model obeys, and whether it obeys all of them."""
    from .model.model import load
    from .verification.report import as_text, laws, summary

    model = load(arguments.folder)
    checks = laws(model)
    return summary(model, checks), as_text(model, checks), all(c.passed for c in checks)


def _rows(report: dict[str, Any]) -> str:
    """Return a report as lines of names and values."""
    return "\n".join(f"{name:<30}{value}" for name, value in report.items())


if __name__ == "__main__":
    sys.exit(main())
