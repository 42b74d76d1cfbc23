"""The functions a scene can ask for: a tail's sizes go in, the loop nest of each function comes
out.
"""

from ..ir.program import Array, Index
from ..mechanics import loads, rotations, torso
from .draft import Draft
from .sweeps import sweeps
from .sweeps.sweeps import mechanism


def assemble_tail_points(d: Draft, arrays: dict[str, Array]) -> None:
    """The joints and the tip, or equally spaced samples of every segment."""
    points, tail = arrays["points"], d.tail
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare_samples(d)
    here = sweeps.torso_pose(d, True, d.known["p"])
    d.copy(points.part(0, 3), here["P"])
    with d.loop("i", tail.segments) as i, d.loop("j", tail.links) as j:
        d.step(mechanism(d).pose, here | d.sample(i), **here)
        d.copy(points.part(3 * (tail.links * i + j + 1), 3), here["P"])


def assemble_tail_point_jacobians(d: Draft, arrays: dict[str, Array]) -> None:
    """d(point)/dt = J v for every tail point; arms start at B, so distance from the origin costs no
    accuracy.
    """
    J, tail = arrays["J"], d.tail
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare_samples(d)
    S = d.array("S", 12, tail.segments)
    here = sweeps.torso_pose(d, True)

    def row(point: Index, axis: int, first: Index | int, size: int):
        return J.part((3 * tail.nv) * point + axis * tail.nv + first, size)

    def base_rows(point: Index):
        d.fill(J.part((3 * tail.nv) * point, 3 * tail.nv), 0)
        for axis in range(3):
            d.fill(row(point, axis, axis, 1), 1)
        rows = {f"J_{name}": row(point, axis, 3, 3) for axis, name in enumerate("xyz")}
        d.step(loads.point_jacobian_base, {"arm": here["P"]}, **rows)

    base_rows(Index())
    with d.loop("i", tail.segments) as i:
        d.fill(S[i], 0)
        with d.loop("j", tail.links) as j:
            d.step(mechanism(d).twist, here | d.sample(i), S_=S[i])
            d.step(mechanism(d).pose, here | d.sample(i), **here)
            point = tail.links * i + j + 1
            base_rows(point)
            with d.loop("l", i + 1) as segment:
                rows = {
                    f"J_{name}": row(point, axis, 6 + 2 * segment, 2)
                    for axis, name in enumerate("xyz")
                }
                d.step(loads.point_jacobian_tail, {"S": S[segment], "arm": here["P"]}, **rows)


def assemble_center_of_mass(d: Draft, arrays: dict[str, Array]) -> None:
    """Where the animal's centre of mass is, how fast it moves, and its Jacobian: momentum columns
    over the mass.
    """
    tail, J, velocity = d.tail, arrays["J"], arrays["velocity"][0]
    # mass, first moment, and the momentum that each tail coordinate gives, in torso axes
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare(d, True)
    columns, roots = d.array("columns", 12, tail.segments), sweeps.segment_roots(d)
    sweeps.forward_roots(d, sweeps.torso_pose(d, world=False), roots)
    sweeps.gather_inertia(d, roots, columns)
    # the torso's motion, then what the tail's adds to it
    rows = {f"J_{name}": J.part(axis * tail.nv, 6) for axis, name in enumerate("xyz")}
    motion = {"position": arrays["position"][0], "velocity": velocity}
    d.step(torso.com_at_base, inverse_mass=d.vector("inverse_mass", 1), **motion, **rows)
    with d.loop("k", tail.nt) as k:
        reads = {"column": sweeps.column_of(columns, k), "rate": arrays["v"].part(6 + k, 1)}
        J_column = J.part(6 + k, 3, stride=tail.nv)
        d.step(torso.com_of_coordinate, reads, J_column=J_column, velocity_=velocity)


ASSEMBLIES = {
    "tail_points": assemble_tail_points,
    "tail_point_jacobians": assemble_tail_point_jacobians,
    "center_of_mass": assemble_center_of_mass,
}
