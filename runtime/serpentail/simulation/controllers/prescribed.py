"""``Prescribed``: how joints move whose drive is "prescribed"."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...basics.checks import finite_array, needed, number, one_of, refusal
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...model.model import Model
from ...model.state import Quantities
from .piecewise import Piecewise, checked_nodes, constant, shaped, spline

BLENDS = ("quintic", "spline")
SUDDEN = ("rate", "shape")  # of moves of legs without mass
AT_ONCE = "joints with mass cannot change their rate at once: "


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Angles over time of the joints that the scene prescribes.

    Rates never jump, because that would need an impulse.

    Parameters
    ----------
    times : array_like, shape (K,)
        Increasing times (s); before the first and after the last, angles are held.
    angles : mapping of str to array_like
        Angles (rad) by the name of a chain, (K, n) for its n coordinates; (n,) for one time. The
        name of a pair stands for both sides, which then mirror each other.
    blend : {"quintic", "spline"}, default "quintic"
        "quintic": from rest to rest between the times; "spline": a cubic spline through all angles,
        at rest at both ends.

    Raises
    ------
    SimulationError
        Times, angles or blend are wrong.

    See Also
    --------
    Prescribed.moves

    Examples
    --------
    >>> import serpentail as st
    >>> legs = st.Prescribed([0, "50 ms"], {"hind": [["40 deg", 0, 0], ["10 deg", 0, 0]]})
    >>> legs.angles["hind"].shape
    (2, 3)
    """

    times: Quantities
    angles: Mapping[str, Any]
    blend: str = "quintic"
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the nodes."""
        given = {"blend": self.blend, "angles": self.angles}
        if not isinstance(self.angles, Mapping) or not self.angles:
            raise refusal("Prescribed: angles", given["angles"], "a table by chain", SimulationError)
        if self.blend == "linear":
            remedy = needed("Prescribed: blend", self.blend, '"quintic" or "spline"')
            raise SimulationError(f"{remedy}: {AT_ONCE}give another blend")
        one_of("Prescribed: blend", self.blend, BLENDS, SimulationError)
        times = np.atleast_1d(finite_array("Prescribed: times", self.times, SimulationError, "s"))
        checked = {}
        for name, value in self.angles.items():
            field = f"angles of {name}"
            rows = finite_array(f"Prescribed: {field}", value, SimulationError, "rad")
            rows = np.atleast_2d(rows) if len(times) == 1 else rows
            width = rows.shape[1] if rows.ndim == 2 else 0
            checked[name] = checked_nodes("Prescribed", field, (times, rows), width)[1]
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "angles", checked)

    @classmethod
    def moves(cls, angles: Mapping[str, Any], moves: Iterable[Mapping[str, Any]] = ()) -> Self:
        """Make joints that move from time to time, from rest to rest, and are held between.

        Parameters
        ----------
        angles : mapping of str to array_like
            First angles (rad) of each chain or pair.
        moves : iterable of mapping
            Moves in the order of time. Each has ``at`` and ``duration`` (s), and the last angles
            (rad) of some of the chains by their names.

        Returns
        -------
        Prescribed
            The schedule.

        Raises
        ------
        SimulationError
            A move is incomplete, or begins before the last one ends.
        """
        start = cls([0.0], angles)
        here, times, rows = {name: each[0] for name, each in start.angles.items()}, [0.0], []
        for k, move in enumerate(moves):
            field = f"moves[{k}]"
            goals = _goals(field, move, here)
            begin, duration = (
                number(f"{field}.{key}", move[key], SimulationError, unit="s", above=least)
                for key, least in (("at", -np.inf), ("duration", 0))
            )
            if rows and begin < times[-1]:
                remedy = f"a time after {times[-1]:.6g} s, where the move before it ends"
                raise refusal(f"{field}.at", move["at"], remedy, SimulationError)
            times = times if rows else [begin]
            rows = rows or [here]
            if begin > times[-1]:
                times, rows = [*times, begin], [*rows, here]
            here = here | goals
            times, rows = [*times, begin + duration], [*rows, here]
        rows = rows or [here]
        return cls(times, {name: np.array([row[name] for row in rows]) for name in here})

    def curve(self, model: Model) -> Piecewise:
        """Return the angles of all prescribed coordinates of a model.

        Parameters
        ----------
        model : Model
            A model with prescribed joints.

        Returns
        -------
        Piecewise
            Angles (rad) over time (s), in the order of ``given``.

        Raises
        ------
        SimulationError
            A chain is missing or unknown, or has another number of coordinates.
        """
        parts, known = [], {}
        for chain in [each for each in model.layout.chains if each.given]:
            names = [name for name in (chain.name, chain.owner) if name in self.angles]
            known |= dict.fromkeys((chain.owner, chain.name), chain)
            count = len(chain.given)
            if not names:
                needs = f"{count} angles of {chain.name}: {', '.join(chain.given)}"
                raise refusal("prescribed", [*self.angles], needs, SimulationError)
            found = self.angles[names[0]]
            if found.shape[1] != count:
                needs = f"{count} angles: {', '.join(chain.given)}"
                raise refusal(f"prescribed: {names[0]}", found[0].tolist(), needs, SimulationError)
            parts.append(found)
        for name in self.angles:
            one_of("prescribed: chain", name, known, SimulationError)
        angles, times = np.concatenate(parts, axis=1), np.asarray(self.times)
        if len(times) == 1:
            return constant(times[0], angles[0])
        return spline(times, angles, "clamped") if self.blend == "spline" else shaped(times, angles, "quintic")


def _goals(field: str, move: object, known: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the last angles of a move by chain."""
    if not isinstance(move, Mapping):
        raise refusal(field, move, "a table of at, duration and chains", SimulationError)
    for key in SUDDEN:
        if key in move:
            raise refusal(f"{field}.{key}", move[key], f"no {key}: {AT_ONCE}give duration", SimulationError)
    for key in move:
        one_of(f"{field}: key", key, ("at", "duration", *known), SimulationError)
    if not {"at", "duration"} < move.keys():
        raise refusal(field, dict(move), "at, duration, and angles of a chain", SimulationError)
    goals = {}
    for name in [name for name in known if name in move]:
        goal = finite_array(f"{field}.{name}", move[name], SimulationError, "rad")
        if goal.shape != known[name].shape:
            needs = f"{len(known[name])} angles"
            raise refusal(f"{field}.{name}", move[name], needs, SimulationError)
        goals[name] = goal
    return goals


def curve_of(model: Model, many: bool, prescribed: object) -> Piecewise | None:
    """Return how the prescribed joints of a model move; SimulationError if they do not match, or
    there are many runs.
    """
    if not model.layout.given:
        if prescribed is not None:
            remedy = f"{model.name} has no such joints: leave it out"
            raise SimulationError(needed("prescribed", prescribed, "nothing") + f": {remedy}")
        return None
    if not isinstance(prescribed, Prescribed):
        names = ", ".join(chain.name for chain in model.layout.chains if chain.given)
        needs = f"st.Prescribed with the angles of {names}"
        raise refusal("prescribed", prescribed, needs, SimulationError)
    if many:
        raise refusal("q0", "many starts", "one start, as joints are prescribed", SimulationError)
    return prescribed.curve(model)
