"""Simulation: a model, a state and a torque law go in, a trajectory comes out."""

import ctypes
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import SimulationError, StateError
from .library import NOT_FINITE, real_array
from .model import Model
from .trajectory import Trajectory

METHODS = ("rk4", "dop853")
NO_NUMBERS = "the state is not finite any more"


@dataclass(frozen=True)
class Damping:
    """tau = -damping q_t_dot (Eq. 47); damping in N m s, one number or one a tail coordinate."""

    damping: float | tuple[float, ...] = 1e-3


@dataclass(frozen=True)
class TorqueTable:
    """Torques (K, 2m) in N m at increasing times (K,) in s: linear in between, held outside; less damping q_t_dot."""

    times: object
    torques: object
    damping: float | tuple[float, ...] = 0.0


Controller = Damping | TorqueTable | Callable[[float, np.ndarray, np.ndarray], object] | None


def simulate(
    model: Model, q0, v0, *, controller: Controller = None, t_span=(0.0, 1.0), method: str = "rk4", **settings
) -> Trajectory:
    """Simulate flight: H v_dot + C = [0; tau], the quaternion kept on the unit sphere.

    q0 (nq,), v0 (nv,): start; its quaternion is normalised.
    controller: None (no torque), Damping, TorqueTable, or a function (t (s), q, v) -> tau (2m,) in N m.
    t_span: (start, end) in s, or the end alone.
    method: "rk4", a generated C loop of fixed steps, or "dop853", SciPy's adaptive method on the compiled model.
    settings: output_step (s, default 1/200 of the span, rounded to divide it); for rk4 step (s, default 1e-4,
    shortened to divide output_step), for dop853 rtol, atol (defaults 1e-10, 1e-12; 1e-6 both for a float model).
    Raises StateError (shapes, values), SimulationError (settings; the state left what numbers can hold), ModelError
    (the scene left out rollout, energy or momentum).
    """
    missing = [name for name in ("rollout", "energy", "momentum") if name not in model.manifest["work"]]
    if missing:
        raise model.without(*missing)
    run = Run.checked(model, q0, v0, t_span, settings.pop("output_step", None))
    if method not in METHODS:
        raise SimulationError(f"method {method!r}: choose one of {', '.join(METHODS)}")
    law = Law(model, controller, run.start)
    begun = time.perf_counter()
    t, q, v, tau, info = (_rk4 if method == "rk4" else _dop853)(model, law, run, settings)
    info |= {"method": method, "seconds": time.perf_counter() - begun, "model": model.name}
    _check_finite(t, q, v, tau)
    try:
        measured = *model.energy(q, v), *model.momentum(q, v)
    except StateError as error:
        raise SimulationError(f"from t = {t[0]:.6g} s to {t[-1]:.6g} s, by sample: {error}") from error
    info["parameters"] = {name: list(x) if isinstance(x, tuple) else x for name, x in model.parameters.items()}
    return Trajectory(t, q, v, tau, *measured, info)


def end_state(model: Model, q0, v0, *, controller: Controller, duration: float, step: float):
    """Return q (nq,), v (nv,) where simulate's "rk4" ends after a duration (s), and measure nothing on the way."""
    run = Run.checked(model, q0, v0, duration, duration)
    t, q, v, tau, _ = _rk4(model, Law(model, controller, run.start), run, {"step": step})
    _check_finite(t, q, v, tau)
    return q[-1], v[-1]


@dataclass(frozen=True)
class Run:
    """A checked start and output grid."""

    q0: np.ndarray
    v0: np.ndarray
    start: float
    end: float
    intervals: int

    @classmethod
    def checked(cls, model: Model, q0, v0, t_span, output_step) -> "Run":
        """Return a run; StateError or SimulationError where an argument is wrong."""
        q0, v0 = _state("q0", q0, model.nq), _state("v0", v0, model.nv)
        norm = math.hypot(*q0[3:7])
        if norm == 0:
            raise StateError("q0[3:7] is the zero quaternion: upright is (1, 0, 0, 0)")
        q0[3:7] /= norm
        span = real_array("t_span", t_span, error=SimulationError)
        if span.shape not in ((), (2,)):
            raise SimulationError(f"t_span {t_span!r}: give (start, end) in s, or the end")
        start, end = span.tolist() if span.ndim else (0.0, float(span))
        if not (np.isfinite([start, end]).all() and end > start):
            raise SimulationError(f"t_span {t_span!r}: the end must be finite and after the start")
        step = _positive("output_step", (end - start) / 200 if output_step is None else output_step)
        intervals = max(1, round((end - start) / step))
        return cls(q0, v0, start, end, intervals)

    @property
    def interval(self) -> float:
        """Time between outputs."""
        return (self.end - self.start) / self.intervals

    @property
    def times(self) -> np.ndarray:
        """Output times (intervals + 1,)."""
        return np.linspace(self.start, self.end, self.intervals + 1)


def _state(name: str, value, size: int) -> np.ndarray:
    array = real_array(name, value).copy()
    if array.shape != (size,):
        raise StateError(f"{name} has shape {array.shape}, not ({size},): one start state")
    if not np.isfinite(array).all():
        raise StateError(f"{name}[{np.flatnonzero(~np.isfinite(array))[0]}] is not finite")
    return array


def _positive(name: str, value) -> float:
    number = real_array(name, value, error=SimulationError)
    if number.shape != () or not 0 < number < np.inf:
        raise SimulationError(f"{name} {value!r}: give a number above 0")
    return float(number)


def _check_finite(t: np.ndarray, *columns: np.ndarray) -> None:
    lost = np.flatnonzero(~np.isfinite(np.column_stack(columns)).all(axis=1))
    if lost.size:
        raise _lost(t[lost[0]], NO_NUMBERS)


def _lost(t: float, what: str) -> SimulationError:
    return SimulationError(f"at t = {t:.6g} s {what}: is the step too long, or a velocity or torque too large?")


class Law:
    """A controller as the C interface takes it: a function pointer and its context."""

    def __init__(self, model: Model, controller: Controller, start: float):
        self.model, self.start, self.error = model, start, None
        self.real = np.ctypeslib.as_ctypes_type(model.parameter_vector.dtype)
        self.nt = model.nv - 6
        self.float_errors = np.geterr()  # the user's: dop853 works with its own
        pointer = ctypes.c_void_p
        self.prototype = ctypes.CFUNCTYPE(None, pointer, self.real, *[ctypes.POINTER(self.real)] * 3)
        if callable(controller):
            self.user = controller
            self.function, self.context = self.prototype(self._call_user), None
        else:
            symbol = getattr(model.library, f"{model.name}_torque_damped_table")
            self.function, self.context = ctypes.cast(symbol, pointer), self._table(controller)

    def _table(self, controller):
        """Return the C context of a damping and a table; the arrays it points to live in ``keep``."""

        class DampedTable(ctypes.Structure):
            _fields_ = (
                ("damping", ctypes.c_void_p),
                ("nodes", ctypes.c_int),
                ("times", ctypes.c_void_p),
                ("torques", ctypes.c_void_p),
            )

        controller = controller if controller is not None else Damping(0.0)
        if not isinstance(controller, Damping | TorqueTable):
            raise SimulationError(f"controller {controller!r}: give None, Damping, TorqueTable or a function (t, q, v)")
        damping = self._damping(controller.damping)
        times, torques = np.zeros(0), np.zeros((0, self.nt))
        if isinstance(controller, TorqueTable):
            times, torques = self._nodes(controller)
        self.keep = [np.ascontiguousarray(a, self.model.parameter_vector.dtype) for a in (damping, times, torques)]
        a, b, c = (array.ctypes.data for array in self.keep)
        self.structure = DampedTable(a, len(times), b, c)
        return ctypes.addressof(self.structure)

    def _damping(self, damping) -> np.ndarray:
        values = real_array("damping", damping, error=SimulationError)
        if values.shape not in ((), (self.nt,)):
            raise SimulationError(f"damping {damping!r}: give one number or {self.nt}, in N m s")
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise SimulationError(f"damping {damping!r}: give finite numbers, 0 or above, in N m s")
        return np.broadcast_to(values, (self.nt,))

    def _nodes(self, table: TorqueTable) -> tuple[np.ndarray, np.ndarray]:
        times, torques = (
            real_array(f"TorqueTable: {name}", getattr(table, name), error=SimulationError)
            for name in ("times", "torques")
        )
        if times.ndim != 1 or len(times) == 0 or torques.shape != (len(times), self.nt):
            raise SimulationError(
                f"TorqueTable: times {times.shape} and torques {torques.shape}, not (K,) and (K, {self.nt})"
            )
        if not (np.isfinite(times).all() and np.isfinite(torques).all() and (np.diff(times) > 0).all()):
            raise SimulationError("TorqueTable: times must increase, and all entries be finite")
        return times - self.start, torques

    def _call_user(self, _context, t, q, v, tau):
        """Call the user's function on a sound state; its exception stops the run by torques that are not numbers."""
        q, v = (np.ctypeslib.as_array(a, (n,)).copy() for a, n in ((q, self.model.nq), (v, self.model.nv)))
        result = np.full(self.nt, np.nan)
        try:
            if np.isfinite(q).all() and np.isfinite(v).all():
                result = self._user_torque(t, q, v)
        except BaseException as error:
            self.error = error
        np.ctypeslib.as_array(tau, (self.nt,))[:] = result

    def _user_torque(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        with np.errstate(**self.float_errors):
            result = np.asarray(self.user(self.start + t, q, v), float)
        if result.shape != (self.nt,) or not np.isfinite(result).all():
            raise SimulationError(
                f"the controller gave {result!r} at t = {self.start + t:.6g} s, not {self.nt} finite torques"
            )
        return result

    def check(self, status: int, t: float) -> None:
        """Raise what a status of the C interface means."""
        if self.error is not None:
            raise self.error
        if status:
            indefinite = "the inertia matrix is not positive definite"
            raise _lost(t, NO_NUMBERS if status == NOT_FINITE else indefinite)


def _c_function(model: Model, name: str, arguments):
    function = getattr(model.library, f"{model.name}_{name}")
    function.argtypes = arguments
    return function


def _rk4(model: Model, law: Law, run: Run, settings: dict):
    longest = _positive("step", settings.pop("step", 1e-4))
    _refuse(settings, "rk4", "step, output_step")
    every = max(1, int(np.ceil(run.interval / longest * (1 - 1e-12))))
    pointer, dtype = ctypes.c_void_p, model.parameter_vector.dtype
    rollout = _c_function(model, "rollout", [pointer] * 3 + [law.real, ctypes.c_long, ctypes.c_long] + [pointer] * 7)
    steps, samples = every * run.intervals, run.intervals + 1
    q, v = run.q0.astype(dtype), run.v0.astype(dtype)
    out = [np.full((samples, size), np.nan, dtype) for size in (model.nq, model.nv, law.nt)]
    work, done = np.zeros(model.manifest["work"]["rollout"], dtype), ctypes.c_long(0)
    h = run.interval / every
    arrays = [a.ctypes.data for a in (q, v, *out)]
    status = rollout(
        model.parameter_vector.ctypes.data,
        law.function,
        law.context,
        h,
        steps,
        every,
        *arrays,
        ctypes.addressof(done),
        work.ctypes.data,
    )
    law.check(status, run.start + done.value * h)
    return run.times, *map(np.float64, out), {"steps": steps, "step": h, "evaluations": 4 * steps}


@np.errstate(all="ignore")  # a trial step may overflow, and is then taken again, shorter
def _dop853(model: Model, law: Law, run: Run, settings: dict):
    from scipy.integrate import DOP853

    defaults = {"rtol": 1e-10, "atol": 1e-12} if law.real is ctypes.c_double else {"rtol": 1e-6, "atol": 1e-6}
    rtol, atol = (_positive(name, settings.pop(name, value)) for name, value in defaults.items())
    _refuse(settings, "dop853", "rtol, atol, output_step")
    rate, y0 = StateRate(model, law), np.concatenate([run.q0, run.v0])
    if not np.isfinite(rate(0.0, y0)).all():
        law.check(NOT_FINITE, run.start)
    solver = DOP853(rate, 0.0, y0, run.end - run.start, rtol=rtol, atol=atol)
    times, samples, steps = run.times - run.start, [solver.y.copy()], 0
    while solver.status == "running":
        message = solver.step()
        law.check(0, solver.t)
        if solver.status == "failed":
            reason = message.rstrip(".").lower()
            raise SimulationError(
                f"at t = {run.start + solver.t:.6g} s {reason}: is the motion stiff, or rtol too small?"
            )
        steps += 1
        due = times[len(samples) : np.searchsorted(times, solver.t, "right")]
        if len(due):
            samples += list(solver.dense_output()(due).T)
        norm = np.linalg.norm(solver.y[3:7])
        solver.y[3:7] /= norm
        solver.f[3:7] /= norm
    if len(samples) < len(times):
        samples.append(solver.y.copy())
    states = np.array(samples)
    q, v = states[:, : model.nq].copy(), states[:, model.nq :].copy()
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    tau = np.array([rate.torque(t, *state) for t, state in zip(times, zip(q, v, strict=True), strict=True)])
    return run.times, q, v, tau, {"steps": steps, "evaluations": solver.nfev, "rtol": rtol, "atol": atol}


class StateRate:
    """y = (q, v) -> y_dot by the compiled model."""

    def __init__(self, model: Model, law: Law):
        self.law, dtype, pointer = law, model.parameter_vector.dtype, ctypes.c_void_p
        self.function = _c_function(model, "state_rate", [pointer] * 3 + [law.real] + [pointer] * 6)
        self.y, self.y_dot = np.zeros(model.nq + model.nv, dtype), np.zeros(model.nq + model.nv, dtype)
        self.tau, self.work = np.zeros(law.nt, dtype), np.zeros(model.manifest["work"]["forward_dynamics"] + 1, dtype)
        split = model.nq * dtype.itemsize
        y, y_dot, tau, work = (a.ctypes.data for a in (self.y, self.y_dot, self.tau, self.work))
        self.head = (model.parameter_vector.ctypes.data, law.function, law.context)
        self.tail = (y, y + split, tau, y_dot, y_dot + split, work)

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return y_dot."""
        self.y[...] = y
        self.law.check(self.function(*self.head, t, *self.tail), self.law.start + t)
        return self.y_dot.astype(float)

    def torque(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the torques at a state."""
        self(t, np.concatenate([q, v]))
        return self.tau.astype(float)


def _refuse(settings: dict, method: str, known: str) -> None:
    if settings:
        raise SimulationError(f"{method} has no setting {', '.join(map(repr, settings))}; it has {known}")
