"""The continuum tail in the runtime: right at every bend, refused beyond its range, convertible to
polar angles.
"""

import casadi
import numpy as np
import pytest

import serpentail as st
from tests.references.body_set import MP, Animal, Arc, exact, moved
from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import TABLE_1
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row

BENDS = (0.0, 1e-300, 1e-16, 1e-8, 1e-4, 1e-2, 0.5, 2.0, np.pi, 5.0, 2 * np.pi)
SHIFT = MP.mpf(10) ** -7
EXACT = ExactContinuum(dict(TABLE_1), 1)


def bent(theta):
    """A state whose one segment is bent by theta in a random plane."""
    rng = np.random.default_rng(0)
    q, v, phi = rng.normal(size=9), 10 * rng.normal(size=8), rng.uniform(0, 2 * np.pi)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = theta * np.cos(phi), theta * np.sin(phi)
    return q, v, 1e-3 * rng.normal(size=2)


def test_every_bend_is_right_to_rounding():
    model = zoo.model("arcs1")
    for theta in BENDS:
        q, v, tau = bent(theta)
        H = EXACT.mass_matrix(q)
        with row(theta):
            assert mass_matrix_error(model.mass_matrix(q), H) <= 1e-14
            assert block_error(model.bias_force(q, v), EXACT.bias_force(q, v)) <= 2e-14
            v_dot = model.forward_dynamics(q, v, tau), EXACT.forward_dynamics(q, v, tau)
            assert block_error(*v_dot) <= 5e-15 * equilibrated_condition(H)


@pytest.mark.parametrize(
    "bends", [BENDS[::9], pytest.param(BENDS[1:], marks=pytest.mark.slow)], ids=["some", "others"]
)
def test_derivatives_are_right_at_every_bend(bends):
    """First and second ones along a direction in which all but the torso's place changes: of
    compiled functions and of CasADi's expressions, against differences of 60 digits.
    """
    model = zoo.model("arcs1")
    body = Arc(TABLE_1["tail_mass"], TABLE_1["tail_length"])
    given = {name: TABLE_1[name] for name in ("torso_mass", "torso_inertia", "tail_mount")}
    animal, rng = Animal(segments=(body,), **given), np.random.default_rng(6)
    for bend in bends:
        q, v, tau = bent(bend)
        (by_q, by_v), (v_dot, weights) = rng.normal(size=(2, 2, 8))
        by_q[:3], by_v[:3] = 0, 0
        sides = []
        for h in (-SHIFT, 0 * SHIFT, SHIFT):
            there, rates = moved(exact(q), by_q, h), exact(v) + h * exact(by_v)
            sides.append(animal.inverse_dynamics(there, rates, v_dot))
        first = ((sides[2] - sides[0]) / (2 * SHIFT)).astype(float)
        second = ((sides[2] - 2 * sides[1] + sides[0]) / SHIFT**2).astype(float) @ weights
        dq, dv = model.inverse_dynamics_derivatives(q, v, v_dot)
        qq, qv, vv, _ = model.inverse_dynamics_hessian(q, v, v_dot, weights)
        curved = by_q @ qq @ by_q + 2 * by_q @ qv @ by_v + by_v @ vv @ by_v
        most = (1e-12 if bend >= 1e-8 else 1e-5) * abs(second)  # what differences are right to
        with row(bend):
            near(dq @ by_q + dv @ by_v, first, 1e-12)
            assert abs(curved - second) <= most
            state = q, v, v_dot, tau
            slope, curve, of_motion = along_by_casadi(model, state, by_q, by_v, weights)
            near(slope, first, 1e-12)
            assert abs(curve - second) <= most
            dq, dv, _ = model.forward_dynamics_derivatives(q, v, tau)
            condition = equilibrated_condition(model.mass_matrix(q))
            near(of_motion, dq @ by_q + dv @ by_v, 1e-13 * condition)


def near(found, expected, limit):
    assert block_error(found, expected) <= limit


def along_by_casadi(model, state, by_q, by_v, weights):
    """The slope of forces, weights times their second derivative, and the slope of v_dot."""
    q, v, v_dot, tau = state
    s = casadi.SX.sym("s")
    turn, w, e = by_q[3:6], q[3], q[4:7]
    angle = np.linalg.norm(turn)
    c, k = casadi.cos(s * angle / 2), casadi.sin(s * angle / 2) / angle
    there = w * c - k * (e @ turn), c * e + k * (w * turn + np.cross(e, turn))
    place = casadi.vertcat(q[:3], *there, q[7:] + s * by_q[6:])
    force = model.casadi.inverse_dynamics(place, v + s * by_v, v_dot)
    motion = model.casadi.forward_dynamics(place, v + s * by_v, tau)
    slope = casadi.jacobian(force, s)
    curve = casadi.jacobian(casadi.jacobian(casadi.dot(weights, force), s), s)
    found = casadi.Function("along", [s], [slope, curve, casadi.jacobian(motion, s)])(0)
    return found[0].full().ravel(), float(found[1]), found[2].full().ravel()


def test_beyond_the_range_is_refused():
    model, (q, v, tau) = zoo.model("arcs1"), bent(6.3)
    with pytest.raises(st.StateError, match=r"segment 1 .*6\.3 .*6\.28"):
        model.forward_dynamics(q, v, tau)
    with pytest.raises(st.StateError, match="segment 1 of state 1 "):
        model.mass_matrix(np.stack([bent(1.0)[0], q]))
    assert np.isnan(np.array(model.casadi.mass_matrix(q))).any()


def test_a_wider_range_is_right_too():
    """The range is the point: the series of the model are longer."""
    model = st.load(model_folder(1, None, bend_range=12.0, functions=["mass_matrix", "bias_force"]))
    q, v, _ = bent(11.9)
    assert mass_matrix_error(model.mass_matrix(q), EXACT.mass_matrix(q)) <= 1e-13
    assert block_error(model.bias_force(q, v), EXACT.bias_force(q, v)) <= 1e-12


def test_polar_angles_are_a_conversion_and_a_straight_segment_has_none():
    rng = np.random.default_rng(0)
    phi, theta, phi_dot, theta_dot = rng.uniform(0.1, 3.0, (4, 50))
    a, b, a_dot, b_dot = st.polar_to_bend(phi, theta, phi_dot, theta_dot)
    back = st.bend_to_polar(a, b, a_dot, b_dot)
    for value, expected in zip(back, (phi, theta, phi_dot, theta_dot), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-13)
    step = 1e-7
    ahead = st.polar_to_bend(phi + step * phi_dot, theta + step * theta_dot)[:2]
    np.testing.assert_allclose((ahead[0] - a) / step, a_dot, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose((ahead[1] - b) / step, b_dot, rtol=1e-5, atol=1e-5)
    with pytest.raises(st.StateError, match=r"segment \[1\]"):
        st.bend_to_polar([0.1, 0.0], [0.2, 0.0])


def test_a_model_tells_of_arcs():
    model = zoo.model("arcs1")
    assert (model.kind, model.links, model.samples) == ("continuum", None, 5)
    assert "1 continuum segments" in repr(model)
    assert model.tail_points(bent(1.0)[0]).shape == (6, 3)
