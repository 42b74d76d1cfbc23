"""Segments and links of their own: against a set of bodies that shares nothing with generators."""

from dataclasses import replace

import numpy as np
import pytest

import serpentail as st
from serpentail.verification.report import laws
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.shape import Shape
from tests.functions.test_columns import arguments, outputs
from tests.references.body_set import MP, Arc, exact, moved
from tests.references.metrics import block_error, force_error, mass_matrix_error
from tests.support.own_tails import TAILS, animal, folder, folder_of_tables, states

CASES = [(tail, True) for tail in TAILS]
SHIFT = MP.mpf(10) ** -10


@pytest.fixture(scope="module", params=CASES, ids=str)
def pair(request):
    """A compiled model, and the same animal as a set of bodies."""
    return st.load(folder(*request.param)), animal(*request.param)


def test_mass_matrix_and_forces(pair):
    model, bodies = pair
    for q, v, v_dot, tau in states(model.nq):
        H, force = bodies.mass_matrix(q), bodies.force(q, v, v_dot)
        bias = bodies.force(q, v, 0 * v_dot)
        assert mass_matrix_error(model.mass_matrix(q), H) < 1e-14
        assert force_error(model.inverse_dynamics(q, v, v_dot), force, H) < 1e-14
        assert force_error(model.bias_force(q, v), bias, H) < 1e-14

        scale = np.sqrt(np.diag(H))
        applied = np.concatenate([np.zeros(6), tau]) - bias
        expected = np.linalg.solve(H / np.outer(scale, scale), applied / scale) / scale
        assert block_error(model.forward_dynamics(q, v, tau), expected) < 1e-12
        graph = model.casadi.forward_dynamics(q, v, tau).full().ravel()
        assert block_error(graph, expected) < 1e-12


def test_energy_momentum_and_points(pair):
    model, bodies = pair
    for q, v, *_ in states(model.nq):
        assert np.allclose(model.energy(q, v), bodies.energy(q, v), rtol=1e-14, atol=0)
        for found, expected in zip(model.momentum(q, v), bodies.momentum(q, v), strict=True):
            assert np.abs(found - expected).max() < 1e-14 * np.abs(expected).max()
        assert np.abs(model.tail_points(q) - bodies.tail_points(q)).max() < 1e-15


def test_derivatives_by_coordinates(pair):
    """Differences of 60 digits in the tangent space of q."""
    model, bodies = pair
    q, v, v_dot, _ = next(states(model.nq))
    dq = model.inverse_dynamics_derivatives(q, v, v_dot)[0]
    for k in (3, 6, model.nv - 1):
        unit = np.eye(model.nv)[k]
        ahead, behind = (
            bodies.inverse_dynamics(moved(exact(q), unit, h), v, v_dot) for h in (SHIFT, -SHIFT)
        )
        slope = ((ahead - behind) / (2 * SHIFT)).astype(float)
        assert np.abs(dq[:, k] - slope).max() < 1e-13 * np.abs(slope).max()


def with_number(bodies, name, k, shift):
    """The animal with number k of a parameter changed."""
    if not name.startswith(("link_", "arc_")):
        value = getattr(bodies, name)
        if not isinstance(value, tuple):
            return replace(bodies, **{name: MP.mpf(value) + shift})
        return replace(bodies, **{name: (*value[:k], MP.mpf(value[k]) + shift, *value[k + 1 :])})
    field = {"es": "mass", "hs": "length", "rs": "center", "as": "inertia"}[name[-2:]]
    segments = [list(s) if isinstance(s, list) else s for s in bodies.segments]
    if name.startswith("arc_"):
        i = [i for i, s in enumerate(segments) if isinstance(s, Arc)][k]
        segments[i] = replace(segments[i], **{field: MP.mpf(getattr(segments[i], field)) + shift})
        return replace(bodies, segments=tuple(segments))
    size = 3 if field == "inertia" else 1
    links = [(i, s) for i, s in enumerate(segments) if isinstance(s, list)]
    place = [(i, j) for i, s in links for j in range(len(s))][k // size]
    link = segments[place[0]][place[1]]
    value = getattr(link, field)
    if size == 3:
        c = k % 3
        value = (*value[:c], MP.mpf(value[c]) + shift, *value[c + 1 :])
    else:
        value = MP.mpf(value) + shift
    segments[place[0]][place[1]] = replace(link, **{field: value})
    return replace(bodies, segments=tuple(segments))


def test_derivatives_by_parameters(pair):
    """Every parameter's first and last number, by differences of 60 digits; v_dot's by H."""
    model, bodies = pair
    q, v, v_dot, tau = next(states(model.nq))
    forces = model.inverse_dynamics_parameter_derivatives(q, v, v_dot)
    at_rest = model.forward_dynamics(q, v, tau)
    accelerations = model.forward_dynamics_parameter_derivatives(q, v, tau)
    H, first, scale = bodies.mass_matrix(q), 0, np.abs(forces).max()
    for entry in [p for p in model.manifest["parameters"] if p["in_struct"]]:
        for k in {0, entry["size"] - 1}:
            ahead, behind = (
                with_number(bodies, entry["name"], k, h).inverse_dynamics(q, v, v_dot)
                for h in (SHIFT, -SHIFT)
            )
            slope = ((ahead - behind) / (2 * SHIFT)).astype(float)
            size = np.abs(slope).max() or scale
            assert np.abs(forces[:, first + k] - slope).max() < 1e-12 * size, entry["name"]
        first += entry["size"]
    by_force = model.inverse_dynamics_parameter_derivatives(q, v, at_rest)
    root = np.sqrt(np.diag(H))
    expected = -np.linalg.solve(H / np.outer(root, root), by_force / root[:, None]) / root[:, None]
    largest = np.abs(expected).max(axis=0)
    assert np.all(np.abs(accelerations - expected).max(axis=0) <= 1e-11 * largest + 1e-300)


@pytest.mark.parametrize("emission", ["straight", "loops", "lanes", "segments"])
def test_every_form_is_the_same_function(emission):
    """What goes by segments needs equal links: other tails get lanes."""
    names = ["mass_matrix", "forward_dynamics"]
    model = st.load(folder("links", True, emission=emission, functions=names))
    assert model.manifest["functions"]["forward_dynamics"]["emission"] == (
        "lanes" if emission == "segments" else emission
    )
    bodies = animal("links", True)
    for q, v, _, tau in states(model.nq, 1):
        H, bias = bodies.mass_matrix(q), bodies.force(q, v, np.zeros(model.nv))
        expected = np.linalg.solve(H, np.concatenate([np.zeros(6), tau]) - bias)
        assert block_error(model.forward_dynamics(q, v, tau), expected) < 1e-11


@pytest.mark.parametrize("kind", ["articulated", "continuum"])
def test_equal_pieces_by_themselves_are_the_default_tail(kind):
    """The same numbers, whether a tail's mass and length are shared or each piece has its own."""
    links = {"links": 3} if kind == "articulated" else {}
    pieces = 6 if links else 2
    even = {"kind": kind, "segments": 2, **links}
    body = {"tail_mass": 0.0035, "tail_length": 0.18}
    inertia = (3e-8, 2e-9, 4e-8)
    own = {f"{'link' if links else 'arc'}_masses": [0.0035 / pieces] * pieces}
    own |= {f"{'link' if links else 'arc'}_lengths": [0.18 / pieces] * pieces}
    if links:
        body["link_inertia"], own["link_inertias"] = inertia, [inertia] * pieces
    default, other = (st.load(folder_of_tables(even, parameters)) for parameters in (body, own))
    for q, v, v_dot, tau in states(default.nq):
        H, force = default.mass_matrix(q), default.inverse_dynamics(q, v, v_dot)
        assert mass_matrix_error(other.mass_matrix(q), H) < 1e-15
        assert block_error(other.inverse_dynamics(q, v, v_dot), force) < 1e-14
        expected = default.forward_dynamics(q, v, tau)
        assert block_error(other.forward_dynamics(q, v, tau), expected) < 1e-13
        assert np.allclose(other.energy(q, v), default.energy(q, v), rtol=1e-14)
    for name in ("tail_mass", "tail_length"):
        assert other.parameters[name] == pytest.approx(default.parameters[name], rel=1e-15)


@pytest.mark.parametrize("counts", [(3, 2, 2), (1, 4), (2,)])
def test_sweeps_in_lanes_give_the_same_acceleration(counts):
    shape = Shape(counts if len(counts) > 1 else (), links=sum(counts), tilted=True)
    tail = Tail(len(counts), max(counts), shape=shape)
    plain, lanes = (
        assemble(FUNCTIONS["forward_dynamics"], tail, each) for each in ("composite", "lanes")
    )
    given = arguments(plain)
    expected, found = outputs(plain, given)["v_dot"], outputs(lanes, given)["v_dot"]
    assert plain != lanes
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.slow
@pytest.mark.parametrize("tail", TAILS)
def test_every_law_holds(tail):
    """Derivatives, products, batches, CasADi and flights agree with each other."""
    checks = laws(st.load(folder(tail, True, functions="all")))
    assert [check.name for check in checks if not check.passed] == []
