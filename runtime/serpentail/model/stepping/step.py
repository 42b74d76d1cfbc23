"""`model.step`: checks what it is given, and has steps of many runs made in lanes and threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import QUATERNION

from ...basics.checks import (
    none_of,
    number,
    one_of,
    real_array,
    refuse_not_finite,
    whole_number,
)
from ...basics.errors import SimulationError, StateError
from ...compiling.threads import MIN_STATES_PER_THREAD, checked_threads, shared
from ..chains import refuse_driven, refuse_given
from ..library import WHY
from ..memory import writeable
from ..parameters import RunParameters
from .makers import ENTRIES, LaneSteps, SingleSteps, StepCall

if TYPE_CHECKING:
    from ..model import Model

METHODS = ("rk4", "implicit_euler")
MOST_STEPS = 10_000  # in one call; for more, `simulate` checks for signals in between
LEGS = 8  # angles (rad) and rates (rad/s) of both legs
SINGLY_LEAST = 32  # steps that are worth a thread, made singly
LANES_LEAST = 4 * MIN_STATES_PER_THREAD  # states of a batch; a step evaluates four


class Stepping:
    """What advances runs of a model: its compiled C with workspaces, and shared parameters."""

    def __init__(self, model: Model):
        self.code = code = model.kernels
        assert code.library is not None
        self.dtype = model.parameter_vector.dtype
        self.singly = SingleSteps(code.manifest, code.library, self.dtype)
        self.lanes: dict[str, LaneSteps] = {}  # by method, made when it is first used
        self.alike = np.zeros((0, len(model.parameter_vector)), self.dtype)

    def parameters(self, model: Model, given: object, runs: int) -> np.ndarray:
        """Return the parameters (runs, scalars) of runs, changes among them checked."""
        if isinstance(given, RunParameters):
            if len(given.vectors) != runs:
                raise StateError(
                    f"step: parameters of {len(given.vectors)} runs, not of {runs}: give as many"
                )
            return np.ascontiguousarray(given.vectors)
        if given:
            return model.parameters_of_runs(given, runs).vectors  # type: ignore[arg-type]
        alike = self.alike  # which another thread may replace
        if len(alike) < runs:
            self.alike = alike = np.tile(model.parameter_vector, (runs, 1))
        return alike[:runs]

    def maker(self, call: StepCall) -> tuple[SingleSteps | LaneSteps, int]:
        """Return what makes steps of runs, and the number of runs that is worth a thread."""
        entry = self.code.manifest.get(ENTRIES[call.method])
        if entry is None or call.runs < entry["states"]:
            return self.singly, max(1, SINGLY_LEAST // call.steps)
        if call.method not in self.lanes:
            lanes = LaneSteps(self.code.manifest, self.code.batches, call.method, self.singly)
            self.lanes[call.method] = lanes
        return self.lanes[call.method], max(entry["states"], LANES_LEAST // (4 * call.steps))


@dataclass(frozen=True)
class StepSettings:
    """Settings of a call, as they were given."""

    steps: Any = 1
    out: Any = None
    bristles: Any = None
    legs: Any = None
    parameters: Any = None
    method: Any = None
    statuses: Any = None
    threads: Any = None

    @classmethod
    def named(cls, given: Mapping[str, Any]) -> StepSettings:
        """Return settings by their names; SimulationError for an unknown name."""
        if "dt" in given:
            raise SimulationError("step: dt: is no setting: the length of a step is h=")
        for name in given:
            if line := none_of("step: setting", name, list(cls.__dataclass_fields__)):
                raise SimulationError(line)
        return cls(**given)


def step(
    model: Model,
    given: tuple[ArrayLike, ArrayLike, ArrayLike],
    h: object,
    settings: Mapping[str, Any],
) -> tuple[np.ndarray, ...]:
    """Return the states after the steps: see ``Model.step``."""
    asked = StepSettings.named(settings)
    method = _method(model, asked.method)
    stepping = model.stepping
    length = number("step: h", h, SimulationError, unit="s", above=0)
    steps = whole_number("step: steps", asked.steps, SimulationError, least=1, most=MOST_STEPS)
    threads = model.batch_library.threads
    if asked.threads is not None:
        threads = checked_threads("step: threads", asked.threads, SimulationError)
    # arrays of all runs; those that change are copied to the results
    arrays, runs, many = _states(model, given, asked)
    if asked.statuses is None:
        _refuse_unsound(arrays, many)
    moved = _outputs(stepping.dtype, arrays, asked.out, runs if many else None)
    call = StepCall(
        moved["q"],
        moved["v"],
        _rows(arrays["tau"], runs),
        moved.get("bristles"),
        _legs(arrays.get("legs"), runs),
        stepping.parameters(model, asked.parameters, runs),
        length,
        steps,
        method,
        _statuses(asked.statuses, runs),
    )
    maker, least = stepping.maker(call)
    shared(runs, threads, lambda first, last: maker.make(call, first, last), least)
    if asked.statuses is None and call.statuses.any():
        _fail(call, many)
    return tuple(array if many else array[0] for array in moved.values())


def _method(model: Model, asked: object) -> str:
    """Return the method; ModelError names what it would need of the scene."""
    model.refuse_fixed("step")
    refuse_given(model, "step")
    name = "implicit_euler" if model.contacts else "rk4"
    if asked is not None:
        name = one_of("step: method", asked, METHODS, SimulationError)
    if model.library is None:
        model.kernel("rollout")  # raises the error with the remedy
    model.need("rollout", *["implicit"] * (name == "implicit_euler"))
    return name


def _states(
    model: Model, given: tuple[ArrayLike, ArrayLike, ArrayLike], asked: StepSettings
) -> tuple[dict[str, np.ndarray], int, bool]:
    """Return the arrays of a call, how many runs they have, and whether with a batch axis."""
    values: dict[str, Any] = dict(zip(("q", "v", "tau"), given, strict=True))
    sizes = {"q": model.nq, "v": model.nv, "tau": model.layout.nt}
    points = sum(model.contacts.values())
    has = {"bristles": points > 0, "legs": "feet" in model.contacts}
    words = {"bristles": f"(k, {2 * points}) in m, zeros at first", "legs": "4 angles, 4 rates"}
    for name, size in (("bristles", 2 * points), ("legs", LEGS)):
        value = getattr(asked, name)
        if has[name] and value is None:
            raise StateError(f"step: {name}: none: this model needs them: give {words[name]}")
        if not has[name] and value is not None:
            raise StateError(f"step: {name}: this model has none: leave them out")
        if has[name]:
            values[name], sizes[name] = value, size
    dtype = model.parameter_vector.dtype
    arrays = {name: _array(name, values[name], sizes[name], dtype) for name in values}
    refuse_driven(model, "step: tau", arrays["tau"], StateError)
    counts = {name: len(array) for name, array in arrays.items() if array.ndim == 2}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise StateError(f"step: numbers of runs differ ({told}): give one, or single rows")
    return arrays, next(iter(counts.values()), 1), bool(counts)


def _array(name: str, value: ArrayLike, size: int, dtype: np.dtype) -> np.ndarray:
    """Return an argument as an array (size,) or (k, size)."""
    array = real_array(f"step: {name}", value, StateError, dtype)
    if array.ndim not in (1, 2) or array.shape[-1] != size or not array.size:
        raise StateError(f"step: {name} has shape {array.shape}, not ({size},) or (k, {size})")
    return array


def _refuse_unsound(arrays: dict[str, np.ndarray], many: bool) -> None:
    """StateError about the first number that is not finite, or quaternion that is zero."""
    for name, array in arrays.items():
        refuse_not_finite(f"step: {name}", array, StateError)
    quaternions = arrays["q"][..., QUATERNION]
    squares = np.einsum("...k,...k", quaternions, quaternions)
    if not squares.all():
        whose = f" of run {int(np.atleast_1d(squares).argmin())}" if many else ""
        raise StateError(f"step: q[3:7]{whose} is the zero quaternion: upright is (1, 0, 0, 0)")


def _rows(array: np.ndarray, runs: int) -> np.ndarray:
    """Return one row for each run; a single row is repeated."""
    return array if array.ndim == 2 else np.broadcast_to(array, (runs, array.size))


def _legs(legs: np.ndarray | None, runs: int) -> np.ndarray | None:
    """Return (k, 4, 2): the angle of each hinge, and its rate."""
    if legs is None:
        return None
    pairs = np.ascontiguousarray(legs.reshape(-1, 2, LEGS // 2).swapaxes(1, 2))
    return np.broadcast_to(pairs, (runs, LEGS // 2, 2))


def _outputs(
    dtype: np.dtype, arrays: dict[str, np.ndarray], out: object, runs: int | None
) -> dict[str, np.ndarray]:
    """Return the arrays that are advanced in place, (k, size): new ones, or those of ``out``."""
    names = [name for name in ("q", "v", "bristles") if name in arrays]
    if out is None:
        return {name: np.array(_rows(arrays[name], runs or 1), order="C") for name in names}
    if not isinstance(out, Sequence) or len(out) != len(names):
        raise StateError(f"step: out: needs {len(names)} arrays, for {', '.join(names)}")
    moved: dict[str, np.ndarray] = {}
    for name, array in zip(names, out, strict=True):
        size = arrays[name].shape[-1]
        shape = (size,) if runs is None else (runs, size)
        writeable(f"step: out: {name}", array, shape, dtype)
        if array is not arrays[name]:
            np.copyto(array, arrays[name])
        moved[name] = array.reshape(-1, size)
    return moved


def _statuses(given: object, runs: int) -> np.ndarray:
    """Return the array for the statuses of the runs: a new one, or the caller's."""
    if given is None:
        return np.zeros(runs, np.intc)
    return writeable("step: statuses", given, (runs,), np.intc)


def _fail(call: StepCall, many: bool) -> None:
    """Raise the error of the first run that failed."""
    k = int(call.statuses.nonzero()[0][0])
    whose = f" of run {k}" if many else ""
    failed = np.count_nonzero(call.statuses)
    others = f" ({failed} of {call.runs} runs failed)" if failed > 1 else ""
    raise SimulationError(f"step{whose}: {WHY[int(call.statuses[k])]}{others}")
