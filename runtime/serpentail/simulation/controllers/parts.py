"""Parts of a controller: damping, torque curves, tracking, functions of C and of Python."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .piecewise import Piecewise

if TYPE_CHECKING:
    from .pfl import Pfl

TorqueFunction = Callable[[float, np.ndarray, np.ndarray], ArrayLike]  # (t, q, v) -> tau


@dataclass(frozen=True, eq=False)
class ControllerState:
    """State of a controller during a run.

    begin: called with the record of a run that begins, and the controller's clock (s). info:
    returns what the run's info has of it. stops: called with the span of the run on that clock (s);
    returns the times (s) at which steps must end.
    """

    begin: Callable[[Any, float], None]
    info: Callable[[], dict[str, Any]]
    stops: Callable[[float, float], list[float]]


@dataclass(frozen=True, eq=False)
class Parts:
    """Sum of the torques of one controller.

    damping (2m,) in N m s; native and user are functions of C and of Python. clock: time of the run
    (s) at which the clock of the C function is 0; state: what the controller remembers.
    """

    damping: np.ndarray | None = None
    torques: Piecewise | None = None
    tensions: Piecewise | None = None
    pfl: "Pfl | None" = None
    native: "NativeTorque | None" = None
    user: TorqueFunction | None = None
    clock: float = 0.0
    state: ControllerState | None = None

    def since(self, begin: float) -> "Parts":
        """Return the parts with a clock that is 0 at the time ``begin`` (s) of the run."""
        if begin == 0:
            return self
        user = self.user
        return replace(
            self,
            torques=None if self.torques is None else self.torques.later(begin),
            tensions=None if self.tensions is None else self.tensions.later(begin),
            pfl=None if self.pfl is None else self.pfl.later(begin),
            user=None if user is None else lambda t, q, v: user(t - begin, q, v),
            clock=begin,
        )

    def kinks(self) -> list[float]:
        """Return the times at which these torques have a jump or a kink."""
        curves = self.torques, self.tensions, None if self.pfl is None else self.pfl.curve
        return [t for curve in curves if curve is not None for t in curve.kinks().tolist()]

    def ticks(self, start: float, end: float) -> list[float]:
        """Return the times (s) from start to end at which the controller needs a step to end."""
        if self.state is None:
            return []
        return [self.clock + t for t in self.state.stops(start - self.clock, end - self.clock)]


@dataclass(frozen=True)
class NativeTorque:
    """A compiled function as controller.

    The function has the C signature ``int f(void *context, real t, const real *q, const real *v,
    real *tau)`` and returns 0 for success. ``t`` (s) is the clock of its phase.

    Parameters
    ----------
    function : ctypes function or int
        The function, or its address. The caller keeps it alive.
    context : int, optional
        Address that is passed to the function. The caller keeps it alive.
    """

    function: Any
    context: int | None = None

    def parts(self, nt: int) -> Parts:
        """Return its parts; they do not depend on the number of tail coordinates."""
        return Parts(native=self)
