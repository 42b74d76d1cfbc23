"""What acts in each of some runs: one controller for all of them, or one for each."""

import ctypes

import numpy as np

from ..basics.errors import SimulationError
from ..model.model import Model
from .controllers.actuation import Actuation
from .controllers.controller import Controller, controllers_of
from .controllers.piecewise import Piecewise
from .records import Records
from .start import Start


class Acting:
    """The actuation of each run; ``distinct`` has each once, ``alike``: all runs share one.

    drives: addresses of the C records of the runs' actuations.
    """

    def __init__(
        self, records: Records, controller: object, start: Start, legs: Piecewise | None = None
    ):
        self.records = records
        self.span = start.start, start.end
        given = controllers_of(controller, start.runs if start.many else None)
        if len(given) == 1 and start.runs > 1 and self._of(given[0], legs, None).keeps:
            given = given * start.runs
        # of one object that acts in several runs there is one record, unless it keeps something
        made: dict[int, Actuation] = {}
        self._each = []
        for k, each in enumerate(given):
            if id(each) not in made or made[id(each)].keeps:
                made[id(each)] = self._of(each, legs, k if len(given) > 1 else None)
            self._each.append(made[id(each)])
        self.distinct = [*dict.fromkeys(self._each)]
        self.alike = len(self.distinct) == 1
        drives = [ctypes.addressof(each.record) for each in self._each]
        self.drives = np.broadcast_to(np.array(drives, np.uintp), start.runs)

    @property
    def model(self) -> Model:
        """The model whose tails are driven."""
        return self.records.model

    def _of(self, controller: Controller, legs: Piecewise | None, k: int | None) -> Actuation:
        """Return the actuation of run k, or of all; SimulationError if it is impossible."""
        try:
            return Actuation(self.records, controller, self.span, legs)
        except SimulationError as error:
            if k is None:
                raise
            raise SimulationError(f"controller of run {k}: {error}") from None

    def of(self, k: int) -> Actuation:
        """Return the actuation of run k."""
        return self.distinct[0] if self.alike else self._each[k]

    @property
    def keeps(self) -> bool:
        """Whether one of them keeps something of a run."""
        return any(each.keeps for each in self.distinct)

    @property
    def of_python(self) -> bool:
        """Whether a function of Python acts in one of them."""
        return any(each.of_python for each in self.distinct)
