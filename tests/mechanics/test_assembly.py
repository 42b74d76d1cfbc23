"""Every function equals its definition, exactly, in rational arithmetic."""

import pytest
from sympy import Matrix, diag, eye, zeros

from .exact import State, kinetic_form, momentum_about, run


@pytest.fixture(params=[(1, 3), (2, 2), (3, 1)], ids=["m1_n3", "m2_n2", "m3_n1"])
def state(request):
    """A random rational state of a tail; its quaternion is not normalised."""
    return State(*request.param, seed=7)


def test_mass_matrix_is_the_form_of_kinetic_energy_and_forces_are_virtual_work(state):
    nv, H = state.tail.nv, state.mass_matrix()
    assert Matrix(nv, nv, list(run("mass_matrix", state)["H"])) == H
    to_world = diag(eye(3), state.bodies()[0].R[0], eye(state.tail.nt))
    assert Matrix(nv, nv, list(run("mass_matrix_world", state)["H"])) == to_world * H * to_world.T
    assert run("inverse_dynamics", state)["force"] == state.force(state.v_dot)
    C = state.force(zeros(nv, 1))
    assert run("bias_force", state)["force"] == C
    assert run("bias_force_world", state)["force"] == to_world * C


def test_forward_dynamics_solves_the_equations_of_motion(state):
    tau = Matrix.vstack(zeros(6, 1), state.tau)
    assert state.force(run("forward_dynamics", state)["v_dot"]) == tau
    J, f = state.point_jacobian(), state.f_ext
    at_torso = Matrix.vstack(f[:6, :], zeros(state.tail.nt, 1))
    pushed = run("forward_dynamics_external", state)["v_dot"]
    assert state.force(pushed) == tau + at_torso + J.T * f[6:, :]


def test_tail_points_and_their_jacobians(state):
    points = Matrix.vstack(*(body.end[0] for body in state.bodies()))
    assert run("tail_points", state)["points"] == points
    assert list(state.point_jacobian()) == list(run("tail_point_jacobians", state)["J"])


def test_energy_and_momentum_are_sums_over_bodies(state):
    bodies = state.bodies(state.v)
    height = sum(body.mass * body.com[0][2] for body in bodies)
    energy = run("energy", state)
    assert energy["kinetic"][0] == kinetic_form(bodies, bodies) / 2
    assert energy["potential"][0] == state.parameters["gravity"][0] * height
    mass = sum(body.mass for body in bodies)
    com = sum((body.mass / mass * body.com[0] for body in bodies), zeros(3, 1))
    expected = momentum_about(com, bodies)
    momentum = run("momentum", state)
    assert Matrix.vstack(momentum["linear"], momentum["angular"]) == expected
    found, columns = run("center_of_mass", state), state.columns()
    assert found["position"] == com
    assert found["velocity"] == momentum["linear"] / mass
    J = Matrix.hstack(*(momentum_about(com, column)[:3, :] / mass for column in columns))
    assert Matrix(3, state.tail.nv, list(found["J"])) == J
