"""Partial feedback linearisation: the torques that give the tail wanted accelerations."""

from dataclasses import replace

from serpentail_scene.layout import OMEGA, VELOCITY

from ..ir.program import Array, Ref, padded
from ..mechanics import branch, rotations, torso, translation
from .air import airspeed, core_airspeed
from .draft import Draft
from .layout import block
from .passive import add_passive_forces
from .scope import State, Vectors
from .sweeps.chains import add, on_each, prepared, seen
from .sweeps.inertia import column_of, columns_and_inertia
from .sweeps.pieces import attitude
from .sweeps.wrenches import (
    add_torso_drag,
    forward_wrenches,
    gather_wrenches,
    torso_without_acceleration,
)
from .tails.mechanism import Segments


def assemble_pfl(draft: Draft, arrays: dict[str, Array]) -> None:
    """Torques of Eq. 46 without X: six rows of Eq. 1 give the accelerations of the torso, the other
    rows the torques.

    In flight gravity accelerates torso and tail equally, and the torques depend neither on position
    nor on attitude. If ``v_dot`` is among the arguments, it receives all accelerations, so that no
    forward dynamics is needed.
    """
    tail, tau, state = draft.tail, arrays["tau"], draft.state(arrays["q"], arrays["v"])
    if tail.fixed:
        hold_base(draft, state, arrays)
        return
    v_dot = arrays.get("v_dot") or draft.array("v_dot", tail.nv)

    # composite inertia, and the momentum columns of the tail coordinates
    segments, columns, composite = columns_and_inertia(draft, state)

    # torques for a torso at rest, then the torso's acceleration, and the torques that it adds
    with draft.loop("k", tail.nt) as k:
        draft.copy(tail.coordinate_v(v_dot, k), arrays["accelerations"].part(k, 1))
    R = attitude(draft, state) if tail.widths else None
    wrench = tail_alone(draft, segments, v_dot, tau, airspeed(draft, state, R))
    motion = free_torso(draft, composite, wrench)
    add_passive_forces(draft, state, lambda i: draft.tail.segment_tau(tau, i), v_dot)
    with draft.loop("k", tail.nt) as k:
        column = {"column": column_of(columns, k)}
        draft.step(translation.coupling_torque, motion, column, torque_=tau.part(k, 1))
    if "v_dot" in arrays:
        reads = {"R": R or attitude(draft, state), "a": motion["a"]}
        draft.step(rotations.world_acceleration, reads, p_ddot=block(v_dot, VELOCITY))
        draft.copy(block(v_dot, OMEGA), motion["w_dot"])


def hold_base(draft: Draft, state: State, arrays: dict[str, Array]) -> None:
    """Torques H v_dot + C: on a fixed base they give exactly the wanted accelerations."""
    segments, v_dot = prepared(draft, state), arrays["accelerations"]
    tail_alone(draft, segments, v_dot, arrays["tau"], core_airspeed(draft, state))
    add_passive_forces(draft, state, lambda i: draft.tail.segment_tau(arrays["tau"], i), v_dot)
    if "v_dot" in arrays:
        draft.copy(draft.tail.all_v(arrays["v_dot"]), draft.tail.all_v(v_dot))


def tail_alone(
    draft: Draft, segments: list[Segments], v_dot: Array, tau: Array, u: Ref | None
) -> Vectors:
    """Compute ``force, moment`` at B and torques for ``v_dot`` of the chains while the torso does
    not accelerate; ``u``: its velocity against the air.
    """
    motion = replace(torso_without_acceleration(draft, segments[0].state), u=u)
    sums = Vectors({})
    for own in on_each(draft, segments):
        wrenches = forward_wrenches(draft, own, seen(draft, motion), v_dot)
        total = gather_wrenches(draft, own, wrenches, lambda i: draft.tail.segment_tau(tau, i))
        if draft.tail.name:
            add(draft, branch.chain_wrench, total, sums)
        else:
            sums = draft.store(torso.torso_wrench, motion, total, force=3, moment=3)
            if not draft.tail.fixed:
                add_torso_drag(draft, motion, sums)
    return sums


def free_torso(draft: Draft, composite: Vectors, wrench: Vectors) -> Vectors:
    """Compute ``w_dot`` and ``a`` of the torso that balance ``force, moment``: translation
    eliminated, then LDL^T.
    """
    A, w_dot = draft.array("A", padded(3), 3), draft.vectors(w_dot=3)
    unloaded = dict.fromkeys(["load_force", "load_moment"], draft.zero(3))
    rows = {f"A_{r}": A.part(padded(3) * r, r + 1) for r in range(3)}
    center = draft.vectors(inverse_mass=1, com=3)
    draft.step(translation.without_translation, composite, **center, **rows)
    net = draft.vectors(net=3)
    reads = center.only("com"), wrench, unloaded
    draft.step(translation.rotational_load, *reads, rhs=w_dot["w_dot"], **net)
    draft.factor(A, 3)
    draft.solve(A, w_dot["w_dot"])
    free = draft.store(translation.free_acceleration, center, net, w_dot, a=3)
    return Vectors({**w_dot, **free})


ASSEMBLIES = {"pfl": assemble_pfl, "tracked_dynamics": assemble_pfl}
