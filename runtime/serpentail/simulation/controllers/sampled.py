"""``Sampled``: a controller that measures at a fixed rate, and holds its torques in between."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...basics.checks import number, numbers_in, refusal
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from .parts import ControllerState, Parts

SAME = 1e-6  # of the time between ticks: closer times count as equal
MOST_TICKS = 1_000_000  # of a run: steps end at each


@dataclass(frozen=True, eq=False)
class Sampled:
    """A function that is called once at each tick, as on a robot's computer.

    Torques are constant between ticks, and steps of the integrator end at them. The function may
    therefore remember what it has seen.

    Parameters
    ----------
    function : callable
        ``(t, q, v) -> tau`` with t (s), q (nq,), v (nv,) and tau (2m,) (N m). It is called at
        t = 0, 1 / rate, 2 / rate and so on, in this order, and at the start of a run that begins
        in between. t is the clock of its phase.
    rate : float
        Rate of the ticks (Hz).
    delay : float, default 0
        Time from a tick until its torques act (s); it may be longer than the time between ticks.
        Before the first torques act there are none.

    Raises
    ------
    SimulationError
        An argument is wrong, or, from ``simulate``, a run has more than a million ticks.

    Notes
    -----
    Many runs are made one after another. If the function remembers anything, give a list with one
    controller for each run.

    Examples
    --------
    >>> import serpentail as st
    >>> law = st.Sampled(lambda t, q, v: -1e-4 * v[6:], rate=200, delay=0.002)
    """

    function: Callable[[float, np.ndarray, np.ndarray], ArrayLike]
    rate: Any  # numbers or texts; then numbers
    delay: Any = 0.0
    __repr__ = brief

    def __post_init__(self) -> None:
        """Refuse anything but a function, a rate and a delay."""
        if not callable(self.function):
            needs = "a function (t, q, v) -> tau"
            raise refusal("Sampled: function", self.function, needs, SimulationError)
        checked = {
            "rate": number("Sampled: rate", self.rate, SimulationError, unit="1/s", above=0),
            "delay": number("Sampled: delay", self.delay, SimulationError, unit="s", least=0),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def parts(self, nt: int) -> Parts:
        """Return its parts in a run, with that run's own memory."""
        torques = SampledTorques(self, nt)
        return Parts(user=torques, state=ControllerState(torques.begin, dict, self.stops))

    def stops(self, start: float, end: float) -> list[float]:
        """Return the times (s) from start to end at which it measures, or its torques change."""
        first, last = np.floor(start * self.rate + SAME), np.ceil(end * self.rate)
        if not last - first <= MOST_TICKS:
            needs = f"at most {MOST_TICKS} ticks in a run"
            raise refusal("Sampled: rate", self.rate, needs, SimulationError)
        ticks = np.maximum(np.arange(first, last) / self.rate, start)
        both = np.sort(np.append(ticks, ticks + self.delay))
        apart = np.diff(both, prepend=-np.inf) > SAME / self.rate
        return [*map(float, both[apart])]


class SampledTorques:
    """The torques of one run: those that act now, and those that will act after the delay."""

    def __init__(self, law: Sampled, nt: int):
        self.law, self.nt = law, nt
        self.begin(None, 0.0)

    def begin(self, record: Any, clock: float) -> None:
        """Begin a run, given by its record, whose time is ``clock`` (s) at its own time 0."""
        self.record, self.clock = record, clock
        self.eps = 0.0
        if record is not None:
            single = type(record).t.size == np.dtype(np.float32).itemsize
            self.eps = float(np.finfo(np.float32 if single else float).eps)
        self.tick = -np.inf
        self.torques: Any = np.zeros(self.nt)
        self.waiting: deque[tuple[float, Any]] = deque()  # when they begin to act (s), torques

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray) -> Any:
        """Return the torques at t; at a tick, which is the start of a step, measure before."""
        now = min(t, self.record.t - self.clock)
        late = now + SAME / self.law.rate + 8 * self.eps * (abs(now) + abs(self.clock))
        tick = np.floor(late * self.law.rate)
        if tick > self.tick:
            self.tick = tick
            given = self.law.function(now, q, v)
            found = numbers_in(given)
            begin = now + self.law.delay
            self.waiting.append((begin, given if found is None else found.copy()))
        while self.waiting and self.waiting[0][0] <= late:
            self.torques = self.waiting.popleft()[1]
        return self.torques
