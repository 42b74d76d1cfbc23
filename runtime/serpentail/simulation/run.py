"""Runs: a model, a state and what acts on it go in, a trajectory comes out."""

import ctypes
import time
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SimulationError, StateError
from ..library import NOT_FINITE, NOT_POSITIVE_DEFINITE, OUT_OF_RANGE, aligned
from ..trajectory import Trajectory
from .controllers import Controller
from .drive import Drive
from .ground import MOST_EVENTS, Ground
from .methods import SCIPY, Method, checked_method, chosen
from .records import Records
from .start import Start

PAUSED, STEP_TOO_SMALL, TOO_MANY_STEPS, STOPPED_AT_EVENT, TORQUE_FAILED = range(32, 37)
MOST_STEPS = 2**31 - 1  # that the C interface counts
PAUSE = 2000  # steps between looks at signals, such as Ctrl-C
WHY = {
    NOT_FINITE: "the state is not finite any more: is the step too long, or a velocity or torque too large?",
    NOT_POSITIVE_DEFINITE: "the inertia matrix is not positive definite: is the step too long, or a torque too large?",
    OUT_OF_RANGE: "a segment is bent beyond the scene's bend_range: is the torque too large, or the range too small?",
    STEP_TOO_SMALL: "the tolerance would need steps that are too short: is the motion stiff, or rtol too small?",
    TOO_MANY_STEPS: "most_steps were not enough: is the motion stiff, or rtol too small?",
}


@dataclass(frozen=True, eq=False)
class Samples:
    """What a method gives: samples of the motion up to where it came, and what ended it before its end."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    bristles: np.ndarray
    info: dict
    failure: BaseException | None = None


class CompiledRun:
    """A run of the generated C: records filled in, ready to go on."""

    def __init__(self, records: Records, drive: Drive, method: Method, start: Start, ground: Ground):
        model = records.model
        self.records, self.drive, self.start, self.ground, self.model = records, drive, start, ground, model
        samples, dtype, points = start.intervals + 1, records.dtype, ground.points
        sizes = {"q": model.nq, "v": model.nv, "tau": drive.nt} | ({"bristles": 2 * points} if points else {})
        self.state = {"q": records.array(start.q0), "v": records.array(start.v0)}
        members = dict(start_members(method), pause=PAUSE, samples=samples, times=records.array(start.times))
        if points:
            self.state["bristles"] = records.array(ground.bristles.ravel())
            self.event_times = np.zeros(MOST_EVENTS, dtype)
            self.event_kinds = np.zeros(MOST_EVENTS, np.intc)
            members |= {"event_times": self.event_times, "event_kinds": self.event_kinds}
            members |= {"most_events": MOST_EVENTS, "stop_at": ground.stop_at}
        self.out = {name: np.zeros((samples, size), dtype) for name, size in sizes.items()}
        members |= {f"{name}_out": array for name, array in self.out.items()} | self.state
        members["work"] = aligned(model.manifest["work"]["rollout"], dtype)
        members["method"] = model.manifest["simulation"]["methods"].get(method.name, 0)
        parameters = model.parameter_vector
        self.record = records.record("run", parameters=parameters, drive=drive.record, t=start.start, **members)

    def function(self, name: str, *arguments):
        """Return a function of the compiled model that takes a run."""
        found = getattr(self.model.library, f"{self.model.name}_{name}")
        found.argtypes = (ctypes.c_void_p, *arguments)
        return found

    def go(self) -> int:
        """Advance to the end, or to what ends the run before; return its status."""
        rollout, address, status = self.function("rollout"), ctypes.addressof(self.record), PAUSED
        while status == PAUSED:
            status = rollout(address)
        return status

    def samples(self, status: int) -> Samples:
        """Return the samples written, and what a status means."""
        record, done = self.record, self.record.done
        info = {name: getattr(record, name) for name in ("steps", "rejected", "evaluations", "factorisations")}
        if self.ground.points:
            count = min(record.events, MOST_EVENTS)
            events = zip(self.event_times[:count].tolist(), self.event_kinds[:count].tolist(), strict=True)
            info["events"] = [self.ground.event(t, number) for t, number in events]
        rows = {name: array[:done].astype(float) for name, array in self.out.items()}
        t = self.start.times[:done]
        if status == STOPPED_AT_EVENT:
            t, rows = self._with_the_end(t, rows)
            status = 0
        bristles = rows.get("bristles", np.zeros((len(t), 0))).reshape(len(t), self.ground.points, 2)
        failure = self.drive.error or (failed(status, record.t) if status else None)
        return Samples(t, rows["q"], rows["v"], rows["tau"], bristles, info, failure)

    def _with_the_end(self, t: np.ndarray, rows: dict) -> tuple[np.ndarray, dict]:
        """Add the state at which a run stopped as a last sample."""
        if t[-1] >= self.record.t:
            return t, rows
        tau = np.zeros_like(self.out["tau"][0])
        y, y_dot = (np.concatenate([*self.state.values()]) for _ in range(2))
        pointer = ctypes.c_void_p
        state_rate = self.function("state_rate", self.records.real, pointer, pointer, pointer)
        state_rate(ctypes.addressof(self.record), self.record.t, *(a.ctypes.data for a in (y, y_dot, tau)))
        last = self.state | {"tau": tau}
        rows = {name: np.vstack([rows[name], last[name]]).astype(float) for name in rows}
        return np.append(t, self.record.t), rows


def start_members(method: Method) -> dict:
    """Return a method's settings as members of the run's record."""
    own = {name: x for name, x in method.settings.items() if name not in ("first_step", "most_steps")}
    own["step"] = method.settings.get("step", method.settings.get("first_step", 0))
    return own | {"most_steps": int(min(method.settings.get("most_steps", np.inf), MOST_STEPS))}


def failed(status: int, t: float) -> SimulationError:
    """Return the error that a status of the C interface means."""
    return SimulationError(f"at t = {t:.6g} s {WHY[status]}")


def simulate(
    model, q0, v0, *, controller: Controller = None, t_span=(0.0, 1.0), method: str = "auto", **settings
) -> Trajectory:
    """Simulate a motion: H v_dot + C = [0; tau], the quaternion kept on the unit sphere.

    q0 (nq,), v0 (nv,): start; its quaternion is normalised.
    controller: None (no torque), Damping, TorqueTable, TorqueCurve, Pfl, Phases of these, NativeTorque, or a function
    (t (s), q, v) -> tau (2m,) in N m.
    legs, bristles0, stop_at (models with contacts): Legs, where there are feet; stretch (points, 2) of the friction
    springs in m, zero by default; events to stop at, pairs such as ("take_off", "feet").
    t_span: (start, end) in s, or the end alone.
    method: "tsit5", "ros34pw2" (adaptive, in C), "rk4", "implicit_euler" (steps of a fixed length, in C),
    "dop853", "lsoda" (SciPy's, as a check), or "auto", whose choice and reason ``info`` tells.
    settings: output_step (s, default 1/200 of the span, rounded to divide it); adaptive methods: rtol, atol (defaults
    1e-8, 1e-4 for ros34pw2), first_step, least_step, most_step (s), most_steps; fixed steps: step (s, default 1e-4,
    shortened to divide output_step); SciPy's: rtol, atol (defaults 1e-10, 1e-12; 1e-6 both for a float model).
    Raises StateError (shapes, values), SimulationError (settings; the state left what numbers can hold; its
    ``trajectory`` is the motion up to there), ModelError (the scene left out rollout, energy or momentum).
    """
    missing = [name for name in ("rollout", "energy", "momentum") if name not in model.manifest["work"]]
    if missing:
        raise model.without(*missing)
    start = Start.checked(model, (q0, v0), t_span, settings.pop("output_step", None))
    run, choice = prepared(model, start, controller, method, settings)
    begun = time.perf_counter(), time.process_time()
    found = integrate(run, choice)
    spent = {"seconds": time.perf_counter() - begun[0], "cpu_seconds": time.process_time() - begun[1]}
    info = found.info | choice.settings | {"method": choice.name, "reason": choice.reason} | spent
    return judged(model, replace(found, info={k: x for k, x in info.items() if x is not np.inf}), run.ground)


def end_state(model, q0, v0, *, controller: Controller, duration: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) where simulate's "rk4" ends after a duration (s), and measure nothing on the way."""
    start = Start.checked(model, (q0, v0), duration, duration)
    found = integrate(*prepared(model, start, controller, "rk4", {"step": step}))
    if found.failure is not None:
        raise found.failure
    return found.q[-1], found.v[-1]


def prepared(model, start: Start, controller: Controller, method, settings: dict) -> tuple[CompiledRun, Method]:
    """Return a run that is ready to go, and its method; SimulationError where a setting is wrong."""
    ground = Ground.checked(model, start, settings)
    records = Records(model)
    drive = Drive(records, controller, ground.legs.curve if ground.legs else None)
    choice = choose(model, drive, start, method, settings)
    return CompiledRun(records, drive, choice, start, ground), choice


def choose(model, drive: Drive, start: Start, name, settings: dict) -> Method:
    """Return the method that was asked for, or a choice and its reason."""
    single = drive.records.real is ctypes.c_float
    available, reason = model.manifest["simulation"]["methods"], "asked for"
    if isinstance(name, str) and name == "auto":
        decay = None if model.contacts else fastest_decay(model, drive, start)
        name, reason = chosen(settings, available, decay)
    method = checked_method(name, settings, available, single)
    for each in ("step", "most_step"):
        refuse_vanishing(start, each, method.settings.get(each, np.inf))
    if name == "rk4":  # steps divide the output's
        steps = max(1, int(np.ceil(start.interval / method.settings["step"] * (1 - 1e-12))))
        return replace(method, reason=reason, settings={"step": start.interval / steps})
    return replace(method, reason=reason)


def refuse_vanishing(start: Start, name: str, step: float) -> None:
    """SimulationError where steps of at most this length (s) are too short to be seen in the time."""
    least = np.finfo(float).eps * max(abs(start.start), abs(start.end))
    if step < least:
        raise SimulationError(f"{name} {step:.3g}: too short to move the time: give {least:.2g} s or more")


def fastest_decay(model, drive: Drive, start: Start) -> float:
    """Largest eigenvalue (1/s) of K (H^-1)_tt at the start, K being joint damping; unit torques give H^-1."""
    damping = np.max([p.damping if p.damping is not None else np.zeros(drive.nt) for p in drive.parts], axis=0)
    if not damping.any():
        return 0.0
    try:
        v_dot = model.forward_dynamics(start.q0, 0 * start.v0, np.vstack([0 * damping, np.eye(drive.nt)]))
    except StateError:
        return 0.0
    columns = (v_dot[1:, 6:] - v_dot[:1, 6:]) * np.sqrt(np.outer(damping, damping))
    return float(np.linalg.eigvalsh(columns).max())


def integrate(run: CompiledRun, method: Method) -> Samples:
    """Run a method."""
    if method.name in SCIPY:
        from .scipy_methods import integrate_by_scipy

        return integrate_by_scipy(run, method)
    return run.samples(run.go())


def judged(model, found: Samples, ground: Ground) -> Trajectory:
    """Return the trajectory of samples, or raise what ended the run, which keeps the trajectory up to there."""
    if not len(found.t):
        raise found.failure
    try:
        trajectory = measured(model, found, ground)
    except StateError as error:
        words = f"from t = {found.t[0]:.6g} s to {found.t[-1]:.6g} s, by sample: {error}"
        raise found.failure or SimulationError(words) from (None if found.failure else error)
    if found.failure is None:
        return trajectory
    if isinstance(found.failure, SimulationError):
        found.failure.trajectory = trajectory
    raise found.failure


def measured(model, found: Samples, ground: Ground) -> Trajectory:
    """Return samples with energies, momenta and forces; StateError where these are beyond numbers."""
    info = found.info | {"model": model.name}
    info["parameters"] = {name: list(x) if isinstance(x, tuple) else x for name, x in model.parameters.items()}
    measures = *model.energy(found.q, found.v), *model.momentum(found.q, found.v)
    contact = ground.contact(model, found.t, (found.q, found.v, found.tau, found.bristles))
    return Trajectory(found.t, found.q, found.v, found.tau, *measures, info, contact)
