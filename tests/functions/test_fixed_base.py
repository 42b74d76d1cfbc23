"""A base that never moves, and no weight: the tail's part of a torso at rest, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.fixed_base import FUNCTIONS as BASED
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.shape import Shape
from serpentail_codegen.scene.signatures.table import DEFAULT, FIXED
from serpentail_codegen.targets.c.straight import straight_line
from tests.references.body_set import MP
from tests.support.models import folder_of
from tests.support.own_tails import FUNCTIONS as NAMES
from tests.support.own_tails import TAILS, TILT, VALUES, animal

SHIFT = MP.mpf(10) ** -10
REST = np.array([0, 0, 0, 1, 0, 0, 0])


def scene(tail="links", functions=FIXED, parameters=None, **keys):
    """The scene of a tail on a tilted mount of a fixed base."""
    given = {"tail_mount": VALUES["tail_mount"], "mount_angles": TILT, **(parameters or {})}
    table = {"base": "fixed", **TAILS[tail][0], "functions": list(functions), **keys}
    return parse_scene({**table, "parameters": given}, "bench")


@pytest.fixture(scope="module", params=TAILS)
def pair(request):
    """A compiled model, and the whole animal as a set of bodies."""
    return st.load(folder_of(scene(request.param))), animal(request.param, True)


def cases(model, count=2):
    """Yield q, v, v_dot and torques of the tail."""
    rng = np.random.default_rng(3)
    for _ in range(count):
        q, v, v_dot, tau = rng.normal(size=(4, model.nq))
        yield q, 4 * v, 20 * v_dot, 1e-4 * tau


def whole(q, v, v_dot):
    """The same of an animal whose torso is at rest."""
    return np.concatenate([REST, q]), np.r_[np.zeros(6), v], np.r_[np.zeros(6), v_dot]


def test_dynamics_are_the_tails_part_of_a_torso_at_rest(pair):
    model, bodies = pair
    assert model.nq == model.nv == 2 * model.segments and model.fixed
    for q, v, v_dot, tau in cases(model):
        there = whole(q, v, v_dot)
        H, force = bodies.mass_matrix(there[0])[6:, 6:], bodies.force(*there)[6:]
        bias = bodies.force(*there[:2], 0 * there[2])[6:]
        np.testing.assert_allclose(model.mass_matrix(q), H, rtol=0, atol=1e-14 * np.abs(H).max())
        for found, expected in (
            (model.inverse_dynamics(q, v, v_dot), force),
            (model.bias_force(q, v), bias),
            (model.forward_dynamics(q, v, tau), np.linalg.solve(H, tau - bias)),
            (
                model.casadi.forward_dynamics(q, v, tau).full().ravel(),
                np.linalg.solve(H, tau - bias),
            ),
            (model.x_dot(np.r_[q, v], tau)[len(q) :], np.linalg.solve(H, tau - bias)),
        ):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
        np.testing.assert_allclose(model.energy(q, v), bodies.energy(*there[:2]), rtol=1e-13)
        points = bodies.tail_points(there[0])
        np.testing.assert_allclose(model.tail_points(q), points, rtol=0, atol=1e-15)


def tail_center(bodies, q):
    """The COM (3,) of all bodies but the torso, in 60 digits."""
    tail = bodies.bodies(q)[0][1:]
    return sum(mass * place for mass, place, *_ in tail) / sum(mass for mass, *_ in tail)


def test_the_center_of_mass_is_that_of_the_tail(pair):
    model, bodies = pair
    for q, v, *_ in cases(model):

        def slope(rates, q=q):
            ends = [
                [MP.mpf(x) + h * MP.mpf(y) for x, y in zip(q, rates, strict=True)]
                for h in (SHIFT, -SHIFT)
            ]
            ahead, behind = (tail_center(bodies, np.array([*REST, *each])) for each in ends)
            return ((ahead - behind) / (2 * SHIFT)).astype(float)

        expected = (
            tail_center(bodies, np.array([*REST, *map(MP.mpf, q)])).astype(float),
            slope(v),
            np.stack([slope(unit) for unit in np.eye(model.nq)], axis=1),
        )
        by_casadi = [each.full().squeeze() for each in model.casadi.center_of_mass(q, v)]
        for found in (model.center_of_mass(q, v), by_casadi):
            for value, there in zip(found, expected, strict=True):
                size = np.abs(there).max()
                np.testing.assert_allclose(value, there, rtol=0, atol=1e-13 * size)


def test_derivatives(pair):
    model, bodies = pair
    q, v, v_dot, tau = next(cases(model))
    dq, dv = model.inverse_dynamics_derivatives(q, v, v_dot)
    H = model.mass_matrix(q)
    for k in range(model.nq):
        unit = np.eye(model.nq)[k]
        for found, moved in ((dq, (unit, 0 * unit)), (dv, (0 * unit, unit))):
            ends = [
                bodies.inverse_dynamics(
                    np.array(
                        [*REST, *(MP.mpf(x) + h * y for x, y in zip(q, moved[0], strict=True))]
                    ),
                    np.array(
                        [
                            *np.zeros(6),
                            *(MP.mpf(x) + h * y for x, y in zip(v, moved[1], strict=True)),
                        ]
                    ),
                    np.r_[np.zeros(6), v_dot],
                )
                for h in (SHIFT, -SHIFT)
            ]
            slope = ((ends[0] - ends[1]) / (2 * SHIFT)).astype(float)[6:]
            size = np.abs(found).max()
            np.testing.assert_allclose(found[:, k], slope, rtol=0, atol=1e-12 * size)

    # of v_dot by those of forces there, and by H
    a = model.forward_dynamics(q, v, tau)
    by_q, by_v = model.inverse_dynamics_derivatives(q, v, a)
    of_a = model.forward_dynamics_derivatives(q, v, tau)
    for found, force in zip(of_a, (by_q, by_v, -np.eye(len(q))), strict=True):
        expected = -np.linalg.solve(H, force)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    A, B = model.x_dot_derivatives(np.r_[q, v], tau)
    np.testing.assert_array_equal(A[len(q) :], np.hstack(of_a[:2]))
    np.testing.assert_array_equal(A[: len(q)], np.hstack([0 * H, np.eye(len(q))]))
    np.testing.assert_array_equal(B, np.vstack([0 * H, of_a[2]]))


def test_derivatives_by_parameters(pair):
    model, bodies = pair
    q, v, v_dot, tau = next(cases(model))
    forces = model.inverse_dynamics_parameter_derivatives(q, v, v_dot)
    steeper = [replace(bodies, gravity=MP.mpf(9.8) + h) for h in (SHIFT, -SHIFT)]
    ends = [each.inverse_dynamics(*whole(q, v, v_dot)) for each in steeper]
    slope = ((ends[0] - ends[1]) / (2 * SHIFT)).astype(float)[6:]
    np.testing.assert_allclose(forces[:, 0], slope, rtol=0, atol=1e-12 * np.abs(slope).max())
    by_force = model.inverse_dynamics_parameter_derivatives(q, v, model.forward_dynamics(q, v, tau))
    expected = -np.linalg.solve(model.mass_matrix(q), by_force)
    found = model.forward_dynamics_parameter_derivatives(q, v, tau)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_nothing_of_the_torso_is_there(pair):
    model, _ = pair
    assert not {"torso_mass", "torso_inertia"} & model.parameters.keys()
    functions = {"implicit_factor", "implicit_solve", "tracked_dynamics"}  # of pfl and implicit
    assert set(model.manifest["functions"]) == {*FIXED, *functions} - {"implicit", "rollout"}


@pytest.mark.parametrize("name", ["mass_matrix", "bias_force", "forward_dynamics"])
@pytest.mark.parametrize("size", [(1, 3), (3, 4)])
def test_a_fixed_base_costs_less(size, name):
    """Of the lines of a free torso; weightless ones have no gravity in them."""
    counts = [
        straight_line(assemble(functions[name], Tail(*size, shape=shape)), "double", "x").operations
        for functions, shape in (
            (FUNCTIONS, Shape()),
            (BASED, Shape(fixed=True)),
            (BASED, Shape(fixed=True, weightless=True)),
        )
    ]
    assert counts[0] > 1.05 * counts[1]
    assert counts[2] <= counts[1] - (name != "mass_matrix")


def test_the_table_of_functions_is_that_of_assemblies():
    parts = {"implicit_factor", "implicit_solve", "tracked_dynamics"}  # of simulations
    assert {*FIXED, *parts} - {"implicit", "rollout"} == set(BASED)
    assert scene_functions({}) == tuple(name for name in DEFAULT if name in FIXED)
    assert set(scene_functions({"functions": "all"})) == set(FIXED)


def scene_functions(keys):
    """Functions of a fixed base's scene with these keys."""
    return parse_scene({"kind": "continuum", "segments": 1, "base": "fixed", **keys}, "b").functions


# ---- no weight -----------------------------------------------------------------------------------


def test_without_weight_is_without_gravity():
    tables = {"kind": "articulated", "segments": 2, "links": 2, "functions": NAMES}
    free = st.load(folder_of(parse_scene({**tables, "parameters": {"gravity": 0}}, "free")))
    model = st.load(folder_of(parse_scene({**tables, "weightless": True}, "orbit")))
    assert model.parameters["gravity"] == 0
    assert next(p["name"] for p in model.manifest["parameters"]) == "torso_mass"
    rng = np.random.default_rng(1)
    q, v, v_dot = rng.normal(size=11), rng.normal(size=10), rng.normal(size=10)
    tau = 1e-4 * rng.normal(size=4)
    np.testing.assert_allclose(model.bias_force(q, v), free.bias_force(q, v), atol=1e-18)
    expected = free.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(model.forward_dynamics(q, v, tau), expected, rtol=1e-13)
    assert model.energy(q, v)[1] == 0
    for name, last in (("inverse", v_dot), ("forward", tau)):
        function = f"{name}_dynamics_parameter_derivatives"
        expected = getattr(free, function)(q, v, last)[:, 1:]  # gravity is the first
        np.testing.assert_allclose(
            getattr(model, function)(q, v, last), expected, atol=1e-12 * np.abs(expected).max()
        )
    with pytest.raises(st.ModelError, match="gravity: no such parameter"):
        model.with_parameters(gravity=9.8)


def test_scenes_are_read_again_as_they_are():
    found = scene(weightless=True)
    assert parse_scene(scene_to_dict(found), "other") == found
    plain = scene_to_dict(parse_scene({"kind": "continuum", "segments": 1}, "plain"))
    assert not {"base", "weightless"} & plain.keys()


@pytest.mark.parametrize(
    ("keys", "field", "words"),
    [
        ({"base": "floating"}, "base", 'needs "free" or "fixed"'),
        ({"weightless": 1}, "weightless", "true or false"),
        ({"contacts": ["tail"]}, "contacts", "a fixed base has none"),
        ({"functions": ["airborne_rates"]}, "functions", "a fixed base has none"),
        ({"parameters": {"torso_mass": 1}}, "parameters.torso_mass", "does not move; remove it"),
        ({"weightless": True, "parameters": {"gravity": 1}}, "parameters.gravity", "weightless"),
    ],
)
def test_what_cannot_be_is_refused(keys, field, words):
    with pytest.raises(SceneError) as refused:
        scene(**keys)
    problems = {problem.field: str(problem) for problem in refused.value.problems}
    assert words in problems[field], problems
