"""What forces from outside do to a run: they change v_dot, and work."""

from serpentail_scene.layout import OMEGA, PUSH_ON_TORSO, VELOCITY

from ..ir.program import Array, Ref
from ..mechanics import contact, loads, rotations, torso
from .contact import Points, place_feet
from .derivatives.jacobians import weightless
from .draft import Draft
from .factored import factored_dynamics
from .layout import LOAD, block
from .scope import Torso
from .sweeps.loads import gather_loads


def assemble_push_rates(draft: Draft, arrays: dict[str, Array]) -> None:
    """H^-1 J^T f and J^T f of forces alone, by the factors of forward dynamics."""
    tail, push, force = draft.tail, arrays["push"], arrays["force"]
    state = draft.state(arrays["q"], arrays["v"])
    factored = factored_dynamics(draft, arrays["q"], arrays["v"])
    R, torques = factored.R, draft.array("pushed", tail.nt)
    draft.fill(torques.whole(), 0)

    # the forces as external loads, those on the torso with their moment about B
    f_ext, points = draft.array("f_ext", tail.loads), tail.loads - LOAD
    moment = block(f_ext, OMEGA)
    draft.copy(block(f_ext, VELOCITY), push.part(0, 3))
    draft.step(loads.moment_of_places, {"R": R, "places": push.part(3, 9)}, moment=moment)
    if tail.leg_numbers:
        _add_feet(draft, state.torso(R), arrays, f_ext.part(0, LOAD))
    draft.step(torso.torso_velocity, {"R": R, "p_dot": moment}, u=moment)
    draft.copy(f_ext.part(LOAD, points), push.part(PUSH_ON_TORSO, points))

    load = gather_loads(draft, state, R, f_ext, torques)
    factored.solve(weightless(draft, lambda k: torques.part(k, 1), **load), arrays["v_dot"])
    if not tail.fixed:
        reads = {"R": R, "vector": load["load_force"]}
        draft.step(rotations.world_vector, reads, vector=block(force, VELOCITY))
        draft.copy(block(force, OMEGA), load["load_moment"])
    draft.copy(force.part(tail.torso_nv, tail.nt), torques.whole())


def _add_feet(draft: Draft, body: Torso, arrays: dict[str, Array], load: Ref) -> None:
    """Add forces on the points of massless legs, the last of ``push``, to a load at B in world
    axes.
    """
    arms, velocities, drifts = (draft.array(f"foot_{n}", 3, 6) for n in ("arm", "motion", "drift"))
    place_feet(draft, body, Points(arms, velocities, {"feet": 0}, drifts=drifts), arrays["legs"])
    first = arrays["push"].length - arms.length
    with draft.loop("k", 6) as k:
        reads = {"arm": arms[k], "force": arrays["push"].part(3 * k + first, 3)}
        draft.step(contact.load_about_torso, reads, load_=load)


ASSEMBLIES = {"push_rates": assemble_push_rates}
