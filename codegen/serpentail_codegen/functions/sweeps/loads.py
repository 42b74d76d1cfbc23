"""Sweeps of loads: forces on the tail's points as a load on the torso and as torques."""

from ...ir.program import Array, Index, Ref
from ...mechanics import branch, loads
from ..draft import Draft
from ..layout import LOAD
from ..scope import State, Vectors
from .chains import add, each_chain, facing
from .pieces import each_point, mechanism, torso_pose


def sample_joints(draft: Draft, state: State) -> tuple[Array, Array]:
    """Compute spatial columns between tail points, and all tail points, in torso axes from B."""
    tail, samples = draft.tail, mechanism(draft).prepare_samples(draft, state, None)
    S = draft.array("S_joint", 6 * tail.width, tail.total)
    points = draft.array("tail_point", 3, tail.total + 1)
    pose = torso_pose(draft, name="joint")
    draft.copy(points[0], pose.P)
    for i, g in each_point(draft):
        draft.step(mechanism(draft).twist, pose, samples.at(i, g), S=S[g])
        draft.step(mechanism(draft).pose, pose, samples.at(i, g), **pose)
        draft.copy(points[g + 1], pose.P)
    return S, points


def gather_loads(draft: Draft, state: State, R: Ref, f_ext: Array, torques: Array) -> Vectors:
    """J^T f (Eq. 10) of the loads in ``f_ext``: returns ``load_force, load_moment`` at B; the
    joints' part is added to ``torques``.
    """
    total, at_torso = Vectors({}), {"R": R, "f_torso": f_ext.part(0, LOAD)}
    for chain in each_chain(draft):
        beyond = gather_chain_loads(draft, state.on(chain), facing(draft, R), f_ext, torques)
        if chain.name:
            add(draft, branch.chain_load, beyond, total)
        else:
            total = draft.store(loads.load_at_torso, at_torso, beyond, load_force=3, load_moment=3)
    return total


def gather_chain_loads(draft: Draft, state: State, R: Ref, f_ext: Array, torques: Array) -> Vectors:
    """Sum the loads on one chain at B, in ``F_beyond``; R turns its places to the world."""
    S, points = sample_joints(draft, state)
    beyond = draft.vectors(F_beyond=6)
    draft.fill(beyond["F_beyond"], 0)

    def add_load(point: Index) -> None:
        force = f_ext.part(LOAD + 3 * (draft.tail.points_before + point), 3)
        reads = {"R": R, "P": points[point], "f_point": force}
        draft.step(loads.load_at_point, reads, beyond, **beyond)

    for i, g in each_point(draft, downward=True):
        add_load(g + 1)
        if not draft.tail.prescribed:
            own = draft.tail.segment_tau(torques, i)
            draft.step(draft.of_segment(loads.joint_load), {"S": S[g]}, beyond, torque_=own)
    add_load(Index())
    return beyond
