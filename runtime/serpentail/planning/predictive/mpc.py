"""``Mpc``: a controller that plans the rest of a flight anew at each tick."""

import ctypes
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import refusal
from ...errors import SimulationError
from ...model.kernel import aligned
from ...model.layout import TAIL_V
from ...model.model import Model
from ...simulation.controllers import NativeTorque, OwnState, Parts
from ..result.plan import Plan
from .emission import write_c
from .kernel import Simulation, kernel
from .settings import checked_settings, refuse_unable
from .task import MpcTask, task_of

RATE = 100.0  # Hz
COUNTS = ("ticks", "failed", "set_changes")


class Mpc:
    """Model-predictive control of a planned flight: a controller for ``st.simulate``.

    At each tick the state is measured, and from it a correction of the plan's torques is computed
    by one Gauss-Newton step: constant in each of some intervals, within the plan's bounds of
    torque, it brings the end nearest to the plan's goal.  What the body does until the torques act
    is foretold.  A tick that fails, as of a state that is not finite, changes nothing.

    model: what the controller takes the body for; it needs airborne_rates,
    airborne_rates_derivatives and momentum, in double.
    plan: of ``st.plan``, its attitude a quaternion.
    rate: Hz, of the ticks.  horizon: s, so far each tick looks ahead; by default to the plan's end,
    and never beyond it.  A shorter one ends at the plan's state of that time.
    settings: intervals of the correction (6); delay (0 s), from a tick until its torques act: what
    computing takes; iterations (1), Gauss-Newton steps a tick; step (0.005 s), the longest of
    Runge-Kutta's steps; rest (s), the time before the plan's end within which there are no ticks,
    by default that between two.

    Called with (t, q, v), t in s from the plan's begin, it returns tau (2m,) in N m, and takes q
    and v as measured where a tick is due; in simulations each run has a memory of its own.  After
    the plan's end there is no torque but that of the plan's damping.  Raises PlanningError where an
    argument is wrong.
    """

    def __init__(
        self,
        model: Model,
        plan: Plan,
        *,
        rate: float = RATE,
        horizon: float | None = None,
        **settings: Any,
    ):
        refuse_unable(model, plan)
        given = {"rate": rate, "horizon": horizon} | settings
        self.model, self.plan = model, plan
        self.settings = checked_settings(plan, given)
        self.task = task_of(model, plan, self.settings)
        self._own = Memory(self.task)

    def __repr__(self) -> str:
        """Of what, how often, how far ahead."""
        rate, ahead = self.settings.rate, self.task.numbers["horizon"]
        return f"Mpc({self.model.name}, {rate:g} Hz, {ahead:.4g} s in {self.settings.intervals})"

    @property
    def info(self) -> dict[str, int]:
        """Counts since the last begin: ticks, how many of them failed, and changes of active sets.

        Of calls alone: those of a simulation are in its ``info["mpc"]``.
        """
        return self._own.info()

    @property
    def memory_size(self) -> int:
        """Doubles that the controller works on."""
        return len(self._own.memory)

    def begin(self) -> None:
        """Forget all ticks."""
        self._own.begin()

    def tick(self, t: float, q: Any, v: Any) -> bool:
        """Compute a correction from q (7+2m,), v (6+2m,), measured at t (s); tell if that did not
        fail.
        """
        return self._own.tick(float(t), *self._state(q, v))

    def torque(self, t: float) -> np.ndarray:
        """Return the torques (2m,) at t (s), N m, before damping."""
        return self._own.torque(float(t))

    def __call__(self, t: float, q: Any, v: Any) -> np.ndarray:
        """Return tau (2m,), N m; a tick where one is due."""
        q, v = self._state(q, v)
        return self._own.control(float(t), q, v) - self.plan.problem.damping * v[TAIL_V]

    def parts(self, nt: int) -> Parts:
        """Return what it adds up in a run, with a memory of that run's own."""
        if nt != self.model.layout.nt:
            needs = f"a model of {self.model.layout.nt} tail coordinates, as the controller's"
            raise refusal("Mpc: tail coordinates", nt, needs, SimulationError)
        memory = Memory(self.task)
        native = NativeTorque(kernel().mpc_simulated, ctypes.addressof(memory.run))
        own = OwnState(memory.begin_run, lambda: {"mpc": memory.info()}, self.stops())
        return Parts(np.full(nt, self.plan.problem.damping), native=native, own=own)

    def write_c(self, folder: str | PathLike[str] = ".") -> list[Path]:
        """Write the controller and its plan as C99, <model>_mpc.h and .c; return their paths.

        They need the model's generated C, allocate nothing, and compute what this one does; the
        header tells how they are called.  Raises PlanningError where there is no such folder.
        """
        return write_c(self.model, self.task, self.memory_size, folder)

    def stops(self) -> list[float]:
        """Return the times (s) at which the torques jump, or are computed."""
        numbers, plan = self.task.numbers, self.task.arrays["times"]
        period, delay = numbers["period"], numbers["delay"]
        ticks = period * np.arange(np.floor(numbers["last"] / period + 1e-6) + 1)
        return sorted({*ticks.tolist(), *(ticks + delay).tolist(), *plan[1:].tolist()})

    def _state(self, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return q, v as arrays; they may be anything but of another size."""
        arrays = []
        for name, value, size in (("q", q, self.model.nq), ("v", v, self.model.nv)):
            array = np.ascontiguousarray(value, float)
            if array.shape != (size,):
                raise refusal(f"Mpc: {name}", value, f"{size} numbers", SimulationError)
            arrays.append(array)
        return arrays[0], arrays[1]


class Memory:
    """What one controller at work keeps, and the C that works on it."""

    def __init__(self, task: MpcTask):
        self.task, self.code = task, kernel()
        self.place = ctypes.addressof(task.record)
        self.memory = aligned(self.code.mpc_memory_size(self.place), np.dtype(float))
        self.run = Simulation()
        self.state = ctypes.addressof(self.run)  # of which its state is the first member
        self.tau = np.zeros(task.record.tail)
        self.begin()

    def begin(self) -> None:
        """Forget all ticks."""
        self.code.mpc_begin(self.state, self.place, self.memory.ctypes.data)

    def begin_run(self, record: Any, clock: float) -> None:
        """Begin a run of the generated C, whose controller's clock is at 0 at a time (s) of it."""
        if type(record).t.size != ctypes.sizeof(ctypes.c_double):
            raise SimulationError("Mpc: the simulated model's numbers are float: it needs double")
        self.begin()
        self.run.step_begin = ctypes.addressof(record) + type(record).t.offset
        self.run.clock = clock

    def tick(self, t: float, q: np.ndarray, v: np.ndarray) -> bool:
        """Compute a correction; tell if that did not fail."""
        return bool(self.code.mpc_tick(self.state, t, q.ctypes.data, v.ctypes.data) == 0)

    def torque(self, t: float) -> np.ndarray:
        """Return the torques at t."""
        self.code.mpc_torque(self.state, t, t, self.tau.ctypes.data)
        return self.tau.copy()

    def control(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the torques at t; a tick where one is due."""
        places = (q.ctypes.data, v.ctypes.data, self.tau.ctypes.data)
        self.code.mpc_control(self.state, t, t, *places)
        return self.tau.copy()

    def info(self) -> dict[str, int]:
        """Return counts."""
        return {name: int(getattr(self.run.state, name)) for name in COUNTS}
