"""Derivatives of v_dot of a long tail, segment by segment: the work grows with m^2.

Each segment's links are differentiated along 7 directions only, whatever m is: omega of the
segment's base, and its own coordinates and rates. The effect of accelerations is known from its
inertia. One sweep carries the motion out along the tail. A second sweep carries loads back to the
torso and eliminates the coordinates. A last one outward gives the accelerations that balance these
loads. A lane is a direction: the rotation of the torso, coordinates and rates of all segments, then
all torques.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, VELOCITY
from serpentail_scene.signatures.arguments import V_DOT, Argument, Q, V

from ...autodiff.angles import SinesAndCosines, sines_and_cosines_of
from ...autodiff.step import tangent
from ...ir.program import Array, Index, Ref
from ...ir.step import Step
from ...mechanics import link, rotations, segment_slopes, torso, translation
from ...mechanics.lower import derive
from ..draft import Draft
from ..function import Function, assemble
from ..layout import block, coordinate
from ..passive import add_passive_slopes, net_torques
from ..scope import Motion, Vectors
from ..sweeps.pieces import mechanism
from ..sweeps.segments import Freed, forward_dynamics
from ..tails.mechanism import Segments
from .directions import Directions

CARRIED = ("w", "w_dot", "a")
# lanes of a segment's own directions: omega of its base, angles, rates
ANGLES, RATES, OWN = 3, 5, 7
FORCES = 6 + PER_SEGMENT  # wrench at the base, torques


@dataclass(frozen=True)
class SegmentSlopes:
    """Derivatives of every segment along its own directions: motion of the tip, wrench and
    torques.
    """

    tip: Array
    force: Array

    @classmethod
    def declared(cls, draft: Draft, role: str) -> "SegmentSlopes":
        """Declare the arrays."""
        sizes = {"tip": 9 * draft.tail.segments, "force": FORCES * draft.tail.segments}
        return cls(*(draft.declare(Array(n, role, s, lanes=OWN)) for n, s in sizes.items()))

    def torque(self, i: Index) -> Ref:
        """Slopes of the torques of segment i."""
        return self.force.part(FORCES * i + 6, PER_SEGMENT)

    def by_omega(self, i: Index) -> dict[str, Ref]:
        """Slopes by omega of the base: of w_dot and a of the tip, and of the wrench and the
        torques.
        """
        rows = {f"tip_{r}": self.tip.lane(9 * i + 3 + r, 0, 3) for r in range(6)}
        return rows | {f"force_{r}": self.force.lane(FORCES * i + r, 0, 3) for r in range(FORCES)}


def derivatives_by_segments(draft: Draft, arrays: dict[str, Array]) -> None:
    """Jacobians of v_dot by q, v and tau."""
    tail, nv = draft.tail, draft.tail.nv
    state, v_dot = draft.state(arrays["q"], arrays["v"]), draft.array("acceleration", nv)
    unloaded = draft.constant("unloaded", [0] * 6)
    torques = net_torques(draft, state, arrays["tau"])
    freed = forward_dynamics(draft, state, unloaded, torques, v_dot, again=True)

    # the torso accelerates by R^T (p_b_ddot + g z)
    reads = {"R": freed.R, "p_ddot": block(v_dot, VELOCITY)}
    a = draft.vector("a_torso", 3)
    draft.step(torso.torso_acceleration, reads, a=a)
    motion = Motion(state.omega, block(v_dot, OMEGA), a)
    slopes = SegmentSlopes.declared(draft, "local")
    arguments = {"q": arrays["q"], "v": arrays["v"], "v_dot": v_dot, "a_torso": a.array}
    draft.call(assemble(SLOPES, tail), tip=slopes.tip, force=slopes.force, **arguments)

    directions = Directions(tail, ("omega",))
    lanes = directions.count + tail.nt
    x = draft.wide("x", nv, lanes)
    Changes(draft, directions, slopes, freed, lanes).solve(motion, x)
    directions.spread(draft, x, arrays["dq"], arrays["dv"])
    with draft.loop("row", nv) as r:
        taus = x.lane(r, directions.count, tail.nt)
        draft.copy(arrays["dtau"].part(tail.nt * r, tail.nt), taus)

    # how p_b_ddot moves with a rotation of the torso
    turned = {f"row_{r}": arrays["dq"].part(nv * r + OMEGA.start, 3) for r in range(3)}
    draft.step(translation.turned_acceleration, {"R": freed.R, "a": a}, **turned)


# ---- one segment ---------------------------------------------------------------------------------


def moved(function, *active: str) -> Step:
    """Return a step with its tangents by some inputs, and by the joint's angles."""
    step = derive(function)
    kind = sines_and_cosines_of(derive(link.joint_trigonometry))
    assert isinstance(kind, SinesAndCosines), "a joint is sines and cosines"
    angles = frozenset({("joint", kind)} if "joint" in dict(step.inputs) else ())
    return tangent(step, frozenset({*active, *(name for name, _ in angles)}), angles)


@dataclass(frozen=True)
class LinkTangents:
    """Differentiates the links of every segment: their wrenches along all of its own directions."""

    draft: Draft
    segments: Segments
    slopes: SegmentSlopes
    wrench: Array
    d_wrench: Array
    own: dict[str, Ref]

    def outward(self, start: Motion, v_dot: Array) -> None:
        """Carry the motion to the tip, link by link; its tangents begin anew in every segment."""
        draft, n = self.draft, self.draft.tail.links
        here, joint = draft.vectors(**dict.fromkeys(CARRIED, 3)), draft.vectors(a_joint=3, swing=3)
        d_here, d_joint = (
            Vectors({f"d_{k}": draft.wide(f"d_{k}", 3, OWN)[0] for k in scope.named})
            for scope in (here, joint)
        )
        draft.copy(here["w"], start.w)
        draft.copy(here["w_dot"], start.w_dot)
        draft.step(torso.mount_acceleration, start, a_mount=here["a"])
        move = moved(link.link_motion, *CARRIED, "rates")
        weigh = moved(link.link_wrench, "w", "w_dot", *joint.named)
        turning = {"d_joint_angles": self.own["angles"], "d_rates": self.own["rates"]}
        with draft.loop("i", draft.tail.segments) as i:
            draft.copy(d_here["d_w"], self.own["w"])
            for name in ("d_w_dot", "d_a"):
                draft.fill(d_here[name], 0)
            with draft.loop("j", n) as j:
                piece, rates = self.segments.at(i), self.segments.motion(i, v_dot)
                writes = {**here, **d_here, **joint, **d_joint}
                draft.step(move, piece, rates, here, d_here, turning, **writes)
                writes = {
                    "F": self.wrench[n * i + j],
                    "d_F": self.d_wrench.part(6 * (n * i + j), 6),
                }
                draft.step(weigh, piece, here, d_here, joint, d_joint, **writes)
            for k, ref in enumerate(d_here.named.values()):
                draft.copy(self.slopes.tip.part(9 * i + 3 * k, 3), ref)

    def inward(self) -> None:
        """Sum the wrenches to the base, with those of all links beyond."""
        draft, n, force = self.draft, self.draft.tail.links, self.slopes.force
        total = {"F_next": draft.vector("F_next", 6)}
        total["d_F_next"] = d_total = draft.wide("d_F_next", 6, OWN)[0]
        draft.fill(total["F_next"], 0)
        gather = moved(link.gather_wrench, "F", "F_next")
        with draft.loop("i", draft.tail.segments, downward=True) as i:
            d_torque = self.slopes.torque(i)
            draft.fill(d_total, 0)
            draft.fill(d_torque, 0)
            with draft.loop("j", n, downward=True) as j:
                loads = {"F": self.wrench[n * i + j], "d_F": self.d_wrench.part(6 * (n * i + j), 6)}
                loads["d_joint_angles"] = self.own["angles"]
                piece = self.segments.at(i)
                draft.step(gather, piece, Vectors(total), loads, **total, d_torque_=d_torque)
            draft.copy(force.part(FORCES * i, 6), d_total)


def assemble_segment_slopes(draft: Draft, arrays: dict[str, Array]) -> None:
    """Slopes of every segment by its own directions, link by link."""
    state, v_dot, total = draft.state(arrays["q"], arrays["v"]), arrays["v_dot"], draft.tail.total
    segments = mechanism(draft).prepare(draft, state, False)
    slopes = SegmentSlopes.declared(draft, "output")
    wrench, d_wrench = draft.array("wrench", 6, total), draft.wide("d_wrench", 6 * total, OWN)

    # directions of a segment's own: omega of its base, angles, rates
    own = {}
    for name, first in (("w", 0), ("angles", ANGLES), ("rates", RATES)):
        own[name] = draft.wide(f"d_{name}_own", 3 if name == "w" else PER_SEGMENT, OWN)[0]
        draft.unit(own[name], first)
    links = LinkTangents(draft, segments, slopes, wrench, d_wrench, own)
    links.outward(Motion(state.omega, block(v_dot, OMEGA), arrays["a_torso"][0]), v_dot)
    links.inward()
    add_passive_slopes(draft, state, own, slopes.torque)


SLOPES = Function(
    "segment_slopes",
    "how each segment answers to the motion of its base, its coordinates and rates",
    (Q, V, V_DOT, Argument("a_torso", (3,), "acceleration of B less gravity, torso axes")),
    (),
    assemble_segment_slopes,
)


# ---- all segments --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Changes:
    """Carries changes of the state along the tail, a lane for each direction."""

    draft: Draft
    directions: Directions
    slopes: SegmentSlopes
    freed: Freed
    lanes: int

    def solve(self, start: Motion, x: Array) -> None:
        """Fill ``x`` with the changes of v_dot, p_b_ddot in world axes."""
        draft, passes = self.draft, self.freed.passes
        loads = self._outward(start)
        omega = draft.wide("d_omega", 3, self.lanes)[0]
        draft.unit(omega, 0)
        free = draft.wide("free", PER_SEGMENT * draft.tail.segments, self.lanes)
        wrench = self._inward(loads, free)

        # the torso, its coordinates free
        at_torso = {name: draft.wide(name, 3, self.lanes)[0] for name in ("d_force", "d_moment")}
        step = tangent(derive(torso.torso_wrench), frozenset({"w", "F_next"}))
        none = {"F_next": draft.zero(6)}
        draft.step(step, start, none, {"d_w": omega, "d_F_next": wrench}, **at_torso)
        response = draft.wide("response", 6, self.lanes)[0]
        load = {"force": at_torso["d_force"], "moment": at_torso["d_moment"]}
        draft.step(segment_slopes.accelerating_load, load, rhs=response)
        draft.solve(self.freed.H, response)
        draft.copy(block(x, OMEGA), response.array.part(0, 3))
        reads = {"R": self.freed.R, "vector": response.array.part(3, 3)}
        draft.step(rotations.world_vector, reads, vector=block(x, VELOCITY))

        # out to the tip
        base = draft.wide("base_response", 6, self.lanes)[0]
        draft.step(segment_slopes.mount_response, {"response": response}, base=base)
        with draft.loop("i", draft.tail.segments) as i:
            reads = self.freed.elimination(i) | {"base": base}
            reads["free"] = free.part(PER_SEGMENT * i, PER_SEGMENT)
            writes = {"accelerations": draft.tail.segment_v(x, i), "base": base}
            draft.step(segment_slopes.responding, passes.tip_of(i), reads, **writes)

    def _outward(self, start: Motion) -> Array:
        """Carry the motion to the tip at fixed second derivatives; return the loads it requires."""
        draft, directions = self.draft, self.directions
        motion = draft.wide("d_motion", 9, self.lanes)
        loads = draft.wide("d_loads", FORCES * draft.tail.segments, self.lanes)
        draft.fill(motion.part(3, 6), 0)
        draft.unit(motion.part(0, 3), 0)
        step = tangent(derive(torso.mount_acceleration), frozenset({"w"}))
        draft.step(step, start, {"d_w": motion.part(0, 3)}, d_a_mount=motion.part(6, 3))
        with draft.loop("i", draft.tail.segments) as i:
            slopes = Vectors(self.slopes.by_omega(i) | self.freed.own(i))
            load, reads = loads.part(FORCES * i, FORCES), {"motion": motion[0]}
            # the lanes of the segment itself are still zero; they are copied afterwards
            with draft.first_lanes(directions.of_q(i + 1)):
                draft.step(segment_slopes.change_at_base, reads, slopes, change=load)
                draft.step(segment_slopes.change_at_tip, reads, slopes, motion=motion[0])
            for rows, count, target, first in (
                (self.slopes.force, FORCES, loads, FORCES * i),
                (self.slopes.tip, 9, motion, Index()),
            ):
                with draft.loop("r", count) as r:
                    lane = target.lane(first + r, directions.of_q(i), 2 * PER_SEGMENT)
                    draft.copy(lane, rows.lane(count * i + r, ANGLES, 2 * PER_SEGMENT))
        return loads

    def _inward(self, loads: Array, free: Array) -> Ref:
        """Carry loads to the mount, with coordinates eliminated; return what acts at the mount."""
        draft, directions, passes = self.draft, self.directions, self.freed.passes
        wrench = draft.wide("d_wrench_base", 6, self.lanes)[0]
        change = draft.wide("d_change", FORCES, self.lanes)[0]
        draft.fill(wrench, 0)
        minus = draft.fixed("minus", [-1])
        with draft.loop("i", draft.tail.segments, downward=True) as i:
            step = segment_slopes.change_from_tip
            draft.step(step, passes.tip_of(i), {"wrench": wrench}, change=change)
            with draft.first_lanes(directions.of_q(i + 1)):
                own = {"own": loads.part(FORCES * i, FORCES)}
                draft.step(segment_slopes.with_own, {"change": change}, own, change=change)
            for c in range(PER_SEGMENT):
                lane = coordinate(i, c) + directions.count
                draft.copy(change.array.lane(6 + c, lane), minus)
            reads = {"change": change, "shares": passes.elimination[i]}
            writes = {"wrench": wrench, "free": free.part(PER_SEGMENT * i, PER_SEGMENT)}
            draft.step(segment_slopes.freed_change, reads, **writes)
        return wrench
