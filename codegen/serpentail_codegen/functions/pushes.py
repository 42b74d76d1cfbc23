"""What forces from outside do to a run: they change v_dot, and work."""

from serpentail_scene.layout import OMEGA, VELOCITY

from ..ir.program import Array, Ref
from ..mechanics import contact, loads, rotations
from .contact import Points, place_feet
from .derivatives.jacobians import weightless
from .draft import Draft
from .factored import factored_dynamics
from .layout import LOAD, block
from .scope import State
from .sweeps.loads import gather_loads

ON_TORSO = 12  # numbers of the forces on the torso: their sum, and that of places times forces


def assemble_push_rates(draft: Draft, arrays: dict[str, Array]) -> None:
    """H^-1 J^T f and J^T f of forces alone, by the factors of forward dynamics."""
    tail, push, force = draft.tail, arrays["push"], arrays["force"]
    state = draft.state(arrays["q"], arrays["v"])
    factored = factored_dynamics(draft, arrays["q"], arrays["v"])
    R, torques = factored.R, draft.array("pushed", tail.nt)
    draft.fill(torques.whole(), 0)

    # the forces as external loads, those on the torso with their moment about B
    f_ext, points = draft.array("f_ext", tail.loads), tail.loads - LOAD
    draft.copy(block(f_ext, VELOCITY), push.part(0, 3))
    reads = {"R": R, "places": push.part(3, 9)}
    draft.step(loads.moment_of_places, reads, moment=block(f_ext, OMEGA))
    draft.copy(f_ext.part(LOAD, points), push.part(ON_TORSO, points))
    load = gather_loads(draft, state, R, f_ext, torques)
    if tail.leg_numbers:
        feet = _load_of_feet(draft, state, R, arrays)
        for name in feet:
            draft.copy(load[name], feet[name], adds=True)

    tau = weightless(draft, lambda k: torques.part(k, 1), **load)
    factored.solve(tau, arrays["v_dot"])
    if not tail.fixed:
        reads = {"R": R, "vector": load["load_force"]}
        draft.step(rotations.world_vector, reads, vector=block(force, VELOCITY))
        draft.copy(block(force, OMEGA), load["load_moment"])
    draft.copy(force.part(tail.torso_nv, tail.nt), torques.whole())


def _load_of_feet(draft: Draft, state: State, R: Ref, arrays: dict[str, Array]) -> dict[str, Ref]:
    """``load_force, load_moment`` at B of forces on the points of massless legs."""
    arms, velocities, drifts = (draft.array(f"foot_{n}", 3, 6) for n in ("arm", "motion", "drift"))
    points, push = Points(arms, velocities, {"feet": 0}, drifts=drifts), arrays["push"]
    place_feet(draft, state.torso(R), points, arrays["legs"])
    total = draft.vector("load_of_feet", 6)
    draft.fill(total, 0)
    with draft.loop("k", 6) as k:
        reads = {"arm": arms[k], "force": push.part(3 * k + (push.length - 18), 3)}
        draft.step(contact.load_about_torso, reads, load_=total)
    reads = {"R": R, "load": total}
    return dict(draft.store(contact.load_in_torso, reads, load_force=3, load_moment=3))


ASSEMBLIES = {"push_rates": assemble_push_rates}
