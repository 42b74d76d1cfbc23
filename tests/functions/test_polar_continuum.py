"""The paper's closed forms in polar angles: right where they can be, wrong by 1 / theta^4, refused
at theta = 0.
"""

import subprocess
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy

import serpentail as st
from serpentail_codegen.mechanics import polar_arc as polar_continuum
from serpentail_codegen.scene.signatures.table import VALUES
from tests.references.exact_polar import ExactPolar
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import TABLE_1
from tests.support.models import model_folder

MODERATE = (0.5, 1.0, 2.0, np.pi)
VANISHING = 10.0 ** np.arange(-1, -3.1, -0.5)
FUNCTIONS = [*VALUES, "rollout"]
EMISSIONS = {"straight": (1, "straight"), "loops": (2, "loops")}


@cache
def model(segments, coordinates="polar", emission="auto"):
    """The compiled continuum in one kind of coordinates."""
    options = {"coordinates": coordinates, "emission": emission, "functions": FUNCTIONS}
    return st.load(model_folder(segments, None, **options))


@cache
def reference(segments):
    """The continuum in 50 digits."""
    return ExactPolar(TABLE_1, segments)


def polar_state(segments, theta, seed=0):
    """(q, v, v_dot, tau), every segment bent by theta, torques on phi that stay finite in bend
    components.
    """
    rng = np.random.default_rng([seed, segments])
    nv = 6 + 2 * segments
    q, v, v_dot = rng.normal(size=nv + 1), 10 * rng.normal(size=nv), 100 * rng.normal(size=nv)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7::2], q[8::2] = rng.uniform(0, 2 * np.pi, segments), theta
    return (
        q,
        v,
        v_dot,
        1e-3 * rng.normal(size=(segments, 2)).ravel() * np.tile([theta, 1.0], segments),
    )


def errors(polar, state):
    """Errors of H, H v_dot + C and v_dot of a polar model; forces and accelerations are compared in
    bend components.
    """
    (q, v, v_dot, tau), exact = state, reference(polar.segments)
    q_bend, v_bend = exact.state(q, v)
    force = exact.bend.inverse_dynamics(q_bend, v_bend, exact.acceleration(q, v, v_dot))
    acceleration = exact.bend.forward_dynamics(q_bend, v_bend, exact.force(q, tau))
    return (
        mass_matrix_error(polar.mass_matrix(q), exact.mass_matrix(q)),
        block_error(numbers(exact.force(q, polar.inverse_dynamics(q, v, v_dot))), force),
        block_error(
            numbers(exact.acceleration(q, v, polar.forward_dynamics(q, v, tau))), acceleration
        ),
    )


def bend_errors(bend, state):
    """Errors of H and v_dot of a bend model at the same state, rounded to float64."""
    (q, v, _, tau), exact = state, reference(bend.segments)
    q, v, tau = (numbers(x) for x in (*exact.state(q, v), exact.force(q, tau)))
    H = mass_matrix_error(bend.mass_matrix(q), exact.bend.mass_matrix(q))
    return H, block_error(bend.forward_dynamics(q, v, tau), exact.bend.forward_dynamics(q, v, tau))


def numbers(vector):
    """The nearest float64 of every entry."""
    return np.array(vector, dtype=float)


def rate_map(q):
    """d(a, b) / d(phi, theta) beside the identity of the torso's rates."""
    J = np.eye(len(q) - 1)
    for k, (phi, theta) in enumerate(q[7:].reshape(-1, 2)):
        s, c, here = np.sin(phi), np.cos(phi), slice(6 + 2 * k, 8 + 2 * k)
        J[here, here] = [[theta * s, -c], [theta * c, s]]
    return J


def in_bend(q, v):
    """The state in bend components, in float64."""
    q_bend, v_bend = q.copy(), v.copy()
    a, b, a_dot, b_dot = st.polar_to_bend(q[7::2], q[8::2], v[6::2], v[7::2])
    q_bend[7::2], q_bend[8::2], v_bend[6::2], v_bend[7::2] = a, b, a_dot, b_dot
    return q_bend, v_bend


# The closed forms


def f_v(theta, x):
    """Eq. 27."""
    s, c = mpmath.sin(theta * x), mpmath.cos(theta * x)
    return [1, s, x * c, -c, x * s]


def f_a(theta, x):
    """Eq. 32."""
    s, c = mpmath.sin(theta * x), mpmath.cos(theta * x)
    return [1, s, 2 * x * c, x * c, -x * x * s, -c, 2 * x * s, x * s, x * x * c]


@pytest.mark.parametrize("theta", ["0.01", "0.7", "3.0"])
def test_entries_of_appendix_b_are_the_integrals(theta):
    def unchanged(_name, value):
        return value

    angles = sympy.Integer(0), sympy.Rational(theta)
    trig = polar_continuum.segment_trigonometry(unchanged, angles)["trig"]
    forms = polar_continuum.slice_integrals(unchanged, angles, trig)
    E, Q = (
        polar_continuum.matrix_E(forms["E_v"]),
        polar_continuum.matrix_Q(forms["E_v"], forms["Q_v"]),
    )
    with mpmath.workdps(40):
        bend = mpmath.mpf(theta)
        for matrix, other in ((E, f_v), (Q, f_a)):
            for k, j in np.ndindex(matrix.shape):
                expected = mpmath.quad(
                    lambda x, k=k, j=j, f=other: f_v(bend, x)[k] * f(bend, x)[j], [0, 1]
                )
                assert abs(mpmath.mpf(str(matrix[k, j].evalf(60))) - expected) <= 1e-35, (k, j)


# Right where they can be, and how they fail


@pytest.mark.parametrize("emission", EMISSIONS)
@pytest.mark.parametrize("theta", MODERATE)
def test_moderate_bends_are_right_up_to_cancellation(theta, emission):
    polar = model(EMISSIONS[emission][0], emission=emission)
    rounding = (
        2e-15 + 1e-14 / theta**4
    )  # five times the worst found: the terms that cancel are 1 / theta^4 times H
    for seed in range(3):
        state = polar_state(polar.segments, theta, seed)
        inertia, force, v_dot = errors(polar, state)
        assert inertia <= rounding
        assert force <= 2 * rounding
        assert v_dot <= 4 * rounding * equilibrated_condition(
            reference(polar.segments).mass_matrix(state[0])
        )


@pytest.mark.slow
def test_error_grows_as_theta_to_the_minus_four_and_that_of_the_bend_form_does_not():
    polar, bend = model(1), model(1, "bend")
    worst = []
    for theta in VANISHING:
        states = [polar_state(1, theta, seed) for seed in range(8)]
        worst.append(np.max([errors(polar, state) for state in states], axis=0)[[0, 2]])
        assert max(max(bend_errors(bend, state)) for state in states) <= 1e-14
    slopes = np.polyfit(np.log10(VANISHING), np.log10(worst), 1)[0]
    assert slopes[0] == pytest.approx(-4, abs=0.5)
    assert slopes[1] <= -3.5  # v_dot saturates at 1
    assert min(worst[2]) >= 1e-8  # at theta = 0.01


@pytest.mark.parametrize("theta", [1e-4, 1e-6])
def test_down_to_the_paper_s_switch_no_digit_is_left(theta):
    polar, bend = model(1), model(1, "bend")
    for seed in range(3):
        q, *_ = state = polar_state(1, theta, seed)
        assert mass_matrix_error(polar.mass_matrix(q), reference(1).mass_matrix(q)) >= 0.1
        try:  # H is rounding, so it may happen to be positive definite
            assert errors(polar, state)[2] >= 0.1
        except st.StateError as refusal:
            assert "not positive definite" in str(refusal)
        assert max(bend_errors(bend, state)) <= 1e-14


# The other functions


def test_energy_momentum_and_points_are_the_reference_s():
    polar, exact = model(2), reference(2)
    q, v, *_ = polar_state(2, 1.3)
    q_bend, v_bend = exact.state(q, v)
    np.testing.assert_allclose(polar.energy(q, v), exact.bend.energy(q_bend, v_bend), rtol=1e-14)
    for found, expected in zip(
        polar.momentum(q, v), exact.bend.momentum(q_bend, v_bend), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(polar.tail_points(q), exact.bend.tail_points(q_bend, 5), atol=1e-15)


@pytest.mark.slow
def test_jacobians_and_world_axes_follow_from_the_bend_form():
    polar, bend = model(2), model(2, "bend")
    q, v, *_ = polar_state(2, 1.3)
    (q_bend, _), J = in_bend(q, v), rate_map(q)
    np.testing.assert_allclose(
        polar.tail_point_jacobians(q), bend.tail_point_jacobians(q_bend) @ J, atol=1e-14
    )
    assert (
        mass_matrix_error(polar.mass_matrix_world(q), J.T @ bend.mass_matrix_world(q_bend) @ J)
        <= 1e-14
    )
    bias, bias_world = polar.bias_force(q, v), polar.bias_force_world(q, v)
    np.testing.assert_allclose(
        np.delete(bias_world, [3, 4, 5]), np.delete(bias, [3, 4, 5]), rtol=1e-12
    )
    assert np.linalg.norm(bias_world[3:6]) == pytest.approx(np.linalg.norm(bias[3:6]), rel=1e-12)


def test_external_loads_balance():
    polar, (q, v, _, tau) = model(2), polar_state(2, 1.3)
    forces = np.random.default_rng(5).normal(size=(11, 3))
    v_dot = polar.forward_dynamics(q, v, tau, polar.external_force(tail=forces))
    load = np.einsum("kij,ki->j", polar.tail_point_jacobians(q), forces)
    residual = polar.inverse_dynamics(q, v, v_dot) - load - np.concatenate([np.zeros(6), tau])
    assert np.abs(residual).max() <= 1e-12 * np.abs(load).max()


@pytest.mark.slow
def test_a_flight_far_from_straight_is_that_of_the_bend_form():
    polar, bend = model(1), model(1, "bend")
    q, v = np.array([0, 0, 0, 1.0, 0, 0, 0, 0.4, 1.5]), np.array([0, 0, 2.0, 6, 1, -2, 3.0, 1.0])
    flights = [
        st.simulate(m, *start, t_span=0.05, step=1e-4)
        for m, start in ((polar, (q, v)), (bend, in_bend(q, v)))
    ]
    end = in_bend(flights[0].q[-1], flights[0].v[-1])
    np.testing.assert_allclose(end[0], flights[1].q[-1], atol=1e-10)
    np.testing.assert_allclose(end[1], flights[1].v[-1], atol=1e-8)


@pytest.mark.slow
def test_c_example_runs_at_a_bend(tmp_path):
    polar = model(2)
    sources = [polar.folder / "example" / "main.c", polar.folder / "src" / f"{polar.name}.c"]
    strict = [
        "-std=c99",
        "-O2",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-I",
        polar.folder / "include",
    ]
    subprocess.run(["cc", *strict, *sources, "-lm", "-o", tmp_path / "example"], check=True)
    run = subprocess.run([tmp_path / "example"], capture_output=True, text=True, check=True)
    printed = [float(line.split(" = ")[1]) for line in run.stdout.splitlines()]
    q, v, tau = np.array([0, 0, 0, 1.0, 0, 0, 0, 0, 0.5, 0, 0.5]), np.zeros(10), np.zeros(4)
    v[3], tau[0] = 1, 1e-4
    np.testing.assert_allclose(printed, polar.forward_dynamics(q, v, tau), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", VALUES)
def test_casadi_and_c_agree(name):
    polar, (q, v, v_dot, tau) = model(2, emission="loops"), polar_state(2, 1.3)
    given = {
        "q": q,
        "v": v,
        "v_dot": v_dot,
        "tau": tau,
        "f_ext": polar.external_force(force=(1.0, 2.0, 3.0)),
    }
    arguments = [given[a["name"]] for a in polar.manifest["functions"][name]["inputs"]]
    found, expected = polar.kernel(name)(*arguments), getattr(polar.casadi, name)(*arguments)
    pairs = zip(found, expected, strict=True) if isinstance(found, tuple) else [(found, expected)]
    for x, y in pairs:
        np.testing.assert_allclose(
            np.ravel(x), np.ravel(np.array(y)), rtol=1e-11, atol=1e-13 * np.abs(x).max()
        )
