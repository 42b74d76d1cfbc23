"""Controllers and legs of a run, as records of the generated C."""

import ctypes
from typing import Any

import numpy as np

from ...basics.checks import numbers_in, refusal
from ...basics.errors import SimulationError
from ...model.chains import refuse_driven
from ...model.model import Model
from ...motion.given import TENSIONS
from ..ground import GroundSettings
from ..records import CFunction, Records
from ..start import Start
from .controller import Controller, controllers_of, parts_of, phases_of
from .ctrl_c import CtrlC
from .parts import NativeTorque, Parts, TorqueFunction
from .piecewise import Piecewise

ROUNDING = 1e-6  # of a tension's limit, by which those of a solver may go beyond it


class Actuation:
    """Controllers and schedule as a C record, times to stop at, errors of a user's function."""

    def __init__(
        self,
        records: Records,
        controller: Controller,
        span: tuple[float, float],
        ground: GroundSettings,
    ):
        self.records, self.loads = records, ground.loads
        self.error: BaseException | None = None
        self.ctrl_c = CtrlC()
        self.nt = self.model.layout.nt
        # phases, each by its parts
        phases = phases_of(controller)
        begins = [begin for begin, _ in phases]
        self.begins = [max(begin, span[0]) for begin in begins]
        all_parts = [parts_of(each, self.nt).since(begin) for begin, each in phases]
        for each in all_parts:
            self._refuse_passive(each)
        self.parts = [*map(self._available, all_parts)]
        if self.of_python:  # the user's: SciPy's methods work with their own
            self.float_errors = np.geterr()
        # times at which something is not smooth; steps end there
        stops = {*self._kinks(begins, span)}
        members: dict[str, Any] = {}
        for name, curve in (("given", ground.given), ("loads", ground.loads)):
            if curve is not None:
                stops |= {*curve.kinks().tolist()}
                members[name] = self._table(curve)
        if (legs := ground.legs) is not None:
            stops |= {*legs.curve.kinks().tolist()}
            members["legs"] = self._table(legs.curve)
            if legs.landing is not None:
                members["landing"] = self._table(legs.landing)
                members["landing_from"] = legs.landing_from
        self.stops = records.array(sorted(stops))
        self.record = records.record(
            "drive",
            phases=len(phases),
            begins=records.array(begins),
            controllers=records.records("controller", [*map(self._controller, self.parts)]),
            stops=len(self.stops),
            stop_times=self.stops,
            **members,
        )

    @property
    def model(self) -> Model:
        """The model whose tail is driven."""
        return self.records.model

    @property
    def acts(self) -> bool:
        """Whether any torque or force from outside acts."""
        return self.loads is not None or any(
            getattr(parts, name) is not None
            for parts in self.parts
            for name in ("damping", "torques", "tensions", "pfl", "native", "user")
        )

    @property
    def of_python(self) -> bool:
        """Whether a function of Python acts."""
        return any(parts.user is not None for parts in self.parts)

    @property
    def has_state(self) -> bool:
        """Whether one of them has a state of its own, so that runs cannot share it."""
        return any(parts.state is not None for parts in self.parts)

    def begin(self, run: ctypes.Structure) -> None:
        """Reset controllers with a state for another run, given by its record."""
        for parts in self.parts:
            if parts.state is not None:
                parts.state.begin(run, parts.clock)

    def info(self) -> dict[str, Any]:
        """Return what controllers add to a run's info."""
        info: dict[str, Any] = {}
        for parts in self.parts:
            if parts.state is not None:
                info |= parts.state.info()
        pulls = [parts.tensions.as_lists() if parts.tensions else {} for parts in self.parts]
        if any(pulls):
            phases = zip(self.begins, pulls, strict=True)
            info[TENSIONS] = [{"begin": begin} | curve for begin, curve in phases]
        return info

    def _refuse_passive(self, parts: Parts) -> None:
        """SimulationError if a torque would act on a passive coordinate."""
        layout = self.model.layout
        if parts.pfl is not None and (layout.given or not all(layout.driven)):
            others = "prescribed" if layout.given else "passive"
            raise SimulationError(
                f"Pfl: needs a torque for each coordinate, and {self.model.name} has {others} "
                "ones: use another controller"
            )
        if parts.damping is not None:
            refuse_driven(self.model, "controller", parts.damping, SimulationError)
        if parts.torques is not None:
            powers = parts.torques.coefficients.swapaxes(1, 2)
            refuse_driven(self.model, "controller", powers, SimulationError)
        if parts.tensions is not None:
            _refuse_tensions(self.model, parts.tensions)

    def _available(self, parts: Parts) -> Parts:
        """Return the parts for this model: PFL in Python if its C is missing."""
        if parts.pfl is None or self.records.has("controller", "reference"):
            return parts
        return Parts(user=parts.pfl)

    def _kinks(self, begins: list[float], span: tuple[float, float]) -> list[float]:
        """Return the times at which phases begin, or at which their torques are not smooth.

        span: start and end of the run (s).
        """
        later = begins[1:]
        times = [*later]
        # the first phase acts before its begin, too
        for begin, end, parts in zip([-np.inf, *later], [*later, np.inf], self.parts, strict=True):
            ticks = parts.ticks(max(begin, span[0]), min(end, span[1]))
            times += [t for t in (*parts.kinks(), *ticks) if begin < t < end]
        return times

    def _controller(self, parts: Parts) -> ctypes.Structure:
        """Return the record of one phase's controller."""
        members: dict[str, Any] = {}
        if parts.damping is not None:
            members["damping"] = self.records.array(parts.damping)
        for name in ("torques", "tensions"):
            if (curve := getattr(parts, name)) is not None:
                members[name] = self._table(curve)
        if parts.pfl is not None:
            law = parts.pfl
            members |= {"reference": self._table(law.curve), "kp": law.kp, "kd": law.kd}
            members["feedforward"] = law.feedforward
            if law.torque is not None:
                members["limit"] = self.records.array(law.torque)
        if parts.native is not None:
            members |= _native(parts.native) | {"clock": parts.clock}
        if parts.user is not None:
            members["function"] = self._callback(parts.user)
        return self.records.record("controller", **members)

    def _table(self, curve: Piecewise) -> ctypes.Structure:
        """Return the record of a function of time."""
        pieces, channels, powers = curve.coefficients.shape
        return self.records.record(
            "piecewise",
            pieces=pieces,
            channels=channels,
            degree=powers - 1,
            times=self.records.array(curve.times),
            coefficients=self.records.array(curve.coefficients),
        )

    def _callback(self, user: TorqueFunction) -> Any:
        """Return a C function that calls the user's; an exception is kept and ends the run."""
        real, pointer = self.records.real, ctypes.POINTER(self.records.real)
        prototype = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, real, pointer, pointer, pointer)

        def call(_context: Any, t: float, q: Any, v: Any, tau: Any) -> int:
            try:
                self.ctrl_c.enter()
                np.ctypeslib.as_array(tau, (self.nt,))[:] = self._user_torque(user, t, q, v)
                self.ctrl_c.leave()
            except BaseException as error:
                self.ctrl_c.leave()
                self.error = error
                return 1
            return 0

        function = prototype(call)
        self.records.kept.append(function)
        return function

    def _user_torque(self, user: TorqueFunction, t: float, q: Any, v: Any) -> np.ndarray:
        """Return torques of the user's function; nan, which ends the step, for an invalid state."""
        q = np.ctypeslib.as_array(q, (self.model.nq,)).copy()
        v = np.ctypeslib.as_array(v, (self.model.nv,)).copy()
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            return np.full(self.nt, np.nan)
        with np.errstate(**self.float_errors):
            given = user(t, q, v)
        torques = numbers_in(given)
        if torques is None or torques.shape != (self.nt,) or not np.isfinite(torques).all():
            raise SimulationError(
                f"the controller gave {given!r:.200} at t = {t:.6g} s, not {self.nt} finite torques"
            )
        refuse_driven(self.model, f"controller at t = {t:.6g} s", torques, SimulationError)
        return torques


def _refuse_tensions(model: Model, curve: Piecewise) -> None:
    """SimulationError if a model has other tendons, or a tension is below 0 or above its limit."""
    names = model.layout.tendons
    if not names or curve.channels != len(names):
        has = f"{len(names)} tendons" if names else "none: give its scene tables [tendon.NAME]"
        raise SimulationError(f"tensions: {curve.channels} tendons: {model.name} has {has}")
    times, limits = curve.times, np.atleast_1d(model.parameters["tendon_limits"])
    looks = np.linspace(0, 1, max(curve.coefficients.shape[2], 2))
    inner = (times[:-1, None] + np.diff(times)[:, None] * looks[:-1]).ravel()
    found = curve.at(np.append(inner, np.nextafter(times[1:], 0)))[0]
    wrong = (found < -ROUNDING * limits) | (found > (1 + ROUNDING) * limits)
    if wrong.any():
        row, k = np.argwhere(wrong)[0]
        needs = f"tendon {names[k]} needs 0 to {limits[k]:g} N"
        raise SimulationError(f"tensions[:, {k}]: value {found[row, k]:.6g}: {needs}")


def _native(law: NativeTorque) -> dict[str, int | None]:
    """Return the members of a compiled function and its context."""
    function = law.function
    if isinstance(function, CFunction):
        function = ctypes.cast(function, ctypes.c_void_p).value
    if not isinstance(function, int) or function <= 0 or not isinstance(law.context, int | None):
        needs = "a ctypes function or an address, and an address or None"
        raise refusal("NativeTorque", law, needs, SimulationError)
    return {"function": function, "context": law.context}


class RunActuations:
    """The actuation of each run; ``distinct`` has each once, ``alike``: all runs share one.

    drives: addresses of the C records of the runs' actuations.
    """

    def __init__(self, records: Records, controller: object, start: Start, ground: GroundSettings):
        self.records, self.ground = records, ground
        self.span = start.start, start.end
        controllers = controllers_of(controller, start.runs if start.many else None)
        one_for_all = len(controllers) == 1 and start.runs > 1
        if one_for_all and self._of(controllers[0], None).has_state:
            controllers = controllers * start.runs
        # of one object that acts in several runs there is one record, unless it has a state
        made: dict[int, Actuation] = {}
        self._each = []
        for k, each in enumerate(controllers):
            if id(each) not in made or made[id(each)].has_state:
                made[id(each)] = self._of(each, k if len(controllers) > 1 else None)
            self._each.append(made[id(each)])
        self.distinct = [*dict.fromkeys(self._each)]
        self.alike = len(self.distinct) == 1
        drives = [ctypes.addressof(each.record) for each in self._each]
        self.drives = np.array(drives * (start.runs if len(drives) == 1 else 1), np.uintp)

    @property
    def model(self) -> Model:
        """The model whose tails are driven."""
        return self.records.model

    def _of(self, controller: Controller, k: int | None) -> Actuation:
        """Return the actuation of run k, or of all; SimulationError if it is impossible."""
        try:
            return Actuation(self.records, controller, self.span, self.ground)
        except SimulationError as error:
            if k is None:
                raise
            raise SimulationError(f"controller of run {k}: {error}") from None

    def of(self, k: int) -> Actuation:
        """Return the actuation of run k."""
        return self.distinct[0] if self.alike else self._each[k]

    @property
    def has_state(self) -> bool:
        """Whether one of them remembers something of a run."""
        return any(each.has_state for each in self.distinct)

    @property
    def of_python(self) -> bool:
        """Whether a function of Python acts in one of them."""
        return any(each.of_python for each in self.distinct)
