"""``view``: writes one or several motions to a page that needs nothing but a browser."""

import json
import os
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ViewError
from ..files import replacing
from ..model.model import Model
from ..model.parameters import total_mass
from ..motion.trajectory import Trajectory
from .figures import events, figures
from .packing import packed
from .panels import panels
from .samples import samples, thinned
from .shape import length, shape

PAGE = Path(__file__).with_name("page.html")  # made of the sources in viewer/ when this is built
COMMON = 95  # percentile of the forces whose arrow is as long as half the torso


def view(
    motions: Trajectory | Sequence[Trajectory],
    path: str | os.PathLike[str] = "run.html",
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
) -> Path:
    """Write a page that shows motions over each other; return its path.

    motions: a Trajectory, or several.  path: an .html file; it is complete in itself, fetches
    nothing, and replaces what was there once it is whole.  names: of the motions, by default what
    each is.  model: of motions that were loaded from files; others know theirs.
    More than 2400 samples are thinned, which the page says, as it says that a run failed.  Raises
    ViewError with argument, value and remedy, ModelError where the model lacks ``tail_points``.
    """
    motions = _checked_motions(motions)
    target, names = checked_path(path), _checked_names(names, motions)
    models = [_model_of(k, motion, model) for k, motion in enumerate(motions)]
    page, data = template(), _data(motions, names, models)
    parts = {
        "<!--TITLE-->": escape(", ".join(dict.fromkeys(each.name for each in models))),
        "/*DATA*/": json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
    }
    marks = re.compile("|".join(map(re.escape, parts)))
    text = marks.sub(lambda mark: parts[mark[0]], page)
    try:
        with replacing(target) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ViewError(f"path: value {str(path)!r}: cannot be written ({error})") from error
    return target


def _data(motions: list[Trajectory], names: list[str], models: list[Model]) -> dict[str, Any]:
    """What the page reads."""
    shown, notes, runs = [], [], []
    for motion, name, model in zip(motions, names, models, strict=True):
        few, step = thinned(motion)
        shown.append(few)
        notes += _notes(name, motion, step)
        numbers = [*figures(model, motion), ("samples", str(len(motion.t)))]
        runs.append(
            _run(few, model) | {"name": name, "numbers": numbers, "events": events(motion, name)}
        )
    weight = max(float(total_mass(m.parameters) * m.parameters["gravity"]) for m in models)
    return {
        "runs": runs,
        "notes": notes,
        "plots": panels(names, shown, weight or 1.0),
        "length": max(map(length, models)),
        "force_scale": _common_force(shown) or weight or 1.0,
    }


def _run(motion: Trajectory, model: Model) -> dict[str, Any]:
    """A run as the page reads it: sizes, and arrays as text."""
    arrays = samples(model, motion)
    return {
        "rows": len(motion.t),
        "points": arrays["tail"].shape[1],
        "legs": 2 if "legs" in arrays else 0,
        "contacts": sum(motion.contact.groups.values()) if motion.contact else 0,
        "grounded": motion.contact is not None,
        "body": shape(model),
        "arrays": {name: packed(array) for name, array in arrays.items()},
    }


def _notes(name: str, motion: Trajectory, step: int) -> list[str]:
    """What a reader of the page has to know of a run."""
    notes = []
    if "failure" in motion.info:
        notes.append(f"{name}: the run failed, and ends here: {motion.info['failure']}")
    if step > 1:
        notes.append(
            f"{name}: one of {step} samples is shown; the numbers are of all {len(motion.t)}."
        )
    return notes


def _common_force(motions: list[Trajectory]) -> float:
    """The 95th percentile of the forces that act, N; 0 where none does."""
    touching = [motion.contact.forces for motion in motions if motion.contact is not None]
    sizes = np.concatenate([[0.0], *(np.linalg.norm(f, axis=-1).ravel() for f in touching)])
    return float(np.percentile(sizes[sizes > 0], COMMON)) if sizes.any() else 0.0


def _checked_motions(motions: Any) -> list[Trajectory]:
    """The motions as a list."""
    listed = list(motions) if isinstance(motions, list | tuple) else [motions]
    for k, motion in enumerate(listed):
        if not isinstance(motion, Trajectory):
            raise ViewError(f"motions[{k}]: type {type(motion).__name__}: needs a Trajectory")
    if not listed:
        raise ViewError("motions: none: needs one Trajectory or more")
    return listed


def checked_path(path: Any) -> Path:
    """Return the path of a page; ViewError where it names none."""
    try:
        target = Path(path)
    except TypeError:
        raise ViewError(f"path: value {path!r:.60}: needs the name of an .html file") from None
    if target.suffix.lower() != ".html" or target.is_dir():
        raise ViewError(f"path: value {str(path)!r}: needs a file whose name ends in .html")
    return target


def _checked_names(names: Any, motions: list[Trajectory]) -> list[str]:
    """A name for each motion."""
    if names is None:
        kinds = ["planned" if m.info.get("kind") == "plan" else "run" for m in motions]
        return [
            kind if kinds.count(kind) == 1 else f"{kind} {k + 1}" for k, kind in enumerate(kinds)
        ]
    listed = list(names) if isinstance(names, list | tuple) else []
    whole = all(isinstance(name, str) and name.strip() for name in listed)
    if not whole or len(listed) != len(motions) or len(set(listed)) != len(listed):
        raise ViewError(f"names: value {names!r:.200}: needs {len(motions)} names that differ")
    return listed


def _model_of(k: int, motion: Trajectory, model: Any) -> Model:
    """The model of motion k."""
    found = motion.model if motion.model is not None else model
    if found is None:
        raise ViewError(
            f"motions[{k}]: was loaded from a file, which has no model: give model=st.load(folder)"
        )
    if not isinstance(found, Model):
        raise ViewError(f"model: type {type(found).__name__}: needs a Model, as st.load returns")
    if motion.q.shape[1] != found.nq:
        raise ViewError(
            f"motions[{k}]: q has {motion.q.shape[1]} numbers, {found.name} has {found.nq}: give "
            "its own model"
        )
    return found


def template() -> str:
    """Return the page without motions; ViewError where it was not built."""
    try:
        return PAGE.read_text(encoding="utf-8")
    except OSError:
        raise ViewError(
            "the page was not built, since node or npm's packages were missing: install Node.js 18 "
            "or newer and set serpentail up again, `make setup`"
        ) from None
