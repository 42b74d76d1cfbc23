"""Partial feedback linearisation: a draft goes in, the torques that give wanted tail accelerations
are added to it.
"""

from ..ir.program import Array, padded
from ..mechanics import rotations, torso, translation
from .draft import Draft
from .sweeps import sweeps
from .sweeps.sweeps import column_of, mechanism


def assemble_pfl(d: Draft, arrays: dict[str, Array]) -> None:
    """Torques of Eq. 46 without X: six rows of Eq. 1 give the torso's accelerations, the others
    then the torques.

    In flight gravity moves torso and tail alike, and torques depend on neither place nor attitude.
    With ``v_dot`` among the arguments it is all accelerations, which need no forward dynamics then.
    """
    tail, tau = d.tail, arrays["tau"]
    v_dot = arrays.get("v_dot") or d.array("v_dot", tail.nv)
    mechanism(d).prepare(d, True)
    columns, roots = d.array("columns", 12, tail.segments), sweeps.segment_roots(d)
    sweeps.forward_roots(d, sweeps.torso_pose(d, world=False), roots)
    sweeps.gather_inertia(d, roots, columns)
    with d.loop("k", tail.nt) as k:
        d.copy(v_dot.part(6 + k, 1), arrays["accelerations"].part(k, 1))
    tail_alone(d, v_dot, tau)
    free_torso(d)
    with d.loop("k", tail.nt) as k:
        d.step(
            translation.coupling_torque, {"column": column_of(columns, k)}, torque_=tau.part(k, 1)
        )
    if "v_dot" in arrays:
        d.store(rotations.quaternion_rotation, R=9)
        d.step(rotations.world_acceleration, p_ddot=v_dot.part(0, 3))
        d.copy(v_dot.part(3, 3), d.known["w_dot"])


def tail_alone(d: Draft, v_dot: Array, tau: Array) -> None:
    """``force, moment`` at B, and torques, of the tail that ``v_dot`` moves while the torso does
    not accelerate.
    """
    d.known |= {"w": d.known["omega"], "w_dot": d.zero(3), "a": d.zero(3)}
    wrench = sweeps.forward_wrenches(d, v_dot)
    sweeps.gather_wrenches(d, wrench, lambda i: tau.part(2 * i, 2))
    d.store(torso.torso_wrench, force=3, moment=3)


def free_torso(d: Draft) -> None:
    """``w_dot`` and ``a`` of the torso that balance ``force, moment``: translation eliminated, then
    LDL^T.
    """
    A, w_dot = d.array("A", padded(3), 3), d.vector("w_dot", 3)
    d.known |= dict.fromkeys(["load_force", "load_moment"], d.zero(3))
    rows = {f"A_{r}": A.part(padded(3) * r, r + 1) for r in range(3)}
    d.step(
        translation.without_translation,
        inverse_mass=d.vector("inverse_mass", 1),
        com=d.vector("com", 3),
        **rows,
    )
    d.step(translation.rotational_load, net=d.vector("net", 3), rhs=w_dot)
    d.factor(A, 3)
    d.solve(A, w_dot)
    d.store(translation.free_acceleration, a=3)


ASSEMBLIES = {"pfl": assemble_pfl, "tracked_dynamics": assemble_pfl}
