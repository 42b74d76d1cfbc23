"""Methods of a model that name, make, move and compare states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY, Layout

from ..basics.attitude import turn_between, turned
from ..basics.checks import finite_array
from ..basics.errors import StateError
from .functions import Array
from .lazy import lazy_property
from .names import Names
from .parameters import total_mass
from .state import State, state_of

if TYPE_CHECKING:
    from .model import Model


class ModelStates:
    """Names of the numbers of a state, states by words, and the manifold on which they lie."""

    layout: Layout
    parameters: Mapping[str, Any]

    @lazy_property
    def names(self) -> Names:
        """Name and unit of each number of q, v and tau."""
        return Names.of(self.layout, cast("Model", self))

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

    def state(self, **words: Any) -> State:
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
        """Return the state at rest, upright and straight, with B at the origin.

        Returns
        -------
        State
            The state.
        """
        return self.state()

    def integrate(self, q: ArrayLike, v: ArrayLike, dt: ArrayLike) -> Array:
        """Move a configuration with a constant velocity for a time.

        Parameters
        ----------
        q, v : array_like, shapes (..., nq) and (..., nv)
            Configurations and velocities; the angular velocity is constant in body axes.
        dt : float, str or array_like, shape (...)
            Time (s).

        Returns
        -------
        ndarray, shape (..., nq)
            Configurations, whose quaternions have norm 1.

        Raises
        ------
        StateError
            A shape or a value is wrong.
        """
        q, v = self._on_manifold("q", q, self.layout.nq), self._on_manifold("v", v, self.layout.nv)
        moves = v * finite_array("dt", dt, unit="s")[..., None]
        q, moves = _alike(q, moves)
        after = q.copy()
        after[..., self.layout.tail_q] += moves[..., self.layout.tail_v]
        if not self.layout.fixed:
            after[..., POSITION] += moves[..., VELOCITY]
            after[..., QUATERNION] = turned(q[..., QUATERNION], moves[..., OMEGA])
        return after

    def difference(self, q: ArrayLike, q2: ArrayLike) -> Array:
        """Compute the velocity that leads from one configuration to another in 1 s.

        It is the inverse of ``integrate``: ``difference(q, integrate(q, v, dt))`` is ``v dt``, if
        that turns the torso by less than half a turn.

        Parameters
        ----------
        q, q2 : array_like, shape (..., nq)
            Configurations.

        Returns
        -------
        ndarray, shape (..., nv)
            Differences of position (m, world), the shortest turn (rad, body axes), and differences
            of the tail coordinates (rad).

        Raises
        ------
        StateError
            A shape or a value is wrong.
        """
        first, last = _alike(
            *(self._on_manifold(name, x, self.layout.nq) for name, x in (("q", q), ("q2", q2)))
        )
        moves = np.zeros((*first.shape[:-1], self.layout.nv))
        moves[..., self.layout.tail_v] = (last - first)[..., self.layout.tail_q]
        if not self.layout.fixed:
            moves[..., VELOCITY] = (last - first)[..., POSITION]
            moves[..., OMEGA] = turn_between(first[..., QUATERNION], last[..., QUATERNION])
        return moves

    def _on_manifold(self, name: str, value: ArrayLike, size: int) -> Array:
        """Return finite numbers (..., size), no quaternion zero; StateError otherwise."""
        array = finite_array(name, value)
        if array.shape[-1:] != (size,):
            raise StateError(
                f"{name} has shape {array.shape}: needs {size} numbers, or rows of them"
            )
        if (
            size == self.layout.nq
            and not self.layout.fixed
            and not array[..., QUATERNION].any(-1).all()
        ):
            raise StateError(f"{name}[3:7] is the zero quaternion: upright is (1, 0, 0, 0)")
        return array


def _alike(a: Array, b: Array) -> tuple[Array, Array]:
    """Return arrays (..., n) and (..., k) of one batch shape."""
    try:
        batch = np.broadcast_shapes(a.shape[:-1], b.shape[:-1])
    except ValueError:
        raise StateError(
            f"shapes {a.shape} and {b.shape} differ: give as many rows of both"
        ) from None
    return np.broadcast_to(a, (*batch, a.shape[-1])), np.broadcast_to(b, (*batch, b.shape[-1]))
