"""Implicit integrators' linear systems: a draft goes in, factoring and solving with 1 - w J are added to it.

J is the Jacobian of the rates of (q in its tangent space, v, bristles), of contact, joint damping and tracking gains
alone.  With k_q = r_q + w k_v and the bristles eliminated, S (k_v - r_v) = forces is left, S = H + stiffness, symmetric
and positive definite but for points that slide: there friction follows the load, and S takes two triangles.
Eliminating translation is what the first three pivots of S do.
"""

from dataclasses import dataclass

from .draft import Draft, Tail
from .functions import Argument, Function, Q, V, assemble_mass_matrix
from .ir.program import Array, Index, Ref, padded
from .mechanics import contact as con
from .mechanics import contact_stiffness as stiff
from .mechanics import loads
from .mechanics.lower import derive
from .touching import BRISTLES, LEGS, Points, gather_points

SPRING = 18  # numbers of a point's linearised contact


def blocks(tail: Tail) -> dict[str, tuple[int, int]]:
    """Size and count of what factoring hands to solving, S first."""
    found = {"S": (padded(tail.nv), tail.nv)}
    if tail.contacts:
        found |= {"S_turned": (padded(tail.nv), tail.nv)}
    found |= {"H_tail": (tail.nt, tail.nt), "damped": (1, tail.nt)}
    found |= dict.fromkeys(["gain_q", "gain_v", "weight"], (1, 1))
    if tail.contacts:
        found |= {"R": (9, 1), "relax": (1, 1), "depth": (1, tail.points), "arm": (3, tail.points)}
        found |= {"spring": (SPRING, tail.points), "J": (3 * tail.nt, tail.groups.get("tail", 0))}
    return found


def factors_size(tail: Tail) -> int:
    """Numbers that factoring hands to solving."""
    return sum(size * count for size, count in blocks(tail).values())


@dataclass(frozen=True)
class Factors:
    """The argument ``factors``: its parts by their names."""

    array: Array
    tail: Tail

    def first(self, name: str) -> int:
        """Where a part begins."""
        names = list(blocks(self.tail))
        return sum(size * count for size, count in list(blocks(self.tail).values())[: names.index(name)])

    def __call__(self, name: str, k: Index | int = 0) -> Ref:
        """Entry k of a part."""
        size = blocks(self.tail)[name][0]
        return self.array.part(self.first(name) + size * k, size)

    def entry(self, name: str, row: Index | int, column: Index | int, size: int = 1) -> Ref:
        """Numbers of a matrix."""
        return self.array.part(self.first(name) + blocks(self.tail)[name][0] * row + column, size)

    def row(self, point: Index | int, axis: int, segment: Index | int) -> Ref:
        """How a tail point moves along an axis with the two coordinates of a segment."""
        return self.array.part(self.first("J") + 3 * self.tail.nt * point + axis + 6 * segment, 2, 3)

    def column(self, point: Index | int, k: Index | int) -> Ref:
        """How a tail point moves with tail coordinate k."""
        return self.array.part(self.first("J") + 3 * self.tail.nt * point + 3 * k, 3)


# ---- factoring ------------------------------------------------------------------------------------------------------


def assemble_factor(d: Draft, arrays: dict[str, Array]) -> None:
    """S = H + tail damping and gains + J^T G J of the points in the ground, and its LDL^T."""
    f = Factors(arrays["factors"], d.tail)
    d.known["weight"] = arrays["weight"].part(0, 1)
    assemble_mass_matrix(d, {"H": f.array}, apart=padded)
    room = padded(d.tail.nv) - d.tail.nv
    with d.loop("k", d.tail.nv if room else 0) as k:
        d.fill(f.entry("S", k, d.tail.nv, room), 0)
    d.copy(f("weight"), d.known["weight"])
    add_gains(d, f)
    with d.loop("k", d.tail.nt) as k:
        d.step(stiff.damped, {"damping": arrays["damping"].part(k, 1)}, damped=f("damped", k))
        d.copy(f.entry("S", 6 + k, 6 + k), f("damped", k), adds=True)
    if d.tail.contacts:
        add_contacts(d, f, arrays)
        add_sliding(d, f)
        d.factor_pair(f.array, d.tail.nv)
    else:
        d.factor(f.array, d.tail.nv)


def add_gains(d: Draft, f: Factors) -> None:
    """Tracking gains act through H_tt, which solving needs, too."""
    d.step(stiff.gain_weights, gain_q=f("gain_q"), gain_v=f("gain_v"))
    d.fill(f.array.part(f.first("H_tail"), d.tail.nt**2), 0)
    with d.when(f("gain_v")), d.loop("k", d.tail.nt) as k, d.loop("l", k + 1) as other:
        entry = f.entry("S", 6 + k, 6 + other)
        d.copy(f.entry("H_tail", k, other), entry)
        d.copy(f.entry("H_tail", other, k), entry)
        d.step(stiff.gained, {"gain": f("gain_v"), "entry": f.entry("H_tail", k, other)}, S_entry_=entry)


def add_contacts(d: Draft, f: Factors, arrays: dict[str, Array]) -> None:
    """The points in the ground, linearised; the others cost a comparison."""
    d.copy(f("R"), d.known["R"])
    d.known["bound_share"] = arrays["weight"].part(1, 1)
    d.step(stiff.relaxation, relax=f("relax"))
    d.step(con.bristle_properties, drag=d.vector("drag", 1))
    points = gather_points(d, arrays)
    for group in [name for name in d.tail.contacts if name != "tail"]:
        with d.loop("k", d.tail.groups[group]) as k:
            number = k + points.first[group]
            keep_point(d, f, points, number)
            with d.when(f("depth", number)):
                stiffen(d, f, points, number, arrays["bristles"])
    if points.S:
        add_tail_contacts(d, f, points, arrays["bristles"])


def keep_point(d: Draft, f: Factors, points: Points, number: Index) -> None:
    """Arm and depth of a point, and no stiffness so far."""
    d.copy(f("arm", number), points.arms[number])
    d.step(stiff.depth_of_point, {"arm": points.arms[number]}, depth=f("depth", number))
    d.fill(f("spring", number), 0)


def stiffen(d: Draft, f: Factors, points: Points, number: Index, bristles: Array) -> None:
    """Linearise a point in the ground, and add its stiffness to the torso's block of S."""
    law = derive(stiff.linearised_contact, friction=d.tail.friction)
    reads = points.motion(number) | {"bristle": bristles.part(2 * number, 2), "spring": f("spring", number)}
    d.apply(law, d.known | reads, spring=f("spring", number))
    rows = {f"S_{r}_": f.entry("S", r, 0, r + 1) for r in range(6)}
    d.step(stiff.stiffened_torso, reads, **rows)


def add_tail_contacts(d: Draft, f: Factors, points: Points, bristles: Array) -> None:
    """Tail points: as those of the torso, and their columns of the tail's coordinates."""
    tail = d.tail
    S, force = d.array("S_segment", 12, tail.segments), d.array("force_column", 3)[0]
    with d.loop("i", tail.segments) as i:
        d.fill(S[i], 0)
        with d.loop("j", tail.links) as j:
            g = tail.links * i + j
            number = g + points.first["tail"]
            d.copy(S[i], points.S[g], adds=True)
            keep_point(d, f, points, number)
            d.fill(f("J", g), 0)
            with d.when(f("depth", number)):
                stiffen(d, f, points, number, bristles)
                with d.loop("l", i + 1) as segment:
                    rows = {f"J_{axis}": f.row(g, k, segment) for k, axis in enumerate("xyz")}
                    d.step(loads.point_jacobian_tail, {"S": S[segment], "arm": f("arm", number)}, **rows)
                with d.loop("k", 2 * i + 2) as k:
                    reads = {"arm": f("arm", number), "spring": f("spring", number), "J_k": f.column(g, k)}
                    d.step(stiff.stiffened_column, reads, force=force, S_row_=f.entry("S", 6 + k, 0, 6))
                    with d.loop("l", k + 1) as other:
                        reads = {"J_k": f.column(g, other), "force": force}
                        d.step(stiff.coupled_columns, reads, S_entry_=f.entry("S", 6 + k, 6 + other))


def add_sliding(d: Draft, f: Factors) -> None:
    """The transpose of S, and what makes them differ: the points that slide, whose friction follows the load."""
    nv, row = d.tail.nv, padded(d.tail.nv)
    d.copy(f.array.part(f.first("S_turned"), nv * row), f.array.part(f.first("S"), nv * row))
    slip, push, lift = d.array("slip", 1)[0], d.array("push", nv), d.array("lift", nv)

    def shear(number: Index, segment: Index | None) -> None:
        spring = {"spring": f("spring", number)}
        with d.when(f("depth", number)):
            d.step(stiff.sliding, spring, slip=slip)
            with d.when(slip):
                reads = spring | {"arm": f("arm", number)}
                d.step(stiff.sheared_torso, reads, push=push.part(0, 6), lift=lift.part(0, 6))
                if segment is not None:
                    shear_tail(d, f, number, segment, (push, lift))
                shear_triangles(d, f, 6 if segment is None else 2 * segment + 8, (push, lift))

    each_contact(d, f, shear)


def shear_tail(d: Draft, f: Factors, number: Index, segment: Index, columns: tuple[Array, Array]) -> None:
    """The tail's part of both columns of a tail point."""
    push, lift = columns
    with d.loop("k", 2 * segment + 2) as k:
        reads = {"J_k": f.column(number + -first_tail_point(d.tail), k), "spring": f("spring", number)}
        d.step(stiff.sheared_column, reads, push=push.part(6 + k, 1), lift=lift.part(6 + k, 1))


def shear_triangles(d: Draft, f: Factors, count: Index | int, columns: tuple[Array, Array]) -> None:
    """Add the product of two columns to S, and to its transpose."""
    push, lift = columns
    with d.loop("k", count) as k, d.loop("l", k + 1) as other:
        reads = {"push_k": push.part(k, 1), "push_l": push.part(other, 1)}
        reads |= {"lift_k": lift.part(k, 1), "lift_l": lift.part(other, 1)}
        d.step(stiff.sheared_entries, reads, entry_=f.entry("S", k, other), turned_=f.entry("S_turned", k, other))


# ---- solving --------------------------------------------------------------------------------------------------------


def assemble_solve(d: Draft, arrays: dict[str, Array]) -> None:
    """k_v from S (k_v - r_v) = forces, then k_q and the bristles."""
    f, r_q, r_v, k_v = Factors(arrays["factors"], d.tail), arrays["r_q"], arrays["r_v"], arrays["k_v"]
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
        d.step(stiff.total_rate, {"change": k_v.part(k, 1), "rate": r_v.part(k, 1)}, k_v=k_v.part(k, 1))
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
        reads = {"entry": f.entry("H_tail", k, other), "angle": r_q.part(6 + other, 1), "rate": r_v.part(6 + other, 1)}
        d.step(stiff.gain_response, reads, rhs_=x.part(6 + k, 1))


@dataclass(frozen=True)
class Shift:
    """A velocity of the animal, to be seen at points: ``v``, and its rotation in world axes."""

    v: Array
    turn: Ref

    def at(self, d: Draft, f: Factors, number: Index, segment: Index | None, motion: Ref) -> None:
        """Store how a point moves: a point of the torso, or tail point ``number`` in a segment."""
        d.step(
            stiff.point_shift, {"shift": self.v.part(0, 3), "turn": self.turn, "arm": f("arm", number)}, motion=motion
        )
        if segment is not None:
            point = number + -first_tail_point(d.tail)
            with d.loop("k", 2 * segment + 2) as k:
                reads = {"J_k": f.column(point, k), "coupling": self.v.part(6 + k, 1)}
                d.step(stiff.tail_shift, reads, motion_=motion)


def first_tail_point(tail: Tail) -> int:
    """Number of the tail's first point."""
    return tail.groups.get("feet", 0)


def shift(d: Draft, v: Array) -> Shift:
    """A velocity with its rotation turned to world axes."""
    turn = d.array(f"turn_{v.name}", 3)[0]
    d.step(stiff.torso_turn, {"rotation": v.part(3, 3)}, turn=turn)
    return Shift(v, turn)


def each_contact(d: Draft, f: Factors, respond) -> None:
    """Call ``respond(number, segment)`` for all points, tail points with their segment."""
    first = 0
    for group, count in d.tail.groups.items():
        if group == "tail":
            with d.loop("i", d.tail.segments) as i, d.loop("j", d.tail.links) as j:
                respond(d.tail.links * i + j + first, i)
        else:
            with d.loop("j", count) as j:
                respond(j + first, None)
        first += count


def contact_response(d: Draft, f: Factors, arrays: dict[str, Array]) -> Array:
    """Forces of the points in the ground for the right-hand sides; returns the loads for r_q alone."""
    x, at_q, at_v = arrays["k_v"], shift(d, arrays["r_q"]), shift(d, arrays["r_v"])
    reads = {name: d.array(name, 3)[0] for name in ("motion_q", "motion_v")}
    force, load = d.array("force_response", 3)[0], d.array("load_response", 6)[0]
    pressed = d.array("pressed", 1, d.tail.points)
    d.fill(load, 0)

    def respond(number: Index, segment: Index | None) -> None:
        with d.when(f("depth", number)):
            at_q.at(d, f, number, segment, reads["motion_q"])
            at_v.at(d, f, number, segment, reads["motion_v"])
            point = {"spring": f("spring", number), "lag": arrays["r_u"].part(2 * number, 2), "arm": f("arm", number)}
            d.step(stiff.contact_response, reads | point, force=force, pressed=pressed[number])
            d.step(con.load_about_torso, point | {"force": force}, load_=load)
            if segment is not None:
                with d.loop("k", 2 * segment + 2) as k:
                    column = f.column(number + -first_tail_point(d.tail), k)
                    d.step(stiff.tail_response, {"J_k": column, "force": force}, rhs_=x.part(6 + k, 1))

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
            reads = {"spring": f("spring", number), "motion": motion, "lag": lag, "pressed": pressed[number]}
            d.step(stiff.bristle_response, reads, k_u=k_u)

    each_contact(d, f, respond)


DAMPING = Argument("damping", lambda t: (t.nt,), "of the tail's joints (N m s): tau = -damping q_t_dot")
GAINS = Argument("gains", lambda t: (2,), "K_p (1/s^2), K_d (1/s) of tracking, through H_tt; zeros without")
WEIGHT = Argument(
    "weight",
    lambda t: (1 + (t.points > 0),),
    "w, weight of J: a method's coefficient times its step (s); with contacts then 1, or 0: friction's bound stays",
)
FACTORS = Argument("factors", lambda t: (factors_size(t),), "what implicit_solve needs")


def part(name: str, meaning: str) -> Argument:
    """Return an argument in the tangent space of q or in v."""
    return Argument(name, lambda t: (t.nv,), meaning)


def bristle_part(name: str, meaning: str) -> Argument:
    """Return an argument of the bristles."""
    return Argument(name, lambda t: (2 * t.points,), meaning)


_TABLE = (
    Function(
        "implicit_factor",
        "factors of 1 - w J, J of contact, joint damping and gains alone",
        (Q, V, DAMPING, GAINS, WEIGHT, BRISTLES, LEGS),
        (FACTORS,),
        assemble_factor,
    ),
    Function(
        "implicit_solve",
        "(1 - w J) k = r",
        (
            FACTORS,
            part("r_q", "right-hand side for q, in its tangent space"),
            part("r_v", "for v"),
            bristle_part("r_u", "for the bristles"),
        ),
        (part("k_q", "solution, in the tangent space"), part("k_v", "for v"), bristle_part("k_u", "for the bristles")),
        assemble_solve,
    ),
)
IMPLICIT = {function.name: function for function in _TABLE}
