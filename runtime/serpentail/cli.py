"""The command `serpentail`: what a model is, whether it obeys its laws, its motions and plans."""

import argparse
import json
import sys

from .errors import SerpentailError


def info(folder: str) -> dict:
    """Return what a model is: sizes, functions, how each was emitted, what it costs."""
    from .model.model import load
    from .model.parameters import json_ready

    model = load(folder)
    functions = {
        name: {
            "inputs": {a["name"]: a["shape"] for a in f["inputs"]},
            "outputs": {a["name"]: a["shape"] for a in f["outputs"]},
            "emission": f["emission"],
            "operations": f["operations"],
        }
        for name, f in model.manifest["functions"].items()
    }
    sizes = {
        name: getattr(model, name) for name in ("kind", "segments", "links", "samples", "nq", "nv")
    }
    return {
        "name": model.name,
        "real": model.manifest["real"],
        **sizes,
        "parameters": json_ready(model.parameters),
        "functions": functions,
    }


def describe(report: dict) -> str:
    """Return an info report as text."""
    shape = (
        "{segments} segments x {links} links"
        if report["links"]
        else "{segments} continuum segments"
    )
    head = ("{name}: " + shape + ", nq {nq}, nv {nv}, {real}").format(**report)
    rows = [
        f"  {name:<28}{f['emission']:<10}{f['operations']:>8} operations"
        for name, f in report["functions"].items()
    ]
    return "\n".join([head, *rows])


def parser() -> argparse.ArgumentParser:
    """Return the argument parser."""
    p = argparse.ArgumentParser(
        prog="serpentail", description="Work with generated models of tailed animals and robots."
    )
    verbs = p.add_subparsers(dest="verb", required=True)
    verb = verbs.add_parser("plan", help="plan the motion of a scene's table [plan]")
    verb.add_argument("scene", help="a scene file, such as scenes/righting_m1_n3.toml")
    verb.add_argument(
        "--folder", help="its generated folder, by default generated/ and the scene's name"
    )
    verb.add_argument("--save", help="write the planned motion to this .npz file")
    verb.add_argument(
        "--json", choices=["-"], help="print one JSON object on stdout instead of text"
    )
    verb = verbs.add_parser("simulate", help="simulate the motion of a scene's table [simulate]")
    verb.add_argument("scene", help="a scene file, such as scenes/kick.toml")
    verb.add_argument(
        "--folder", help="its generated folder, by default generated/ and the scene's name"
    )
    verb.add_argument(
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
    verb.add_argument("--save", help="write the motion to this .npz file")
    verb.add_argument("--film", help="draw it as a filmstrip, to this .png, .svg or .pdf file")
    verb.add_argument(
        "--json", choices=["-"], help="print one JSON object on stdout instead of text"
    )
    for name, words in (
        ("info", "what a generated model is"),
        ("verify", "check the laws that a model must obey"),
    ):
        verb = verbs.add_parser(name, help=words)
        verb.add_argument("folder", help="a generated folder, such as generated/articulated_m3_n4")
        verb.add_argument(
            "--json", choices=["-"], help="print one JSON object on stdout instead of text"
        )
    return p


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


def run(arguments: argparse.Namespace) -> tuple[dict, str, bool]:
    """Return the report of a verb, as data and as text, and whether all is well."""
    if arguments.verb == "info":
        report = info(arguments.folder)
        return report, describe(report), True
    if arguments.verb == "plan":
        from .scenes.plan import planned

        plan = planned(arguments.scene, arguments.folder)
        if arguments.save:
            plan.trajectory.save(arguments.save)
        text = "\n".join(f"{name:<30}{value}" for name, value in plan.report.items())
        return plan.report, text, plan.success
    if arguments.verb == "simulate":
        return simulated(arguments)
    from .model.model import load
    from .verification.report import as_text, laws, summary

    model = load(arguments.folder)
    checks = laws(model)
    return summary(model, checks), as_text(model, checks), all(c.passed for c in checks)


def simulated(arguments: argparse.Namespace) -> tuple[dict, str, bool]:
    """Return the report of a scene's motion."""
    from .scenes.overrides import parsed
    from .scenes.simulate import scenario

    scene = scenario(arguments.scene, arguments.folder, parsed(arguments.changes))
    motion = scene.simulate()
    if arguments.save:
        motion.save(arguments.save)
    if arguments.film:
        scene.film(motion, arguments.film)
    report = scene.summary(motion)
    return report, "\n".join(f"{name:<30}{value}" for name, value in report.items()), True


if __name__ == "__main__":
    sys.exit(main())
