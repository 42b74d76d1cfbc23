"""The job of a sweep: plain data that is sent to the processes that run points."""

import hashlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from ...basics.checks import shown
from ...basics.errors import SweepError
from .axis import as_json
from .points import Point

RUNS = ("simulate", "plan", "identify")
STARTS = ("q0", "v0")
DATA = "data"  # of an identification: its files of marker tracks


@dataclass(frozen=True)
class Job:
    """What is run: one of RUNS, or a function of a model and a point, or of a point alone.

    settings: of st.simulate, st.plan or st.identify. outputs: names of a simulation's outputs.
    table, phases, parent: of a scene; a model has no table. parent is the folder of the files that
    are named: the scene's, or the one where the sweep was called. built: names that the model was
    built with. keys: names of keys of the table. parameters, profile: of a model that was given.
    """

    run: str | Callable[..., Any]
    settings: Mapping[str, Any] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    table: Mapping[str, Any] | None = None
    phases: Sequence[Mapping] = ()
    parent: str = ""
    built: frozenset[str] = frozenset()
    keys: frozenset[str] = frozenset()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    profile: str | None = None

    def parameters_of(self, point: Point) -> Point:
        """Return the parameters of the model that a point has."""
        others = self.built | self.keys
        return {name: value for name, value in point.items() if name not in others}

    def keys_of(self, point: Point) -> Point:
        """Return the keys of the scene's table, or the settings, that a point has."""
        return {name: value for name, value in point.items() if name in self.keys}

    def recordings(self, point: Point) -> list[Any]:
        """Return the trials of a point: paths of files, whole, and tracks as they were given."""
        data = point.get(DATA, self.settings.get(DATA))
        trials = data if isinstance(data, list | tuple) else [data]
        return [Path(self.parent, x) if isinstance(x, str | PathLike) else x for x in trials]

    def digest_of(self, point: Point) -> str:
        """Return a hash of the content of a point's files; SweepError if one cannot be read."""
        content = hashlib.sha256()
        for path in self.recordings(point):
            if isinstance(path, Path):
                try:
                    content.update(hashlib.sha256(path.read_bytes()).digest())
                except OSError as reason:
                    raise SweepError(
                        f"{DATA}: {shown(str(path))}: it cannot be read ({reason.strerror}): needs "
                        "files of marker tracks"
                    ) from None
        return content.hexdigest()

    def pickled(self) -> bytes:
        """Return it as bytes; SweepError if a part of it cannot be pickled."""
        try:
            return pickle.dumps(self)
        except Exception as reason:  # whatever a part of it raises
            raise SweepError(
                f"run, settings: they cannot be sent to another process ({reason}): take a "
                "function at the top of a module, and settings that can be pickled"
            ) from None

    def identity(self) -> str:
        """Return what rows depend on besides the model and the point."""
        parts = (self.outputs, self.table, self.phases, dict(self.parameters), self.profile)
        return as_json([_run_identity(self.run), _identity(dict(self.settings)), *parts])


def _run_identity(run: Any) -> Any:
    """Return the name of a run; of a partial function, with its arguments."""
    if isinstance(run, str):
        return run
    if isinstance(run, partial):
        return [_run_identity(run.func), _identity([list(run.args), run.keywords])]
    where = run if hasattr(run, "__qualname__") else type(run)  # an object that is called
    name = f"{where.__module__}.{where.__qualname__}"
    if not callable(run) or "<" in name:  # a lambda, or a function in a function
        raise SweepError(
            f"run: value {shown(run)}: needs {', '.join(map(repr, RUNS))}, or a function at the "
            "top of a module, which other processes can import"
        )
    return name


def _identity(value: Any) -> Any:
    """Return plain data as it is, anything else as a digest of its pickle."""
    try:
        as_json(value)
        return value
    except (TypeError, ValueError):
        if isinstance(value, dict):
            return {str(name): _identity(each) for name, each in value.items()}
        return hashlib.sha256(pickle.dumps(value)).hexdigest()
