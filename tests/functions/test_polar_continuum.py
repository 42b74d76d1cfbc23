"""The paper's closed forms in polar angles: right where they can be, wrong by 1 / theta^4, refused
at theta = 0.
"""

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy

import serpentail as st
from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.mechanics import polar_arc
from serpentail_scene.signatures.table import VALUES
from tests.references.exact_polar import ExactPolar
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import TABLE_1
from tests.support import zoo
from tests.support.rows import row

VANISHING = 10.0 ** np.arange(-1, -3.1, -0.5)


@cache
def reference(segments):
    """The continuum in 50 digits."""
    return ExactPolar(TABLE_1, segments)


class Programs:
    """Functions of two segments as their programs mean them."""

    segments = 2

    def __getattr__(self, name):
        program = assemble(FUNCTIONS[name], Tail(2, 5, "continuum", polar=True))
        given = {a.name: np.ravel(TABLE_1[a.name]) for a in program.of_role("parameters")}

        def function(*arguments):
            names = (a.name for a in program.of_role("input"))
            values = Run(program, Numbers(np), given | dict(zip(names, arguments, strict=True)))
            found = [np.array(values.values[a.name]) for a in program.of_role("output")]
            return found[0].reshape(10, 10) if name == "mass_matrix" else found[0]

        return function


def polar_state(segments, theta, seed=0):
    """(q, v, v_dot, tau), every segment bent by theta, torques on phi that stay finite in bend
    components.
    """
    rng = np.random.default_rng([seed, segments])
    nv = 6 + 2 * segments
    q, v, v_dot = rng.normal(size=nv + 1), 10 * rng.normal(size=nv), 100 * rng.normal(size=nv)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7::2], q[8::2] = rng.uniform(0, 2 * np.pi, segments), theta
    tau = 1e-3 * rng.normal(size=(segments, 2)) * [theta, 1.0]
    return q, v, v_dot, tau.ravel()


def errors(polar, state):
    """Errors of H, H v_dot + C and v_dot of a polar model; forces and accelerations are compared in
    bend components.
    """
    (q, v, v_dot, tau), exact = state, reference(polar.segments)
    q_bend, v_bend = exact.state(q, v)
    force = exact.bend.inverse_dynamics(q_bend, v_bend, exact.acceleration(q, v, v_dot))
    acceleration = exact.bend.forward_dynamics(q_bend, v_bend, exact.force(q, tau))
    found = exact.acceleration(q, v, polar.forward_dynamics(q, v, tau))
    return (
        mass_matrix_error(polar.mass_matrix(q), exact.mass_matrix(q)),
        block_error(numbers(exact.force(q, polar.inverse_dynamics(q, v, v_dot))), force),
        block_error(numbers(found), acceleration),
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
    angles = sympy.Integer(0), sympy.Rational(theta)
    trig = polar_arc.segment_trigonometry(lambda _, value: value, angles)["trig"]
    forms = polar_arc.slice_integrals(lambda _, value: value, angles, trig)
    E = polar_arc.matrix_E(forms["E_v"])
    Q = polar_arc.matrix_Q(forms["E_v"], forms["Q_v"])
    with mpmath.workdps(40):
        bend = mpmath.mpf(theta)
        for matrix, other in ((E, f_v), (Q, f_a)):
            for k, j in np.ndindex(matrix.shape):
                entry = lambda x, k=k, j=j, f=other: f_v(bend, x)[k] * f(bend, x)[j]  # noqa: E731
                error = mpmath.mpf(str(matrix[k, j].evalf(60))) - mpmath.quad(entry, [0, 1])
                assert abs(error) <= 1e-35, (k, j)


@pytest.mark.parametrize("segments", [1, 2])
def test_moderate_bends_are_right_up_to_cancellation(segments):
    polar = zoo.model("polar") if segments == 1 else Programs()
    for theta in (0.5, 1.0, np.pi) if segments == 1 else (0.6,):
        # five times the worst found: the terms that cancel are 1 / theta^4 times H
        rounding = 2e-15 + 1e-14 / theta**4
        state = polar_state(segments, theta)
        condition = equilibrated_condition(reference(segments).mass_matrix(state[0]))
        with row(theta):
            inertia, force, v_dot = errors(polar, state)
            assert inertia <= rounding
            assert force <= 2 * rounding
            assert v_dot <= 4 * rounding * condition


@pytest.mark.slow
def test_error_grows_as_theta_to_the_minus_four_and_that_of_the_bend_form_does_not():
    polar, bend, worst = zoo.model("polar"), zoo.model("arcs1"), []
    for theta in VANISHING:
        states = [polar_state(1, theta, seed) for seed in range(8)]
        worst.append(np.max([errors(polar, state) for state in states], axis=0)[[0, 2]])
        assert max(max(bend_errors(bend, state)) for state in states) <= 1e-14
    slopes = np.polyfit(np.log10(VANISHING), np.log10(worst), 1)[0]
    assert slopes[0] == pytest.approx(-4, abs=0.5)
    assert slopes[1] <= -3.5  # v_dot saturates at 1
    assert min(worst[2]) >= 1e-8  # at theta = 0.01


def test_everything_else_follows_from_the_bend_form():
    polar, bend = zoo.model("polar"), zoo.model("arcs1")
    q, v, _, tau = polar_state(1, 1.3)
    there, J = (q.copy(), v.copy()), np.eye(8)
    there[0][7:], there[1][6:] = np.reshape(st.polar_to_bend(*q[7:], *v[6:]), (2, 2))
    s, c = np.sin(q[7]), np.cos(q[7])
    J[6:, 6:] = [[q[8] * s, -c], [q[8] * c, s]]  # d(a, b) / d(phi, theta)
    np.testing.assert_allclose(polar.energy(q, v), bend.energy(*there), rtol=1e-13)
    for found, expected in zip(polar.momentum(q, v), bend.momentum(*there), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
    *center, of_center = bend.center_of_mass(*there)
    for found, expected in zip(polar.center_of_mass(q, v), (*center, of_center @ J), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(polar.tail_points(q), bend.tail_points(there[0]), atol=1e-15)
    by_bend = bend.tail_point_jacobians(there[0]) @ J
    np.testing.assert_allclose(polar.tail_point_jacobians(q), by_bend, atol=1e-14)
    H = J.T @ bend.mass_matrix_world(there[0]) @ J
    assert mass_matrix_error(polar.mass_matrix_world(q), H) <= 1e-14
    bias, world = polar.bias_force(q, v), polar.bias_force_world(q, v)
    others = [0, 1, 2, 6, 7]
    np.testing.assert_allclose(world[others], bias[others], rtol=1e-12)
    assert np.linalg.norm(world[3:6]) == pytest.approx(np.linalg.norm(bias[3:6]), rel=1e-12)

    forces = np.random.default_rng(5).normal(size=(6, 3))
    v_dot = polar.forward_dynamics(q, v, tau, polar.external_force(tail=forces))
    load = np.einsum("kij,ki->j", polar.tail_point_jacobians(q), forces)
    residual = polar.inverse_dynamics(q, v, v_dot) - load - np.concatenate([np.zeros(6), tau])
    assert np.abs(residual).max() <= 1e-12 * np.abs(load).max()


def test_casadi_and_c_agree():
    polar, state = zoo.model("polar"), polar_state(1, 1.3)
    given = dict(zip(("q", "v", "v_dot", "tau"), state, strict=True))
    given["f_ext"] = polar.external_force(force=(1.0, 2.0, 3.0))
    for name in {*VALUES} & {*polar.generated}:
        arguments = [given[a["name"]] for a in polar.manifest["functions"][name]["inputs"]]
        found, graphs = polar.kernel(name)(*arguments), getattr(polar.casadi, name)(*arguments)
        if not isinstance(found, tuple):
            found, graphs = [found], [graphs]
        for x, y in zip(found, graphs, strict=True):
            most = 1e-13 * np.abs(x).max()
            with row(name):
                np.testing.assert_allclose(np.ravel(x), np.ravel(y.full()), rtol=1e-11, atol=most)


def test_a_straight_segment_and_one_beyond_the_range_are_refused():
    polar, (q, v, v_dot, tau) = zoo.model("polar"), polar_state(1, 1.0)
    good = q.copy()
    with pytest.raises(st.StateError, match=r"segment 1 .*6\.3 .*6\.28"):
        polar.mass_matrix(polar_state(1, 6.3)[0])
    for theta in (0.0, -0.0, 1e-200):
        q[8] = theta
        for function, *arguments in (
            *((polar.mass_matrix, q), (polar.inverse_dynamics, q, v, v_dot)),
            *((polar.forward_dynamics, q, v, tau), (polar.tail_points, q), (polar.energy, q, v)),
        ):
            with pytest.raises(st.StateError, match=r"segment 1 .*theta = \S+ rad.*bend"):
                function(*arguments)
        with pytest.raises(st.StateError, match=r"segment 1 of state 1 .*theta"):
            polar.mass_matrix(np.stack([good, q]))
        assert np.isnan(np.array(polar.casadi.forward_dynamics(q, v, tau))).any()
