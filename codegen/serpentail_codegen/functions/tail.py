"""The sizes of a tail, which determine the sizes of arrays and the shapes of arguments."""

from dataclasses import dataclass
from math import pi

from serpentail_scene.keys import LIMBS
from serpentail_scene.layout import PER_SEGMENT, PUSH_ON_TORSO, Sizes
from serpentail_scene.parameters import Parameter

from ..ir.program import Array, Index, Ref, padded
from ..scene.resolve import each_parameter
from ..scene.scene import Scene
from ..scene.variant import EQUAL, SegmentRun, Shape, Stretch, runs_of, stretches_of
from .layout import LOAD

SPRING = 18  # numbers of a point's linearised contact


@dataclass(frozen=True)
class Tail(Sizes):
    """Sizes of a tail of m segments.

    They have n links each; or n samples each in a continuum, bent by bend_range at most; or both in
    a "mixed" tail, whose arcs have n samples. ``shape`` says how segments and links differ.
    """

    segments: int
    links: int
    kind: str = "articulated"
    bend_range: float = 2 * pi
    polar: bool = False  # a continuum in the paper's coordinates
    contacts: tuple[str, ...] = ()  # groups of points that can touch the ground
    friction: str = "cone"
    shape: Shape = EQUAL
    passive: tuple[str, ...] = ()  # springs, damping, stops; and what limits controllers
    widths: int = 0  # of the tail in the air: of the root and of each piece; 0: no air acts
    # a tree has chains, the tail first; its segments and its shape are those of all
    branches: tuple["Tail", ...] = ()
    # of a chain besides the tail: its name, how the names of its parameters begin, whether it is
    # the mirror image of what they describe, and how many segments, coordinates and points the
    # chains before it have
    name: str = ""
    owner: str = ""
    mirrored: bool = False
    segments_before: int = 0
    coordinates_before: int = 0  # of its own sort: free ones, or prescribed ones
    points_before: int = 0
    prescribed: bool = False  # its coordinates are in `given`

    @property
    def chains(self) -> tuple["Tail", ...]:
        """Return all chains: the tail, then the others of a tree."""
        return self.branches or (self,)

    @property
    def group(self) -> str:
        """Name of the chain's points among those that can touch the ground."""
        return self.name or "tail"

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """Consecutive segments of one kind with equally many links."""
        return stretches_of(self.segments, self.links, self.kind, self.shape)

    @property
    def parts(self) -> dict[str, "Tail"]:
        """Return a chain for each set of parameters, by what begins their names."""
        return {chain.owner: chain for chain in self.chains}

    def runs(self, kind: str) -> tuple[SegmentRun, ...]:
        """Consecutive segments of one kind, links or arcs; in most tails all of them."""
        return runs_of(self.stretches, kind)

    @property
    def fixed(self) -> bool:  # type: ignore[override]
        """Tell if the torso never moves."""
        return self.shape.fixed

    @property
    def width(self) -> int:
        """Coordinates of each segment of a chain."""
        return 1 if self.kind in LIMBS else PER_SEGMENT

    @property
    def hinges(self) -> int:  # type: ignore[override]
        """Number of segments with one coordinate."""
        if self.branches:
            return sum(chain.hinges for chain in self.branches)
        return self.segments * (PER_SEGMENT - self.width)

    @property
    def given(self) -> int:  # type: ignore[override]
        """Number of prescribed coordinates."""
        if self.branches:
            return sum(chain.given for chain in self.branches)
        return self.width * self.segments * self.prescribed

    @property
    def free(self) -> int:
        """1 if the torso moves, 0 on a fixed base: a factor of shapes."""
        return 0 if self.fixed else 1

    @property
    def torso_nq(self) -> int:
        """Numbers of q before those of the tail: 7, or 0 on a fixed base."""
        return self.nq - self.nt

    @property
    def torso_nv(self) -> int:
        """Numbers of a velocity before those of the tail: 6, or 0 on a fixed base."""
        return self.nv - self.nt

    def all_q(self, q: Array) -> Ref:
        """Return all tail coordinates."""
        return q.part(self.torso_nq, self.nt)

    def all_v(self, v: Array) -> Ref:
        """Return the rates, accelerations or forces of all tail coordinates."""
        return v.part(self.torso_nv, self.nt)

    def segment_q(self, q: Array, i: Index | int) -> Ref:
        """Return the coordinates of segment i."""
        return q.part(self.torso_nq + self.coordinate(i), self.width)

    def segment_v(self, v: Array, i: Index | int) -> Ref:
        """Return the rates, accelerations or forces of segment i."""
        return v.part(self.torso_nv + self.coordinate(i), self.width)

    def segment_tau(self, tau: Array, i: Index | int) -> Ref:
        """Return the torques of segment i."""
        return tau.part(self.coordinate(i), self.width)

    def of_chain(self, array: Array, i: Index | int) -> Ref:
        """Return the part of segment i of an array with a number for each coordinate of the
        chain.
        """
        return array.part(self.width * i, self.width)

    def coordinate(self, i: Index | int) -> Index | int:
        """Return the number of the first coordinate of segment i."""
        return self.width * i + self.coordinates_before

    def coordinate_v(self, v: Array, k: Index | int) -> Ref:
        """Return the rate, acceleration or force of coordinate k of the tail, or of a chain."""
        return v.part(self.torso_nv + self.coordinates_before + k, 1)

    @property
    def total(self) -> int:
        """N = m n links or samples: tail points but the first."""
        return self.stretches[-1].points_before(self.segments)

    @property
    def pieces(self) -> int:
        """Links, and arcs."""
        return self.stretches[-1].pieces_before(self.segments)

    @property
    def tendons(self) -> int:
        """Number of tendons."""
        return len(self.shape.tendons)

    @property
    def tail_points(self) -> int:
        """Number of points of all chains: N joints and the tip of each, or the root and N samples
        of arcs.
        """
        return self.total + len(self.chains)

    @property
    def loads(self) -> int:
        """Length of f_ext: a force and a moment at B, then a force at each tail point."""
        return LOAD + 3 * self.tail_points

    @property
    def pushes(self) -> int:
        """Length of push: numbers of the torso, then a force at each tail and foot point."""
        return PUSH_ON_TORSO + 3 * self.tail_points + 18 * bool(self.leg_numbers)

    @property
    def parameter_numbers(self) -> int:
        """Number of values in the parameter struct of the C code."""
        return sum(p.size for p in struct_parameters(self))

    @property
    def elastic(self) -> bool:
        """Tell if forces depend on the tail coordinates themselves."""
        return "spring" in self.passive or "stops" in self.passive

    @property
    def groups(self) -> dict[str, int]:
        """Return the number of points in each group that can touch the ground: A, M and T of both
        feet, tail, other chains, torso.
        """
        count = {"feet": 6, "torso": 1} | {chain.group: chain.total for chain in self.chains}
        return {name: count[name] for name in self.contacts}

    @property
    def points(self) -> int:
        """Number of points that can touch the ground."""
        return sum(self.groups.values())

    @property
    def bristles(self) -> int:
        """Number of bristle deflections: x and y of each point that can touch the ground."""
        return 2 * self.points

    @property
    def leg_numbers(self) -> int:
        """Number of leg angles and their rates, 8 for both legs; 0 in scenes without feet."""
        return 8 if "feet" in self.contacts else 0

    @property
    def rates(self) -> int:
        """Number of v_dot and the rates of the bristles."""
        return self.nv + self.bristles

    @property
    def causes(self) -> int:
        """Number of all that rates depend on: q in its tangent space, v, tau, bristles, legs,
        parameters.
        """
        return 2 * self.nv + self.nt + self.bristles + self.leg_numbers + self.parameter_numbers

    @property
    def airborne_state(self) -> int:
        """Length of an airborne state: a quaternion, the tail coordinates, their rates; in air also
        the velocity of B against it, and omega.
        """
        return 4 + 2 * self.nt + 6 * bool(self.widths)

    @property
    def airborne_arguments(self) -> int:
        """Length of (x, tau): an airborne state and the torques."""
        return self.airborne_state + self.nt

    @property
    def airborne_results(self) -> int:
        """Length of y: the rates of an airborne state, then omega (3)."""
        return self.airborne_state + 3

    @property
    def weights(self) -> int:
        """Numbers that weight the Jacobian of an implicit method: with contacts one more, for the
        bound of friction.
        """
        return 2 if self.points else 1

    @property
    def factor_blocks(self) -> dict[str, tuple[int, int]]:
        """Size and count of the blocks that factoring hands to solving, S first."""
        blocks = {"S": (padded(self.nv), self.nv)}
        if self.contacts:
            blocks |= {"S_turned": (padded(self.nv), self.nv)}
        blocks |= {"H_tail": (self.nt, self.nt), "damped": (1, self.nt)}
        if self.elastic:
            blocks |= {"sprung": (1, self.nt)}
        blocks |= dict.fromkeys(["gain_q", "gain_v", "weight"], (1, 1))
        if self.contacts:
            blocks |= {"R": (9, 1), "relax": (1, 1), "depth": (1, self.points)}
            blocks |= {"arm": (3, self.points), "spring": (SPRING, self.points)}
            points = self.groups
            blocks |= {f"J_{c.group}": (3 * c.nt, points.get(c.group, 0)) for c in self.chains}
        return blocks

    @property
    def factors(self) -> int:
        """Numbers that factoring hands to solving."""
        return sum(size * count for size, count in self.factor_blocks.values())

    @property
    def rotational(self) -> int:
        """Rows of H without translation: those of the tail alone on a fixed base."""
        return 3 * self.free + self.nt

    @property
    def rotational_row(self) -> int:
        """Reals from one row of H without translation to the next."""
        return padded(self.rotational)


def struct_parameters(model: Tail | Scene) -> tuple[Parameter, ...]:
    """Return the parameters that the functions of a model read: the fields of its struct."""
    return tuple(p for _, p in each_parameter(model) if not p.name.endswith("link_radius"))
