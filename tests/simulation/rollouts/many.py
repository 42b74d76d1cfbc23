"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

from functools import cache

import numpy as np

import serpentail as st

from ...support.models import model_folder

SEGMENTS, LINKS = 2, 2
NQ, NV, NT = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS
WANTED = ["forward_dynamics", "energy", "momentum", "rollout", "implicit", "pfl"]
ARRAYS = ("t", "q", "v", "tau", "kinetic", "potential", "linear_momentum", "angular_momentum")
PER_RUN = ARRAYS[1:]
DAMPING = st.Damping(1e-6)
LEGS = st.Legs.ramp(3.66, (-0.26, -1.3), at=0.01, rate=-70)


@cache
def tail(**options):
    return st.load(model_folder(SEGMENTS, LINKS, name="tail", functions=WANTED, **options))


@cache
def rat():
    """A model with feet and a tail that touch the ground."""
    return st.load(model_folder(1, 3, contacts=["feet", "tail"], functions=WANTED))


def starts(model, count, seed=0):
    """Random poses (count, nq), upright and clear of the ground, and velocities."""
    rng = np.random.default_rng(seed)
    q, v = 0.1 * rng.normal(size=(count, model.nq)), rng.normal(size=(count, model.nv))
    q[:, 2] += 1.0 if not model.contacts else 0.1
    q[:, 3:7] = [1, 0, 0, 0] + 0.05 * rng.normal(size=(count, 4))
    return q, v * ([0.1] * 3 + [1.0] * (model.nv - 3))


def alone(model, q, v, **settings):
    """Every run by a call of its own."""
    return [st.simulate(model, *state, **settings) for state in zip(q, v, strict=True)]


def same(rollouts, flights):
    """Assert that all arrays of rollouts are those of single flights, bit for bit."""
    for k, flight in enumerate(flights):
        np.testing.assert_array_equal(rollouts.t, flight.t)
        for name in PER_RUN:
            np.testing.assert_array_equal(
                getattr(rollouts, name)[k], getattr(flight, name), err_msg=name
            )
