"""Sweeps of momentum: mass and first moment, momentum or kinetic energy."""

from ...ir.program import Ref
from ...mechanics import branch, mount, torso
from ..draft import Draft
from ..scope import State, Vectors
from ..tails.mechanism import Segments, Wrenches
from .chains import add, on_each, prepared, sided
from .pieces import across, each_piece, mechanism
from .wrenches import gather_wrenches


def gather_momentum(draft: Draft, state: State, R: Ref, p_dot: Ref) -> Vectors:
    """``mass`` and first moment ``h`` of the animal, and its momentum ``force, moment``, at B,
    which moves with p_dot.
    """
    found, moment, root, u_torso = _begin_momentum(draft, state, R, p_dot)
    momentum = Vectors({})
    for segments in on_each(draft, found):
        velocity = _at_root(draft, state, u_torso) if draft.tail.name else root
        momenta = Wrenches(draft.array("momenta", 6, draft.tail.pieces))
        for place in each_piece(draft):
            mechanism(draft).momentum(draft, segments, place, velocity, momenta.at(*place).named)
        total = gather_wrenches(draft, segments, momenta)
        if draft.tail.name:
            add(draft, branch.chain_wrench, total, momentum)
        else:
            reads = u_torso, {"w": state.omega}, total
            momentum = draft.store(torso.torso_momentum, *reads, force=3, moment=3)
    return Vectors({**moment, **momentum})


def gather_kinetic(draft: Draft, state: State, R: Ref, kinetic: Ref) -> Vectors:
    """``mass`` and first moment ``h`` of the animal; sums its energy in ``kinetic``."""
    found, moment, velocity, u_torso = _begin_momentum(draft, state, R, state.velocity)
    draft.fill(kinetic, 0)
    for segments in on_each(draft, found):
        if draft.tail.name:
            velocity = _at_root(draft, state, u_torso)
        for place in each_piece(draft):
            mechanism(draft).momentum(draft, segments, place, velocity, {"kinetic_": kinetic})
    draft.step(torso.torso_momentum, u_torso, {"w": state.omega}, kinetic_=kinetic)
    return moment


def _begin_momentum(
    draft: Draft, state: State, R: Ref, p_dot: Ref
) -> tuple[list[Segments], Vectors, Vectors, Vectors]:
    """Return the segments of each chain, mass and first moment, velocities of the tail mount, and
    of the torso.
    """
    segments = prepared(draft, state)
    moment = gather_moment(draft, segments)
    velocity = draft.vectors(w=3, u=3)
    if draft.tail.fixed:
        for ref in velocity.named.values():
            draft.fill(ref, 0)
        return segments, moment, velocity, Vectors({"u_torso": state.velocity})
    draft.step(torso.torso_velocity, {"R": R, "p_dot": p_dot}, u=velocity["u"])
    u_torso = draft.vectors(u_torso=3)
    draft.copy(u_torso["u_torso"], velocity["u"])
    draft.copy(velocity["w"], state.omega)
    with draft.on(draft.tail.chains[0]):
        _to_root(draft, velocity)
    return segments, moment, velocity, u_torso


def _at_root(draft: Draft, state: State, u_torso: Vectors) -> Vectors:
    """Return the velocities of the mount of a chain besides the tail, in the axes at its root."""
    velocity = draft.vectors(w=3, u=3)
    draft.copy(velocity["w"], state.omega)
    draft.copy(velocity["u"], u_torso["u_torso"])
    if draft.tail.mirrored:
        draft.step(sided(draft, branch.mirrored_velocity), velocity, **velocity)
    _to_root(draft, velocity)
    return velocity


def _to_root(draft: Draft, velocity: Vectors) -> None:
    """Carry velocities from the torso to a mount, into the axes at the root."""
    draft.step(torso.mount_velocity, velocity, u=velocity["u"])
    across(draft, mount.velocity_at_root, velocity.named)


def gather_moment(draft: Draft, found: list[Segments]) -> Vectors:
    """Sum mass and first moment of torso and chains at B, in ``mass`` and ``h``; ``found``: the
    segments of each chain.
    """
    total = Vectors({})
    for segments in on_each(draft, found):
        moment = draft.vectors(mass=1, h=3)
        for ref in moment.named.values():
            draft.fill(ref, 0)
        for place in each_piece(draft, downward=True):
            draft.step(mechanism(draft).gather_moment, segments.at(*place), moment, **moment)
        across(draft, mount.moment_at_mount, h=moment["h"])
        if draft.tail.name:
            add(draft, branch.chain_moment, moment, total)
        else:
            draft.step(torso.torso_moment, moment, **moment)
            total = moment
    return total
