"""A base that never moves, and no weight: the tail's part of a torso at rest, and nothing else."""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.variant import Shape
from serpentail_codegen.targets.c.straight import straight_line
from serpentail_scene.signatures.table import FIXED
from tests.references.metrics import near
from tests.support import zoo
from tests.support.rows import row

# on a fixed base, and the same tail on a torso that moves
PAIRS = {"fixed": "m2_n2", "fixed_arcs": "arcs2", "fixed_mixed": "mixed"}
PARTS = {"implicit_factor", "implicit_solve", "tracked_dynamics"}  # of pfl and implicit


@pytest.mark.parametrize(
    "name", ["fixed", "fixed_mixed", pytest.param("fixed_arcs", marks=pytest.mark.slow)]
)
def test_it_is_the_tails_part_of_a_torso_at_rest(name):
    model, free = zoo.model(name), zoo.model(PAIRS[name])
    assert model.nq == model.nv == 2 * model.segments and model.fixed
    mass = free.parameters["torso_mass"] / free.parameters["tail_mass"] + 1
    scales = np.array([1, 4, 20, 1e-4])[:, None]
    for q, v, v_dot, tau in scales * np.random.default_rng(3).normal(size=(3, 4, model.nq)):
        there = np.r_[0, 0, 0, 1, 0, 0, 0, q], np.r_[np.zeros(6), v]
        H, bias = free.mass_matrix(there[0])[6:, 6:], free.bias_force(*there)[6:]
        near(model.mass_matrix(q), H, 1e-14)
        force = free.inverse_dynamics(*there, np.r_[np.zeros(6), v_dot])[6:]
        near(model.inverse_dynamics(q, v, v_dot), force, 1e-13)
        near(model.bias_force(q, v), bias, 1e-12)
        acceleration = np.linalg.solve(H, tau - bias)
        near(model.forward_dynamics(q, v, tau), acceleration, 1e-11)
        near(model.casadi.forward_dynamics(q, v, tau).full().ravel(), acceleration, 1e-11)
        x_dot = model.x_dot(np.r_[q, v], tau)
        near(x_dot, np.r_[v, acceleration], 1e-11)
        near(model.energy(q, v), free.energy(*there), 1e-13)
        near(model.tail_points(q), free.tail_points(there[0]), 1e-14)
        position, velocity, J = (mass * x for x in free.center_of_mass(*there))
        for found in (model.center_of_mass(q, v), model.casadi.center_of_mass(q, v)):
            for x, expected in zip(found, (position, velocity, J[:, 6:]), strict=True):
                near(np.array(x).squeeze(), expected, 1e-13)
        none, by = np.zeros((model.nv, model.nv)), model.forward_dynamics_derivatives(q, v, tau)
        A, B = model.x_dot_derivatives(np.r_[q, v], tau)
        np.testing.assert_array_equal(A, np.block([[none, np.eye(model.nv)], [*by[:2]]]))
        np.testing.assert_array_equal(B, np.vstack([none, by[2]]))


def test_nothing_of_the_torso_is_there():
    model = zoo.model("fixed_mixed")
    assert not {"torso_mass", "torso_inertia"} & model.parameters.keys()
    assert set(model.manifest["functions"]) == {*FIXED, *PARTS} - {
        "implicit",
        "loads",
        "rollout",
        "tendon_lengths",
        "tendon_torques",
    }


def test_a_fixed_base_costs_less():
    shapes = Shape(), Shape(fixed=True), Shape(fixed=True, weightless=True)
    for name in ("mass_matrix", "bias_force", "forward_dynamics"):
        free, fixed, weightless = (
            straight_line(
                assemble(FUNCTIONS[name], Tail(2, 3, shape=shape)), "double", "x"
            ).operations
            for shape in shapes
        )
        with row(name):
            assert free > 1.05 * fixed
            assert weightless <= fixed - (name != "mass_matrix")


def test_without_weight_is_without_gravity():
    free, model = zoo.model("m1_n3").with_parameters(gravity=0), zoo.model("weightless")
    assert model.parameters["gravity"] == 0
    assert next(p["name"] for p in model.manifest["parameters"]) == "torso_mass"
    rng = np.random.default_rng(1)
    q, v, v_dot, tau = rng.normal(size=9), *rng.normal(size=(2, 8)), 1e-4 * rng.normal(size=2)
    np.testing.assert_allclose(model.bias_force(q, v), free.bias_force(q, v), atol=1e-18)
    expected = free.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(model.forward_dynamics(q, v, tau), expected, rtol=1e-13)
    assert model.energy(q, v)[1] == 0
    for name, last in (("inverse", v_dot), ("forward", tau)):
        function = f"{name}_dynamics_parameter_derivatives"
        expected = getattr(free, function)(q, v, last)[:, 1:]  # gravity is the first
        near(getattr(model, function)(q, v, last), expected, 1e-12)
    with pytest.raises(st.ModelError, match="gravity"):
        model.with_parameters(gravity=9.8)
