"""Laws of the passive tail: its springs, damping and stops, against the same tail without them."""

from dataclasses import replace

import numpy as np

from serpentail_scene.parameters import PARTS

from ..model.model import Model
from ..model.passive import passive_force, stored_energy
from ..model.weight import fall, total_mass
from .contact_laws import implicit_step
from .errors import relative, rounding, sensitivity
from .law import PIECEWISE, VALUE_LIMIT, Errors, law, rid_of
from .states import Case
from .value_laws import flight


@law("inverse_dynamics", VALUE_LIMIT, only="passive")
def the_tail_itself_asks_for_torques(model: Model, s: Case) -> Errors:
    """H v_dot + C has the forces of springs, damping and stops on the tail's coordinates alone."""
    bare = rid_of(model, PARTS)
    force = model.inverse_dynamics(s.q, s.v, s.v_dot).astype(float)
    expected = bare.inverse_dynamics(s.q, s.v, s.v_dot).astype(float)
    size = np.abs(force) + np.abs(expected)
    expected[model.layout.tail_v] += passive_force(
        model.passive_values, s.q[model.layout.tail_q], s.v[model.layout.tail_v]
    )
    return relative(force, expected, size + np.abs(expected))


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
    bare = rid_of(model, PARTS)
    gradient = model.energy_derivatives(s.q, s.v)[2].astype(float)
    expected = bare.energy_derivatives(s.q, s.v)[2].astype(float)
    size = np.abs(gradient) + np.abs(expected)
    expected[model.layout.tail_v] += passive_force(
        model.passive_values, s.q[model.layout.tail_q], 0 * s.v[model.layout.tail_v]
    )
    return relative(gradient, expected, size)


@law("forward_dynamics inverse_dynamics", VALUE_LIMIT, only="passive")
def torques_that_make_up_for_it_rid_a_tail_of_it(model: Model, s: Case) -> Errors:
    """With torques that compensate the passive tail, v_dot is that of a tail without it."""
    bare = rid_of(model, PARTS)
    force = passive_force(model.passive_values, s.q[model.layout.tail_q], s.v[model.layout.tail_v])
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
    if model.fixed:
        return error
    pull = total_mass(values) * fall(values)
    linear = motion.linear_momentum[0] + np.outer(motion.t, pull)
    return error | {
        "linear": relative(motion.linear_momentum, linear),
        "angular": relative(motion.angular_momentum, motion.angular_momentum[0]),
    }


@law("implicit_factor implicit_solve mass_matrix", VALUE_LIMIT, only="passive", without=PIECEWISE)
def implicit_steps_know_the_passive_tail(model: Model, s: Case) -> Errors:
    """High up and untracked, (1 - w J) k = r with J of springs and both dampings, relative to
    cond(H).
    """
    w, damping, values = 1e-3, np.linspace(1e-3, 2e-3, len(s.tau)), model.passive_values
    H = model.mass_matrix(s.q).astype(float)
    k_q, k_v, *_ = implicit_step(model, s, w, damping, np.zeros(2))

    # H (k_v - r_v) = -w (D k_v + K k_q)
    own = damping + np.asarray(values.get("tail_damping", 0.0))
    stiffness, load = np.asarray(values.get("tail_stiffness", 0.0)), np.zeros(model.nv)
    tail = model.layout.tail_v
    load[tail] = -w * (own * k_v[tail] + stiffness * k_q[tail])
    scale = np.sqrt(np.diag(H))
    return {
        "v": relative(H @ (k_v - s.dv) / scale, load / scale) / sensitivity(model, s.q),
        "q": relative(k_q, s.dq + w * k_v),
    }
