"""A run made again with a tape: its states at the ends of all steps, and sweeps along them in C."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.errors import SimulationError
from ...model.library import PAUSED
from ...model.memory import address_of
from ..runs.outcomes import failed
from ..runs.single import CompiledRun
from .nodes import moves_of

if TYPE_CHECKING:
    from ..one_run import RunAgain

ROOM, PAUSE = 1024, 2000  # nodes that arrays hold at first; steps between checks for Ctrl-C
ROWS = 7  # of causes from outside, for each node
CLOSER = 0.05  # tolerance of the run with a tape, over that of the run: kinks are where they are


@dataclass(frozen=True, eq=False)
class Swept:
    """What a sweep gives: state (nq + nv + 2 points,), by_parameters as in the struct, by_times
    (nodes,), rows (n, columns) of causes from outside, and the largest gradient by q and v.
    """

    state: np.ndarray
    by_parameters: np.ndarray
    by_times: np.ndarray
    rows: np.ndarray
    largest: float


class Tape:
    """A run at its nodes, the ends of its steps, and derivatives along them.

    nodes: arrays by name, a row for each node; moves: what moves the nodes; landed_at: time (s) at
    which the landing of the legs begins, infinite without one.
    """

    def __init__(self, again: "RunAgain"):
        again.start.model.need("gradients")
        settings = dict(again.method.settings)
        settings |= {name: CLOSER * settings[name] for name in ("rtol", "atol")}
        method = replace(again.method, settings=settings)
        self.runs = again.runs(again.start, again.ground, method)
        self.model, self.ground = self.runs.model, self.runs.ground
        self.run = CompiledRun(self.runs)
        self.record: Any = self.runs.records.types["tape"](pause=PAUSE)
        if self.ground.points:
            self.record.touched = -np.inf
        self.nodes: dict[str, np.ndarray] = {}
        self._write()
        self.landed_at = float(self.run.record.landed_at) if self.ground.legs else np.inf
        self.moves = moves_of(self)
        for name, array in self.nodes.items():
            self._set(name, np.ascontiguousarray(array))
        self.record.nodes = len(self.times)

    @property
    def times(self) -> np.ndarray:
        """Times of the nodes (s)."""
        return self.nodes["times"][:, 0]

    def _write(self) -> None:
        """Make the run, and note its nodes."""
        size = self.model.nq + self.model.nv + 2 * self.ground.points
        status, function = PAUSED, self._function("taped_rollout")
        while status == PAUSED:
            if self.record.nodes == self.record.room:  # twice the room
                self.record.room = 2 * self.record.room or ROOM
                for name, width in {"times": 1, "untils": 1, "states": size, "rates": size}.items():
                    array = np.zeros((self.record.room, width))
                    array[: self.record.nodes] = self.nodes.get(name, array[:0])
                    self.nodes[name] = self._set(name, array)
            status = function(self.run.address, ctypes.addressof(self.record))
        if status:
            raise failed(status, self.run.record.t, (0.0, 0.0))
        self.nodes = {name: array[: self.record.nodes] for name, array in self.nodes.items()}

    def _set(self, name: str, array: np.ndarray) -> np.ndarray:
        """Let the record point to an array, which the caller keeps."""
        setattr(self.record, name, address_of(array))
        return array

    def _function(self, name: str) -> Callable[..., int]:
        return self.run.function(name, ctypes.c_void_p)

    def swept(
        self,
        way: str,
        state: np.ndarray,
        parameters: np.ndarray | None = None,
        outside: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> Swept:
        """Carry a gradient by the end (nq + nv + 2 points,) to the start, way "vjp"; or a change of
        the start, of parameters, as in the struct, and of rows and nodes' times, to the end, way
        "jvp".
        """
        record, moves, count = self.record, self.moves, len(self.times)
        columns = 2 + 2 * self.model.layout.nt + 9 * bool(self.ground.legs)
        found = {"state": state.copy(), "by_times": np.zeros(count)}
        none = np.zeros(len(self.model.parameter_vector))
        found |= {"by_parameters": none if parameters is None else parameters}
        found |= {"rows": np.zeros((ROWS * count, columns))}
        record.row, record.largest = 0, 0.0
        if outside is not None:
            found["rows"], found["by_times"] = outside
            record.row = len(outside[0])
        given = {"kinds": moves.kinds}
        if self.ground.points:
            given |= {"ties": moves.ties, "sides": moves.sides, "sunk": moves.sunk}
        for name, array in (found | given).items():
            self._set(name, array)
        if self.ground.legs:
            record.landed_at, record.by_landing = self.landed_at, 0.0
        if status := self._function(f"rollout_{way}")(self.run.address, ctypes.addressof(record)):
            raise SimulationError(f"{way}: step {record.step} cannot be made again: {status}")
        return Swept(**found | {"rows": found["rows"][: record.row]}, largest=record.largest)
