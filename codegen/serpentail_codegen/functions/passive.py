"""Springs, damping and stops of the tail's coordinates, if a scene has them.

They act only on the coordinates: their forces are added to H v_dot + C, or subtracted from the
torques.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from ..ir.program import Array, Index, Ref
from ..mechanics import passive
from ..mechanics.lower import derive
from .draft import Draft
from .scope import Instead, State, Vectors
from .sweeps.chains import each_chain
from .tail import Tail
from .tails.mechanism import StepFunction

FORCES: dict[str, StepFunction] = {
    "spring": passive.spring_force,
    "damping": passive.damping_force,
    "stops": passive.stop_force,
    "stop damping": passive.stop_damping_force,
    "rotor": passive.rotor_torque,
}
ENERGIES: dict[str, StepFunction] = {"spring": passive.spring_energy, "stops": passive.stop_energy}
SLOPES: dict[str, StepFunction] = {"spring": passive.spring_slope, "stops": passive.stop_slope}


def passive_parameters(draft: Draft, step: StepFunction, part: Callable[[Array], Ref]) -> Instead:
    """Return the parameters that a step reads, for some coordinates only."""
    names = [name for name in draft.parameters if name in dict(derive(step).inputs)]
    return Instead({name: part(draft.parameters[name].array) for name in names})


@contextmanager
def each_passive_force(
    draft: Draft, state: State, v_dot: Array | None = None
) -> Iterator[tuple[Index, Ref]]:
    """Open a loop over the segments of a chain; yields the segment and the forces of its passive
    parts, those of rotors only if there is v_dot.
    """
    force = draft.vector("passive", draft.tail.width)
    with draft.loop("i", draft.tail.segments) as i:
        draft.fill(force, 0)
        _add_forces(draft, state, i, force, v_dot)
        yield i, force


def _forces(tail: Tail, v_dot: Array | None = None) -> list[StepFunction]:
    """Return the steps of what acts on a tail by itself."""
    names = [name for name in tail.passive if name in FORCES and (v_dot or name != "rotor")]
    return [FORCES[name] for name in names]


def _add_forces(
    draft: Draft, state: State, i: Index, force: Ref, v_dot: Array | None = None
) -> None:
    reads = {"angles": state.angles(i), "rates": state.rates(i)}
    reads |= {"accelerations": draft.tail.segment_v(v_dot, i)} if v_dot else {}
    for step in _forces(draft.tail, v_dot):
        own = passive_parameters(draft, step, partial(draft.tail.of_chain, i=i))
        draft.step(draft.of_segment(step), Vectors(reads), own, passive_=force)


def add_passive_forces(
    draft: Draft, state: State, force: Callable[[Index], Ref], v_dot: Array | None = None
) -> None:
    """Add the forces of the passive parts to the force on each segment."""
    for chain in each_chain(draft):
        if _forces(chain, v_dot):
            with draft.loop("i", chain.segments) as i:
                _add_forces(draft, state.on(chain), i, force(i), v_dot)


def add_passive_power(
    draft: Draft, state: State, multiplier: Array, v_dot: Array, power: Ref
) -> None:
    """Add the power of the passive parts, when the tail moves with a multiplier."""
    for chain in each_chain(draft):
        if _forces(chain, v_dot):
            with each_passive_force(draft, state.on(chain), v_dot) as (i, passive_force):
                rates = {"virtual_rates": chain.segment_v(multiplier, i)}
                reads = {"passive": passive_force} | rates
                draft.step(draft.of_segment(passive.virtual_power), reads, power_=power)


def net_torques(draft: Draft, state: State, tau: Array) -> Array:
    """Return the torques minus those of the passive parts: what is left for the dynamics."""
    if not _forces(draft.tail):
        return tau
    net = draft.array("net_torques", draft.tail.nt)
    for chain in each_chain(draft):
        if chain.prescribed:
            continue
        with each_passive_force(draft, state.on(chain)) as (i, passive_force):
            reads = {"tau": chain.segment_tau(tau, i), "passive": passive_force}
            draft.step(draft.of_segment(passive.net_torque), reads, net=chain.segment_tau(net, i))
    return net


def add_elastic_energy(draft: Draft, state: State, potential: Ref) -> None:
    """Add the energy that springs and stops store."""
    _add_energies(draft, state, ENERGIES, potential_=potential)


def add_rotor_energy(draft: Draft, state: State, kinetic: Ref) -> None:
    """Add the kinetic energy of rotors."""
    _add_energies(draft, state, {"rotor": passive.rotor_energy}, kinetic_=kinetic)


def _add_energies(
    draft: Draft, state: State, steps: dict[str, StepFunction], **energy: Ref
) -> None:
    for chain in each_chain(draft):
        own = state.on(chain)
        for step in (steps[name] for name in chain.passive if name in steps):
            with draft.loop("i", chain.segments) as i:
                parameters = passive_parameters(draft, step, partial(chain.of_chain, i=i))
                reads = Vectors({"angles": own.angles(i), "rates": own.rates(i)})
                draft.step(draft.of_segment(step), reads, parameters, **energy)
