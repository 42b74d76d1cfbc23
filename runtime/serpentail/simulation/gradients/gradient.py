"""The gradient of a number that depends on the end of a run, by all that the run was made of."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...basics.checks import one_of, refusal
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...model.model import Model
from ...model.parameters import flat
from ...model.state_space import in_numbers, in_tangent
from ..controllers.controller import parts_of
from .curves import CurveGradient
from .tables import STEP, by_numbers, by_tables, changed_by_tables, numbers_of, parts_of_run
from .tape import Tape

if TYPE_CHECKING:
    from ..one_run import RunAgain

METHODS = ("tsit5", "ros34pw2", "switching")
USELESS = 1e6  # condition beyond which a gradient says nothing of a change that one could make


@dataclass(frozen=True, eq=False)
class Gradient:
    """Gradient of a number that depends on the end of a run.

    Attributes
    ----------
    q0, v0 : ndarray, shape (nv,)
        Gradient by the start: by q0 in its tangent space (per m, rad), and by v0.
    bristles0 : ndarray, shape (K, 2)
        Gradient by the friction springs at the start (per m).
    parameters : ndarray, shape (n,)
        Gradient by the numbers of ``model.parameter_vector``, each with the others held.
    damping : ndarray, shape (2m,)
        Gradient by the damping of the controller (per N m s).
    torques, legs, landing : CurveGradient or None
        Gradient by the controller's table of torques, by that of the legs, and by that from their
        landing on.
    exists : bool
        Whether there is a derivative: where a point grazes the ground, there is none.
    doubts : tuple of str
        What is wrong or inexact, with times and points.
    condition : float
        Largest gradient by q and v along the run, over that at its end. A gradient through many
        tumbles is exact and useless: beyond 1e6, ``doubts`` says so.
    """

    model: Model
    q0: np.ndarray
    v0: np.ndarray
    bristles0: np.ndarray
    parameters: np.ndarray
    damping: np.ndarray
    torques: CurveGradient | None
    legs: CurveGradient | None
    landing: CurveGradient | None
    exists: bool
    doubts: tuple[str, ...]
    condition: float
    __repr__ = brief

    def by(self, what: str | Callable[[np.ndarray], Any], x: ArrayLike | None = None) -> np.ndarray:
        """Return the gradient by a parameter, or by numbers that legs or a controller are made of.

        Parameters
        ----------
        what : str or callable
            Name of a parameter, which changes as by ``Model.with_parameters``; or the function
            that makes the run's legs or controller of numbers.
        x : array_like, shape (n,), optional
            The numbers of the run; only for a function.

        Returns
        -------
        ndarray, shape (n,)
            The gradient; of a parameter with one number, shape (1,).

        Raises
        ------
        SimulationError
            An argument is wrong, or tables of other sizes are made of other numbers.

        Examples
        --------
        >>> gradient.by("mu")  # doctest: +SKIP
        >>> gradient.by(lambda x: st.Legs.fixed(*x), [4.0, -0.35])  # doctest: +SKIP
        """
        if isinstance(what, str):
            return self.parameters @ directions(self.model, what)
        if not callable(what) or x is None:
            raise refusal("by", what, "a parameter's name, or a function and x", SimulationError)
        own = {name: getattr(self, name) for name in ("damping", "torques", "legs", "landing")}
        own = {name: part for name, part in own.items() if part is not None}
        columns = by_numbers(what, x, own)
        return np.sum([numbers_of(own[name]) @ by for name, by in columns.items()], axis=0)


@dataclass(frozen=True, eq=False)
class Change:
    """How the end of a run changes: q (nv,) in its tangent space, v (nv,) and bristles (K, 2), SI;
    exists and doubts as of Gradient.
    """

    q: np.ndarray
    v: np.ndarray
    bristles: np.ndarray
    exists: bool
    doubts: tuple[str, ...]
    __repr__ = brief


def directions(model: Model, name: str) -> np.ndarray:
    """Return how the numbers of the parameter struct (n,) change with those of a parameter (k,)."""
    one_of("parameter", name, [*model.parameters], SimulationError)
    value = np.atleast_1d(np.asarray(model.parameters[name], float))
    steps = STEP * np.where(value == 0, 1.0, np.abs(value))
    columns = []
    for row, step in zip(np.diag(steps), steps, strict=True):
        ends = []
        for sign in (1, -1):
            moved = (value + sign * row).tolist()
            varied = model._varied({name: moved if len(moved) > 1 else moved[0]})
            ends.append(np.array(flat(model.manifest, varied.parameters)))
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T


def refuse(again: RunAgain) -> None:
    """SimulationError about a run that has no derivatives."""
    model, parts = again.start.model, parts_of(again.controller, again.start.model.layout.nt)
    scene = model.manifest["scene"]
    law = parts.pfl or parts.native or parts.user or parts.state or parts.tensions
    wrong = {
        f"method {again.method.name!r}": again.method.name not in METHODS,
        "controller: what is no Damping, TorqueTable or TorqueCurve": law is not None,
        "motors, which may limit a controller": again.controller is not None
        and any(name.startswith("motor_") for name in model.parameters),
        "load: a force from outside": again.ground.loads is not None,
        "stop_at: the end of a run at an event": again.ground.stop_at > 0,
        'real = "float"': model.parameter_vector.dtype != np.float64,
        "a fixed base": model.fixed,
        "chains besides the tail": len(model.layout.chains) > 1,
        "polar coordinates": scene["coordinates"] == "polar",
    }
    for what, is_wrong in wrong.items():
        if is_wrong:
            raise SimulationError(f"{what}: has no derivatives: see docs/simulation.md")


def _numbers(name: str, value: ArrayLike | None, size: int) -> np.ndarray:
    """Return a checked vector; zeros if it is left out."""
    if value is None:
        return np.zeros(size)
    array = np.asarray(value, float)
    if array.size != size or not np.isfinite(array).all():
        raise refusal(name, value, f"{size} finite numbers", SimulationError)
    return array.ravel()


def vjp(again: RunAgain, parts: tuple[Any, Any, Any]) -> Gradient:
    """Return the gradient of a weighted sum of the end of a run: weights of q, v and bristles."""
    tape, points = again.tape, again.ground.points
    dq, *others = _parts(again, parts, ("q", "v", "bristles"))
    weights = np.concatenate([in_numbers(tape.nodes["states"][-1], dq, 2), *others])
    swept = tape.swept("vjp", weights)
    size, doubts = np.abs(weights[: -2 * points or None]).max(), tape.moves.grazes
    condition = float(swept.largest / size) if size else 1.0
    doubts += tape.moves.doubts
    if condition > USELESS:
        doubts += (f"condition {condition:.1g}: the motion is so sensitive that nothing follows",)
    q0, v0, bristles0 = _parted(tape, 0, swept.state, 0.5)
    return Gradient(
        tape.model,
        q0,
        v0,
        bristles0,
        swept.by_parameters,
        **by_tables(again, tape, swept),
        exists=not tape.moves.grazes,
        doubts=doubts,
        condition=condition,
    )


def jvp(
    again: RunAgain,
    parts: tuple[Any, Any, Any],
    parameters: Mapping[str, ArrayLike],
    schedules: Iterable[tuple[Callable[[np.ndarray], Any], ArrayLike, ArrayLike]] = (),
) -> Change:
    """Return the change of the end of a run, for one of q0, v0 and bristles, of parameters, and of
    the numbers that legs or a controller are made of.
    """
    tape, model = again.tape, again.tape.model
    dq, *others = _parts(again, parts, ("q0", "v0", "bristles0"))
    moved = np.zeros(len(model.parameter_vector))
    for name, value in parameters.items():
        by = directions(model, name)
        moved += by @ _numbers(f"parameters.{name}", value, by.shape[1])
    change = np.concatenate([in_numbers(tape.nodes["states"][0], dq, 0.5), *others])
    tables: dict[str, Any] = {}
    for each in schedules:
        if not isinstance(each, tuple) or len(each) != 3 or not callable(each[0]):
            raise refusal("schedules", each, "(function, x, dx) for each", SimulationError)
        make, x, dx = each
        for name, by in by_numbers(make, x, parts_of_run(again)).items():
            tables[name] = tables.get(name, 0.0) + by @ _numbers("schedules", dx, by.shape[1])
    rows = None
    if tables:  # where they are looked up, backward
        rows = changed_by_tables(again, tape, tape.swept("vjp", 0 * change).rows, tables)
    q, v, bristles = _parted(tape, -1, tape.swept("jvp", change, moved, rows).state, 2)
    grazes, doubts = tape.moves.grazes, tape.moves.doubts
    return Change(q, v, bristles, not grazes, grazes + doubts)


def _parts(again: RunAgain, parts: tuple[Any, Any, Any], names: tuple[str, ...]) -> Any:
    """Return checked parts by q in its tangent space, v and bristles."""
    nv = again.start.model.nv
    return map(_numbers, names, parts, (nv, nv, 2 * again.ground.points))


def _parted(tape: Tape, node: int, state: np.ndarray, factor: float) -> Any:
    """Return the parts of what was swept to a node: by q in its tangent space, v and bristles."""
    dq, v, bristles = np.split(state, np.cumsum([tape.model.nq, tape.model.nv]))
    return in_tangent(tape.nodes["states"][node], dq, factor), v, bristles.reshape(-1, 2)
