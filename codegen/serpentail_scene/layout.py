"""The layout of q, v and tau, and of contact points; no other place depends on it.

A velocity, its derivative, a generalised force and a row of H have the same layout.
"""

from dataclasses import dataclass, field
from itertools import accumulate, chain

from .messages import did_you_mean, shown

POSITION = slice(0, 3)  # of B in q, world (m)
QUATERNION = slice(3, 7)  # in q, (w, x, y, z)
VELOCITY = slice(0, 3)  # of B in v, world (m/s); of forces in generalised forces (N)
OMEGA = slice(3, 6)  # in v, body axes (rad/s); of moments in generalised forces (N m)
TORSO_NQ, TORSO_NV = 7, 6  # numbers of the torso in q and in v
TORSO_Q = slice(0, TORSO_NQ)  # in q
TORSO_V = slice(0, TORSO_NV)  # in v and in generalised forces
TAIL_Q, TAIL_V = slice(TORSO_NQ, None), slice(TORSO_NV, None)  # tail coordinates, and their rates
PER_SEGMENT = 2  # coordinates of a segment; of one that is a hinge there is one
PUSH_ON_TORSO = 12  # numbers of `push`: the sum of the torso's forces, that of places times forces
# in q, of all segments: alpha, a or phi; and beta, b or theta
FIRST_Q, SECOND_Q = slice(TORSO_NQ, None, PER_SEGMENT), slice(TORSO_NQ + 1, None, PER_SEGMENT)


class Sizes:
    """The sizes of a model of m segments: q (nq,), v (nv,), tau (nt,).

    fixed: the base never moves, so that q and v are those of the tail alone. hinges: how many
    segments have one coordinate. given: how many coordinates are prescribed; they are not in q.
    """

    segments: int
    fixed: bool
    hinges: int
    given: int

    @property
    def nt(self) -> int:
        """Number of tail coordinates and of torques: two for a segment, one for a hinge."""
        return PER_SEGMENT * self.segments - self.hinges - self.given

    @property
    def nq(self) -> int:
        """Length of q, 7 + nt; with a fixed base nt, the tail coordinates alone."""
        return self.nt + (0 if self.fixed else TORSO_NQ)

    @property
    def nv(self) -> int:
        """Length of v, 6 + nt; with a fixed base nt, the rates of the tail coordinates alone."""
        return self.nt + (0 if self.fixed else TORSO_NV)


@dataclass(frozen=True)
class ChainLayout:
    """Where the numbers of one chain lie: in q, v and tau; its segments, and its points among all
    tail points.

    owner: the beginning of the names of its parameters; a mirrored chain is their mirror image.
    names: of its coordinates; driven: whether each has an actuator; given: names of prescribed
    coordinates, which are in none of q, v and tau.
    """

    name: str
    owner: str
    mirrored: bool
    q: slice
    v: slice
    tau: slice
    segments: slice
    points: slice
    names: tuple[str, ...]
    driven: tuple[bool, ...]
    given: tuple[str, ...] = ()


@dataclass(frozen=True)
class Layout(Sizes):
    """Where numbers lie in q, v and tau; ``layout["hind_left"]`` is that of one chain.

    chains: those of a model, the tail first. hinges: how many segments have one coordinate.
    tendons: their names. given: how many coordinates are prescribed.
    """

    segments: int
    fixed: bool = False
    chains: tuple[ChainLayout, ...] = field(default=(), compare=False)
    hinges: int = 0
    tendons: tuple[str, ...] = field(default=(), compare=False)
    given: int = 0

    @property
    def widths(self) -> tuple[int, ...]:
        """The number of coordinates of each segment."""
        each = [(c.tau, c.segments.stop - c.segments.start) for c in self.chains]
        runs = [((tau.stop - tau.start) // count,) * count for tau, count in each if count]
        return tuple(chain.from_iterable(runs)) or (PER_SEGMENT,) * self.segments

    @property
    def firsts(self) -> list[int]:
        """The number of the first coordinate of each segment."""
        return list(accumulate(self.widths, initial=0))[:-1]

    @property
    def driven(self) -> tuple[bool, ...]:
        """Whether each tail coordinate has an actuator."""
        return tuple(chain.from_iterable(c.driven for c in self.chains)) or (True,) * self.nt

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the tail coordinates; empty if the layout does not know its chains."""
        return tuple(chain.from_iterable(c.names for c in self.chains))

    @property
    def owners(self) -> list[str]:
        """What the names of the parameters of each tail coordinate begin with; see ``chains``."""
        return [c.owner for c in self.chains for _ in c.names]

    def __getitem__(self, name: str) -> ChainLayout:
        found = {own.name: own for own in self.chains}
        if name not in found:
            remedy = did_you_mean(name, found) or f"there are {', '.join(found)}"
            raise KeyError(f"chain: value {shown(name)}: {remedy}")
        return found[name]

    @classmethod
    def of_width(cls, nq: int, nv: int = 0) -> "Layout | None":
        """Return the layout in which q has ``nq`` numbers and v ``nv``; None if there is none.

        With a free torso q is longer than v; where nv is not known, nq is odd unless the base is
        fixed.
        """
        fixed = nq % PER_SEGMENT == 0 and nv != nq - 1
        nt = nq if fixed else nq - TORSO_NQ
        hinges = nt % PER_SEGMENT
        return cls((nt + hinges) // PER_SEGMENT, fixed, (), hinges) if nt >= fixed else None

    @property
    def tail_q(self) -> slice:
        """Where the tail coordinates lie in q."""
        return slice(self.nq - self.nt, None)

    @property
    def tail_v(self) -> slice:
        """Where their rates lie in v, and their forces among generalised forces."""
        return slice(self.nv - self.nt, None)
