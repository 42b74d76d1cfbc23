"""Laws of the air: what its force is, and in which functions it is."""

import numpy as np

from serpentail_scene.layout import VELOCITY

from ..model.model import Model
from .errors import relative
from .law import VALUE_LIMIT, Errors, law, rid_of
from .states import Case


@law("inverse_dynamics air_force", VALUE_LIMIT, only="air")
def the_air_pushes_the_animal_itself(model: Model, s: Case) -> Errors:
    """H v_dot + C is that without air less the force of the air."""
    bare, force = rid_of(model, ("air",)), model.air_force(s.q, s.v).astype(float)
    expected = bare.inverse_dynamics(s.q, s.v, s.v_dot).astype(float)
    found = model.inverse_dynamics(s.q, s.v, s.v_dot).astype(float)
    return relative(found, expected - force, np.abs(found) + np.abs(expected) + np.abs(force))


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
