"""``Mpc``: a controller that corrects the rest of a planned flight at each tick."""

import ctypes
from enum import IntFlag
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from serpentail_scene.layout import TAIL_V

from ..basics.checks import refusal
from ..basics.errors import SimulationError
from ..basics.near_names import NearNames
from ..model.memory import aligned
from ..model.model import Model
from ..model.state import Quantity
from ..planning.result.plan import Plan
from ..simulation.controllers.parts import ControllerState, NativeTorque, Parts
from .emission import write_c
from .kernel import COUNTS, kernel
from .settings import checked_settings, refuse_unable
from .task import MpcTask, task_of

RATE = 100.0  # Hz


class MpcFlag(IntFlag):
    """What happened at a tick of ``Mpc``; several may hold.

    Attributes
    ----------
    SECOND
        The predicted end was far off after a step, more than about 0.5 degrees of the torso, so
        there was another one.
    LIMIT
        A quadratic program ended at its limit of changes; torques are within their bounds.
    BOUND
        An angle or a rate of the tail is beyond its bound, or will be.
    MISS
        The end is predicted to miss the target, by more than about 1 degree of the torso.
    KEPT
        The tick failed, for instance because the state was not finite: it changed nothing.
    OPEN
        It failed, and no earlier correction acts: the torques are the plan's.

    Examples
    --------
    >>> import serpentail as st
    >>> st.MpcFlag(9)
    <MpcFlag.SECOND|MISS: 9>
    """

    SECOND, LIMIT, BOUND, MISS, KEPT, OPEN = (1 << bit for bit in range(6))


class Mpc(NearNames):
    """Model-predictive control of a planned flight: a controller for ``simulate``.

    At each tick it measures the state and computes a correction of the plan's torques by a
    Gauss-Newton step, and another one while the predicted end is far off. The correction is
    constant in each of some intervals and brings the end nearest to the plan's goal. Bounds of
    torques, and of the tail's angles and rates in the predicted motion, are hard. The motion until
    the new torques act is predicted. A tick that fails, for instance because the state is not
    finite, changes nothing. Each tick has flags that tell what happened.

    Parameters
    ----------
    model : Model
        The model that the controller uses; it needs "airborne_rates",
        "airborne_rates_derivatives" and "momentum", and has a free base. The controller computes
        with the model's type of numbers, double or float.
    plan : Plan
        The plan.
    rate : float, default 100
        Rate of the ticks (Hz).
    horizon : float, optional
        How far each tick looks ahead (s), at most to the plan's end. A horizon that ends earlier
        aims at the plan's state of that time. Default: to the plan's end.
    intervals : int, default 6
        Number of intervals of the correction.
    delay : float, default 0
        Time from a tick until its torques act (s), at most the time between ticks.
    iterations : int, default 2
        Most Gauss-Newton steps at a tick.
    step : float, default 0.01
        Longest Runge-Kutta step of the prediction (s).
    rest : float, optional
        Time before the plan's end without ticks (s). Default: the time between two ticks.
    bounds : Bounds, optional
        Bounds of angles, rates and torques; it keeps no bounds of torque rates. Default: the
        plan's.
    ignore_path : bool, default False
        Fly a plan that has path constraints or a clearance, which corrections do not keep. Without
        it such a plan is refused.

    Raises
    ------
    PlanningError
        The model, the plan or a setting is wrong.
    ModelError
        The base is fixed.

    Notes
    -----
    Called with (t, q, v), t (s) from the plan's start, it returns the torques (2m,) (N m), and
    takes q and v as measured if a tick is due. In simulations each run has its own memory. After
    the plan's end only the plan's damping acts.

    Examples
    --------
    >>> mpc = st.Mpc(model, plan, rate=200)  # doctest: +SKIP
    >>> motion = st.simulate(other, q0, v0, controller=mpc, t_span=plan.duration)  # doctest: +SKIP
    """

    def __init__(
        self,
        model: Model,
        plan: Plan,
        *,
        rate: Quantity = RATE,
        horizon: Quantity | None = None,
        **settings: Any,
    ):
        refuse_unable(model, plan)
        given = {"rate": rate, "horizon": horizon} | settings
        self.model, self.plan = model, plan
        self.settings = checked_settings(model, plan, given)
        self.task = task_of(model, plan, self.settings)
        self._own = ControllerMemory(self.task)

    def __repr__(self) -> str:
        """Model, rate, horizon and intervals."""
        rate, ahead = self.settings.rate, self.task.numbers["horizon"]
        return f"Mpc({self.model.name}, {rate:g} Hz, {ahead:.4g} s in {self.settings.intervals})"

    @property
    def info(self) -> dict[str, Any]:
        """Counts since ``begin``: ticks, failed ticks, Gauss-Newton steps, motions that were tried
        for them, changes of active sets; and flags, a list: for each tick the sum of its
        ``MpcFlag``, for at most as many as a flight has.

        They count calls of this object only; a simulation's counts are in its ``info["mpc"]``.
        """
        return self._own.info()

    @property
    def memory_size(self) -> int:
        """How many numbers its workspace has, of the model's type."""
        return len(self._own.memory)

    def begin(self) -> None:
        """Forget all ticks."""
        self._own.begin()

    def tick(self, t: float, q: Any, v: Any) -> bool:
        """Compute a correction from a measured state.

        Parameters
        ----------
        t : float
            Time of the measurement (s).
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        bool
            False if the tick failed and changed nothing.
        """
        return self._own.tick(float(t), *self._state(q, v))

    def torque(self, t: float) -> np.ndarray:
        """Evaluate the corrected torques, without damping.

        Parameters
        ----------
        t : float
            Time (s).

        Returns
        -------
        ndarray, shape (2m,)
            Torques (N m).
        """
        return self._own.torque(float(t))

    def __call__(self, t: float, q: Any, v: Any) -> np.ndarray:
        """Return tau (2m,), N m; compute a correction if a tick is due."""
        q, v = self._state(q, v)
        return self._own.control(float(t), q, v) - self.plan.problem.damping * v[TAIL_V]

    def parts(self, nt: int) -> Parts:
        """Return its parts in a run, with that run's own memory."""
        if nt != self.model.layout.nt:
            needs = f"a model of {self.model.layout.nt} tail coordinates, as the controller's"
            raise refusal("Mpc: tail coordinates", nt, needs, SimulationError)
        memory = ControllerMemory(self.task)
        native = NativeTorque(memory.code.mpc_simulated, ctypes.addressof(memory.run))
        state = ControllerState(
            memory.begin_run, lambda: {"mpc": memory.info()}, lambda *_: self.stops()
        )
        return Parts(np.full(nt, self.plan.problem.damping), native=native, state=state)

    def write_c(self, folder: str | PathLike[str] = ".") -> list[Path]:
        """Write the controller and its plan as C99.

        The files need the model's generated C, allocate nothing, and compute what this object does;
        the header describes how to call them.

        Parameters
        ----------
        folder : str or path, default "."
            The folder; a missing one is made.

        Returns
        -------
        list of Path
            Paths of ``<model>_mpc.h`` and ``<model>_mpc.c``.

        Raises
        ------
        PlanningError
            ``folder`` is no path.
        NotWritten
            The system refuses the folder or a file.
        """
        return write_c(self.model, self.task, self.memory_size, folder)

    def stops(self) -> list[float]:
        """Return the times (s) at which the torques jump or are computed."""
        numbers, plan = self.task.numbers, self.task.arrays["times"]
        period, delay = numbers["period"], numbers["delay"]
        ticks = period * np.arange(np.floor(numbers["last"] / period + 1e-6) + 1)
        return sorted({*ticks.tolist(), *(ticks + delay).tolist(), *plan[1:].tolist()})

    def _state(self, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return q and v as arrays of the right size; their values may be anything."""
        arrays = []
        for name, value, size in (("q", q, self.model.nq), ("v", v, self.model.nv)):
            array = np.ascontiguousarray(value, self._own.real)
            if array.shape != (size,):
                raise refusal(f"Mpc: {name}", value, f"{size} numbers", SimulationError)
            arrays.append(array)
        return arrays[0], arrays[1]


class ControllerMemory:
    """The memory of one controller at work, and the C code that uses it."""

    def __init__(self, task: MpcTask):
        made = kernel(task.real)
        self.task, self.code, self.real = task, made.code, made.real
        self.place = ctypes.addressof(task.record)
        self.memory = aligned(self.code.mpc_memory_size(self.place), np.dtype(made.real))
        self.run = made.simulation()
        self.state = ctypes.addressof(self.run)  # its first member is the controller's state
        self.tau = np.zeros(int(task.numbers["tail"]), made.real)
        self.log = np.zeros(int(task.numbers["last"] / task.numbers["period"]) + 2, np.uint8)
        self.begin()

    def begin(self) -> None:
        """Forget all ticks."""
        self.code.mpc_begin(self.state, self.place, self.memory.ctypes.data)
        self.run.state.log, self.run.state.room = self.log.ctypes.data, len(self.log)

    def begin_run(self, record: Any, clock: float) -> None:
        """Begin a run of the generated C whose time is ``clock`` (s) at the controller's time 0."""
        if type(record).t.size != ctypes.sizeof(self.real):
            simulated = "float" if self.task.real == "double" else "double"
            raise SimulationError(
                f"Mpc: the simulated model computes with {simulated}, the controller's model with "
                f"{self.task.real}: give both the same type"
            )
        self.begin()
        self.run.step_begin = ctypes.addressof(record) + type(record).t.offset
        self.run.clock = clock

    def tick(self, t: float, q: np.ndarray, v: np.ndarray) -> bool:
        """Compute a correction; return False if that failed."""
        return bool(self.code.mpc_tick(self.state, t, q.ctypes.data, v.ctypes.data) == 0)

    def torque(self, t: float) -> np.ndarray:
        """Return the torques at t."""
        self.code.mpc_torque(self.state, t, t, self.tau.ctypes.data)
        return self.tau.astype(float)

    def control(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the torques at t; compute a correction if a tick is due."""
        places = (q.ctypes.data, v.ctypes.data, self.tau.ctypes.data)
        self.code.mpc_control(self.state, t, t, *places)
        return self.tau.astype(float)

    def info(self) -> dict[str, Any]:
        """Return counts, and the flags of each tick."""
        counts = {name: int(getattr(self.run.state, name)) for name in COUNTS}
        return counts | {"flags": self.log[: counts["ticks"]].tolist()}
