"""Sampled motions: states, torques, energies and momenta at times, kept in files, sampled anew."""

import dataclasses
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array
from ..checks import finite_array
from ..model.layout import QUATERNION, Layout
from ..model.model import Model
from . import archive
from .account import account
from .contact import Contact
from .derived import Derived, Later, made, settled
from .doubts import doubts, warnings_of
from .exports import Exports
from .resample import Interpolation, hermite_q, inside, monotone, smooth

UNIT_TOLERANCE = 1e-3  # how far a stored quaternion's norm may drift from 1


@dataclass(frozen=True, eq=False)
class Trajectory(Exports):
    """K samples of a motion with m tail segments, SI, in read-only arrays; ValueError if unsound.

    t (K,) s, increasing; q (K, 7+2m), v (K, 6+2m), on a fixed base both (K, 2m); tau (K, 2m) N m;
    kinetic, potential (K,) J; in the world linear_momentum (K, 3) kg m/s and, about the COM,
    angular_momentum (K, 3) kg m2/s, of the tail alone on a fixed base; info: JSON-ready dict;
    contact: points, forces and bristles of a motion on the ground, None in flight; model: what
    moved, which no file and no pickle keeps: None there.
    """

    t: Array
    q: Array
    v: Array
    tau: Array
    kinetic: Array
    potential: Array
    linear_momentum: Array
    angular_momentum: Array
    info: dict[str, Any] = field(default_factory=dict)
    contact: Contact | None = None
    model: Model | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Freeze private copies of the fields once each has been found sound."""
        for name in ARRAYS:
            object.__setattr__(self, name, _real(name, getattr(self, name)))
        for name, shape in _shapes(self.t, self.q, (self.v, self.tau)).items():
            actual = getattr(self, name).shape
            if actual != shape:
                raise ValueError(
                    f"{name} has shape {actual}: give {shape}, to match the shapes of t and q"
                )
        _check_time(self.t)
        _check_unit(self.attitude)
        object.__setattr__(self, "info", json.loads(_json(self.info)))

    @classmethod
    def of_run(cls, arrays: dict[str, Array], model: Model, later: Later) -> Self:
        """Return a motion of sound arrays t, q, v, tau of its own, whose other fields are derived
        by ``later(name)`` when they are first asked for.
        """
        for array in arrays.values():
            array.setflags(write=False)
        return made(cls, arrays | {"model": model}, later)

    __repr__ = account

    @property
    def energy(self) -> Array:
        """Total energy T + V, (K,), J."""
        return self.kinetic + self.potential

    @property
    def events(self) -> list[dict[str, Any]]:
        """Touch-downs and take-offs in order: time (s), group, kind, such as "take_off".

        ValueError where nobody looked for them: SciPy's methods on the ground.
        """
        if self.contact is not None and "events" not in self.info:
            method = self.info.get("method", "how it was made")
            raise ValueError(
                f"events: {method} looks for none: simulate by a compiled method, such as ros34pw2"
            )
        return self.info.get("events", [])

    @property
    def warnings(self) -> list[str]:
        """What to mind about the motion, a sentence each: see docs/simulation.md.

        Books that do not balance, unfelt touches, what cannot be true of an animal.  The last needs
        the model: where that is gone, it is what was found when the motion was saved or pickled.
        """
        return warnings_of(self.model, self)

    @property
    def segments(self) -> int:
        """Number of tail segments m."""
        return self.layout.segments

    @property
    def layout(self) -> Layout:
        """Where the numbers of q, v and tau lie."""
        return _layout(self.q)

    @property
    def pose(self) -> Array:
        """Place (m) and quaternion of the torso, (K, 7); a fixed base is at the origin."""
        return self.layout.pose(self.q)

    @property
    def attitude(self) -> Array:
        """Torso quaternions (w, x, y, z), torso to world, (K, 4)."""
        return self.pose[:, QUATERNION]

    @property
    def tail(self) -> Array:
        """Tail coordinates q_t, (K, 2m), rad."""
        return self.q[:, self.layout.tail_q]

    @property
    def tail_rate(self) -> Array:
        """Their rates, (K, 2m), rad/s."""
        return self.v[:, self.layout.tail_v]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write one npz file (suffix added if absent), whole or not at all, and return its path;
        NotWritten where that cannot be done.
        """
        arrays = {name: getattr(self, name) for name in ARRAYS}
        return archive.write(path, arrays, self._told(), self.contact)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a saved file; FileNotFoundError if absent, ValueError if it is no trajectory."""
        source, fields = archive.read(path, ARRAYS)
        try:
            return cls(**fields)
        except ValueError as error:
            raise ValueError(f"{str(source)!r} holds no sound trajectory: {error}") from error

    def __getstate__(self) -> dict[str, Any]:
        """Leave the model behind, whose compiled code belongs to one machine."""
        return settled(self, DERIVED) | {"model": None, "info": self._told()}

    def _told(self) -> dict[str, Any]:
        """Info with what only the model can tell."""
        found = [] if self.model is None else doubts(self.model, self)
        return self.info | {"doubts": found} if found else self.info

    def view(self, path: str | os.PathLike[str] = "run.html", model: Model | None = None) -> Path:
        """Write the page of this motion, and return its path; see ``st.view``."""
        from ..viewer.view import view

        return view(self, path, model=model)

    def _repr_html_(self) -> str:
        """For notebooks: the text, and the page."""
        from ..viewer.notebook import in_notebook

        return in_notebook(self, lambda: [self])

    def film(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Write a moving film, a filmstrip or a page, by the suffix; see ``st.film``."""
        from ..pictures.film import film

        return film(self, path, **options)

    def filmstrip(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """Draw moments side by side; return figure and axes; see ``st.filmstrip``."""
        from ..pictures.filmstrip import filmstrip

        return filmstrip(self, path, **options)

    def plot(self, *panels: str, **options: Any) -> Any:
        """Draw panels over time, named or all; return figure and axes; see ``st.plot``."""
        from ..pictures.plot import plot

        return plot(self, *panels, **options)

    def resample(self, t: ArrayLike) -> Self:
        """The motion at the increasing times t (n,), s; ValueError names the first one outside.

        p and q_t: cubic Hermite through positions and velocities. Attitude: the same on the
        quaternion with q_dot = q (0, omega) / 2, normalised (samples less than half a turn apart).
        v in flight: cubic spline, of fourth order in the samples' distance. v on the ground, and
        energies and momenta: monotone cubic, of second order where they turn, so no overshoot at
        impacts. tau and contact: linear, since they may jump.
        """
        times = inside(_real("t", t), self.t)
        rows = Interpolation.at(times, self.t)
        cubics: dict[str, Any] = {
            name: monotone(self.t, getattr(self, name), times) for name in MONOTONE
        }
        cubics["v"] = (monotone if self.contact else smooth)(self.t, self.v, times)
        q = hermite_q(rows, self.q, self.v, self.layout)
        contact = self.contact.mapped(rows.linear) if self.contact else None
        return dataclasses.replace(
            self, t=times, q=q, tau=rows.linear(self.tau), contact=contact, **cubics
        )


ARRAYS = tuple(
    entry.name
    for entry in dataclasses.fields(Trajectory)
    if entry.name not in ("info", "contact", "model")
)
MONOTONE = ("kinetic", "potential", "linear_momentum", "angular_momentum")
DERIVED = (*MONOTONE, "info", "contact")
for _name in DERIVED:
    setattr(Trajectory, _name, Derived(_name))


def _real(name: str, value: ArrayLike) -> Array:
    """A finite, read-only float64 copy of value."""
    array = finite_array(name, value, ValueError).copy()
    array.setflags(write=False)
    return array


def _layout(q: Array) -> Layout:
    """The layout of configurations (K, nq) that have one."""
    layout = Layout.of_width(q.shape[1])
    assert layout is not None
    return layout


def _shapes(t: Array, q: Array, like: tuple[Array, ...]) -> dict[str, tuple[int, ...]]:
    """The shape each array must have, from the number of samples of t and the columns of q; on a
    fixed base v and tau are like q.
    """
    samples = len(t) if t.ndim == 1 else 0
    if not samples:
        raise ValueError(f"t has shape {t.shape}: give one row of at least one time")
    layout = Layout.of_width(q.shape[1]) if q.ndim == 2 else None
    if layout is None or (layout.fixed and any(each.shape != q.shape for each in like)):
        raise ValueError(
            f"q has shape {q.shape}: give ({samples}, 7 + 2m), position, quaternion and 2m tail "
            f"coordinates, or ({samples}, 2m) of a tail on a fixed base"
        )
    return {
        "q": (samples, layout.nq),
        "v": (samples, layout.nv),
        "tau": (samples, layout.nt),
        "kinetic": (samples,),
        "potential": (samples,),
        "linear_momentum": (samples, 3),
        "angular_momentum": (samples, 3),
    }


def _check_time(t: Array) -> None:
    """ValueError unless t increases."""
    backward = np.flatnonzero(np.diff(t) <= 0)
    if backward.size:
        k = int(backward[0]) + 1
        raise ValueError(
            f"t has shape {t.shape} and t[{k}] = {t[k]} follows {t[k - 1]}: give strictly "
            "increasing times"
        )


def _check_unit(attitude: Array) -> None:
    """ValueError unless the quaternions have unit norm."""
    norm = np.linalg.norm(attitude, axis=1)
    k = int(np.argmax(np.abs(norm - 1)))
    if abs(norm[k] - 1) > UNIT_TOLERANCE:
        raise ValueError(f"q[{k}, 3:7] has norm {norm[k]:.6g}: give unit quaternions (w, x, y, z)")


def _json(info: Any) -> str:
    """The text of info, a dict of plain JSON values."""
    try:
        if isinstance(info, dict):
            return json.dumps(info, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"info is not JSON-ready ({error}): convert arrays by tolist(), use None for nan"
        ) from error
    raise ValueError(f"info is a {type(info).__name__}: give a dict of plain JSON values")
