"""Independent references agree: libraries with 40 digits, and 40 digits with Lagrange and more."""

import importlib
from itertools import product

import casadi as ca
import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.support.rows import row

BENDS = [0.0, 1e-300, 1e-16, 1e-8, 1e-3, 1.0, np.pi, 2 * np.pi, 10.0]
NO_DIGITS = 1e-25  # of the largest entry: what is smaller is a remainder of many digits
INERTIA = {"link_inertia": (4.9e-8, 2e-9, 5e-8), "link_radius": None}


def states_of(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    return list(zip(*random_states(segments, 17, 2, kind), strict=True))


@pytest.mark.parametrize("name", ["Pinocchio", "Mujoco"])
@pytest.mark.parametrize("given", [{}, INERTIA], ids=["ellipsoids", "given inertias"])
def test_libraries_agree_with_40_digits(name, given):
    pytest.importorskip(name.lower())
    module = importlib.import_module(f"tests.references.{name.lower()}_chain")
    for size, kind in product([(1, 1), (1, 3), (3, 4)], KINDS):
        chain = getattr(module, f"{name}Chain")(TABLE_1 | given, *size)
        exact = ExactChain(TABLE_1 | given, *size)
        for q, v, v_dot, tau in states_of(size[0], kind):
            with row(size, kind):
                H = exact.mass_matrix(q)
                assert mass_matrix_error(chain.mass_matrix(q), H) <= 1e-13
                for function, last in (("bias_force", ()), ("inverse_dynamics", (v_dot,))):
                    found, force = (getattr(of, function)(q, v, *last) for of in (chain, exact))
                    assert block_error(found, force) <= 1e-13
                found, expected = (of.forward_dynamics(q, v, tau) for of in (chain, exact))
                assert block_error(found, expected) <= 1e-13 * equilibrated_condition(H)
                assert chain.energy(q, v) == pytest.approx(exact.energy(q, v), 1e-13, 1e-14)
                for function in ("momentum", "center_of_mass"):
                    pairs = zip(
                        *(getattr(of, function)(q, v) for of in (chain, exact)), strict=True
                    )
                    for x, expected in pairs:
                        assert np.abs(x - expected).max() <= 1e-13 * np.abs(expected).max()
                points = chain.tail_points(q)
                np.testing.assert_allclose(points, chained(q, *size), rtol=0, atol=5e-15)


def chained(q, segments, links):
    """p + R mount, then one link along -y_j after each R_j = R_{j-1} Rx(alpha_i) Rz(beta_i)."""
    rotation = Rotation.from_quat(q[3:7], scalar_first=True)
    points = [q[:3] + rotation.apply(TABLE_1["tail_mount"])]
    link = [0, -TABLE_1["tail_length"] / (segments * links), 0]
    for angles in np.repeat(np.reshape(q[7:], (segments, 2)), links, axis=0):
        rotation = rotation * Rotation.from_euler("XZ", angles)
        points.append(points[-1] + rotation.apply(link))
    return np.array(points)


def assert_same_float64(few, many, state):
    """Every quantity of two tails is the same float64, but for zeros."""
    q, v, v_dot, tau = state
    asked = {"mass_matrix": (q,), "inverse_dynamics": (q, v, v_dot), "energy": (q, v)}
    asked |= {"forward_dynamics": (q, v, tau), "momentum": (q, v), "center_of_mass": (q, v)}
    asked |= {"tail_points": (q, 3)} if isinstance(few, ExactContinuum) else {}
    for name, arguments in asked.items():
        found = [getattr(tail, name)(*arguments) for tail in (few, many)]
        for pair in zip(*found, strict=True):
            floor = NO_DIGITS * np.max(np.abs(pair[1]))
            np.testing.assert_array_equal(*(np.where(np.abs(x) < floor, 0, x) for x in pair))


def test_more_digits_and_nodes_give_the_same_float64():
    with mpmath.workdps(5):  # digits are a tail's own
        for size, kind in product([(1, 3), (3, 4)], KINDS):
            few, many = (ExactChain(TABLE_1, *size, digits) for digits in (30, 50))
            with row(size, kind):
                assert_same_float64(few, many, states_of(size[0], kind)[0])
        few, many = (ExactContinuum(TABLE_1, 1, *size) for size in ((40, 24), (60, 32)))
        (q, *others), _ = states_of(1, "random")
        for bend in BENDS:
            with row(bend):
                state = (np.array([*q[:7], 0.6 * bend, -0.8 * bend]), *others)
                assert_same_float64(few, many, state)


def lagrange(segments):
    """H, C and slices of Lagrange's equations at x = [p, xi, q_t] with xi = 0, by automatic
    differentiation.
    """
    nv = 6 + 2 * segments
    x, x_dot, axes = ca.SX.sym("x", nv), ca.SX.sym("x_dot", nv), ca.SX.sym("R", 3, 3)
    half = ca.skew(x[3:6] / 2)
    # R_b = R Exp(xi) up to xi^2, so omega = xi_dot and omega_dot = xi_ddot at xi = 0
    turn = ca.DM.eye(3) + 2 / (1 + ca.sumsqr(x[3:6]) / 4) * (half + half @ half)
    points, masses = paper_slices(x, axes @ turn, segments)
    turn_rate = ca.reshape(ca.jtimes(ca.vec(turn), x, x_dot), 3, 3)
    omega, inertia = ca.inv_skew(turn.T @ turn_rate), ca.diag(ca.DM(TABLE_1["torso_inertia"]))
    velocities = ca.jtimes(points, x, x_dot)
    kinetic = (velocities.T @ (masses * velocities) + omega.T @ inertia @ omega) / 2
    potential = TABLE_1["gravity"] * ca.dot(masses[2::3], points[2::3])
    mass, momenta = ca.hessian(kinetic, x_dot)
    bias = ca.jtimes(momenta, x, x_dot) - ca.gradient(kinetic - potential, x)
    return ca.Function("lagrange", [x, x_dot, axes], [mass, bias, kinetic, potential])


def paper_slices(x, axes, segments):
    """Coordinates of B and of the slices at nodes, each with its mass, in polar form (Eqs. 20 to
    23, 33).
    """
    nodes, weights = np.polynomial.legendre.leggauss(20)
    length, mass = TABLE_1["tail_length"] / segments, TABLE_1["tail_mass"] / segments
    points, masses = [x[:3]], [TABLE_1["torso_mass"], *np.tile(weights * mass / 2, segments)]
    root = x[:3] + axes @ ca.DM(TABLE_1["tail_mount"])
    for i in range(segments):
        a, b = x[6 + 2 * i], x[7 + 2 * i]
        theta, phi = ca.hypot(a, b), ca.atan2(b, -a)
        radial = ca.sin(phi) * axes[:, 0] + ca.cos(phi) * axes[:, 2]  # b_i of Eq. 23
        across, along = length / theta * radial, -length / theta * axes[:, 1]
        *slices, tip = [
            root + across + ca.sin(theta * s) * along - ca.cos(theta * s) * across
            for s in (*(1 + nodes) / 2, 1)
        ]
        points, root = points + slices, tip
        axes = axes @ about_y(phi) @ about_x(-theta) @ about_y(-phi)
    return ca.vertcat(*points), ca.DM(np.repeat(masses, 3))


def about_x(angle):
    """R_x."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))


def about_y(angle):
    """R_y."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, 0, s), ca.horzcat(0, 1, 0), ca.horzcat(-s, 0, c))


def test_lagrange_s_equations_of_the_paper_s_polar_form_agree_with_40_digits():
    for segments, kind in product((1, 2), ("random", "folded")):
        exact, equations = ExactContinuum(TABLE_1, segments), lagrange(segments)
        for q, v, v_dot, tau in states_of(segments, kind):
            with row(segments, kind):
                R = Rotation.from_quat(q[3:7], scalar_first=True).as_matrix()
                found = equations(np.concatenate([q[:3], np.zeros(3), q[7:]]), v, R)
                H, C, *energies = (np.array(x).squeeze() for x in found)
                assert mass_matrix_error(H, exact.mass_matrix(q)) <= 1e-13
                assert block_error(C, exact.bias_force(q, v)) <= 1e-13
                force = exact.inverse_dynamics(q, v, v_dot)
                assert block_error(force, H @ v_dot + C) <= 5e-13
                moved = exact.forward_dynamics(q, v, tau)
                limit = 1e-13 * equilibrated_condition(H)
                assert block_error(moved, np.linalg.solve(H, [*np.zeros(6), *tau] - C)) <= limit
                assert exact.energy(q, v) == pytest.approx(np.array(energies), 1e-13, 1e-14)
                linear, angular = exact.momentum(q, v)
                np.testing.assert_allclose(linear, (H @ v)[:3], rtol=0, atol=1e-14)
                # H_p,omega = -M (c - p)~ R_b
                about_torso = angular - H[:3, 3:6] @ R.T @ linear / H[0, 0]
                np.testing.assert_allclose(R @ (H @ v)[3:6], about_torso, rtol=0, atol=1e-15)
                tips = exact.tail_points(q, 2)[1:], tangent_integrals(q, segments, 2)
                np.testing.assert_allclose(*tips, rtol=0, atol=1e-14)


def tangent_integrals(q, segments, samples):
    """Points p_x = root - L R_i (int_0^x Exp(s [a, 0, b]) ds) y of a rod of constant curvature."""
    axes = Rotation.from_quat(q[3:7], scalar_first=True).as_matrix()
    root, points = q[:3] + axes @ TABLE_1["tail_mount"], []
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for a, b in q[7:].reshape(-1, 2):
        for x in np.arange(1, samples + 1) / samples:
            turns = Rotation.from_rotvec(np.outer(x * (1 + nodes) / 2, [a, 0, b])).as_matrix()
            bent = x / 2 * weights @ turns[:, :, 1]
            points.append(root - TABLE_1["tail_length"] / segments * axes @ bent)
        root, axes = points[-1], axes @ Rotation.from_rotvec([a, 0, b]).as_matrix()
    return np.array(points)
