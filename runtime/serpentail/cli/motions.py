"""The verbs that make motions, or show them: plan, simulate, identify, sweep, view, compare."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..basics.errors import SimulationError, SweepError
from ..motion.text import as_text
from .outcome import Files, VerbOutcome

if TYPE_CHECKING:
    from ..motion.trajectory import Trajectory
    from ..scenes.scenario import Scenario

LATER = ("executor", "retry_failed", "limit")  # arguments of a sweep that runs


def plan(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the report of a scene's plan, and whether it converged."""
    from ..bridges.containers.tables import save
    from ..scenes import plan as scenes

    plan = scenes.planned(arguments.scene, arguments.folder)
    files: Files = {"save": partial(save, plan.trajectory), "view": plan.view}
    report = plan.report | {"warnings": plan.warnings}
    return VerbOutcome(report, as_text(report), plan.success, files)


def simulate(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the report of a scene's motion."""
    from ..bridges.containers.tables import save
    from ..motion.numbers import UNITS
    from ..scenes.overrides import parsed
    from ..scenes.simulate import scenario

    scene = scenario(arguments.scene, arguments.folder, parsed(arguments.changes))
    motion, stopped = _motion(scene, arguments.view)
    found = scene.summary(motion, arguments.errors)
    report = found | _phases(motion) | stopped
    text = as_text(report, UNITS, found.errors)
    if arguments.errors:
        report["errors"] = found.errors
    files: Files = {
        "save": partial(save, motion),
        "film": motion.film,
        "view": partial(motion.view, live=arguments.live),
    }
    return VerbOutcome(report, text, True, files)


def identify(arguments: argparse.Namespace) -> VerbOutcome:
    """Return parameters, motion and torques that marker tracks show, and whether that converged."""
    from ..bridges.containers.tables import save
    from ..scenes.identify import identified

    found = identified(arguments.scene, arguments.data, arguments.folder)
    files: Files = {"save": partial(save, found.trajectory), "view": found.view}
    report = found.report
    rest = {name: value for name, value in report.items() if name != "parameters"}
    text = "\n".join(each for each in (found.table, as_text(rest)) if each)
    return VerbOutcome(report, text, found.success, files)


def _phases(motion: "Trajectory") -> dict[str, dict]:
    """Return how the phases of a sequence went, by name; nothing of other motions."""
    phases = {}
    for phase in motion.info.get("phases", []):
        row = {"begin_s": phase["begin"], "end_s": phase["end"], "ended_by": phase["ended_by"]}
        if "plan" in phase:
            row["plan_is_true"] = phase["plan"]["success"]
        phases[phase["name"]] = row
    return {"phases": phases} if phases else {}


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


def view(arguments: argparse.Namespace) -> VerbOutcome:
    """Write the page of saved motions, and return its path."""
    from ..show.motions import saved_motion
    from ..show.page.view import view as page_of

    motions = [saved_motion(file, arguments.folder) for file in arguments.files]
    names = list(arguments.files) if len(motions) > 1 else None
    path = arguments.output or Path(arguments.files[0]).with_suffix(".html")
    page = page_of(motions, path, names=names)
    return VerbOutcome({"page": str(page)}, str(page))


def compare(arguments: argparse.Namespace) -> VerbOutcome:
    """Return the numbers of saved motions beside each other."""
    from ..show.compare import compare as compared
    from ..show.motions import saved_motion

    motions = [saved_motion(file, arguments.folder) for file in arguments.files]
    both = compared(motions, names=arguments.files)
    files: Files = {"view": both.view, "plot": lambda path: both.plot(path=path)}
    return VerbOutcome({"runs": arguments.files, "rows": both.rows}, str(both), True, files)


def sweep(arguments: argparse.Namespace) -> VerbOutcome:
    """Run the missing points of a scene's sweep, and return how far it is."""
    from ..bridges.sweeps.points import axes_of, checked_row
    from ..bridges.sweeps.scene import arguments_of
    from ..bridges.sweeps.sweep import posed
    from ..bridges.sweeps.sweep import sweep as swept
    from ..bridges.sweeps.tables import checked

    if arguments.export is not None:
        checked(arguments.export)
    job = arguments_of(arguments.scene)
    if arguments.view is not None:  # before anything runs
        points = len(axes_of(job["over"], job.get("points"), job.get("seed", 0)))
        checked_row(arguments.row, points)
    if arguments.store is not None:
        job["store"] = arguments.store
    if arguments.status:
        if not job["store"].exists():
            raise SweepError(f"store: {job['store']} is not there yet: run it without --status")
        result = posed(**{name: value for name, value in job.items() if name not in LATER})
    else:
        result = swept(**job, executor=arguments.executor, retry_failed=arguments.retry_failed)
    status = result.status()
    report: dict[str, Any] = {"points": status.points, "done": status.done}
    report |= {"failed": status.failed, "store": str(job["store"])}
    text = f"{status}\nstore: {job['store']}"
    first = next((row for row in result if row["error"]), None) if status.failed else None
    if hung := result.spent.hung:
        text += f"\n{hung} of them hung, and have no row: the same call runs them again"
    if first is not None:
        report["first_failure"] = {"number": first["number"], "error": first["error"]}
        text += f"\nfirst failure, point {first['number']}: {first['error']}"
    if arguments.export is not None:
        text += f"\nwritten: {result.save(arguments.export)}"
    if arguments.view is not None:
        text += f"\npage of point {arguments.row}: {result.view(arguments.row, arguments.view)}"
    return VerbOutcome(report, text, status.failed == 0)
