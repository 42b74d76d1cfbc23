"""Accelerations and virtual velocities in torso axes, where nothing depends on the attitude.

It also has the effect of a rotation of the torso on them.
"""

from dataclasses import dataclass

from serpentail_scene.layout import VELOCITY

from ...ir.program import Array, Ref
from ...mechanics import rotation_derivatives as turns
from ...mechanics import torso
from ..draft import Draft
from ..layout import block
from ..scope import Vectors
from ..sweeps.pieces import attitude


@dataclass(frozen=True)
class TorsoAxes:
    """Attitude, ``a`` = R^T (p_b_ddot + g z), and ``u``, the virtual velocity of B."""

    R: Ref
    a: Array
    u: Array

    def arrays(self) -> dict[str, Array]:
        """Return both vectors as arrays."""
        return {"a": self.a, "u": self.u}

    def vectors(self, **others: Ref) -> Vectors:
        """Return both vectors and others."""
        return Vectors({name: array[0] for name, array in self.arrays().items()} | others)


def torso_axes(
    draft: Draft, q: Array, v_dot: Array, multiplier: Array, R: Ref | None = None
) -> TorsoAxes:
    """Turn an acceleration and a virtual velocity into torso axes."""
    R = R or attitude(draft, draft.state(q))
    axes = TorsoAxes(R, acceleration_at(draft, R, v_dot), draft.array("body_multiplier", 3))
    p_dot = {"R": R, "p_dot": block(multiplier, VELOCITY)}
    draft.step(torso.torso_velocity, p_dot, u=axes.u[0])
    return axes


def acceleration_at(draft: Draft, R: Ref, v_dot: Array) -> Array:
    """Return R^T (p_b_ddot + g z)."""
    a = draft.array("body_acceleration", 3)
    reads = {"R": R, "p_ddot": draft.of_torso(v_dot, VELOCITY)}
    draft.step(torso.torso_acceleration, reads, a=a[0])
    return a


def turned_back(draft: Draft, vector: Array, turn: Ref) -> Array:
    """Return the change, in torso axes, of a vector that is constant in the world while the torso
    rotates, in all lanes.
    """
    change = draft.wide(f"d_{vector.name}", 3, turn.lanes)
    draft.step(turns.turned_back, {"vector": vector[0], "turn": turn}, change=change[0])
    return change
