"""The trajectory of a run's samples; its energies, momenta and books when somebody asks.

A run's state is certainly finite, but its energy need not be. Where that is not certain, they are
computed at once, so that the run fails with an error of its own.
"""

import json
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..basics.errors import SimulationError, StateError
from ..model.model import Model
from ..model.passive import behind_stops, stored_energy
from ..motion.archive import origin
from ..motion.given import LOADS, PRESCRIBED
from ..motion.trajectory import Trajectory
from .audit import BALANCED, Between, allowance, audited, warnings_of
from .ground import LANDED_AT, GroundSettings
from .methods import ADAPTIVE, FIXED
from .runs.outcomes import Samples

# numbers whose eighth power a real can hold
MODEST = {np.dtype(real): float(np.finfo(real).max) ** 0.125 for real in (np.float32, np.float64)}
EASE_STOPS = "{behind}: make the stop stiffer, or its width larger"
INTERRUPTED = "interrupted"  # the failure of a run that Ctrl-C ended, whose error has no words
MEASURES = {"energy": ("kinetic", "potential"), "momentum": ("linear_momentum", "angular_momentum")}


def trajectory_or_error(model: Model, samples: Samples, ground: GroundSettings) -> Trajectory:
    """Return the trajectory of samples; raise the error that ended the run, with its motion."""
    t, failure = samples.t, samples.failure
    if failure is not None and not len(t):
        raise failure
    try:
        trajectory = measured(model, samples, ground)
    except StateError as error:
        if failure is not None:
            raise failure from None
        words = f"from t = {t[0]:.6g} s to {t[-1]:.6g} s, by sample: {error}"
        raise SimulationError(words) from error
    if failure is None:
        return trajectory
    if isinstance(failure, SimulationError):
        failure.trajectory = trajectory
    if isinstance(failure, KeyboardInterrupt):
        vars(failure)["motion"] = trajectory
    raise failure


def measured(model: Model, samples: Samples, ground: GroundSettings) -> Trajectory:
    """Return samples whose energies, momenta, forces and info are derived when asked for.

    Where it is not certain that numbers hold them they are derived now; StateError if not.
    """
    arrays = {"t": samples.t, "q": samples.q, "v": samples.v, "tau": samples.tau}
    motion = Trajectory.of_run(arrays, model, Energies(model, samples, ground))
    whole = samples.failure is None and samples.ledger.size > 0
    method = samples.info.get("method") if whole else None
    numbers = model.parameter_vector, samples.q, samples.v, samples.bristles
    return motion if certain(model, method, numbers) else replace(motion)


def certain(model: Model, method: str | None, numbers: Iterable[np.ndarray]) -> bool:
    """Tell whether the energies, momenta and forces of a run are certainly finite.

    They are sums of products of at most five parameters, coordinates and rates; a continuum may be
    bent too far between steps.
    """
    if method not in (*FIXED, *ADAPTIVE) or model.kind != "articulated":
        return False
    most = MODEST[model.parameter_vector.dtype] ** 2
    return all(np.vdot(array, array) < most for array in numbers)


def certain_runs(model: Model, method: str, numbers: Iterable[np.ndarray]) -> np.ndarray:
    """Return ``certain`` for each of some runs, whose numbers are (runs, ...)."""
    sound = []
    for array in numbers:
        rows = array.reshape(len(array), -1)
        sound.append(np.einsum("ki,ki->k", rows, rows) < MODEST[rows.dtype] ** 2)
    return np.all(sound, axis=0) & certain(model, method, ())


class Energies:
    """Derived fields of a run's samples: called with a name, it returns the field and related ones.

    StateError if a result is too large for a number.
    """

    def __init__(self, model: Model, samples: Samples, ground: GroundSettings):
        self.model, self.samples, self.ground = model, samples, ground

    def __call__(self, name: str) -> dict[str, Any]:
        """Return fields of a trajectory by name."""
        samples = self.samples
        state = samples.q, samples.v
        if name == "info":
            return {"info": json.loads(json.dumps(self._info()))}
        if name == "contact":
            given = *state, samples.tau, samples.bristles
            landed_at = samples.info.get(LANDED_AT, np.inf)
            return {"contact": self.ground.contact(self.model, samples.t, given, landed_at)}
        function, names = next(row for row in MEASURES.items() if name in row[1])
        found = getattr(self.model, function)(*state, *self.ground.given_at(samples.t))
        measures = {k: np.asarray(array, float) for k, array in zip(names, found, strict=True)}
        for array in measures.values():
            array.setflags(write=False)
        return measures

    def _info(self) -> dict[str, Any]:
        """Return the info of the run, with its audit."""
        samples = self.samples
        info = samples.info | origin(self.model)
        for name, curve in ((PRESCRIBED, self.ground.given), (LOADS, self.ground.loads)):
            if curve is not None:
                info[name] = curve.as_lists()
        if samples.failure is not None:
            return info | {"failure": str(samples.failure) or INTERRUPTED}
        if not samples.ledger.size:  # a part of a run
            return info
        eps = float(np.finfo(self.model.parameter_vector.dtype).eps)
        books = audited(
            self.model,
            self.model.parameters,
            samples.ledger,
            samples.t[-1] - samples.t[0],
            self._ends(),
            Between(allowance(info, eps), self._all),
        )
        warnings = warnings_of(books, info, eps)
        behind = behind_stops(self.model, samples.q[:, self.model.layout.tail_q])
        if behind:
            warnings.append(EASE_STOPS.format(behind=behind))
        return info | books.info() | {"warnings": warnings}

    def _ends(self) -> dict[str, np.ndarray]:
        """Return energies (2,), linear momentum (2, 3), stored energy at start and end."""
        rows = []
        for k in (0, -1):
            state = self.samples.q[k], self.samples.v[k], *self.ground.given_at(self.samples.t[k])
            rows.append((*self.model.energy(*state), self.model.momentum(*state)[0]))
        columns = zip(*rows, strict=True)
        ends = {name: np.array(each, float) for name, each in zip(BALANCED, columns, strict=True)}
        return ends | {"stored": self._stored(self.samples.q[[0, -1]])}

    def _all(self, _: np.ndarray) -> dict[str, np.ndarray]:
        """Return the same at all samples."""
        measures = self("kinetic") | self("linear_momentum")
        return measures | {"stored": self._stored(self.samples.q)}

    def _stored(self, q: np.ndarray) -> np.ndarray:
        """Return the energy (K,) that the tail stores."""
        return np.asarray(stored_energy(self.model.passive_values, q[:, self.model.layout.tail_q]))
