"""The exceptions of the runtime: each names what is wrong and what to do about it."""

from __future__ import annotations

from typing import Any


class SerpentailError(Exception):
    """Anything that the runtime refuses; the base of all its exceptions."""


class CompilerNotFound(SerpentailError):
    """No C compiler works here; the message names what was tried."""


class CompileFailed(SerpentailError):
    """The C compiler failed; `command`, `returncode` and `stderr` are its own words."""

    command: tuple[str, ...] = ()
    returncode: int = 0
    stderr: str = ""


class ModelError(SerpentailError):
    """A generated folder is stale, tampered with, incomplete or of another ABI."""


class StateError(SerpentailError, ValueError):
    """A state, rate, torque or force has a wrong shape or a value that is not finite."""


class SimulationError(SerpentailError):
    """A simulation cannot go on; `trajectory` is the motion until then, None if it never began."""

    trajectory: Any = None  # a Trajectory


class PlanningError(SerpentailError, ValueError):
    """A planning problem that cannot be posed."""


class IdentificationError(SerpentailError, ValueError):
    """Markers that cannot be read, or parameters that cannot be estimated as asked."""


class ExtraMissing(SerpentailError, ImportError):
    """A library is not installed; the message names the extra that brings it."""


class NotWritten(SerpentailError, OSError):
    """A file cannot be written; what was there before is there still."""


class ViewError(SerpentailError, ValueError):
    """A page, a film or a figure that cannot be drawn as asked."""


class ExportError(SerpentailError, ValueError):
    """A model that another tool's file cannot hold, or a file that cannot be one."""


class SweepError(SerpentailError, ValueError):
    """A sweep that cannot be posed, or whose workers are gone."""


class UnlikeBodies(UserWarning):
    """Torso and tail are so unlike in size that moments cancel in H, which loses digits."""


class UnusualSize(UserWarning):
    """A mass, length, angle or other number that no animal or robot has: mostly a slip of units."""


class DoubtfulMarkers(UserWarning):
    """Marker tracks that fit badly, as those of swapped markers do."""
