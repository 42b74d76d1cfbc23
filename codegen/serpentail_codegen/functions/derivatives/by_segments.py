"""Derivatives of v_dot of a long tail, segment by segment: the work grows with m^2.

Each segment's pieces are differentiated along 7 directions only, whatever m is: omega of the
segment's base, and its own coordinates and rates. The effect of accelerations is known from its
inertia. One sweep carries the motion out along the tail. A second sweep carries loads back to the
torso and eliminates the coordinates. A last one outward gives the accelerations that balance these
loads. A lane is a direction: the rotation of the torso, coordinates and rates of all segments, then
all torques.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, VELOCITY
from serpentail_scene.signatures.arguments import V_DOT, Argument, Q, V

from ...autodiff.forward import tangent_program
from ...autodiff.step import tangent
from ...ir.program import Array, Index, Ref
from ...mechanics import mount, rotations, segment_slopes, torso, translation
from ...mechanics.lower import derive
from ..draft import Draft
from ..function import Function, assemble
from ..layout import block, coordinate
from ..passive import add_passive_forces, net_torques
from ..scope import Motion, Vectors
from ..sweeps.pieces import across, each_segment, mechanism, pieces_of
from ..sweeps.segments import Freed, forward_dynamics
from ..tails.mechanism import Wrenches
from .directions import Directions

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
    slopes = segment_slopes_of(draft, motion, q=arrays["q"], v=arrays["v"], v_dot=v_dot)

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


def assemble_segment_loads(draft: Draft, arrays: dict[str, Array]) -> None:
    """Motions of the tips of all segments, and wrenches and torques at their bases.

    Between two segments all passes through ``base`` and ``beyond``: tangents that are cut there are
    those of each segment alone.
    """
    tail, state, v_dot = draft.tail, draft.state(arrays["q"], arrays["v"]), arrays["v_dot"]
    segments = mechanism(draft).prepare(draft, state, False)
    wrench = draft.array("wrench", 6, tail.pieces)
    wrenches = Wrenches(wrench, mechanism(draft).declare_torques(draft))

    # from the mount to the tip
    bases, here = draft.array("base", 9, tail.segments), draft.array("here", 9)
    motion = Motion(*(here.part(3 * k, 3) for k in range(3)))
    draft.copy(here[0], arrays["start"][0])
    for stretch, i in each_segment(draft):
        draft.copy(bases[i], here[0])
        draft.copy(here[0], bases[i])
        with pieces_of(draft, stretch, i) as g:
            mechanism(draft).move(draft, segments, (i, g), motion, v_dot, wrenches.at(i, g))
        draft.copy(arrays["tips"].part(9 * i, 9), here[0])

    # from the tip to the mount
    beyond, total = draft.vector("beyond", 6), draft.vectors(F_next=6)
    draft.fill(total["F_next"], 0)
    for stretch, i in each_segment(draft, downward=True):
        torque = arrays["loads"].part(FORCES * i + 6, PER_SEGMENT)
        draft.copy(beyond, total["F_next"])
        draft.copy(total["F_next"], beyond)
        draft.fill(torque, 0)
        with pieces_of(draft, stretch, i, downward=True) as g:
            reads = segments.at(i, g), wrenches.at(i, g), total
            draft.step(mechanism(draft).gather_wrench, *reads, **total, torque_=torque)
        draft.copy(arrays["loads"].part(FORCES * i, 6), total["F_next"])
    add_passive_forces(draft, state, lambda i: arrays["loads"].part(FORCES * i + 6, PER_SEGMENT))


SEGMENT_LOADS = Function(
    "segment_loads",
    "motions of the tips of all segments, and wrenches and torques at their bases",
    (Q, V, V_DOT, Argument("start", (9,), "w, w_dot and a of the tail's root")),
    (
        Argument("tips", ("segments", 9), "w, w_dot and a of the tips"),
        Argument("loads", ("segments", FORCES), "wrenches at the bases, and torques"),
    ),
    assemble_segment_loads,
)


def segment_slopes_of(draft: Draft, torso_motion: Motion, **arguments: Array) -> SegmentSlopes:
    """Differentiate every segment; the directions of each are in the same lanes.

    The base of the first one has the axes of the torso. arguments: q, v and v_dot.
    """
    tail, start = draft.tail, draft.array("start", 9)
    root = Motion(*(start.part(3 * k, 3) for k in range(3)))
    draft.copy(root.w, torso_motion.w)
    draft.copy(root.w_dot, torso_motion.w_dot)
    draft.step(torso.mount_acceleration, torso_motion, a_mount=root.a)
    across(draft, mount.motion_at_root, root.vectors())

    # directions
    sizes = {"q": tail.nq, "v": tail.nv, "base": 9 * tail.segments}
    own = {name: draft.wide(f"d_{name}_own", size, OWN) for name, size in sizes.items()}
    draft.fill(own["base"].whole(), 0)
    with draft.loop("i", tail.segments) as i:
        draft.unit(own["base"].part(9 * i, 3), 0)
        draft.unit(tail.segment_q(own["q"], i), ANGLES)
        draft.unit(tail.segment_v(own["v"], i), RATES)
    across(draft, mount.velocity_at_root, w=own["base"].part(0, 3))

    # slopes
    inner = tangent_program(assemble(SEGMENT_LOADS, tail), tuple(own), OWN, cut=("base", "beyond"))
    arguments |= {f"d_{name}": array for name, array in own.items()}
    tip = draft.wide("tip", 9 * tail.segments, OWN)
    force = draft.wide("force", FORCES * tail.segments, OWN)
    draft.call(inner, start=start, **arguments, d_tips=tip, d_loads=force)
    across(draft, mount.wrench_at_mount, F_next=force.part(0, 6))
    return SegmentSlopes(tip, force)


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
