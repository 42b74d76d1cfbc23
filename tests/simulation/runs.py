"""What the tests of runs share: starts, each run by itself, and how the two are compared."""

import numpy as np

import serpentail as st
from tests.support import zoo

NQ, NV, NT = 11, 10, 4  # of two segments
Q0 = np.array([0.1, -0.2, 0.3, 0.8, -0.4, 0.4, 0.2, 0.5, -0.4, 0.3, 0.6])
V0 = np.array([0.3, -0.5, 1.2, 4.0, -2.0, 3.0, 8.0, -6.0, 5.0, 7.0])
ARRAYS = ("t", "q", "v", "tau", "kinetic", "potential", "linear_momentum", "angular_momentum")
PER_RUN = ARRAYS[1:]
DAMPING = st.Damping(1e-6)
LEGS = st.Legs.ramp(3.66, (-0.26, -1.3), at=0.01, rate=-70)
# torques with kinks and with jumps
TABLE = st.TorqueTable([0.0, 0.0123, 0.031], np.outer([1, -1, 2], [1e-5, 2e-5, -1e-5, 1e-5]), 1e-6)
JUMPS = st.TorqueCurve(
    st.Piecewise(
        np.array([0.01, 0.0207, 0.04]), 1e-5 * np.array([[[1.0, 0]] * NT, [[-2.0, 9]] * NT])
    )
)


def tail():
    """The model that flies."""
    return zoo.model("m2_n2")


def rat():
    """A model with feet and a tail that touch the ground."""
    return zoo.model("feet_tail")


def fly(model=None, **settings):
    """A flight from Q0, V0."""
    return st.simulate(model or tail(), Q0, V0, **{"t_span": 0.2} | settings)


def starts(model, count, seed=0):
    """Random poses (count, nq), upright and clear of the ground, and velocities."""
    rng = np.random.default_rng(seed)
    q, v = 0.1 * rng.normal(size=(count, model.nq)), rng.normal(size=(count, model.nv))
    q[:, 2] += 1.0 if not model.contacts else 0.1
    q[:, 3:7] = [1, 0, 0, 0] + 0.05 * rng.normal(size=(count, 4))
    return q, v * ([0.1] * 3 + [1.0] * (model.nv - 3))


def alone(model, q, v, controller=None, **settings):
    """Every run by a call of its own, with one of the controllers if there are several."""
    each = controller if isinstance(controller, list | tuple) else [controller] * len(q)
    runs = zip(q, v, each, strict=True)
    return [st.simulate(model, *run[:2], controller=run[2], **settings) for run in runs]


def same(rollouts, flights):
    """Assert that all arrays of rollouts are those of single flights, bit for bit."""
    for k, flight in enumerate(flights):
        np.testing.assert_array_equal(rollouts.t, flight.t)
        for name in PER_RUN:
            np.testing.assert_array_equal(
                getattr(rollouts, name)[k], getattr(flight, name), err_msg=f"{name} of run {k}"
            )


def near(rollouts, flights, digits=1e-11):
    """Assert that all arrays of rollouts are those of single flights but for rounding."""
    for name in PER_RUN:
        expected = np.array([getattr(flight, name) for flight in flights])
        error = np.abs(getattr(rollouts, name) - expected).max()
        assert error <= digits * max(np.abs(expected).max(), 1e-9), (name, error)


def both(model, q, v, controller=None, each=None, compare=same, **settings):
    """Rollouts, and every run by a call of its own, with the controllers ``each``: they agree."""
    found = st.simulate(model, q, v, controller=controller, **settings)
    flights = alone(model, q, v, controller if each is None else each, **settings)
    compare(found, flights)
    return found, flights


def centre_of_mass(model, flight):
    """By the middles of equal links (K, 3); of another tail by the model's own function."""
    if model.kind != "articulated":
        return model.center_of_mass(flight.q, flight.v)[0]
    points = model.tail_points(flight.q)
    torso, own = model.parameters["torso_mass"], model.parameters["tail_mass"]
    middles = (points[:, 1:] + points[:, :-1]) / 2
    return (torso * flight.q[:, :3] + own * middles.mean(axis=1)) / (torso + own)


def summed(values, t):
    """Trapezoidal integral from the start, (K, n)."""
    steps = (values[1:] + values[:-1]) / 2 * np.diff(t)[:, None]
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(steps, axis=0)])
