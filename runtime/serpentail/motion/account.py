"""The text of a motion in a REPL: what moved, when, how it was made, how it ended."""

from typing import TYPE_CHECKING, Any

from serpentail_scene.messages import one_line

from ..model.model import Model

if TYPE_CHECKING:
    from .trajectory import Trajectory

UNITS = "SI: s, m, rad, kg, N"
ARRAYS = ("q", "v", "tau")
WIDTH = 96  # characters of a line


def account(motion: "Trajectory") -> str:
    """Return a trajectory on at most six lines."""
    first, last = motion.t[[0, -1]]
    moved = tail_of(motion.model) if motion.model else "without its model"
    name = motion.info.get("model", "a tail")
    lines = [
        f"Trajectory of {name}, {moved}: {len(motion.t)} samples, {first:.6g} to {last:.6g} s",
        arrays_of(motion),
        _touched(motion),
        how_made(motion.info),
    ]
    return framed(lines + _ended(motion))


def tail_of(model: Model) -> str:
    """Return in words what a model's tail is made of."""
    if model.kind == "mixed":
        return model.tail_words()
    if isinstance(model.links, tuple):
        return f"{model.kind}, {', '.join(map(str, model.links))} links"
    if model.links:
        return f"{model.kind}, {model.segments} x {model.links} links"
    return f"{model.kind}, {model.segments} segments"


def arrays_of(motion: Any) -> str:
    """Return the shapes of q, v and tau, and the units."""
    shapes = [f"{name} {getattr(motion, name).shape}" for name in ARRAYS]
    return f"{', '.join(shapes)}; {UNITS}"


def how_made(info: dict[str, Any]) -> str:
    """Return how a motion was made, as far as its info says so."""
    if "method" not in info:
        return "planned" if info.get("kind") == "plan" else "by an unknown method"
    counts = [f"{info[name]} {name}" for name in ("steps", "rejected") if name in info]
    return f"by {info['method']}: {', '.join(counts)}"


def framed(lines: list[str]) -> str:
    """Return lines as the text of one object, each cut to the width."""
    return "<" + "\n  ".join(one_line(line, WIDTH) for line in lines) + ">"


def _touched(motion: "Trajectory") -> str:
    """What touches the ground, and how often that changes."""
    if motion.contact is None:
        return "on a fixed base" if motion.layout.fixed else "in flight"
    points = [f"{count} of the {group}" for group, count in motion.contact.groups.items()]
    events = _listed(motion.info, "events")
    return f"on the ground by points: {', '.join(points)}; {len(events)} events"


def _ended(motion: "Trajectory") -> list[str]:
    """What went wrong."""
    if "failure" in motion.info:
        return [f"failed: {motion.info['failure']}"]
    warnings = _listed(motion.info, "warnings")
    return [f"{len(warnings)} warnings, the first: {warnings[0]}"] if warnings else []


def _listed(info: dict[str, Any], name: str) -> list[Any]:
    """Return a list of an info; empty if the entry is something else."""
    found = info.get(name)
    return found if isinstance(found, list) else []
