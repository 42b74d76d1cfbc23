"""The exceptions and warnings of the runtime; each message gives the value and a remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..motion.trajectory import Trajectory


class SerpentailError(Exception):
    """Base class of all exceptions of this package."""


class CompilerNotFound(SerpentailError):
    """No C compiler works on this machine; the message names those that were tried."""


class CompileFailed(SerpentailError):
    """The C compiler reported an error.

    Attributes
    ----------
    command : tuple of str
        The command that failed.
    returncode : int
        Its exit status.
    stderr : str
        What the compiler wrote.
    """

    command: tuple[str, ...] = ()
    returncode: int = 0
    stderr: str = ""


class ModelError(SerpentailError):
    """A generated folder, a scene key or a parameter is wrong.

    For instance: a folder is stale, changed, incomplete or of another version; a parameter is
    unknown or unphysical; the scene left out a function.
    """


class StateError(SerpentailError, ValueError):
    """A state, rate, torque or force has a wrong shape, or a value that is not finite."""


class SimulationError(SerpentailError):
    """A setting of a simulation is wrong, or a simulation cannot go on.

    Attributes
    ----------
    trajectory : Trajectory or None
        The motion up to the failure; None if it never began.
    """

    trajectory: Trajectory | None = None


class PlanningError(SerpentailError, ValueError):
    """A planning problem, or a setting of a plan, of ``Gains`` or of ``Mpc``, is wrong."""


class IdentificationError(SerpentailError, ValueError):
    """Markers cannot be read, or parameters cannot be estimated as asked."""


class ExtraMissing(SerpentailError, ImportError):
    """A library is not installed; the message names the extra that installs it."""


class NotWritten(SerpentailError, OSError):
    """A file cannot be written; a file that was there before is unchanged."""


class ViewError(SerpentailError, ValueError):
    """A page, a film or a figure cannot be drawn as asked."""


class ExportError(SerpentailError, ValueError):
    """A file format cannot hold the model, or a file cannot have that name."""


class SweepError(SerpentailError, ValueError):
    """A sweep is not well posed, or its worker processes are gone."""


class UnlikeBodies(UserWarning):
    """Warning: torso and tail differ so much in size that the inertia matrix H loses digits."""


class UnusualSize(UserWarning):
    """Warning: a number has a size that no animal or robot has; most often a unit is wrong.

    It also tells if the arcs of a tapered tail are too long for its inertia.
    """


class DoubtfulMarkers(UserWarning):
    """Warning: marker tracks fit badly; swapped markers are a common cause."""
