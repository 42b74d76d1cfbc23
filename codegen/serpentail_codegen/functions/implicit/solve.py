"""Solving with 1 - w J, once it is factored.

``f`` are the factors. r_q, r_v and r_u are right-hand sides for q in its tangent space, for v and
for the bristles; k_q, k_v and k_u are the solution.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY

from ...ir.program import Array, Index, Ref
from ...mechanics import contact, passive
from ...mechanics import contact_stiffness as stiffness
from ..draft import Draft
from ..layout import block
from .layout import Factors, Place, each_contact


def assemble_solve(draft: Draft, arrays: dict[str, Array]) -> None:
    """k_v from S (k_v - r_v) = forces, then k_q and the bristles."""
    f, r_q, r_v, k_v = (
        Factors(arrays["factors"], draft.tail),
        arrays["r_q"],
        arrays["r_v"],
        arrays["k_v"],
    )
    # forces for the right-hand sides
    draft.fill(k_v[0], 0)
    tail_response(draft, f, arrays)
    pressed = None
    if draft.tail.contacts:
        pressed = contact_response(draft, f, arrays)
        draft.solve(f.array, k_v[0], pair=True)
    else:
        draft.solve(f.array, k_v[0])

    # k_v from its change, and k_q
    with draft.loop("k", draft.tail.nv) as k:
        rate, angle = k_v.part(k, 1), r_q.part(k, 1)
        reads = {"change": rate, "rate": r_v.part(k, 1)}
        draft.step(stiffness.total_rate, reads, k_v=rate)
        reads = {"weight": f("weight"), "k_v": rate, "angle": angle}
        draft.step(stiffness.total_place, reads, k_q=arrays["k_q"].part(k, 1))
    if pressed:
        solve_bristles(draft, f, arrays, pressed)


def tail_response(draft: Draft, f: Factors, arrays: dict[str, Array]) -> None:
    """Forces of damping, stiffness and gains for the right-hand sides."""
    r_q, r_v, x = arrays["r_q"], arrays["r_v"], arrays["k_v"]

    def of_tail(v: Array, k: Index) -> Ref:
        return v.part(draft.tail.torso_nv + k, 1)

    with draft.loop("k", draft.tail.nt) as k:
        reads = {"damped": f("damped", k), "rate": of_tail(r_v, k)}
        draft.step(stiffness.damped_response, reads, rhs=of_tail(x, k))
        if draft.tail.elastic:
            reads = {"sprung": f("sprung", k), "angle": of_tail(r_q, k)}
            draft.step(passive.sprung_response, reads, rhs_=of_tail(x, k))
    gains = {name: f(name) for name in ("gain_q", "gain_v")}
    with (
        draft.when(f("gain_v")),
        draft.loop("k", draft.tail.nt) as k,
        draft.loop("l", draft.tail.nt) as other,
    ):
        reads = {
            "entry": f.entry("H_tail", k, other),
            "angle": of_tail(r_q, other),
            "rate": of_tail(r_v, other),
        }
        draft.step(stiffness.gain_response, gains, reads, rhs_=of_tail(x, k))


@dataclass(frozen=True)
class Shift:
    """A velocity of the animal that is evaluated at points: ``v``, and its rotation in world
    axes.
    """

    v: Array
    rotation: Ref

    def at(self, draft: Draft, f: Factors, number: Index, place: Place | None, motion: Ref) -> None:
        """Store how a point moves: a point of the torso, or of a chain."""
        reads = {"shift": block(self.v, VELOCITY), "turn": self.rotation, "arm": f("arm", number)}
        draft.step(stiffness.point_shift, reads, motion=motion)
        if place is None:
            return
        with draft.loop("k", place.coordinates) as k:
            reads = {"J_k": f.column(place, k), "coupling": place.chain.coordinate_v(self.v, k)}
            draft.step(stiffness.tail_shift, reads, motion_=motion)


def shift(draft: Draft, f: Factors, v: Array) -> Shift:
    """A velocity with its rotation in world axes."""
    rotation = draft.vector(f"turn_{v.name}", 3)
    reads = {"R": f("R"), "rotation": block(v, OMEGA)}
    draft.step(stiffness.torso_turn, reads, turn=rotation)
    return Shift(v, rotation)


def contact_response(draft: Draft, f: Factors, arrays: dict[str, Array]) -> Array:
    """Forces of the points in the ground for the right-hand sides; returns the loads for r_q
    alone.
    """
    x = arrays["k_v"]
    at_q, at_v = shift(draft, f, arrays["r_q"]), shift(draft, f, arrays["r_v"])
    motions = {name: draft.vector(name, 3) for name in ("motion_q", "motion_v")}
    force, load = draft.vector("force_response", 3), draft.vector("load_response", 6)
    pressed = draft.array("pressed", 1, draft.tail.points)
    draft.fill(load, 0)

    def respond(number: Index, place: Place | None) -> None:
        with draft.when(f("depth", number)):
            # how the point moves, and its force
            at_q.at(draft, f, number, place, motions["motion_q"])
            at_v.at(draft, f, number, place, motions["motion_v"])
            point = {"spring": f("spring", number), "lag": arrays["r_u"].part(2 * number, 2)}
            writes = {"force": force, "pressed": pressed[number]}
            draft.step(stiffness.contact_response, motions, point, **writes)

            # the force on the torso, and on the chain's coordinates
            reads = {"arm": f("arm", number), "force": force}
            draft.step(contact.load_about_torso, reads, load_=load)
            if place is None:
                return
            with draft.loop("k", place.coordinates) as k:
                reads = {"J_k": f.column(place, k), "force": force}
                draft.step(stiffness.tail_response, reads, rhs_=place.chain.coordinate_v(x, k))

    each_contact(draft, respond)
    reads = {"R": f("R"), "load": load}
    draft.step(stiffness.torso_response, reads, rhs=x.part(0, TORSO_NV))
    return pressed


def solve_bristles(draft: Draft, f: Factors, arrays: dict[str, Array], pressed: Array) -> None:
    """k_u of all points."""
    at, motion = shift(draft, f, arrays["k_v"]), draft.vector("motion_k", 3)

    def respond(number: Index, place: Place | None) -> None:
        lag, k_u = arrays["r_u"].part(2 * number, 2), arrays["k_u"].part(2 * number, 2)
        draft.step(stiffness.relaxed, {"relax": f("relax"), "lag": lag}, k_u=k_u)
        with draft.when(f("depth", number)):
            at.at(draft, f, number, place, motion)
            reads = {
                "spring": f("spring", number),
                "motion": motion,
                "lag": lag,
                "pressed": pressed[number],
            }
            draft.step(stiffness.bristle_response, reads, k_u=k_u)

    each_contact(draft, respond)
