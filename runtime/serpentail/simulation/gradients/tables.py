"""Gradients by what legs and controllers are made of, and the changes of runs for its changes.

It is damping, and tables of torques, of legs and of their landing, by these names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...basics.errors import SimulationError
from ..controllers.controller import parts_of
from ..controllers.schedules import Legs
from .curves import CurveGradient, curve_change, curve_gradient
from .nodes import BREAK, LANDING
from .tape import Swept, Tape

if TYPE_CHECKING:
    from ..one_run import RunAgain

STEP = 1e-5  # relative, of central differences of tables and parameters
Tables = dict[str, Any]  # by name


def parts_made(made: Any, nt: int) -> Tables:
    """Return the damping and the tables of legs or a controller; those that it has."""
    if isinstance(made, Legs):
        found: Tables = {"legs": made.curve, "landing": made.landing}
    else:
        parts = parts_of(made, nt)
        damping = np.zeros(nt) if parts.damping is None else parts.damping
        found = {"damping": damping, "torques": parts.torques}
    return {name: part for name, part in found.items() if part is not None}


def numbers_of(part: Any) -> np.ndarray:
    """Return the numbers of damping, or the times and coefficients of a table."""
    if isinstance(part, np.ndarray):
        return part
    return np.concatenate([part.times, part.coefficients.ravel()])


def _shape(part: Any) -> tuple[int, ...]:
    """Return the shape of damping, or of a table's coefficients."""
    return np.shape(getattr(part, "coefficients", part))


def by_numbers(make: Callable[[np.ndarray], Any], x: ArrayLike, own: Tables) -> Tables:
    """Return how the parts of legs or a controller change with the numbers x (k,) that they are
    made of: (n, k) each. own: the parts of a run; others are left out.
    """
    at, columns = np.atleast_1d(np.asarray(x, float)), []
    steps = STEP * np.maximum(np.abs(at), STEP)
    for row, step in zip(np.diag(steps), steps, strict=True):
        ends = [parts_made(make(at + sign * row), len(own["damping"])) for sign in (1, -1)]
        for name in own.keys() & ends[0]:
            if len({_shape(parts.get(name)) for parts in (*ends, own)}) > 1:
                raise SimulationError("by: the function makes a table that the run did not have")
        late, early = ({name: numbers_of(part) for name, part in end.items()} for end in ends)
        columns.append({n: (late[n] - early[n]) / (2 * step) for n in own.keys() & late})
    if not columns or not columns[0]:
        raise SimulationError("by: the function makes nothing that the run had: legs or controller")
    return {name: np.array([each[name] for each in columns]).T for name in columns[0]}


def parts_of_run(again: RunAgain) -> Tables:
    """Return the damping and the tables of a run."""
    own = parts_made(again.controller, again.start.model.layout.nt)
    return own | (parts_made(again.ground.legs, 0) if again.ground.legs else {})


def _acting(tape: Tape, own: Tables, rows: np.ndarray) -> dict[str, Any]:
    """Return by name of a table which rows it acts in, and their times and ends on its clock."""
    late, since = rows[:, -1] > 0, tape.landed_at
    found = {"torques": (np.full(len(rows), True), 0.0)}
    found |= {"legs": (~late, 0.0), "landing": (late, since)}
    return {n: (at, (rows[at, 0] - s, rows[at, 1] - s)) for n, (at, s) in found.items() if n in own}


def _breaks(tape: Tape, own: Tables) -> Iterator[tuple[int, Tables, bool]]:
    """Yield the nodes at breaks, which times of tables are there, and whether of one table."""
    curves = {name: own[name] for name in ("torques", "legs") if name in own}
    for node in np.flatnonzero(tape.moves.kinds == BREAK).tolist():
        here: Tables = {name: curve.times == tape.times[node] for name, curve in curves.items()}
        yield node, here, sum(at.any() for at in here.values()) == 1


def by_tables(again: RunAgain, tape: Tape, swept: Swept) -> Tables:
    """Return the gradients by damping, and by the tables of torques, legs and landing."""
    nt, own, rows = tape.model.layout.nt, parts_of_run(again), swept.rows
    _, rates, by_tau, by_legs = np.split(rows, [2, 2 + nt, 2 + 2 * nt], axis=1)
    found: Tables = dict.fromkeys(("torques", "legs", "landing"))
    for name, (chosen, at) in _acting(tape, own, rows).items():
        by = by_tau if name == "torques" else by_legs[chosen, :4]
        rate = 0 * by_tau if name == "torques" else by_legs[chosen, 4:8]
        found[name] = curve_gradient(own[name], at, by, rate)

    # nodes at breaks move with these; of two tables that break at once, neither can move alone
    for node, here, alone in _breaks(tape, own):
        for name, at in here.items():
            found[name].times[at] += swept.by_times[node] if alone else np.nan
    if found["landing"]:
        found["landing"].times[1] += swept.by_times[tape.moves.kinds == LANDING].sum()
    return {"damping": -(rates * by_tau).sum(axis=0)} | found


def changed_by_tables(
    again: RunAgain, tape: Tape, rows: np.ndarray, change: Tables
) -> tuple[np.ndarray, np.ndarray]:
    """Return how rows and the times of nodes change for changes of the numbers of damping and
    tables, by name: the transpose of ``by_tables``.
    """
    nt, own = tape.model.layout.nt, parts_of_run(again)
    found, moved, acting = 0 * rows, np.zeros(len(tape.times)), _acting(tape, own, rows)
    _, _, tau, legs = np.split(found, [2, 2 + nt, 2 + 2 * nt], axis=1)  # parts of it
    tau[:] = -rows[:, 2 : 2 + nt] * change.get("damping", 0.0)
    curves = {}
    for name in change.keys() - {"damping"}:
        times, coefficients = np.split(change[name], [len(own[name].times)])
        curves[name] = CurveGradient(times, coefficients.reshape(own[name].coefficients.shape))
        chosen, at = acting[name]
        values, slopes = curve_change(own[name], at, curves[name])
        if name == "torques":
            tau += values
        else:
            legs[chosen, :8] += np.hstack([values, slopes])
    for node, here, alone in _breaks(tape, own):
        shifts = [curves[name].times[at].sum() for name, at in here.items() if name in curves]
        moved[node] = sum(shifts) if alone or not any(shifts) else np.nan
    if "landing" in curves:
        moved[tape.moves.kinds == LANDING] = curves["landing"].times[1]
    return found, moved
