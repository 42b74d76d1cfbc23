"""``State``: configuration and velocity, and the words for one, of programs and of scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, get_type_hints

import numpy as np

from serpentail_scene.keys import Key
from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY
from serpentail_scene.messages import one_line

from ..basics.attitude import Array, from_angles
from ..basics.checks import finite_array, none_of, number, real_array, refusal
from ..basics.errors import StateError
from ..basics.near_names import NearNames
from .names import Names

if TYPE_CHECKING:
    from .model import Model

SPAN = (0.0, 1.0)  # s, of a run that names none
Quantity = float | np.number | str  # a number in SI, or a text with its unit
Quantities = Quantity | Sequence[Any] | np.ndarray  # also rows of these
Span = Quantity | Sequence[Quantity] | np.ndarray  # s
WIDTH = 96  # characters of a line in a REPL
ANGLES = ("pitch", "roll", "yaw")
OTHER_WORDS = {"rate": "spin", "bends": "bend"}  # which say the same


class StateWords(TypedDict, total=False):
    """The words, with the units of their numbers."""

    height: Annotated[Quantity, Key("m")]
    position: Annotated[Quantities, Key("m", depth=1)]
    pitch: Annotated[Quantity, Key("rad")]
    roll: Annotated[Quantity, Key("rad")]
    yaw: Annotated[Quantity, Key("rad")]
    velocity: Annotated[Quantities, Key("m/s", depth=1)]
    spin: Annotated[Quantities, Key("rad/s", depth=1)]
    bend: Annotated[Quantities, Key("rad", depth=2)]
    bend_rate: Annotated[Quantities, Key("rad/s", depth=2)]
    rate: Annotated[Quantities, Key("rad/s", depth=1)]
    bends: Annotated[Quantities, Key("rad", depth=2)]


_HINTS = get_type_hints(StateWords, include_extras=True)
START: dict[str, Key] = {word: hint.__metadata__[0] for word, hint in _HINTS.items()}
OF_TAIL = ("bend", "bend_rate")


@dataclass(frozen=True, eq=False)
class State(NearNames):
    """A configuration and a velocity of a model, or a row of each for many times.

    ``q, v = state`` takes it apart; ``state["alpha_1"]`` is a number by its name. It stands in
    place of q and v in ``simulate``, ``plan`` (``start=``), ``Sequence.simulate``, ``settle``,
    ``Model.step``, the settings of ``sweep``, and ``environment`` (``start=``). ``Model.state``,
    ``Model.neutral``, ``Trajectory.at`` and ``Trajectory.end`` make states.

    Attributes
    ----------
    q : ndarray, shape (nq,) or (n, nq)
        Configuration; see ``Model``. Read-only.
    v : ndarray, shape (nv,) or (n, nv)
        Velocity. Read-only.
    """

    q: Array
    v: Array
    names: Names = field(repr=False)

    def __post_init__(self) -> None:
        """Keep read-only copies."""
        for name in ("q", "v"):
            array = np.array(getattr(self, name), float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __iter__(self) -> Iterator[Array]:
        return iter((self.q, self.v))

    def __getitem__(self, name: str) -> Any:
        return named(self, self.names, name, (*self.names.q, *self.names.v))

    def __repr__(self) -> str:
        if self.q.ndim > 1:
            return f"<State at {len(self.q)} times: q {self.q.shape}, v {self.v.shape}; SI>"
        lines = [f"State of {len(self.q)} and {len(self.v)} numbers, 0 but for"]
        for units, array in ((self.names.q, self.q), (self.names.v, self.v)):
            each = zip(units.items(), array.tolist(), strict=True)
            told = [f"{name} {x:.6g} {unit}".removesuffix(" 1") for (name, unit), x in each if x]
            lines += [one_line(", ".join(told), WIDTH)] if told else []
        return "<" + "\n  ".join(lines) + ">"


def named(whole: Any, names: Names, name: object, known: tuple[str, ...]) -> Any:
    """Return the numbers (...) of q, v or tau that have a name; KeyError with the nearest name."""
    place = names.place(name) if isinstance(name, str) and name in known else None
    if place is None:
        own = f"name: value {name!r}: it is an attribute: take .{name}"
        raise KeyError(own if name in vars(whole) else none_of("name", name, known))
    return getattr(whole, place[0])[..., place[1]]


def _may_span(value: Any) -> bool:
    """Tell if a value can be a time or two."""
    if isinstance(value, np.ndarray):
        return value.shape in ((), (2,))
    both = value if isinstance(value, tuple | list) and len(value) == 2 else [value]
    return all(isinstance(time, str | int | float | np.number) for time in both)


def parted(
    model: Model, q0: Any, v0: Any = None, t_span: Any = SPAN
) -> tuple[tuple[Any, Any], Any]:
    """Return (q, v) of a start, and the time span of its run.

    In place of q0 and v0 there may be a State, (q, v), or x of both; the span may follow it.
    StateError for a start of one half, or of one and a half.
    """
    spans = _may_span(v0)
    if v0 is not None and not isinstance(q0, State) and (not spans or model.nv == 2):
        return (q0, v0), t_span
    if v0 is not None:
        if not spans or t_span is not SPAN:
            needs = f"{model.nv} numbers beside q0; beside a whole state leave it out"
            raise refusal("v0", v0, needs, StateError)
        t_span = v0
    if isinstance(q0, State):
        return (q0.q, q0.v), t_span
    sequences = (tuple, list, np.ndarray)
    if isinstance(q0, sequences[:2]) and len(q0) == 2 and all(isinstance(x, sequences) for x in q0):
        return (q0[0], q0[1]), t_span
    x = real_array("q0", q0)
    if x.shape[-1:] != (model.nq + model.nv,):
        needs = f"{model.nv} numbers beside q0, or in place of q0 a state such as model.neutral()"
        raise refusal("v0", v0, needs, StateError)
    return (x[..., : model.nq], x[..., model.nq :]), t_span


def state_of(
    model: Model,
    words: Mapping[str, Any],
    where: str = "state",
    error: type[Exception] = StateError,
    tail: Array | None = None,
) -> State:
    """Return the state that words describe, numbers in SI or texts with units.

    where: begins the names of fields in errors; tail: coordinates (2m,) where no bend is given.
    """
    given, said = {}, dict[str, str]()
    for name, value in words.items():
        unknown = none_of(f"{where}: word", name, START)
        if unknown:
            raise error(unknown)
        word = OTHER_WORDS.get(name, name)
        same = said.setdefault("height" if word == "position" else word, name)
        if same != name:
            raise error(f"{where}.{name}: beside {same}, which says the same: give one of them")
        if model.fixed and word not in OF_TAIL:
            own = "this scene has a fixed base, whose state has `bend` and `bend_rate` alone"
            raise error(f'{where}.{name}: {own}: remove it, or set base = "free"')
        given[word] = _numbers(model, f"{where}.{name}", word, value, error)

    q, v = np.zeros(model.nq), np.zeros(model.nv)
    if not model.fixed:
        q[2] = given.get("height", 0.0)
        q[POSITION] = given.get("position", q[POSITION])
        # R = Rz(yaw) Rx(pitch) Ry(roll)
        q[QUATERNION] = from_angles(np.array([given.get(name, 0.0) for name in ANGLES]))
        v[VELOCITY], v[OMEGA] = given.get("velocity", 0.0), given.get("spin", 0.0)
    q[model.layout.tail_q] = given.get("bend", 0.0 if tail is None else tail)
    v[model.layout.tail_v] = given.get("bend_rate", 0.0)
    return State(q, v, model.names)


def _numbers(model: Model, field: str, word: str, value: Any, error: type[Exception]) -> Any:
    """Return the number or numbers of a word, SI; of the tail, its coordinates or their rates."""
    unit = START[word].unit
    assert isinstance(unit, str)
    if not START[word].depth:
        return number(field, value, error, unit=unit)
    array = finite_array(field, value, error, unit=unit)
    if word in OF_TAIL:
        if model.manifest["scene"]["coordinates"] == "polar":
            raise error(f"{field}: is no polar coordinate: leave it out, and set q")
        m, nt, hinges = model.segments, model.layout.nt, model.layout.hinges + model.layout.given
        if array.shape not in ((), (m,), (nt,), *[(m, 2)] * (not hinges)):
            each = "the angle of each hinge, " if hinges else ""
            needs = f"pitch and yaw of each segment, {each}{nt} numbers; {m} pitches; or one pitch"
            raise refusal(field, value, needs, error)
        if hinges and array.shape == (nt,):
            return array / np.repeat(model.turns_each, model.layout.widths)
        array = np.broadcast_to(array, m) if array.ndim == 0 else array
        return shared_among_links(model, array.reshape(1, m, -1))[0]
    if array.shape != (3,):
        raise refusal(field, value, "three numbers", error)
    return array


def shared_among_links(model: Model, bends: Array) -> Array:
    """Return tail coordinates (K, nt) of bends of the segments, (K, m, 1 or 2), rad: pitch, yaw; of
    hinges the first is their angle.
    """
    both, widths = np.zeros((*bends.shape[:2], 2)), np.array(model.layout.widths)
    both[..., : bends.shape[2]] = bends
    return both[:, np.arange(2) < widths[:, None]] / np.repeat(model.turns_each, widths)
