"""The tail's points and their Jacobians."""

from serpentail_scene.layout import OMEGA, TORSO_NV
from serpentail_scene.signatures.arguments import ANGULAR, LINEAR, Q, V

from ..ir.program import Array, Index, Ref
from ..mechanics import loads, torso
from .draft import Draft
from .dynamics import assemble_momentum
from .function import Function, assemble
from .layout import coordinate
from .sweeps.chains import each_chain, facing
from .sweeps.inertia import column_of, columns_and_inertia
from .sweeps.pieces import (
    attitude,
    each_point,
    each_segment,
    mechanism,
    points_of,
    torso_pose,
)

MOMENTUM = Function(
    "all_momentum", "momentum of the animal", (Q, V), (LINEAR, ANGULAR), assemble_momentum
)


def assemble_tail_points(draft: Draft, arrays: dict[str, Array]) -> None:
    """The joints and the tip (Eqs. 14, 15), or equally spaced samples of every segment."""
    points, state = arrays["points"], draft.state(arrays["q"])
    R = attitude(draft, state)
    for chain in each_chain(draft):
        first = chain.points_before
        samples = mechanism(draft).prepare_samples(draft, state.on(chain), None)
        pose = torso_pose(draft, facing(draft, R), state.position)
        draft.copy(points.part(3 * first, 3), pose.P)
        for i, g in each_point(draft):
            draft.step(mechanism(draft).pose, pose, samples.at(i, g), **pose)
            draft.copy(points.part(3 * (first + g + 1), 3), pose.P)


def assemble_tail_point_jacobians(draft: Draft, arrays: dict[str, Array]) -> None:
    """d(point)/dt = J v for every tail point (Eqs. A5 to A8).

    Arms start at B, so that distance from the origin costs no accuracy.
    """
    J, tail, state = arrays["J"], draft.tail, draft.state(arrays["q"])
    R = attitude(draft, state)
    samples = mechanism(draft).prepare_samples(draft, state, None)
    S = draft.array("S", 12, tail.segments)
    pose = torso_pose(draft, R)

    def rows(point: Index, first: Index | int, size: int) -> dict[str, Ref]:
        return {f"J_{name}": row(point, axis, first, size) for axis, name in enumerate("xyz")}

    def row(point: Index, axis: int, first: Index | int, size: int) -> Ref:
        return J.part((3 * tail.nv) * point + axis * tail.nv + first, size)

    def base_rows(point: Index) -> None:
        draft.fill(J.part((3 * tail.nv) * point, 3 * tail.nv), 0)
        for axis in range(3):
            draft.fill(row(point, axis, axis, 1), 1)
        reads = {"R": R, "arm": pose.P}
        draft.step(loads.point_jacobian_base, reads, **rows(point, OMEGA.start, 3))

    base_rows(Index())
    for stretch, i in each_segment(draft):
        draft.fill(S[i], 0)
        with points_of(draft, stretch, i) as g:
            draft.step(mechanism(draft).twist, pose, samples.at(i, g), S_=S[i])
            draft.step(mechanism(draft).pose, pose, samples.at(i, g), **pose)
            point = g + 1
            base_rows(point)
            with draft.loop("l", i + 1) as segment:
                reads = {"S": S[segment], "arm": pose.P}
                first = TORSO_NV + coordinate(segment)
                draft.step(loads.point_jacobian_tail, reads, **rows(point, first, 2))


def assemble_center_of_mass(draft: Draft, arrays: dict[str, Array]) -> None:
    """Position and velocity of the animal's centre of mass, and its Jacobian: momentum columns over
    the mass.
    """
    tail, J, velocity = draft.tail, arrays["J"], arrays["velocity"][0]
    state = draft.state(arrays["q"], arrays["v"])

    # mass, first moment, and the momentum that each tail coordinate gives, in torso axes
    R = attitude(draft, state)
    _, columns, composite = columns_and_inertia(draft, state)

    # the motion of the torso, then the contribution of the tail
    rows = {f"J_{name}": J.part(axis * tail.nv, TORSO_NV) for axis, name in enumerate("xyz")}
    if tail.fixed:
        rows, moment = {}, composite.only("mass", "h")
        draft.step(torso.torso_moment, moment, **moment)
    motion = {"position": arrays["position"][0], "velocity": velocity}
    mass = draft.vectors(inverse_mass=1)
    draft.step(torso.com_at_base, state.torso(R), composite, **mass, **motion, **rows)
    with draft.loop("k", tail.nt) as k:
        reads = {
            "R": R,
            "column": column_of(columns, k),
            "rate": tail.coordinate_v(arrays["v"], k),
        }
        writes = {"J_column": J.part(tail.torso_nv + k, 3, stride=tail.nv), "velocity_": velocity}
        draft.step(torso.com_of_coordinate, mass, reads, **writes)
    if tail.given:  # J v lacks the prescribed rates
        inner, linear = assemble(MOMENTUM.of(tail), tail), draft.array("linear", 3)
        known = {name: arrays[name] for name in ("q", "v", "given")}
        draft.call(inner, **known, linear=linear, angular=draft.array("angular", 3))
        draft.step(torso.com_velocity, mass, {"linear": linear[0]}, velocity=velocity)


ASSEMBLIES = {
    "tail_points": assemble_tail_points,
    "tail_point_jacobians": assemble_tail_point_jacobians,
    "center_of_mass": assemble_center_of_mass,
}
