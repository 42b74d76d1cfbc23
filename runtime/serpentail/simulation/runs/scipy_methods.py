"""SciPy's methods on the compiled model: an independent check of the generated ones."""

import ctypes
from dataclasses import replace

import numpy as np

from serpentail_scene.layout import QUATERNION

from ...basics.errors import SimulationError
from ...model.library import NOT_FINITE, TOO_MANY_STEPS
from ..callback import Watched, samples_from
from ..methods import IntegrationMethod
from .outcomes import Samples, failed
from .single import CompiledRun

Part = tuple[float, np.ndarray, float]  # start (s), state there, end (s)


class StateRate:
    """y = (q, v) -> y_dot by the compiled model; nan or, without ``trials``, an error for none."""

    def __init__(self, run: CompiledRun, trials: bool):
        self.trials = trials
        self.refused: SimulationError | None = None
        self.run, pointer, dtype = run, ctypes.c_void_p, run.runs.records.dtype
        self.function = run.function("state_rate", run.runs.records.real, pointer, pointer, pointer)
        size = sum(map(len, run.state.values()))
        self.y, self.y_dot = np.zeros(size, dtype), np.zeros(size, dtype)
        self.tau = np.zeros(run.actuation.nt, dtype)
        self.addresses = [a.ctypes.data for a in (self.y, self.y_dot, self.tau)]

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return y_dot."""
        self.y[...] = y
        self.refused = None
        status = self.function(ctypes.addressof(self.run.record), t, *self.addresses)
        if self.run.actuation.error is not None:
            raise self.run.actuation.error
        if not status and not np.isfinite(self.y_dot).all():
            status = NOT_FINITE
        if status:
            self.refused = failed(status, t if np.isfinite(t) else self.run.record.t)
            if self.trials:
                return np.full(len(y), np.nan)
            raise self.refused
        return self.y_dot.astype(float)

    def torque(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the torques at a state that must have a rate."""
        self(t, y)
        if self.refused is not None:
            raise self.refused
        return self.tau.astype(float)


class SampleWriter:
    """Samples written one after another as steps pass their times."""

    def __init__(self, rate: StateRate, times: np.ndarray, watched: Watched | None):
        self.rate, self.times, self.watched = rate, times, watched
        self.states: list[np.ndarray] = []
        self.torques: list[np.ndarray] = []

    def write(self, t: float, y: np.ndarray) -> None:
        """Write one sample; normalise its quaternion, if it has one."""
        y = y.copy()
        if not self.rate.run.model.fixed:
            y[QUATERNION] /= np.linalg.norm(y[QUATERNION])
        self.torques.append(self.rate.torque(t, y))
        self.states.append(y)

    def look(self) -> None:
        """Report the progress of the run."""
        if self.watched is not None:
            self.watched.look(len(self.states), lambda first: samples_from(self.part(first), 0))

    def part(self, first: int) -> Samples:
        """Return the samples written from a number on."""
        run, done = self.rate.run, len(self.states)
        sizes = np.cumsum([run.model.nq, run.model.nv, 2 * run.runs.ground.points])
        q, v, bristles, ledger = np.split(np.array(self.states[first:]), sizes, axis=1)
        bristles = bristles.reshape(len(q), run.runs.ground.points, 2)
        tau, times = np.array(self.torques[first:]), self.times[first:done]
        return Samples(times, q, v, tau, bristles, ledger[-1], {})

    def due(self, t: float) -> np.ndarray:
        """Times of the samples not later than t."""
        return self.times[len(self.states) : np.searchsorted(self.times, t, "right")]


@np.errstate(all="ignore")  # a trial step may overflow, and is then taken again, shorter
def integrate_by_scipy(run: CompiledRun, watched: Watched | None = None) -> Samples:
    """Return the samples of a run, made from stop to stop, and the error that ended it, if any."""
    method = run.runs.method
    run.actuation.begin(run.record)
    rate = StateRate(run, method.name == "dop853")  # a step with NaN is repeated, shorter
    start, counts = run.runs.start, {"steps": 0, "evaluations": 0}
    samples = SampleWriter(rate, start.times, watched)
    ends = [*(t for t in run.actuation.stops if start.start < t < start.end), start.end]
    y, t = np.concatenate([*run.state.values()]).astype(float), start.start
    failure: BaseException | None = None
    try:
        with run.actuation.ctrl_c.waits(run.actuation.of_python):
            run.record.until = ends[0]
            samples.write(t, y)
            for end in ends:
                run.record.t, run.record.until = t, end
                y, t = _smooth_part(rate, method, (t, y, end), samples, counts), end
    except BaseException as error:
        if not samples.states:
            raise
        failure = error
    info = counts | run.actuation.info()
    return replace(samples.part(0), info=info, failure=failure)


def _smooth_part(
    rate: StateRate, method: IntegrationMethod, part: Part, samples: SampleWriter, counts: dict
) -> np.ndarray:
    """Integrate over times without a break, (start, state, end), and return the last state."""
    from scipy.integrate import DOP853, LSODA

    t, y, end = part
    rate.torque(t, y)  # where the rate is NaN, DOP853's first step would be, and never end
    tolerances = {name: method.settings[name] for name in ("rtol", "atol")}
    solver = {"dop853": DOP853, "lsoda": LSODA}[method.name](rate, t, y, end, **tolerances)
    steps = 0
    while solver.status == "running":
        if counts["steps"] + steps >= method.settings["most_steps"]:
            raise failed(TOO_MANY_STEPS, solver.t)
        message = solver.step()
        if solver.status == "failed" and rate.refused is not None:
            raise rate.refused
        if solver.status == "failed":
            reason = (message or "the step failed").rstrip(".").lower()
            raise SimulationError(
                f"at t = {solver.t:.6g} s {reason}: is the motion stiff, or rtol too small?"
            )
        steps += 1
        interpolant = solver.dense_output()
        for at in samples.due(solver.t):
            samples.write(at, interpolant(at) if at < solver.t else solver.y)
        samples.look()
        if method.name == "dop853" and not rate.run.model.fixed:
            norm = np.linalg.norm(solver.y[QUATERNION])
            solver.y[QUATERNION] /= norm
            solver.f[QUATERNION] /= norm
    counts["steps"] += steps
    counts["evaluations"] += solver.nfev
    if isinstance(solver, DOP853):  # 2 evaluations to begin, 3 in each step for its interpolant
        attempts = (solver.nfev - 2 - 3 * steps) // solver.n_stages
        counts["rejected"] = counts.get("rejected", 0) + attempts - steps
    return solver.y
