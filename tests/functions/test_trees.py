"""Models of several chains: against sets of bodies in 60 digits, and against Pinocchio."""

import numpy as np
import pytest

from serpentail_scene.parameters import PASSIVE
from tests.functions.test_own_segments import accelerated
from tests.references.body_set import Animal, Chain, Hinge, Link
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
)
from tests.references.passive import PassiveTail
from tests.support import own_tails, zoo

FORWARD = 5e-15  # of v_dot, times the condition number of H
LEG = own_tails.LINK_BODIES[1:2], (0.01, 0.02, -0.003), (0.4, -0.2, 1.3)
# the same moments as of the ellipsoids that the scene describes
THIRD = (Link(5e-4, 0.02, 0.01, tuple(1e-4 * np.array([1.0841e-4, 1.682e-5, 1.0841e-4]))),) * 2
TREE = Animal(
    segments=own_tails.LINK_BODIES[:2],
    mount_angles=own_tails.TILT,
    **own_tails.VALUES,
    chains=(
        Chain(*LEG),
        Chain(*LEG, mirrored=True),
        Chain(own_tails.ARC_BODIES[:1], (0.002, 0.05, 0.01)),
        Chain((THIRD,), (-0.004, 0.01, 0.02)),
    ),
)
SHANK = Hinge(0, 1e-3, (0, -0.008, 0), (5e-8, 4e-9, 5e-8), (0, -0.02, 0))
THIGH = Hinge(0, 2e-3, (0, -0.015, 0), (9.64e-8, 1.28e-8, 9.64e-8), (0, -0.03, 0))
LIFT = (1.5e-3, (0.002, -0.008, -0.004), (6e-8, 4e-8, 5e-8), (0.005, -0.02, 0.003))
ARM = (Hinge(2, rotor=2e-7), Hinge(0, *LIFT, rotor=3e-7))
WHEEL = Hinge(1, 3e-3, inertia=(4e-8, 7e-8, 4e-8))
LIMB = ((Hinge(1), THIGH, SHANK), *LEG[1:])
LIMBS = Animal(
    segments=own_tails.LINK_BODIES[1:2],
    mount_angles=own_tails.TILT,
    **own_tails.VALUES,
    chains=(Chain(*LIMB), Chain(*LIMB, mirrored=True), Chain((*ARM, WHEEL), (0.002, 0.05, 0.01))),
)
# the passive chains of models: their first coordinate, how many, the names of their parameters
PASSIVE_CHAINS = {
    "tree": ((4, 2, "leg"), (6, 2, "leg"), (10, 2, "third")),
    "limbs": ((2, 3, "leg"), (5, 3, "leg")),
}


def passive(model, q, v):
    """Generalised forces of springs, damping and stops of a model of the zoo, chain by chain."""
    force = np.zeros(model.nv)
    for first, count, owner in PASSIVE_CHAINS[model.name]:
        names = {f"{owner}_{p.name.removeprefix('tail_')}": p.name for p in PASSIVE}
        own = {names[n]: x for n, x in model.parameters.items() if n in names}
        angles, rates = q[7 + first :][:count], v[6 + first :][:count]
        force[6 + first :][:count] = PassiveTail(own, count).force(angles, rates)
    return force


@pytest.mark.slow  # 60 digits
@pytest.mark.parametrize(("name", "bodies"), [("tree", TREE), ("limbs", LIMBS)])
def test_a_tree_is_its_set_of_bodies(name, bodies):
    model = zoo.model(name)
    for q, v, v_dot, tau in own_tails.states(model.nq, 1):
        H, force, bias = own_tails.dynamics(bodies, q, v, v_dot)
        own = passive(model, q, v)
        assert mass_matrix_error(model.mass_matrix(q), H) < 1e-13
        assert force_error(model.inverse_dynamics(q, v, v_dot), force + own, H) < 1e-13
        assert force_error(model.bias_force(q, v), bias + own, H) < 1e-13
        second = model.layout.chains[1].v.start
        assert (model.mass_matrix(q)[6:second, second:] == 0).all()  # chains do not couple

        expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - bias - own)
        most = FORWARD * equilibrated_condition(H)
        assert block_error(model.forward_dynamics(q, v, tau), expected) < most
        graph = model.casadi.forward_dynamics(q, v, tau).full().ravel()
        assert block_error(graph, expected) < most
        np.testing.assert_allclose(model.energy(q, v)[0], bodies.energy(q, v)[0], rtol=1e-14)
        for found, momentum in zip(model.momentum(q, v), bodies.momentum(q, v), strict=True):
            assert np.abs(found - momentum).max() < 1e-13 * np.abs(momentum).max()
        assert np.abs(model.tail_points(q) - bodies.tail_points(q)).max() < 1e-15

        # in the air: torso and acceleration by the momentum of the bodies; M' by that of H
        x, h = np.concatenate([q[3:], v[6:]]), np.array(bodies.momentum(q, v)[1], float)
        y, J = model.airborne_rates_derivatives(x, tau, h)
        nt, most = model.layout.nt, 1e-13 * equilibrated_condition(H)
        assert np.abs(y[-3:] - v[3:6]).max() < most * np.abs(v).max()
        assert block_error(y[4 + nt : -3], expected[6:]) < most
        left = H[6:, 6:] - H[6:, :6] @ np.linalg.solve(H[:6, :6], H[:6, 6:])
        assert np.abs(J[4 + nt : -3, -nt:] @ left - np.eye(nt)).max() < most


@pytest.mark.parametrize("name", ["tree", "limbs"])
def test_loads_do_their_work(name):
    """J^T f of a force at each point, by the points' velocities along v_dot of a load alone."""
    model, step = zoo.model(name), 1e-6
    q, v, _, tau = next(own_tails.states(model.nq, 1))
    q[3:7] /= np.linalg.norm(q[3:7])
    rng = np.random.default_rng(4)
    f_ext = rng.normal(size=len(model.external_force()))
    change = model.forward_dynamics(q, v, tau, f_ext) - model.forward_dynamics(q, v, tau)
    force, way = model.mass_matrix(q) @ change, rng.normal(size=model.nv)
    ahead, behind = (model.tail_points(model.integrate(q, way, h)) for h in (step, -step))
    power = f_ext[:3] @ way[:3] + f_ext[3:6] @ way[3:6]
    power += np.sum(f_ext[6:].reshape(-1, 3) * (ahead - behind)) / (2 * step)
    assert way @ force == pytest.approx(power, rel=1e-8)
