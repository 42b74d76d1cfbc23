"""``Gains``: feedback of a plan's errors by Riccati gains, a controller in C."""

from __future__ import annotations

import ctypes
from copy import copy
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import TAIL_V

from ...basics.checks import number, one_of, refusal, whole_number
from ...basics.errors import PlanningError, SimulationError
from ...basics.near_names import NearNames
from ...model.model import Model
from ...model.state import Quantity
from ...simulation.controllers.parts import ControllerState, NativeTorque, Parts
from ...simulation.controllers.piecewise import Piecewise
from ..c_text import write_texts
from ..result.plan import Plan, refuse_unfit
from .emission import texts_of
from .kernel import GainsMemory, kernel
from .riccati import NONE, tables_of
from .validity import Validity, error_of, validity_of

NEEDED = ("airborne_rates", "airborne_rates_derivatives", "momentum")
RATE = 1000.0  # Hz
MOST_TICKS = 100_000


class Gains(NearNames):
    """Riccati gains along a plan: a controller for ``simulate``.

    At each tick it measures the state and adds K e to the plan's torques, within their bounds. e is
    the state's error from the plan; K minimises the error at the end and the squares of the torques
    for small errors. Torques are held between ticks. ``plan.gains`` are the gains of a plan by
    default settings.

    Parameters
    ----------
    plan : Plan
        The plan.
    model : Model, optional
        The model of the body; it needs "airborne_rates", "airborne_rates_derivatives" and
        "momentum". Default: the plan's.
    rate : float, default 1000
        Rate of the ticks (Hz).
    knots : int, default 40
        Largest number of different K. They are denser towards the end.
    within : float or None, default 3
        Largest distance from the goal's attitude at the end (deg) that counts as right when
        ``validity`` is measured. None: it is not measured, and no tick counts as beyond.
    flights : int, default 64
        Number of pushed flights by which it is measured.
    seed : int, default 0
        Seed of these pushes.

    Raises
    ------
    PlanningError
        The plan, the model or a setting is wrong.
    ModelError
        The base is fixed.

    Notes
    -----
    Called with (t, q, v), t (s) from the plan's start, it returns the torques (2m,) (N m) of a
    tick. In simulations each run has its own memory, and ``info["gains"]`` counts the ticks, and
    those that told a flag: ``failed``: the state was not finite, and the plan's torques act alone;
    ``saturated``: a torque was cut to its bound; ``beyond``: the error is as large as in a flight
    that ended wrong. After the plan's end only the plan's damping acts.

    Examples
    --------
    >>> flight = st.simulate(body, q0, v0, controller=plan.gains, t_span=0.4)  # doctest: +SKIP
    >>> flight.info["gains"]["beyond"] == 0  # doctest: +SKIP
    """

    def __init__(
        self,
        plan: Plan,
        *,
        model: Model | None = None,
        rate: Quantity = RATE,
        knots: int = 40,
        within: Quantity | None = 3.0,
        flights: int = 64,
        seed: int = 0,
    ):
        self.plan, self.model = plan, _able(plan, model)
        most = MOST_TICKS / plan.duration
        self.rate = number("Gains: rate", rate, PlanningError, unit="1/s", above=0, most=most)
        knots = whole_number("Gains: knots", knots, PlanningError, least=1, most=1000)
        self.within = within
        if within is not None:
            self.within = number(
                "Gains: within", within, PlanningError, unit="deg", above=0, most=180
            )
        self.flights = whole_number("Gains: flights", flights, PlanningError, least=1, most=10_000)
        self.seed = whole_number("Gains: seed", seed, PlanningError, least=0, most=2**63 - 1)
        made = tables_of(self.model, plan, 1 / self.rate, knots)
        self.tables = {name: np.ascontiguousarray(table, float) for name, table in made.items()}

    def __repr__(self) -> str:
        """Model, rate and number of knots."""
        return f"Gains({self.model.name}, {self.rate:g} Hz, {len(self.times)} knots)"

    @property
    def times(self) -> np.ndarray:
        """Times (knots,) from which each K acts (s)."""
        return self.tables["begins"]

    @property
    def K(self) -> np.ndarray:
        """Gains (knots, 2m, 6 + 4m): torques (N m) by errors; see ``error``."""
        return self.tables["gains"]

    @cached_property
    def validity(self) -> Validity:
        """Where the gains hold, measured when it is first needed, in some tenths of a second.

        ``validity.push`` is the largest push (rad/s) that all flights corrected. Simulations and
        ``write_c`` need it, too.
        """
        if self.within is None:
            none = np.zeros(0)
            return Validity(np.inf, np.full(len(self.times), NONE), none, none)
        return validity_of(self, self.flights, self.seed)

    def error(self, t: ArrayLike, q: ArrayLike, v: ArrayLike) -> np.ndarray:
        """Compute the errors of states from the plan.

        Parameters
        ----------
        t : array_like, shape (k,)
            Times from the plan's start (s).
        q : array_like, shape (k, nq)
            Configurations.
        v : array_like, shape (k, nv)
            Velocities.

        Returns
        -------
        ndarray, shape (k, 6 + 4m)
            Attitude (rad: twice the vector part of the rotation from the planned one, torso axes),
            angular velocity (rad/s, torso axes), tail (rad) and its rates (rad/s).
        """
        plan = Piecewise(self.tables["times"], self.tables["plan"])
        return error_of(plan, *(np.asarray(array, float) for array in (t, q, v)))

    def unwatched(self) -> Gains:
        """Return the same gains without a region: no tick counts as beyond it."""
        law = copy(self)
        law.within = None
        law.__dict__.pop("validity", None)
        return law

    def __call__(self, t: float, q: ArrayLike, v: ArrayLike) -> np.ndarray:
        """Return tau (2m,), N m, of a tick at t."""
        arrays = []
        for name, value, size in (("q", q, self.model.nq), ("v", v, self.model.nv)):
            array = np.ascontiguousarray(value, float)
            if array.shape != (size,):
                raise refusal(f"Gains: {name}", value, f"{size} numbers", SimulationError)
            arrays.append(array)
        torques = self.unwatched()._memory().tick(float(t), *arrays)
        return torques - self.plan.problem.damping * arrays[1][TAIL_V]

    def parts(self, nt: int) -> Parts:
        """Return its parts in a run, with that run's own memory."""
        if nt != self.model.layout.nt:
            needs = f"a model of {self.model.layout.nt} tail coordinates, as the plan's"
            raise refusal("Gains: tail coordinates", nt, needs, SimulationError)
        memory = self._memory()

        def begin(record: Any, clock: float) -> None:
            if type(record).t.size != ctypes.sizeof(ctypes.c_double):
                raise SimulationError(
                    "Gains: the simulated model computes with float: needs double"
                )
            memory.begin()
            memory.run.step_begin = ctypes.addressof(record) + type(record).t.offset
            memory.run.clock = clock

        native = NativeTorque(kernel().gains_simulated, memory.state)
        state = ControllerState(begin, lambda: {"gains": memory.counts()}, self._stops)
        return Parts(np.full(nt, self.plan.problem.damping), native=native, state=state)

    def write_c(self, folder: str | PathLike[str] = ".", real: str = "float") -> list[Path]:
        """Write the gains and their plan as C99, which needs nothing else.

        The files do not need the model's C, and allocate nothing; the header describes how to call
        them.

        Parameters
        ----------
        folder : str or path, default "."
            The folder; a missing one is made.
        real : {"float", "double"}, default "float"
            Type of the numbers.

        Returns
        -------
        list of Path
            Paths of ``<model>_gains.h`` and ``<model>_gains.c``.

        Raises
        ------
        PlanningError
            ``folder`` is no path, or ``real`` another type.
        NotWritten
            The system refuses the folder or a file.
        """
        one_of("write_c: real", real, ("float", "double"), PlanningError)
        return write_texts(folder, texts_of(self.model.name, self._tables(), 1 / self.rate, real))

    def _tables(self) -> dict[str, np.ndarray]:
        return self.tables | {"region": self.validity.region}

    def _memory(self) -> GainsMemory:
        return GainsMemory(self._tables(), 1 / self.rate)

    def _stops(self, start: float, end: float) -> list[float]:
        """Return the times (s) of ticks from start to end, and the plan's end."""
        first, last = max(start, 0.0) * self.rate, min(end, self.plan.duration) * self.rate
        ticks = np.arange(np.floor(first), np.ceil(last)) / self.rate
        return [*ticks.tolist(), self.plan.duration]


def _able(plan: Any, model: Model | None) -> Model:
    """Return the model of a plan with gains; PlanningError if the plan or the model has none."""
    if not isinstance(plan, Plan):
        raise refusal("Gains: plan", plan, "what st.plan returns", PlanningError)
    own = plan.model if model is None else model
    if not isinstance(own, Model):
        needs = "the plan's model, which a stored plan lost: st.Gains(plan, model=...)"
        raise refusal("Gains: model", own, needs, PlanningError)
    if own.manifest["real"] != "double":
        raise PlanningError(f"Gains: the model computes with {own.manifest['real']}: needs double")
    refuse_unfit("Gains", own, plan, NEEDED)
    return own
