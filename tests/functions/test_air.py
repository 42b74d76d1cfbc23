"""The air in all functions of forces: against independent sums, closed forms, and the same animal
without air.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.problems import SceneError
from tests.references import air as reference
from tests.references.metrics import block_error
from tests.support import zoo
from tests.support.derivative_models import of_every_kind
from tests.support.rows import row

NAMES = ["air", "air_fixed", pytest.param("air_mixed", marks=pytest.mark.slow)]
every_model = pytest.mark.parametrize("name", NAMES)
STILL = {"wind": (0, 0, 0), "tail_drag_speed": 1e-9}
SMOOTH = {"torso_drag": (0, 0, 0), "torso_drag_turning": (0, 0, 0), "torso_air_damping": (0, 0, 0)}


def moving(model):
    """States whose arcs are bent, so that the reference may divide by the bend."""
    return [(s["q"], s["v"], s) for kind, s in of_every_kind(model) if "straight" not in kind]


@pytest.mark.parametrize("name", [*NAMES, "air_arc"])
def test_the_force_is_the_sum_over_gauss_points(name):
    model = zoo.model(name)
    for q, v, _ in moving(model):
        expected = reference.air_force(model, q, v)
        assert block_error(model.air_force(q, v), expected) <= 1e-13


def test_a_rod_that_swings_has_the_moment_of_the_integral():
    """1/8 rho C d w^2 L^4, of a straight tail that turns with the torso about its root."""
    values = {"tail_mount": (0, 0, 0), "tail_widths": 0.0058, "tail_drag": (1.1, 0.3)}
    model = zoo.model("air").with_parameters(**STILL, **SMOOTH, **values)
    q, v, w = model.state().q, np.zeros(model.nv), 56.0
    v[3] = w
    moment = 1.2 * 1.1 * 0.0058 * w**2 * model.parameters["tail_length"] ** 4 / 8
    assert model.air_force(q, v)[3] == pytest.approx(-moment, rel=1e-14)


def test_a_torso_falls_at_its_terminal_velocity():
    """sqrt(2 m g / (rho C A)): the air carries the weight."""
    model = zoo.model("air").with_parameters(**STILL, tail_widths=0.0)
    p = model.parameters
    weight = (p["torso_mass"] + p["tail_mass"]) * p["gravity"]
    q, v = model.state().q, np.zeros(model.nv)
    v[2] = -np.sqrt(2 * weight / (p["air_density"] * p["torso_drag"][2]))
    assert model.air_force(q, v)[2] == pytest.approx(weight, rel=1e-14)


def test_all_functions_of_forces_are_those_of_still_air_less_its_force():
    model, plain = zoo.model("air"), zoo.model("m2_n2")
    for q, v, s in moving(model):
        force, wanted = model.air_force(q, v), s["v_dot"][6:]
        for name, *more in (("bias_force",), ("inverse_dynamics", s["v_dot"])):
            found, bare = (getattr(m, name)(q, v, *more) for m in (model, plain))
            with row(name):
                assert block_error(found, bare - force) <= 1e-12
        tau = model.pfl(q, v, wanted)
        v_dot = model.forward_dynamics(q, v, tau)
        assert block_error(v_dot[6:], wanted) <= 1e-9
        left = model.inverse_dynamics(q, v, v_dot)
        assert np.abs(left - np.r_[np.zeros(6), tau]).max() <= 1e-12 * np.abs(left).max() + 1e-15


def test_no_density_is_no_air():
    off = {"air_density": 0.0, "torso_air_damping": (0, 0, 0)}
    for name, plain in (("air", "m2_n2"), ("air_fixed", "fixed")):
        own = {n: x for n, x in off.items() if n in zoo.model(name).parameters}
        model, bare = zoo.model(name).with_parameters(**own), zoo.model(plain)
        for q, v, s in moving(model):
            found, expected = (m.forward_dynamics(q, v, s["tau"]) for m in (model, bare))
            with row(name):
                assert block_error(found, expected) <= 1e-10


@pytest.mark.parametrize("method", ["tsit5", "dp8", "rk4", "ros34pw2", "implicit_euler"])
def test_books_of_runs_have_the_work_and_the_impulse_of_the_air(method):
    model = zoo.model("air")
    start = model.state(height=0.3, spin=(20, 2, -3), velocity=(0.2, -0.3, 2.0))
    how = {"step": 2e-4} if method in ("rk4", "implicit_euler") else {"rtol": 1e-8, "atol": 1e-10}
    motion = st.simulate(model, start, t_span=0.2, method=method, **how)
    found = st.summary(model, motion)
    assert not found["warnings"]
    assert found["imbalance"]["relative"] <= (1e-3 if method == "implicit_euler" else 1e-6)
    assert found["work_J"]["air"] < 0 and found["ground_impulse_N_s"] is None
    # by the samples
    forces = np.array([model.air_force(q, v) for q, v in zip(motion.q, motion.v, strict=True)])
    power = np.einsum("ki,ki->k", forces, motion.v)
    assert np.trapezoid(power, motion.t) == pytest.approx(found["work_J"]["air"], rel=1e-2)
    impulse = np.trapezoid(forces[:, :3], motion.t, axis=0)
    np.testing.assert_allclose(found["impulse_N_s"]["air"], impulse, rtol=2e-2, atol=1e-5)


def test_wrong_air_is_refused():
    links = {"kind": "articulated", "segments": 1, "links": 3}
    air = {"air_density": 1.2}
    for table, field, value in (
        ({"tail_drag": [1.1, 0]}, "parameters.air_density", None),
        (air | {"tail_widths": [1, 2, 3]}, "parameters.tail_widths", [1, 2, 3]),
        (air | {"tail_widths": -1}, "parameters.tail_widths", -1),
        ({"air_density": "1.2 kg"}, "parameters.air_density", "1.2 kg"),
        (air | {"wind": [1, 2]}, "parameters.wind", [1, 2]),
        (air | {"tail_drag_speed": 0}, "parameters.tail_drag_speed", 0),
        (air | {"link_inertia": [1e-7] * 3}, "parameters.tail_widths", None),
        ({}, "functions", "air_force"),
    ):
        with row(field, value), pytest.raises(SceneError) as caught:
            parse_scene(links | {"functions": ["air_force"], "parameters": table}, "a")
        assert [(p.field, p.value) for p in caught.value.problems] == [(field, value)]
    chain = {"leg": {"kind": "articulated", "segments": 1, "links": 1, "mount": [0, 0, 0]}}
    chain["leg"] |= {"mass": 1, "length": 1}
    for more, field in (
        ({"chain": chain}, "parameters.air_density"),
        ({"base": "fixed", "parameters": air | {"torso_drag": [1, 1, 1]}}, "parameters.torso_drag"),
        ({"kind": "continuum", "links": None, "coordinates": "polar"}, "parameters.air_density"),
    ):
        table = {k: x for k, x in (links | {"parameters": air} | more).items() if x is not None}
        with row(field), pytest.raises(SceneError) as caught:
            parse_scene(table, "a")
        assert field in [p.field for p in caught.value.problems]
