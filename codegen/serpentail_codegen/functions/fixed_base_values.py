"""The state of a tail on a fixed base, and its values: energy, momentum and positions."""

from serpentail_scene.layout import POSITION, QUATERNION, TORSO_NQ, TORSO_NV

from ..ir.program import Array
from ..mechanics import fixed_base as resting
from .draft import Draft
from .layout import block
from .passive import add_elastic_energy
from .scope import State, Vectors
from .sweeps.inertia import column_of, forward_roots, gather_inertia, segment_roots
from .sweeps.momentum import gather_moment
from .sweeps.pieces import each_piece, each_point, mechanism, torso_pose
from .sweeps.wrenches import gather_wrenches
from .tails.mechanism import Wrenches

# ---- the whole animal from the tail --------------------------------------------------------------


def whole_v(draft: Draft, tail: Array) -> Array:
    """Return rates, or accelerations, of the whole animal: those of the torso are zero."""
    whole = draft.array(f"{tail.name}_whole", TORSO_NV + draft.tail.nt)
    draft.fill(whole.part(0, TORSO_NV), 0)
    draft.copy(whole.part(TORSO_NV, draft.tail.nt), tail.part(0, draft.tail.nt))
    return whole


def whole_state(draft: Draft, arrays: dict[str, Array]) -> State:
    """Return the state of the whole animal, with the torso at rest at the origin."""
    q = draft.array("q_whole", TORSO_NQ + draft.tail.nt)
    draft.fill(block(q, POSITION), 0)
    draft.fill(block(q, QUATERNION), 1, 0, 0, 0)
    draft.copy(q.part(TORSO_NQ, draft.tail.nt), arrays["q"].part(0, draft.tail.nt))
    return State(q, whole_v(draft, arrays["v"]) if "v" in arrays else None)


# ---- energy and places ---------------------------------------------------------------------------


def resting_root(draft: Draft) -> Vectors:
    """Return velocities of a root at rest, to be carried along the tail."""
    velocity = draft.vectors(w=3, u=3)
    for ref in velocity.named.values():
        draft.fill(ref, 0)
    return velocity


def assemble_energy(draft: Draft, arrays: dict[str, Array]) -> None:
    """Energies of the tail; the torso does not move, and its height is zero."""
    state = whole_state(draft, arrays)
    segments = mechanism(draft).prepare(draft, state, False)
    moment, velocity = gather_moment(draft, segments), resting_root(draft)
    kinetic, potential = arrays["kinetic"][0], arrays["potential"][0]
    draft.fill(kinetic, 0)
    for place in each_piece(draft):
        mechanism(draft).momentum(draft, segments, place, velocity, {"kinetic_": kinetic})
    draft.step(resting.resting_potential, moment, potential=potential)
    add_elastic_energy(draft, state, potential)


def assemble_momentum(draft: Draft, arrays: dict[str, Array]) -> None:
    """Momentum of the tail, and its angular momentum about its own centre of mass."""
    segments = mechanism(draft).prepare(draft, whole_state(draft, arrays), False)
    moment, velocity = gather_moment(draft, segments), resting_root(draft)
    momenta = Wrenches(draft.array("momenta", 6, draft.tail.pieces))
    for place in each_piece(draft):
        mechanism(draft).momentum(draft, segments, place, velocity, momenta.at(*place).named)
    total = gather_wrenches(draft, segments, momenta)
    writes = {name: arrays[name][0] for name in ("linear", "angular")}
    draft.step(resting.resting_momentum, moment, total, **writes)


def assemble_center_of_mass(draft: Draft, arrays: dict[str, Array]) -> None:
    """Position and velocity of the tail's centre of mass, and its Jacobian: momentum columns over
    the mass.
    """
    tail, J, velocity = draft.tail, arrays["J"], arrays["velocity"][0]
    segments = mechanism(draft).prepare(draft, whole_state(draft, arrays), True)
    columns, roots = draft.array("columns", 12, tail.segments), segment_roots(draft)
    forward_roots(draft, segments, torso_pose(draft), roots)
    composite = gather_inertia(draft, segments, roots, columns)

    mass = draft.vectors(inverse_mass=1)
    draft.step(resting.resting_com, composite, **mass, position=arrays["position"][0])
    draft.fill(velocity, 0)
    with draft.loop("k", tail.nt) as k:
        reads = {"column": column_of(columns, k), "rate": arrays["v"].part(k, 1)}
        writes = {"J_column": J.part(k, 3, stride=tail.nt), "velocity_": velocity}
        draft.step(resting.resting_com_of_coordinate, mass, reads, **writes)


def assemble_tail_points(draft: Draft, arrays: dict[str, Array]) -> None:
    """The joints and the tip (Eqs. 14, 15), or equally spaced samples of every segment."""
    points = arrays["points"]
    samples = mechanism(draft).prepare_samples(draft, whole_state(draft, arrays), None)
    pose = torso_pose(draft)
    draft.copy(points.part(0, 3), pose.P)
    for i, g in each_point(draft):
        draft.step(mechanism(draft).pose, pose, samples.at(i, g), **pose)
        draft.copy(points.part(3 * (g + 1), 3), pose.P)


ASSEMBLIES = {
    "energy": assemble_energy,
    "momentum": assemble_momentum,
    "center_of_mass": assemble_center_of_mass,
    "tail_points": assemble_tail_points,
}
