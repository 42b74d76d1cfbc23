"""``Prescribed``: how joints move whose drive is "prescribed"."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...basics.checks import finite_array, number, one_of, refusal, shown
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...model.model import Model
from ...model.state import Quantities
from .piecewise import Piecewise, checked_nodes, shaped, spline

BLENDS = ("quintic", "spline")
AT_ONCE = "joints with mass cannot change their rate at once: remove it, and give duration"


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Angles over time of the joints that a scene prescribes; their rates never jump.

    Parameters
    ----------
    times : array_like, shape (K,)
        Increasing times (s); before the first and after the last, angles are held.
    angles : mapping of str to array_like
        Angles (rad) of a chain's n coordinates by its name, (K, n), or (n,) for one time. The name
        of a pair stands for both sides, which mirror each other.
    blend : {"quintic", "spline"}, default "quintic"
        "quintic": from rest to rest between the times; "spline": a cubic spline through all angles,
        at rest at both ends.

    Raises
    ------
    SimulationError
        Times, angles or blend are wrong.

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
        one_of("Prescribed: blend", self.blend, BLENDS, SimulationError)
        if not isinstance(self.angles, Mapping) or not self.angles:
            needs = "a table of angles by chain"
            raise refusal("Prescribed: angles", self.angles, needs, SimulationError)
        times = np.atleast_1d(finite_array("Prescribed: times", self.times, SimulationError, "s"))
        checked = {}
        for name, value in self.angles.items():
            field = f"angles of {name}"
            rows = finite_array(f"Prescribed: {field}", value, SimulationError, "rad")
            rows = np.atleast_2d(rows) if len(times) == 1 else rows
            checked[name] = checked_nodes("Prescribed", field, (times, rows), rows.shape[-1])[1]
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
        here = {name: rows[0] for name, rows in cls([0.0], angles).angles.items()}
        nodes: list[tuple[float, dict[str, np.ndarray]]] = []
        for k, move in enumerate(moves):
            begin, end, goals = _checked_move(f"moves[{k}]", move, here)
            if nodes and begin < nodes[-1][0]:
                needs = f"{nodes[-1][0]:.6g} s, where the move before it ends, or later"
                raise refusal(f"moves[{k}].at", move["at"], needs, SimulationError)
            if not nodes or begin > nodes[-1][0]:
                nodes.append((begin, here))
            here = here | goals
            nodes.append((end, here))
        times, rows = zip(*(nodes or [(0.0, here)]), strict=True)
        return cls(times, {name: np.array([row[name] for row in rows]) for name in here})


def _checked_move(
    field: str, move: Any, known: Mapping[str, np.ndarray]
) -> tuple[float, float, dict[str, np.ndarray]]:
    """Return begin and end (s) of a move, and its last angles (rad) by chain."""
    if not isinstance(move, Mapping) or not {"at", "duration"} < move.keys():
        raise refusal(field, move, "at, duration, and angles of a chain", SimulationError)
    for key in move:
        if key in ("rate", "shape"):  # of legs without mass
            raise SimulationError(f"{field}.{key}: value {shown(move[key])}: {AT_ONCE}")
        one_of(f"{field}: key", key, ("at", "duration", *known), SimulationError)
    begin = number(f"{field}.at", move["at"], SimulationError, unit="s")
    length = number(f"{field}.duration", move["duration"], SimulationError, unit="s", above=0)
    goals = {}
    for name in [name for name in known if name in move]:
        goals[name] = finite_array(f"{field}.{name}", move[name], SimulationError, "rad")
        if goals[name].shape != known[name].shape:
            needs = f"{len(known[name])} angles"
            raise refusal(f"{field}.{name}", move[name], needs, SimulationError)
    return begin, begin + length, goals


def curve_of(model: Model, many: bool, prescribed: Any) -> Piecewise | None:
    """Return how the prescribed joints of a model move, in the order of ``given``; SimulationError
    if they do not match, or there are many runs.
    """
    chains = [chain for chain in model.layout.chains if chain.given]
    if not chains:
        if prescribed is not None:
            needs = f"nothing: {model.name} has no prescribed joints"
            raise refusal("prescribed", prescribed, needs, SimulationError)
        return None
    if not isinstance(prescribed, Prescribed):
        needs = f"st.Prescribed with the angles of {', '.join(chain.name for chain in chains)}"
        raise refusal("prescribed", prescribed, needs, SimulationError)
    if many:
        raise refusal("q0", "many starts", "one, as joints are prescribed", SimulationError)
    known = [name for chain in chains for name in (chain.name, chain.owner)]
    for name in prescribed.angles:
        one_of("prescribed: chain", name, known, SimulationError)
    parts = []
    for chain in chains:
        rows = prescribed.angles.get(chain.name, prescribed.angles.get(chain.owner))
        if rows is None or rows.shape[1] != len(chain.given):
            needs = f"{len(chain.given)} angles: {', '.join(chain.given)}"
            value = None if rows is None else rows[0].tolist()
            raise refusal(f"prescribed: {chain.name}", value, needs, SimulationError)
        parts.append(rows)
    times, angles = np.asarray(prescribed.times), np.concatenate(parts, axis=1)
    if prescribed.blend == "spline" and len(times) > 1:
        return spline(times, angles, "clamped")
    return shaped(times, angles, "quintic")
