"""The centre of mass, the joints of both legs, and partial feedback linearisation."""

import numpy as np
import pytest

from tests.references.contact import attitude, joints
from tests.references.parameters import random_states
from tests.support import zoo
from tests.support.rows import row

LEGS = {"L_h2d": 0.01, "L_d2k": 0.02, "L_k2a": 0.03, "L_a2m": 0.04, "L_m2t": 0.05}


def test_joints_are_those_of_the_reference():
    """Of quaternions of any norm, one by one, in a batch and in CasADi, for any parameters."""
    models = {name: zoo.own(name) for name in ("feet", "ground_m2_n2", "ground_arcs")}  # no lanes
    other = models["feet"].with_parameters(hip=(0.01, 0.02, -0.03), **LEGS)
    models["other legs"] = other.with_parameters(delta_m=0.7)
    for name, model in models.items():
        q = random_states(model.segments, 3, 20, "random")[0] * 1.7
        angles = np.random.default_rng(4).uniform(-np.pi, np.pi, (20, 4))
        batch = model.leg_points(q, angles)
        for k, (at, pose) in enumerate(zip(q, angles, strict=True)):
            place = np.array(joints(model.parameters, pose)) @ attitude(at[3:7]).T + at[:3]
            found = model.leg_points(at, pose)
            with row(name, k):
                np.testing.assert_allclose(found, place, rtol=0, atol=2e-14)
                np.testing.assert_array_equal(batch[k], found)
        graph = model.casadi.leg_points(at, pose).full().reshape(2, 6, 3)
        np.testing.assert_allclose(graph, place, rtol=0, atol=2e-14)


@pytest.mark.parametrize(
    "name", ["m1_n3", "loops", "arcs2_loops", pytest.param("arcs3", marks=pytest.mark.slow)]
)
def test_torques_of_the_tail_are_those_of_eliminating_the_torso(name):
    """Eqs. 44 to 46, in flight, in H and C."""
    model = zoo.model(name)
    q, v, v_dot, _ = random_states(model.segments, 3, 20, "random")
    wanted, tau = v_dot[:, 6:], model.pfl(q, v, v_dot[:, 6:])
    same, found = model.kernel("tracked_dynamics")(q, v, wanted)
    np.testing.assert_array_equal(found[:, 6:], wanted)
    np.testing.assert_allclose(same, tau, rtol=1e-12, atol=1e-14)
    expected = model.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())
    v_dot[:, :6] = 0
    H, force = model.mass_matrix(q), model.inverse_dynamics(q, v, v_dot)
    torso = np.linalg.solve(H[:, :6, :6], force[:, :6, None])
    expected = force[:, 6:] - (H[:, 6:, :6] @ torso)[..., 0]
    np.testing.assert_allclose(tau, expected, atol=1e-9 * np.abs(expected).max())
    graph = np.array(model.casadi.pfl(q[0], v[0], wanted[0])).ravel()
    np.testing.assert_allclose(graph, tau[0], rtol=1e-10)
