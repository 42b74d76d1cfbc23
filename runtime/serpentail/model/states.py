"""Methods of a model that name, make, move and compare states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY, Layout

from ..basics.attitude import turn_between, turned
from ..basics.checks import finite_array
from ..basics.errors import StateError
from .functions import Array
from .lazy import lazy_property
from .names import Names
from .state import State, StateWords, state_of
from .weight import total_mass

if TYPE_CHECKING:
    from .model import Model


class ModelStates:
    """Names of the numbers of a state, states by words, and the manifold on which they lie."""

    layout: Layout
    parameters: Mapping[str, Any]

    @lazy_property
    def names(self) -> Names:
        """Name and unit of each number of q, v and tau."""
        return Names.of(self.layout, self.layout.names)

    @property
    def coordinates(self) -> list[str]:
        """Names of the numbers of ``q``: x, y, z, qw, qx, qy, qz, then such as alpha_1, beta_1."""
        return [*self.names.q]

    @property
    def velocities(self) -> list[str]:
        """Names of the numbers of ``v``: vx to vz, omega_x to omega_z, then such as alpha_1_dot."""
        return [*self.names.v]

    @property
    def torques(self) -> list[str]:
        """Names of the numbers of ``tau``, such as tau_alpha_1."""
        return [*self.names.tau]

    @property
    def nu(self) -> int:
        """Number of torques, 2m."""
        return self.layout.nt

    @property
    def total_mass(self) -> float:
        """Mass of torso and tail (kg)."""
        return float(total_mass(self.parameters))

    def state(self, **words: Unpack[StateWords]) -> State:
        """Describe a state by words, as ``[simulate.start]`` of a scene does; the rest is 0.

        Parameters
        ----------
        height : float or str, optional
            Height of B (m). This and all other numbers may be texts with units: "30 cm".
        position : array_like, shape (3,), optional
            Position of B (m, world), in place of ``height``.
        pitch, roll, yaw : float or str, optional
            Attitude (rad): R = Rz(yaw) Rx(pitch) Ry(roll).
        velocity : array_like, shape (3,), optional
            Velocity of B (m/s, world).
        spin : array_like, shape (3,), optional
            Angular velocity (rad/s, body axes). ``rate`` says the same.
        bend : float or array_like, shape (m,), (2m,) or (m, 2), optional
            Bend of the segments (rad): one pitch for all, a pitch of each, or pitch and yaw of
            each. The n links of a segment take 1/n of it each. ``bends`` says the same.
        bend_rate : float or array_like, as ``bend``, optional
            Rates of these bends (rad/s).

        Returns
        -------
        State
            The state.

        Raises
        ------
        StateError
            A word is unknown, has a wrong value, or says the same as another one.

        Examples
        --------
        >>> import serpentail as st
        >>> model = st.build(tail="articulated", segments=1, links=3)  # doctest: +SKIP
        >>> start = model.state(height="30 cm", bend=["20 deg", 0])  # doctest: +SKIP
        >>> motion = st.simulate(model, start, t_span=0.4)  # doctest: +SKIP
        """
        return state_of(cast("Model", self), words)

    def neutral(self) -> State:
        """Return the state at rest, upright and straight, with B at the origin."""
        return self.state()

    def integrate(self, q: ArrayLike, v: ArrayLike, dt: ArrayLike | str) -> Array:
        """Return configurations (..., nq), quaternions of norm 1, after a time at some velocities.

        Parameters
        ----------
        q, v : array_like, shapes (..., nq) and (..., nv)
            Configurations, and velocities, whose angular part is constant in body axes.
        dt : float, str or array_like, shape (...)
            Time (s).

        Raises
        ------
        StateError
            A shape or a value is wrong, also of ``difference``.
        """
        q, v, dt = self._alike(q=q, v=v, dt=finite_array("dt", dt, unit="s")[..., None])
        after, moves = q.copy(), v * dt
        after[..., self.layout.tail_q] += moves[..., self.layout.tail_v]
        if not self.layout.fixed:
            after[..., POSITION] += moves[..., VELOCITY]
            after[..., QUATERNION] = turned(q[..., QUATERNION], moves[..., OMEGA])
        return after

    def difference(self, q: ArrayLike, q2: ArrayLike) -> Array:
        """Return the velocities (..., nv) that lead from configurations to others in 1 s.

        It is the inverse of ``integrate``: ``difference(q, integrate(q, v, dt))`` is ``v dt``, if
        that turns the torso by less than half a turn; the turn is the shortest.
        """
        first, last = self._alike(q=q, q2=q2)
        moves = np.zeros((*first.shape[:-1], self.layout.nv))
        moves[..., self.layout.tail_v] = (last - first)[..., self.layout.tail_q]
        if not self.layout.fixed:
            moves[..., VELOCITY] = (last - first)[..., POSITION]
            moves[..., OMEGA] = turn_between(first[..., QUATERNION], last[..., QUATERNION])
        return moves

    def _alike(self, **values: ArrayLike) -> tuple[Array, ...]:
        """Return finite arrays (..., size) of one batch shape, no quaternion zero."""
        arrays = {name: finite_array(name, value) for name, value in values.items()}
        for name, array in arrays.items():
            size = {"v": self.layout.nv, "dt": 1}.get(name, self.layout.nq)
            if array.shape[-1:] != (size,):
                raise StateError(f"{name} has shape {array.shape}: needs {size} numbers, or rows")
            rotates = name[0] == "q" and not self.layout.fixed
            if rotates and not array[..., QUATERNION].any(-1).all():
                raise StateError(f"{name}[3:7] is the zero quaternion: upright is (1, 0, 0, 0)")
        shapes = {name: array.shape[:-1] for name, array in arrays.items()}
        try:
            batch = np.broadcast_shapes(*shapes.values())
        except ValueError:
            raise StateError(f"numbers of rows differ: {shapes}: give as many of each") from None
        return tuple(np.broadcast_to(x, (*batch, x.shape[-1])) for x in arrays.values())
