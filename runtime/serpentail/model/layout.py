"""The layout of q, v and tau; no other place depends on it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

POSITION = slice(0, 3)  # of B in q, world (m)
QUATERNION = slice(3, 7)  # in q, (w, x, y, z)
VELOCITY = slice(0, 3)  # of B in v, world (m/s); of forces in generalised forces (N)
OMEGA = slice(3, 6)  # in v, body axes (rad/s); of moments in generalised forces (N m)
TORSO_NQ, TORSO_NV = 7, 6  # numbers of the torso in q and in v
TORSO_Q = slice(0, TORSO_NQ)  # in q
TORSO_V = slice(0, TORSO_NV)  # in v and in generalised forces
REST = np.array([0.0, 0, 0, 1, 0, 0, 0])  # place and quaternion of a fixed base
REST.setflags(write=False)
TAIL_Q, TAIL_V = slice(TORSO_NQ, None), slice(TORSO_NV, None)  # tail coordinates, and their rates
PER_SEGMENT = 2  # coordinates of a segment
# in q, of all segments: alpha, a or phi; and beta, b or theta
FIRST_Q, SECOND_Q = slice(TORSO_NQ, None, PER_SEGMENT), slice(TORSO_NQ + 1, None, PER_SEGMENT)


@dataclass(frozen=True)
class Layout:
    """The layout of a model of m segments: q (nq,), v (nv,), tau (nt,).

    fixed: the base never moves, so that q and v are those of the tail alone.
    """

    segments: int
    fixed: bool = False

    @classmethod
    def of_width(cls, nq: int) -> "Layout | None":
        """Return the layout in which q has ``nq`` numbers; None if there is none.

        With a free torso the number is odd.
        """
        fixed = nq % PER_SEGMENT == 0
        segments = (nq if fixed else nq - TORSO_NQ) // PER_SEGMENT
        return cls(segments, fixed) if segments >= fixed else None

    @property
    def nt(self) -> int:
        """Tail coordinates, and torques."""
        return PER_SEGMENT * self.segments

    @property
    def nq(self) -> int:
        """Numbers of a configuration."""
        return self.nt + (0 if self.fixed else TORSO_NQ)

    @property
    def nv(self) -> int:
        """Numbers of a velocity."""
        return self.nt + (0 if self.fixed else TORSO_NV)

    @property
    def tail_q(self) -> slice:
        """Where the tail coordinates lie in q."""
        return slice(self.nq - self.nt, None)

    @property
    def tail_v(self) -> slice:
        """Where their rates lie in v, and their forces among generalised forces."""
        return slice(self.nv - self.nt, None)

    def pose(self, q: NDArray[Any]) -> NDArray[Any]:
        """Return place and quaternion (..., 7) of the torso in configurations q (..., nq).

        A fixed base is at the world's origin, in its axes.
        """
        return np.broadcast_to(REST, (*q.shape[:-1], TORSO_NQ)) if self.fixed else q[..., TORSO_Q]

    def segment_q(self, i: int) -> slice:
        """Where the coordinates of segment i (from 0) lie in q."""
        return slice(TORSO_NQ + PER_SEGMENT * i, TORSO_NQ + PER_SEGMENT * (i + 1))

    def segment_v(self, i: int) -> slice:
        """Where the rates of segment i (from 0) lie in v."""
        return slice(TORSO_NV + PER_SEGMENT * i, TORSO_NV + PER_SEGMENT * (i + 1))
