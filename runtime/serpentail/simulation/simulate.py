"""``simulate``: checks and prepares one run or many, and makes them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from ..basics.errors import SimulationError
from ..basics.plausible_values import warn_of_degrees
from ..compiling.threads import checked_threads
from ..model.checked import checked_model
from ..model.model import Model
from ..model.state import SPAN, Quantity, Span, State, parted
from ..motion.derived import AGAIN
from ..motion.trajectory import Trajectory
from .callback import checked_watch
from .controllers.controller import Controller, remembers
from .energies import trajectory_or_error
from .one_run import RunAgain, integrate
from .prepare import prepared
from .rollouts import Rollouts
from .runs.batch import run_batch
from .settings import RunSettings, VariedRuns
from .start import Start

Row = Sequence[float]
Rows = Sequence[Row | np.ndarray]


@overload
def simulate(
    model: Model, q0: Any, v0: Any = None, t_span: Span = SPAN, **settings: Unpack[VariedRuns]
) -> Rollouts: ...


@overload
def simulate(  # type: ignore[overload-overlap]  # a pair of rows, and a span, look like starts
    model: Model,
    q0: State | Row | tuple[Row, Row],
    v0: Row | Quantity | None = None,
    t_span: Span = SPAN,
    **settings: Unpack[RunSettings],
) -> Trajectory: ...


@overload
def simulate(
    model: Model, q0: Rows, v0: Row | Rows, t_span: Span = SPAN, **settings: Unpack[RunSettings]
) -> Rollouts: ...


@overload
def simulate(
    model: Model,
    q0: np.ndarray | Row | Rows,
    v0: np.ndarray | Row | Rows | Quantity | None = None,
    t_span: Span = SPAN,
    **settings: Unpack[RunSettings],
) -> Any: ...


def simulate(
    model: Model,
    q0: Any,
    v0: Any = None,
    t_span: Any = SPAN,
    *,
    controller: Any = None,
    method: str = "auto",
    **settings: Any,
) -> Trajectory | Rollouts:
    """Simulate one motion, or many of one model at once.

    It integrates H v_dot + C = [0; tau] (Eq. 1), with the ground's forces if the model has
    contacts, and keeps the quaternion at norm 1. On a fixed base only the tail moves.

    Parameters
    ----------
    model : Model
        The model; a loaded one needs the functions "rollout", "energy" and "momentum".
    q0, v0 : array_like, shapes (nq,) and (nv,)
        State at the start; the quaternion is normalised. With a leading axis, (k, nq) or
        (k, nv), they are k starts; see Notes. In their place one argument may be a ``State``, a
        pair (q, v), or the nq + nv numbers of both: ``simulate(model, state, "0.4 s")``.
    t_span : float, str or a pair of these, default (0, 1)
        Start and end (s), or the end alone. This and all settings with a unit may be texts, such
        as "0.4 s" or "20 ms".
    controller : controller or callable, optional
        Torques of the tail: ``Damping``, ``TorqueTable``, ``TorqueCurve``, ``Pfl``, ``Gains``,
        ``Mpc``, ``NativeTorque``, ``Sampled``, ``Phases`` of these, or a function
        ``(t, q, v) -> tau`` with t (s) and tau (2m,) (N m). It must depend on (t, q, v) alone: it
        is called several times a step, also at earlier times. ``Sampled`` is for functions with a
        memory. Default: no torque.
    method : str, default "auto"
        "tsit5" or "ros34pw2": adaptive, in C; "switching": the first in flight, the second while
        a point touches the ground; "dp8": adaptive, of order 8, in C, without contacts; "rk4" or
        "implicit_euler": steps of a fixed length, in C; "dop853" or "lsoda": SciPy's, as a check;
        "auto" chooses, and ``info`` of the result gives its choice and reason.

    Returns
    -------
    Trajectory or Rollouts
        The motion; for k starts their ``Rollouts``. Type checkers tell which by a State, by numbers
        in a list, and by ``parameters``; an array may be either, so they say Any.

    Other Parameters
    ----------------
    output_step : float, optional
        Time between samples (s); it is rounded to divide the span. Default: span / 200,
        of k starts span / 20.
    rtol, atol : float, optional
        Tolerances of adaptive methods. At the same ``rtol`` all methods have errors of about the
        same size. Defaults: 1e-8 in flight, 1e-12 for "dp8", 1e-4 with contacts and for
        "ros34pw2" by name (float models: 1e-4, 2e-5 and 1e-3), ``atol`` equal to ``rtol``; for
        SciPy's methods 1e-10 and 1e-12 (float models: 1e-6 and 1e-6).
    first_step, least_step, most_step : float, optional
        Bounds of the steps of adaptive methods in C (s).
    most_steps : int, optional
        Largest number of steps of these and of SciPy's methods. Default: 300000 for each second,
        at least 300000 and at most 1000000.
    step : float, default 1e-4
        Step of "rk4" and "implicit_euler" (s); it is shortened to divide ``output_step``.
    legs : Legs
        Leg angles over time; required if the model has feet.
    prescribed : Prescribed
        Angles of prescribed joints over time; required if the model has any. It takes one start.
    load : Load or sequence of Load
        Forces from outside, over time. A built model that lacks the C for them gets it.
    bristles0 : array_like, shape (points, 2), optional
        Stretch of the friction springs at the start (m), of models with contacts. Default:
        zero. For k starts also (k, points, 2).
    stop_at : sequence of (str, str), optional
        Events that end a run on the ground, such as ``[("take_off", "feet")]``; the kinds are
        "touch_down" and "take_off".
    watch : callable, optional
        Function that receives the new samples during a run from one start, as ``Trajectory``
        objects that follow each other: at most ten times a second, and once at the end. An
        exception that it raises ends the run.
    parameters : mapping, optional
        For k starts: parameter name to values (k,) or (k, 3), SI.
    threads : int, optional
        For k starts: largest number of threads. Default: the model's, see ``load``.

    Raises
    ------
    StateError
        A shape is wrong, or a value is not finite.
    SimulationError
        A setting is wrong, or the state became too large for numbers. The error's
        ``trajectory`` is the motion up to there.
    ModelError
        The scene left out "rollout", "energy" or "momentum", or a parameter is wrong.
    KeyboardInterrupt
        After Ctrl-C. Its attribute ``motion`` is the motion so far: a Trajectory, or Rollouts in
        which unfinished runs have errors.

    Warns
    -----
    UnusualSize
        A tail's angle at the start is beyond a whole turn: degrees, most likely.

    Notes
    -----
    k starts give ``Rollouts``. One method is chosen for all runs. The SimulationError of a run
    is stored in ``Rollouts.errors``, and the other runs continue. ``controller`` may then also be
    a list with one controller for each run, a ``TorqueTable`` with torques (k, K, 2m), or a
    ``Damping`` with (k, 2m). A ``NativeTorque`` must allow calls from several threads at once.

    Eight or more flights are computed in SIMD lanes, several times as fast, if the method is
    "tsit5" or "rk4", if the torques are none, Damping, a TorqueTable, a TorqueCurve or Phases of
    these, and if the C for lanes is compiled or its compilation pays off. The last digits then
    differ.

    With a Python function as controller, or with one of SciPy's methods, the runs are made one
    after another in the calling thread. An exception of the function ends all runs, unless it is
    a SimulationError.

    See Also
    --------
    settle : Let a model come to rest on the ground.
    scenario : Motion that a scene file describes.

    Examples
    --------
    >>> import serpentail as st
    >>> model = st.build("righting_m1_n3")  # doctest: +SKIP
    >>> q0 = [0, 0, 0.5, 1, 0, 0, 0, 0.3, 0]
    >>> v0 = [0, 0, 0, 8, 0, 0, 0, 0]
    >>> law = st.Damping(1e-4)
    >>> motion = st.simulate(model, q0, v0, controller=law, t_span=0.4)  # doctest: +SKIP
    """
    checked_model(model, SimulationError).need("rollout", "energy", "momentum")
    state, t_span = parted(model, q0, v0, t_span)
    start = Start.checked(model, state, t_span, settings.pop("output_step", None))
    watch = checked_watch(settings.pop("watch", None), start.many)
    threads = _threads(model, start, settings.pop("threads", None))
    runs = prepared(model, start, controller, method, settings)
    _doubt(start)
    clocks = read_clocks()
    if start.many:
        return run_batch(runs, threads).rollouts(spent(clocks))
    samples = integrate(runs, watch)
    info = samples.info | runs.method.info | spent(clocks)
    motion = trajectory_or_error(model, replace(samples, info=info), runs.ground)
    if not remembers(controller):
        vars(motion)[AGAIN] = RunAgain(start, runs.ground, controller, runs.method)
    return motion


def _doubt(start: Start) -> None:
    """Warn the caller of ``simulate`` of a tail that starts at degrees."""
    if start.model.manifest["scene"]["coordinates"] != "polar":
        tail = start.model.layout.tail_q
        tails = start.q0[:, tail]
        warn_of_degrees("q0", tails if start.many else tails[0], tail.start, calls=3)


def _threads(model: Model, start: Start, asked: int | None) -> int | None:
    """Return the largest number of threads for many runs: as asked for here, else the model's."""
    if asked is None:
        return model.batch_library.threads
    if not start.many:
        raise SimulationError(
            f"threads: value {asked!r:.60}: one start only, which uses one: leave it out, or give "
            "q0 or v0 one row for each run"
        )
    return checked_threads("threads", asked, SimulationError)


def read_clocks() -> tuple[float, float]:
    """Return wall and processor time (s)."""
    return time.perf_counter(), time.process_time()


def spent(clocks: tuple[float, float]) -> dict[str, float]:
    """Return the times (s) that passed since the clocks were read."""
    seconds, cpu_seconds = time.perf_counter() - clocks[0], time.process_time() - clocks[1]
    return {"seconds": seconds, "cpu_seconds": cpu_seconds}


def end_state(
    model: Model,
    q0: ArrayLike,
    v0: ArrayLike,
    *,
    controller: Controller,
    duration: float,
    rtol: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,) and v (nv,) at the end of a run by "tsit5", without energies and momenta."""
    start = Start.checked(model, (q0, v0), duration, duration)
    samples = integrate(prepared(model, start, controller, "tsit5", {"rtol": rtol}))
    if samples.failure is not None:
        raise samples.failure
    return samples.q[-1], samples.v[-1]
