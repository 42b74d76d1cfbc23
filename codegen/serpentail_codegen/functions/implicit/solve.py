"""Implicit integrators' linear systems: a draft goes in, factoring and solving with 1 - w J are
added to it.

J is the Jacobian of the rates of (q in its tangent space, v, bristles), of contact, joint damping
and tracking gains alone.  With k_q = r_q + w k_v and the bristles eliminated, S (k_v - r_v) =
forces is left, S = H + stiffness, symmetric and positive definite but for points that slide: there
friction follows the load, and S takes two triangles. Eliminating translation is what the first
three pivots of S do.
"""

from dataclasses import dataclass

from ...ir.program import Array, Index, Ref
from ...mechanics import contact as con
from ...mechanics import contact_stiffness as stiff
from ..draft import Draft
from .layout import Factors, each_contact, first_tail_point

# ---- solving -------------------------------------------------------------------------------------


def assemble_solve(d: Draft, arrays: dict[str, Array]) -> None:
    """k_v from S (k_v - r_v) = forces, then k_q and the bristles."""
    f, r_q, r_v, k_v = (
        Factors(arrays["factors"], d.tail),
        arrays["r_q"],
        arrays["r_v"],
        arrays["k_v"],
    )
    d.known |= {name: f(name) for name in ("gain_q", "gain_v", "weight")}
    d.fill(k_v[0], 0)
    tail_response(d, f, arrays)
    if d.tail.contacts:
        d.known |= {"R": f("R"), "relax": f("relax")}
        pressed = contact_response(d, f, arrays)
        d.solve_pair(f.array, k_v[0])
    else:
        d.solve(f.array, k_v[0])
    with d.loop("k", d.tail.nv) as k:
        d.step(
            stiff.total_rate, {"change": k_v.part(k, 1), "rate": r_v.part(k, 1)}, k_v=k_v.part(k, 1)
        )
        reads = {"k_v": k_v.part(k, 1), "angle": r_q.part(k, 1)}
        d.step(stiff.total_place, reads, k_q=arrays["k_q"].part(k, 1))
    if d.tail.contacts:
        solve_bristles(d, f, arrays, pressed)


def tail_response(d: Draft, f: Factors, arrays: dict[str, Array]) -> None:
    """Forces of damping and gains for the right-hand sides."""
    r_q, r_v, x = arrays["r_q"], arrays["r_v"], arrays["k_v"]
    with d.loop("k", d.tail.nt) as k:
        reads = {"damped": f("damped", k), "rate": r_v.part(6 + k, 1)}
        d.step(stiff.damped_response, reads, rhs=x.part(6 + k, 1))
    with d.when(f("gain_v")), d.loop("k", d.tail.nt) as k, d.loop("l", d.tail.nt) as other:
        reads = {
            "entry": f.entry("H_tail", k, other),
            "angle": r_q.part(6 + other, 1),
            "rate": r_v.part(6 + other, 1),
        }
        d.step(stiff.gain_response, reads, rhs_=x.part(6 + k, 1))


@dataclass(frozen=True)
class Shift:
    """A velocity of the animal, to be seen at points: ``v``, and its rotation in world axes."""

    v: Array
    turn: Ref

    def at(self, d: Draft, f: Factors, number: Index, segment: Index | None, motion: Ref) -> None:
        """Store how a point moves: a point of the torso, or tail point ``number`` in a segment."""
        d.step(
            stiff.point_shift,
            {"shift": self.v.part(0, 3), "turn": self.turn, "arm": f("arm", number)},
            motion=motion,
        )
        if segment is not None:
            point = number + -first_tail_point(d.tail)
            with d.loop("k", 2 * segment + 2) as k:
                reads = {"J_k": f.column(point, k), "coupling": self.v.part(6 + k, 1)}
                d.step(stiff.tail_shift, reads, motion_=motion)


def shift(d: Draft, v: Array) -> Shift:
    """A velocity with its rotation turned to world axes."""
    turn = d.array(f"turn_{v.name}", 3)[0]
    d.step(stiff.torso_turn, {"rotation": v.part(3, 3)}, turn=turn)
    return Shift(v, turn)


def contact_response(d: Draft, f: Factors, arrays: dict[str, Array]) -> Array:
    """Forces of the points in the ground for the right-hand sides; returns the loads for r_q
    alone.
    """
    x, at_q, at_v = arrays["k_v"], shift(d, arrays["r_q"]), shift(d, arrays["r_v"])
    reads = {name: d.array(name, 3)[0] for name in ("motion_q", "motion_v")}
    force, load = d.array("force_response", 3)[0], d.array("load_response", 6)[0]
    pressed = d.array("pressed", 1, d.tail.points)
    d.fill(load, 0)

    def respond(number: Index, segment: Index | None) -> None:
        with d.when(f("depth", number)):
            at_q.at(d, f, number, segment, reads["motion_q"])
            at_v.at(d, f, number, segment, reads["motion_v"])
            point = {
                "spring": f("spring", number),
                "lag": arrays["r_u"].part(2 * number, 2),
                "arm": f("arm", number),
            }
            d.step(stiff.contact_response, reads | point, force=force, pressed=pressed[number])
            d.step(con.load_about_torso, point | {"force": force}, load_=load)
            if segment is not None:
                with d.loop("k", 2 * segment + 2) as k:
                    column = f.column(number + -first_tail_point(d.tail), k)
                    d.step(
                        stiff.tail_response, {"J_k": column, "force": force}, rhs_=x.part(6 + k, 1)
                    )

    each_contact(d, f, respond)
    d.step(stiff.torso_response, {"load": load}, rhs=x.part(0, 6))
    return pressed


def solve_bristles(d: Draft, f: Factors, arrays: dict[str, Array], pressed: Array) -> None:
    """k_u of all points."""
    at, motion = shift(d, arrays["k_v"]), d.array("motion_k", 3)[0]

    def respond(number: Index, segment: Index | None) -> None:
        lag, k_u = arrays["r_u"].part(2 * number, 2), arrays["k_u"].part(2 * number, 2)
        d.step(stiff.relaxed, {"lag": lag}, k_u=k_u)
        with d.when(f("depth", number)):
            at.at(d, f, number, segment, motion)
            reads = {
                "spring": f("spring", number),
                "motion": motion,
                "lag": lag,
                "pressed": pressed[number],
            }
            d.step(stiff.bristle_response, reads, k_u=k_u)

    each_contact(d, f, respond)
