"""The verbs that make motions, or show them: plan, simulate, identify, view."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..basics.errors import SimulationError
from ..motion.text import as_text
from .outcome import Files, Outcome

if TYPE_CHECKING:
    from ..motion.trajectory import Trajectory
    from ..scenes.simulate import Scenario


def plan(arguments: argparse.Namespace) -> Outcome:
    """Return the report of a scene's plan, and whether it converged."""
    from ..bridges.containers.tables import save
    from ..scenes import plan as scenes

    plan = scenes.planned(arguments.scene, arguments.folder)
    files: Files = {"save": partial(save, plan.trajectory), "view": plan.view}
    report = plan.report | {"warnings": plan.warnings}
    return Outcome(report, as_text(report), plan.success, files)


def simulate(arguments: argparse.Namespace) -> Outcome:
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
    files: Files = {"save": partial(save, motion), "film": motion.film, "view": motion.view}
    return Outcome(report, text, True, files)


def identify(arguments: argparse.Namespace) -> Outcome:
    """Return parameters, motion and torques that marker tracks show, and whether that converged."""
    from ..bridges.containers.tables import save
    from ..scenes.identify import identified

    found = identified(arguments.scene, arguments.data, arguments.folder)
    files: Files = {"save": partial(save, found.trajectory), "view": found.view}
    text = "\n".join(each for each in (found.table, as_text(_rest(found.report))) if each)
    return Outcome(found.report, text, found.success, files)


def _rest(report: dict) -> dict:
    """Return a report without what its table has."""
    return {name: value for name, value in report.items() if name != "parameters"}


def _phases(motion: "Trajectory") -> dict[str, dict]:
    """Return how the phases of a sequence went, by name; nothing of other motions."""
    told = {}
    for phase in motion.info.get("phases", []):
        seen = {"begin_s": phase["begin"], "end_s": phase["end"], "ended_by": phase["ended_by"]}
        if "plan" in phase:
            seen["plan_is_true"] = phase["plan"]["success"]
        told[phase["name"]] = seen
    return {"phases": told} if told else {}


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


def view(arguments: argparse.Namespace) -> Outcome:
    """Write the page of saved motions, and return its path."""
    from ..show.motions import saved_motion
    from ..show.page.view import view as page_of

    motions = [saved_motion(file, arguments.folder) for file in arguments.files]
    names = list(arguments.files) if len(motions) > 1 else None
    path = arguments.output or Path(arguments.files[0]).with_suffix(".html")
    page = page_of(motions, path, names=names)
    return Outcome({"page": str(page)}, str(page))
