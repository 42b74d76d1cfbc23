"""Implicit integrators' linear systems: a draft goes in, factoring and solving with 1 - w J are
added to it.

J is the Jacobian of the rates of (q in its tangent space, v, bristles), of contact, joint damping
and tracking gains alone.  With k_q = r_q + w k_v and the bristles eliminated, S (k_v - r_v) =
forces is left, S = H + stiffness, symmetric and positive definite but for points that slide: there
friction follows the load, and S takes two triangles. Eliminating translation is what the first
three pivots of S do.
"""

from ...ir.program import Array, Index, padded
from ...mechanics import contact as con
from ...mechanics import contact_stiffness as stiff
from ...mechanics import loads
from ...mechanics.lower import derive
from ..contact import Points, gather_points
from ..draft import Draft
from ..dynamics import assemble_mass_matrix
from .layout import Factors, each_contact, first_tail_point

# ---- factoring -----------------------------------------------------------------------------------


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
        d.step(
            stiff.gained,
            {"gain": f("gain_v"), "entry": f.entry("H_tail", k, other)},
            S_entry_=entry,
        )


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
    reads = points.motion(number) | {
        "bristle": bristles.part(2 * number, 2),
        "spring": f("spring", number),
    }
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
                    d.step(
                        loads.point_jacobian_tail,
                        {"S": S[segment], "arm": f("arm", number)},
                        **rows,
                    )
                with d.loop("k", 2 * i + 2) as k:
                    reads = {
                        "arm": f("arm", number),
                        "spring": f("spring", number),
                        "J_k": f.column(g, k),
                    }
                    d.step(
                        stiff.stiffened_column, reads, force=force, S_row_=f.entry("S", 6 + k, 0, 6)
                    )
                    with d.loop("l", k + 1) as other:
                        reads = {"J_k": f.column(g, other), "force": force}
                        d.step(
                            stiff.coupled_columns, reads, S_entry_=f.entry("S", 6 + k, 6 + other)
                        )


def add_sliding(d: Draft, f: Factors) -> None:
    """The transpose of S, and what makes them differ: the points that slide, whose friction follows
    the load.
    """
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


def shear_tail(
    d: Draft, f: Factors, number: Index, segment: Index, columns: tuple[Array, Array]
) -> None:
    """The tail's part of both columns of a tail point."""
    push, lift = columns
    with d.loop("k", 2 * segment + 2) as k:
        reads = {
            "J_k": f.column(number + -first_tail_point(d.tail), k),
            "spring": f("spring", number),
        }
        d.step(stiff.sheared_column, reads, push=push.part(6 + k, 1), lift=lift.part(6 + k, 1))


def shear_triangles(d: Draft, f: Factors, count: Index | int, columns: tuple[Array, Array]) -> None:
    """Add the product of two columns to S, and to its transpose."""
    push, lift = columns
    with d.loop("k", count) as k, d.loop("l", k + 1) as other:
        reads = {"push_k": push.part(k, 1), "push_l": push.part(other, 1)}
        reads |= {"lift_k": lift.part(k, 1), "lift_l": lift.part(other, 1)}
        d.step(
            stiff.sheared_entries,
            reads,
            entry_=f.entry("S", k, other),
            turned_=f.entry("S_turned", k, other),
        )
