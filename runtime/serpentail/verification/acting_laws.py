"""Laws of what acts on an animal besides torques and gravity: the passive tail's springs, damping
and stops, air and tendons, each against the same animal without it.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from serpentail_scene.layout import VELOCITY
from serpentail_scene.parameters import PARTS

from ..model.model import Model
from ..model.passive import passive_force, stored_energy
from .contact_laws import implicit_errors
from .errors import relative, rounding
from .law import PIECEWISE, SLOPE_LIMIT, VALUE_LIMIT, Errors, fastest, law, rid_of, slope
from .states import Case
from .value_laws import flight, momentum_errors


def added_error(
    model: Model, parts: tuple[str, ...], force: np.ndarray, f: Callable[[Model], np.ndarray]
) -> float:
    """Return the error of f, which is to be that without these parts, and their force."""
    found, bare = (np.asarray(f(each), float) for each in (model, rid_of(model, parts)))
    return relative(found, bare + force, np.abs(found) + np.abs(bare) + np.abs(force))


def tail_force(model: Model, s: Case, factor: float = 1.0) -> np.ndarray:
    """Return the generalised force (nv,) of the passive tail, its rates times a factor."""
    force, layout = np.zeros(model.nv), model.layout
    rates = factor * s.v[layout.tail_v]
    force[layout.tail_v] = passive_force(model.passive_values, s.q[layout.tail_q], rates)
    return force


@law("inverse_dynamics", VALUE_LIMIT, only="passive")
def the_tail_itself_asks_for_torques(model: Model, s: Case) -> Errors:
    """H v_dot + C has the forces of springs, damping and stops on the tail's coordinates alone."""
    force = tail_force(model, s)
    return added_error(model, PARTS, force, lambda m: m.inverse_dynamics(s.q, s.v, s.v_dot))


@law("energy", VALUE_LIMIT, only="passive")
def springs_and_stops_store_potential_energy(model: Model, s: Case) -> Errors:
    """Potential energy is that of height plus what the tail stores.

    Kinetic energy does not change.
    """
    bare = rid_of(model, PARTS)
    kinetic, potential = model.energy(s.q, s.v)
    own, height = bare.energy(s.q, s.v)
    stored = float(stored_energy(model.passive_values, s.q[model.layout.tail_q]))
    return {
        "kinetic": relative(kinetic, own),
        "potential": relative(potential, height + stored, abs(float(height)) + stored),
    }


@law("energy_derivatives", VALUE_LIMIT, only="passive")
def stored_energy_changes_by_its_forces(model: Model, s: Case) -> Errors:
    """The gradient of potential energy has the forces of springs and stops, without damping."""
    force = tail_force(model, s, 0.0)
    return added_error(model, PARTS, force, lambda m: m.energy_derivatives(s.q, s.v)[2])


@law("forward_dynamics inverse_dynamics", VALUE_LIMIT, only="passive")
def torques_that_make_up_for_it_rid_a_tail_of_it(model: Model, s: Case) -> Errors:
    """With torques that compensate the passive tail, v_dot is that of a tail without it."""
    bare = rid_of(model, PARTS)
    force = tail_force(model, s)[model.layout.tail_v]
    expected = bare.inverse_dynamics(s.q, s.v, bare.forward_dynamics(s.q, s.v, s.tau))
    found = bare.inverse_dynamics(s.q, s.v, model.forward_dynamics(s.q, s.v, s.tau + force))
    scale = np.abs(force).max() + np.abs(expected).max() + np.abs(found).max()
    return relative(found, expected, scale)


@law("rollout energy momentum", 2000, floor=1e-6, only="passive", without=("air",))
def passive_tails_change_energy_by_their_damping_alone(model: Model, s: Case) -> Errors:
    """In flight, momentum changes by - M g t and energy by the work of the tail's damping; springs
    and stops store energy and give it back. The tail starts between its stops.
    """
    values, q = model.passive_values, s.q.copy()
    tail = np.clip(q[model.layout.tail_q], -1, 1)
    if "tail_stop_lower" in values:
        tail = np.clip(tail, values["tail_stop_lower"], values["tail_stop_upper"])
    q[model.layout.tail_q] = tail
    motion = flight(model, replace(s, q=q), rtol=max(1e-8, 200 * rounding(model)))
    energy = motion.energy[-1] - sum(motion.info["work_J"].values())
    size = np.max(motion.kinetic + np.abs(motion.potential))
    error = {"energy": relative(energy, motion.energy[0], size)}
    return error if model.fixed else error | momentum_errors(model, motion)


@law("implicit_factor implicit_solve mass_matrix", VALUE_LIMIT, only="passive", without=PIECEWISE)
def implicit_steps_know_the_passive_tail(model: Model, s: Case) -> Errors:
    """High up and untracked, (1 - w J) k = r with J of springs and both dampings, relative to
    cond(H).
    """
    values = model.passive_values
    damping, stiffness = (
        np.asarray(values.get(f"tail_{name}", 0.0)) for name in ("damping", "stiffness")
    )
    force = lambda k_q, k_v: damping * k_v + stiffness * k_q  # noqa: E731
    return implicit_errors(model, s, np.zeros(2), force)


@law("inverse_dynamics air_force", VALUE_LIMIT, only="air")
def the_air_pushes_the_animal_itself(model: Model, s: Case) -> Errors:
    """H v_dot + C is that without air less the force of the air."""
    force = -model.air_force(s.q, s.v).astype(float)
    return added_error(model, ("air",), force, lambda m: m.inverse_dynamics(s.q, s.v, s.v_dot))


@law("air_force", VALUE_LIMIT, only="air")
def air_that_rests_takes_energy(model: Model, s: Case) -> Errors:
    """Seen from the air, its power is not positive."""
    v = s.v.astype(float)
    if model.fixed:
        model = model.with_parameters(wind=(0, 0, 0))
    else:
        v[VELOCITY] -= model.parameters["wind"]
    force = model.air_force(s.q, s.v).astype(float)
    return max(float(force @ v), 0.0) / max(float(np.abs(force) @ np.abs(v)), 1e-300)


@law("air_force", VALUE_LIMIT, only="air")
def air_that_moves_along_does_nothing(model: Model, s: Case) -> Errors:
    """An animal that does not turn or bend, and moves as the wind does, feels no force."""
    v, size = 0 * s.v, np.abs(model.air_force(s.q, s.v)).astype(float)
    if not model.fixed:
        v[VELOCITY] = model.parameters["wind"]
        return relative(model.air_force(s.q, v), 0 * v, size)
    still = model.with_parameters(wind=(0, 0, 0))
    return relative(still.air_force(s.q, v), 0 * v, size)


@law("tendon_lengths", SLOPE_LIMIT, only="tendons")
def lengths_change_with_the_tail(model: Model, s: Case) -> Errors:
    """The rate of a length along a motion is B q_t_dot."""
    tail, rates = model.layout.tail_q, s.v[model.layout.tail_v]

    def lengths(t: float) -> np.ndarray:
        q = s.q.copy()
        q[tail] += t * rates
        return model.tendon_lengths(q)[0].astype(float)

    rate = max(1.0, fastest(model, s.v))
    change, largest = slope(lengths, rate)
    return relative(change, model.tendon_lengths(s.q)[1] @ rates, largest * rate)


@law("tendon_lengths tendon_torques", VALUE_LIMIT, only="tendons")
def tensions_have_the_power_of_their_tendons(model: Model, s: Case) -> Errors:
    """T l_dot + tau q_t_dot = 0: what tendons lose, the tail gains."""
    B, rates = model.tendon_lengths(s.q)[1].astype(float), s.v[model.layout.tail_v]
    given = s.tension * (B @ rates)
    taken = model.tendon_torques(s.q, s.tension) @ rates
    return relative(given.sum(), -taken, np.abs(given).sum())
