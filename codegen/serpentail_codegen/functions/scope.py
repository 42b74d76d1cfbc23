"""Vectors that belong together, under the names by which steps read them.

A sweep passes scopes instead of single vectors; a step takes from a scope the vectors that it
declares.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY

from ..ir.program import Array, Index, Ref
from .layout import block
from .tail import Tail


class Scope:
    """Named vectors; ``**scope`` passes all of them on."""

    def vectors(self) -> Mapping[str, Ref]:
        """Return the vectors by their names."""
        raise NotImplementedError

    def keys(self) -> Iterable[str]:
        """Return the names."""
        return self.vectors().keys()

    def __getitem__(self, name: str) -> Ref:
        return self.vectors()[name]


@dataclass(frozen=True)
class Vectors(Scope):
    """Vectors of any names."""

    named: Mapping[str, Ref]

    def vectors(self) -> Mapping[str, Ref]:
        """Return the vectors by their names."""
        return self.named

    def only(self, *names: str) -> "Vectors":
        """Return some of the vectors."""
        return Vectors({name: self.named[name] for name in names})


class Instead(Vectors):
    """Vectors that replace the parameters of the same names; only this scope may do so."""


class Fields(Scope):
    """A scope whose vectors are the fields of a dataclass."""

    def vectors(self) -> Mapping[str, Ref]:
        """Return the vectors by their names."""
        return vars(self)


@dataclass(frozen=True)
class Pose(Fields):
    """The attitude and the origin of a frame."""

    R: Ref
    P: Ref


@dataclass(frozen=True)
class Motion(Fields):
    """Angular velocity of a frame, its rate, and the acceleration of the frame's origin; ``u``: its
    velocity against the air, if any acts.
    """

    w: Ref
    w_dot: Ref
    a: Ref
    u: Ref | None = None

    def vectors(self) -> Mapping[str, Ref]:
        """Return the vectors by their names."""
        return {name: ref for name, ref in vars(self).items() if ref}


@dataclass(frozen=True)
class Torso(Fields):
    """The torso in the world: attitude, position, velocity and angular velocity (body axes)."""

    R: Ref
    p: Ref
    p_dot: Ref
    omega: Ref


@dataclass(frozen=True)
class State:
    """The arguments q and v of a function; v is missing if the function does not use it.

    still: zeros in place of what a fixed base does not have: it rests at the world's origin. given:
    angles, rates and accelerations of prescribed joints, if there are any.
    """

    tail: Tail
    q: Array
    v: Array | None = None
    still: Ref | None = None
    given: Array | None = None

    @property
    def quaternion(self) -> Ref:
        """Attitude of a torso that moves."""
        return block(self.q, QUATERNION)

    @property
    def position(self) -> Ref:
        """Position of B."""
        return self.still or block(self.q, POSITION)

    @property
    def velocity(self) -> Ref:
        """Velocity of B."""
        return self.still or block(self._v, VELOCITY)

    @property
    def omega(self) -> Ref:
        """Angular velocity of the torso."""
        return self.still or block(self._v, OMEGA)

    @property
    def _v(self) -> Array:
        if self.v is None:
            raise ValueError("this function has no v among its arguments")
        return self.v

    def on(self, chain: Tail) -> "State":
        """Return the same state, whose segments are those of a chain."""
        return replace(self, tail=chain)

    def torso(self, R: Ref) -> Torso:
        """Return the vectors of the torso; R is its attitude."""
        return Torso(R, self.position, self.velocity, self.omega)

    def angles(self, i: Index | int) -> Ref:
        """Return the coordinates of segment i."""
        return self._given(0, i) or self.tail.segment_q(self.q, i)

    def rates(self, i: Index | int) -> Ref:
        """Return the rates of the coordinates of segment i."""
        return self._given(1, i) or self.tail.segment_v(self._v, i)

    def accelerations(self, i: Index | int, v_dot: Array | None) -> Ref | None:
        """Return the accelerations of the coordinates of segment i; None if there are none."""
        return self._given(2, i) or (self.tail.segment_v(v_dot, i) if v_dot else None)

    def _given(self, order: int, i: Index | int) -> Ref | None:
        """Return angles, rates or accelerations of a segment that is prescribed."""
        if self.given is None or not self.tail.prescribed:
            return None
        first = order * (self.given.length // 3)
        return self.given.part(self.tail.coordinate(i) + first, self.tail.width)
