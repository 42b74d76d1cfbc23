"""Sweeps of wrenches: motion from the torso to the tip, forces back, and their power."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from serpentail_scene.layout import OMEGA, VELOCITY

from ...ir.program import Array, Index, Ref
from ...mechanics import air, branch, mount, torso
from ..draft import Draft
from ..layout import block
from ..scope import Motion, State, Vectors
from ..tails.mechanism import Segments, Wrenches
from .chains import add, on_each, seen, seen_virtually
from .pieces import across, attitude, each_piece, each_segment, mechanism, pieces_of


def forward_wrenches(
    draft: Draft, segments: Segments, start: Motion, v_dot: Array | None
) -> Wrenches:
    """Velocities and accelerations to the tip, and the inertial wrench of every piece (Eqs. A1 to
    A12, 17, 19).

    ``start`` is the torso's motion; ``v_dot`` None means that the tail does not accelerate. Of a
    torso that moves against the air, the wrenches are less those of the air.
    """
    wrench = draft.array("wrench", 6, draft.tail.pieces)
    motion = Motion(*(draft.vector(f"{name}_here", 3) for name in ("w", "w_dot", "a")))
    draft.copy(motion.w, start.w)
    draft.copy(motion.w_dot, start.w_dot)
    draft.step(torso.mount_acceleration, start, a_mount=motion.a)
    flow = [against_air(draft, start)] if start.u else []
    across(draft, mount.motion_at_root, motion.vectors())
    wrenches = Wrenches(wrench, mechanism(draft).declare_torques(draft))
    for i, g in each_piece(draft):
        mechanism(draft).move(draft, segments, (i, g), motion, v_dot, wrenches.at(i, g), *flow)
    return wrenches


def against_air(draft: Draft, start: Motion | Vectors) -> Ref:
    """Carry the velocity ``u`` of B against the air to the mount, into the axes at the root."""
    u, at_torso = draft.vector("u_here", 3), {"w": start["w"], "u": start["u"]}
    draft.step(torso.mount_velocity, at_torso, u=u)
    across(draft, mount.flow_at_root, u=u)
    return u


def gather_wrenches(
    draft: Draft,
    segments: Segments,
    wrenches: Wrenches,
    torque: Callable[[Index], Ref] | None = None,
) -> Vectors:
    """Sum wrenches (or momenta) from the tip to the tail mount, in ``F_next``, torso axes; torques
    add up per segment.

    Of inertial wrenches this is the sum of Eq. 4.
    """
    total = draft.vectors(F_next=6)
    draft.fill(total["F_next"], 0)
    for stretch, i in each_segment(draft, downward=True):
        writes = dict(total.named)
        if torque:
            draft.fill(torque(i), 0)
            writes["torque_"] = torque(i)
        with pieces_of(draft, stretch, i, downward=True) as g:
            step = mechanism(draft).gather_wrench
            draft.step(step, segments.at(i, g), wrenches.at(i, g), total, **writes)
    across(draft, mount.wrench_at_mount, total.named)
    return total


def inertial_forces(
    draft: Draft,
    segments: list[Segments],
    motion: Motion,
    v_dot: Array | None,
    force: Array,
    drives: Array | None = None,
) -> None:
    """Compute the generalised forces of a motion of the torso and ``v_dot`` of the chains, in torso
    axes; ``segments`` are those of each chain. ``drives`` receives those on prescribed joints.
    """
    sums = Vectors({"force": block(force, VELOCITY), "moment": block(force, OMEGA)})
    for own in on_each(draft, segments):
        wrenches = forward_wrenches(draft, own, seen(draft, motion), v_dot)
        tail, torque = draft.tail, None
        if not tail.prescribed:
            torque = partial(tail.segment_v, force)
        elif drives:
            torque = partial(tail.segment_tau, drives)
        total = gather_wrenches(draft, own, wrenches, torque)
        if draft.tail.name:
            add(draft, branch.chain_wrench, total, sums)
        elif not draft.tail.fixed:
            draft.step(torso.torso_wrench, motion, total, **sums)
            add_torso_drag(draft, motion, sums)


def add_torso_drag(draft: Draft, motion: Motion, sums: Vectors) -> None:
    """Add minus ``force, moment`` of the air on a torso that moves against it."""
    if motion.u:
        writes = {f"{name}_": ref for name, ref in sums.named.items()}
        draft.step(air.torso_drag, motion, **writes)


def core_bias(draft: Draft, segments: list[Segments], bias: Array, u: Ref | None = None) -> None:
    """C without gravity and translation: force and moment at B in torso axes, then the tail's
    forces; on a fixed base those alone, with gravity. ``u``: velocity of B against the air.
    """
    motion = replace(torso_without_acceleration(draft, segments[0].state), u=u)
    inertial_forces(draft, segments, motion, None, bias)


def torso_without_acceleration(draft: Draft, state: State) -> Motion:
    """Return the motion of a torso that falls freely, without gravity in its own axes; a fixed base
    does not fall, and gravity is an acceleration of it.
    """
    zero = draft.zero(3)
    motion = Motion(state.omega, zero, zero)
    if not draft.tail.fixed:
        return motion
    reads = {"R": attitude(draft, state), "p_ddot": zero}
    return replace(motion, a=draft.store(torso.torso_acceleration, reads, a=3)["a"])


def virtual_power(
    draft: Draft,
    segments: list[Segments],
    start: Vectors,
    multiplier: Array,
    v_dot: Array,
    power: Ref,
) -> None:
    """Sum the power of all inertial wrenches when the animal moves with the velocity
    ``multiplier``, less that of the air; ``segments`` are those of each chain.

    ``start``: ``w``, ``w_dot``, ``a`` of the torso and ``w_virtual``, ``u_virtual``, its virtual
    velocities; in air also ``u``, its velocity against it.
    """
    draft.step(torso.torso_power, start, power=power)
    flow = {}
    if draft.tail.widths:
        flow["u"] = against_air(draft, start)
        draft.step(air.torso_drag_power, start, power_=power)
    for own in on_each(draft, segments):
        carried = _virtual_at_root(draft, seen_virtually(draft, start))

        # from the mount to the tip
        for i, g in each_piece(draft):
            if flow:
                both = Vectors({**carried, **flow})
                virtual = draft.tail.segment_v(multiplier, i)
                mechanism(draft).drag_power(draft, own, (i, g), virtual, both, power)
            rates = (
                own.motion(i, v_dot),
                {"virtual_rates": draft.tail.segment_v(multiplier, i)},
            )
            step = mechanism(draft).power
            draft.step(step, own.at(i, g), *rates, carried, power_=power, **carried)


def _virtual_at_root(draft: Draft, start: Vectors) -> Vectors:
    """Carry the torso's motion and its virtual velocities to a mount, into the axes at the root."""
    names = ("w", "w_dot", "a", "w_virtual", "u_virtual")
    carried = Vectors({name: draft.vector(f"{name}_here", 3) for name in names})
    draft.step(torso.mount_acceleration, start, a_mount=carried["a"])
    reads = {"w": start["w_virtual"], "u": start["u_virtual"]}
    draft.step(torso.mount_velocity, reads, u=carried["u_virtual"])
    for name in ("w", "w_dot", "w_virtual"):
        draft.copy(carried[name], start[name])
    across(draft, mount.motion_at_root, carried.only("w", "w_dot", "a").named)
    virtual = carried.only("w_virtual", "u_virtual").named
    across(draft, mount.virtual_velocity_at_root, virtual)
    return carried
