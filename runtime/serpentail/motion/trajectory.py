"""``Trajectory``: a sampled motion with torques, energies and momenta; it can be saved."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from numpy.typing import ArrayLike

from serpentail_scene.layout import QUATERNION, Layout

from ..basics.attitude import Array, pose_of
from ..basics.checks import needed
from ..model.model import Model
from . import archive
from .asked import Asked
from .contact import Contact
from .derived import Derived, Later, made, settled
from .given import given_at
from .methods import Exports, Showable
from .plausibility import doubts, warnings_of
from .resample import Interpolation, inside, monotone, states_between
from .text import short_text
from .validation import check_time, check_unit, json_text, layout_of, real, shapes


@dataclass(frozen=True, eq=False)
class Trajectory(Asked, Exports, Showable):
    """A sampled motion: states, torques, energies and momenta at K times.

    ``simulate`` and ``plan`` make trajectories; the constructor checks arrays of other origin.
    All arrays are read-only, in SI units.

    Attributes
    ----------
    t : ndarray, shape (K,)
        Increasing times (s).
    q : ndarray, shape (K, nq)
        Configurations with quaternions of norm 1; see ``Model``. On a fixed base (K, 2m).
    v : ndarray, shape (K, nv)
        Velocities. On a fixed base (K, 2m).
    tau : ndarray, shape (K, 2m)
        Torques (N m).
    kinetic, potential : ndarray, shape (K,)
        Energies (J).
    linear_momentum : ndarray, shape (K, 3)
        Momentum (kg m/s, world); on a fixed base that of the tail.
    angular_momentum : ndarray, shape (K, 3)
        Angular momentum about the centre of mass (kg m^2/s, world); on a fixed base that of the
        tail.
    info : dict
        How the motion was made: method, reason, counts, events, warnings and more, JSON-ready.
    contact : Contact or None
        Points, forces and friction springs on the ground; None in flight.
    model : Model or None
        The model that moved. Files and pickles do not keep it; there it is None.

    Raises
    ------
    ValueError
        A shape is wrong, a value is not finite, times do not increase, or a quaternion does not
        have norm 1.

    Examples
    --------
    >>> motion = st.simulate(model, q0, v0, t_span=0.4)  # doctest: +SKIP
    >>> motion.save("tumble.npz")  # doctest: +SKIP
    >>> again = st.Trajectory.load("tumble.npz")  # doctest: +SKIP
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
        """Check the fields, and keep read-only copies."""
        for name in ARRAYS:
            object.__setattr__(self, name, real(name, getattr(self, name)))
        for name, shape in shapes(self.t, self.q, (self.v, self.tau)).items():
            actual = getattr(self, name).shape
            if actual != shape:
                raise ValueError(
                    f"{name} has shape {actual}: give {shape}, to match the shapes of t and q"
                )
        if not isinstance(self.contact, Contact | None):
            raise ValueError(needed("contact", self.contact, "a serpentail.Contact, or None"))
        if self.contact is not None and len(self.contact.points) != len(self.t):
            raise ValueError(
                f"contact has {len(self.contact.points)} samples: give {len(self.t)}, as t has"
            )
        check_time(self.t)
        check_unit(self.attitude)
        object.__setattr__(self, "info", json.loads(json_text(self.info)))

    @classmethod
    def of_run(cls, arrays: dict[str, Array], model: Model, later: Later) -> Self:
        """Return a motion of checked arrays; ``later(name)`` computes a field that is used."""
        for array in arrays.values():
            array.setflags(write=False)
        return made(cls, arrays | {"model": model}, later)

    __repr__ = short_text

    @property
    def energy(self) -> Array:
        """Total energy, (K,), J."""
        return self.kinetic + self.potential

    @property
    def events(self) -> list[dict[str, Any]]:
        """Touch-downs and take-offs in the order of time.

        Each is a dict of "time" (s), "group" ("feet", "tail", "torso" or a chain) and "kind"
        ("touch_down" or "take_off"). ValueError is raised for a motion on the ground by one of
        SciPy's methods, which detect no events.
        """
        if self.contact is not None and "events" not in self.info:
            method = self.info.get("method", "how it was made")
            raise ValueError(
                f"events: {method} detects none: simulate by a compiled method, such as ros34pw2"
            )
        return self.info.get("events", [])

    @property
    def warnings(self) -> list[str]:
        """Doubts about the motion, one sentence each; see docs/simulation.md.

        They report energy or momentum that does not balance, touches that the integrator may have
        missed, and motions that no animal can make. The last kind needs the model; without it they
        are those that were found when the motion was saved or pickled.
        """
        return warnings_of(self.model, self)

    @property
    def segments(self) -> int:
        """Number of tail segments m."""
        return self.layout.segments

    @property
    def layout(self) -> Layout:
        """Where the parts of q, v and tau are."""
        own: Layout | None = getattr(self.model, "layout", None)
        found = layout_of(self.q, self.v)
        return own if own is not None and (own.nq, own.nv) == (found.nq, found.nv) else found

    @property
    def pose(self) -> Array:
        """Position of B (m, world) and quaternion of the torso, (K, 7).

        A fixed base is at the origin.
        """
        return pose_of(self.q, self.layout)

    @property
    def attitude(self) -> Array:
        """Quaternions (w, x, y, z) from torso to world, (K, 4)."""
        return self.pose[:, QUATERNION]

    @property
    def tail(self) -> Array:
        """Tail coordinates, (K, 2m), rad."""
        return self.q[:, self.layout.tail_q]

    @property
    def tail_rate(self) -> Array:
        """Rates of the tail coordinates, (K, 2m), rad/s."""
        return self.v[:, self.layout.tail_v]

    @property
    def given(self) -> tuple[Array, ...]:
        """How prescribed joints move: angles (rad), rates, accelerations, (K, 3, n), as functions
        of a model take them; an empty tuple without such joints.
        """
        return given_at(self.info, self.t)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the motion to an .npz file, whole or not at all.

        Parameters
        ----------
        path : str or path
            The file; the suffix .npz is added if it is missing.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        NotWritten
            The file cannot be written.
        """
        arrays = {name: getattr(self, name) for name in ARRAYS}
        return archive.write(path, arrays, self._info_with_doubts(), self.contact)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a motion that ``save`` wrote.

        Parameters
        ----------
        path : str or path
            The file; the suffix .npz is added if it is missing.

        Returns
        -------
        Trajectory
            The motion, without its model.

        Raises
        ------
        FileNotFoundError
            There is no such file.
        ValueError
            The file is not a trajectory, or is damaged.
        """
        return archive.read(path, ARRAYS, cls)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the model, whose compiled code belongs to one machine."""
        return settled(self, DERIVED) | {"model": None, "info": self._info_with_doubts()}

    def _info_with_doubts(self) -> dict[str, Any]:
        """Return info with the doubts that only the model can find."""
        sentences = [] if self.model is None else doubts(self.model, self)
        return self.info | {"doubts": sentences} if sentences else self.info

    def resample(self, t: ArrayLike) -> Self:
        """Return the motion at other times, by interpolation.

        Parameters
        ----------
        t : array_like, shape (n,)
            Increasing times (s) within those of the motion.

        Returns
        -------
        Trajectory
            The motion at these times.

        Raises
        ------
        ValueError
            A time is outside; the message names the first one.

        Notes
        -----
        Position and tail coordinates: cubic Hermite polynomials of positions and velocities.
        Attitude: the same for the quaternion with its rate q (0, omega) / 2, then normalised; the
        torso must turn less than half a turn between samples. Velocity in flight: a cubic spline,
        of fourth order in the time between samples. Velocity on the ground, energies and momenta:
        monotone cubics, which do not overshoot at impacts and are of second order at extrema.
        Torques and contact: linear, because they may jump.
        """
        times = inside(real("t", t), self.t)
        rows = Interpolation.at(times, self.t)
        cubics: dict[str, Any] = {
            name: monotone(self.t, getattr(self, name), times) for name in MONOTONE
        }
        q, cubics["v"] = states_between(self, times)
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
