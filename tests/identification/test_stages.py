"""Integrated intervals against SciPy's integrator, their derivatives against differences."""

import numpy as np
import pytest

from serpentail.identification import stages
from tests.identification.flights import flown, start
from tests.support import zoo


@pytest.mark.parametrize("name", ["m1_n3", "elastic", "arcs2"])
def test_ends_are_those_of_scipy(name):
    model = zoo.model(name)
    times = np.linspace(0, 0.05, 41)
    states = flown(model, times, start(model))
    spans, begin = np.diff(times), states[:-1]
    torques = np.zeros((len(spans), 3, model.layout.nt))
    found = stages.solved(model, spans, begin, torques, np.repeat(begin[:, None], 3, axis=1))
    off = stages.difference(model, found[:, -1], states[1:])
    assert np.abs(off).max() < 1e-7


def interval(model, x, torques, span=0.004):
    """End of one interval with torques at both ends."""
    nodes = stages.NODES[:, None]
    over = ((1 - nodes) * torques[0] + nodes * torques[1])[None]
    begin = x[None]
    guess = np.repeat(begin[:, None], 3, axis=1)
    return stages.solved(model, np.array([span]), begin, over, guess)[0], over


@pytest.mark.parametrize("name", ["m1_n3", "elastic_arcs"])
def test_derivatives_are_central_differences(name):
    model = zoo.model(name)
    rng = np.random.default_rng(0)
    x, torques = start(model), 1e-3 * rng.standard_normal((2, model.layout.nt))
    columns = np.eye(len(model.parameter_vector))
    X, over = interval(model, x, torques)
    parts = X[None], columns, True
    found = stages.differentiated(model, np.array([0.004]), x[None], over, parts)

    def change(ahead, behind, h):
        return stages.difference(model, ahead[-1], behind[-1]) / (2 * h)

    h = 1e-6
    for k, step in enumerate(h * np.eye(2 * model.nv)):
        ends = [interval(model, stages.moved(model, x, s * step), torques)[0] for s in (1, -1)]
        np.testing.assert_allclose(found.by_state[0, :, k], change(*ends, h), atol=2e-6, rtol=2e-6)
    for end in (0, 1):
        for k in range(model.layout.nt):
            step = np.zeros_like(torques)
            step[end, k] = 1e-5
            ends = [interval(model, x, torques + s * step)[0] for s in (1, -1)]
            wanted = change(*ends, 1e-5)
            np.testing.assert_allclose(
                found.by_torque[0, end, :, k], wanted, atol=1e-6 * np.abs(wanted).max()
            )
    for of, column in (("torso_mass", 1), ("tail_mount", 5)):
        value = np.array(model.parameters[of], float)
        small = 1e-6 * max(np.abs(value).max(), 1e-3)
        unit = np.eye(3)[0] if value.ndim else 1.0
        ends = []
        for sign in (1, -1):
            other = model.with_parameters(**{of: value + sign * small * unit})
            ends.append(interval(other, x, torques)[0])
        wanted = change(*ends, small)
        np.testing.assert_allclose(
            found.by_parameters[0, :, column], wanted, atol=1e-5 * np.abs(wanted).max() + 1e-9
        )
