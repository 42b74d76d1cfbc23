"""Segments of their own, links and arcs in one tail: against a set of bodies that shares nothing
with generators; what scenes and models say of them.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail.bridges.containers.contents import contents
from serpentail.show.animal import animal_of
from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.draft import Draft
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.sweeps.pieces import each_segment, mechanism
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.variant import SegmentRun, Shape
from tests.functions.test_columns import arguments, assert_same, outputs
from tests.references.body_set import MP, exact, moved
from tests.references.metrics import block_error, force_error, mass_matrix_error
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.own_tails import IN_ZOO, animal, dynamics, states
from tests.support.rows import row

SHIFT = MP.mpf(10) ** -12
every_tail = pytest.mark.parametrize(
    "name", ["mixed", *(pytest.param(n, marks=pytest.mark.slow) for n in ("own_links", "own_arcs"))]
)


@every_tail
def test_a_model_is_its_set_of_bodies(name):
    model, bodies = zoo.model(name), animal(IN_ZOO[name], True)
    q, v, v_dot, tau = next(states(model.nq))
    H, force, bias = dynamics(bodies, q, v, v_dot)
    assert mass_matrix_error(model.mass_matrix(q), H) < 1e-14
    assert force_error(model.inverse_dynamics(q, v, v_dot), force, H) < 1e-14
    assert force_error(model.bias_force(q, v), bias, H) < 1e-14
    expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - bias)
    assert block_error(model.forward_dynamics(q, v, tau), expected) < 1e-12
    graph = model.casadi.forward_dynamics(q, v, tau).full().ravel()
    assert block_error(graph, expected) < 1e-12
    np.testing.assert_allclose(model.energy(q, v), bodies.energy(q, v), rtol=1e-14)
    for found, momentum in zip(model.momentum(q, v), bodies.momentum(q, v), strict=True):
        assert np.abs(found - momentum).max() < 1e-14 * np.abs(momentum).max()
    assert np.abs(model.tail_points(q) - bodies.tail_points(q)).max() < 1e-15


def accelerated(H, force):
    """H^-1 times a force."""
    scale = np.sqrt(np.diag(H))
    return np.linalg.solve(H / np.outer(scale, scale), force / scale) / scale


@pytest.mark.slow
@every_tail
def test_by_segments_a_model_is_its_set_of_bodies_too(name):
    """The form is the point: v_dot, and how it changes, against forces of 60 digits."""
    functions = ["forward_dynamics", "forward_dynamics_derivatives"]
    scene = zoo.scene(name, functions=functions, emission="segments")
    model, bodies = st.load(folder_of(scene)), animal(IN_ZOO[name], True)
    for function in functions:
        assert model.manifest["functions"][function]["emission"] == "segments"
    q, v, _, tau = next(states(model.nq))
    q[3:7] /= np.linalg.norm(q[3:7])
    v_dot = model.forward_dynamics(q, v, tau)
    H, force, _ = dynamics(bodies, q, v, v_dot)
    assert force_error(force, np.concatenate([np.zeros(6), tau]), H) < 1e-13

    (by_q, by_v), by_tau = np.random.default_rng(3).normal(size=(2, model.nv)), 1e-3 * tau
    by_q[:3] = by_v[:3] = 0
    low, high = (
        bodies.inverse_dynamics(moved(exact(q), by_q, h), exact(v) + h * exact(by_v), v_dot)
        for h in (-SHIFT, SHIFT)
    )
    change = ((high - low) / (2 * SHIFT)).astype(float)
    dq, dv, dtau = model.forward_dynamics_derivatives(q, v, tau)
    expected = accelerated(H, np.concatenate([np.zeros(6), by_tau]) - change)
    assert block_error(dq @ by_q + dv @ by_v + dtau @ by_tau, expected) < 1e-12


@pytest.mark.parametrize("kind", ["articulated", "continuum"])
def test_equal_pieces_by_themselves_are_the_default_tail(kind):
    """The same numbers, whether a tail's mass and length are shared or each piece has its own."""
    links = kind == "articulated"
    size, pieces, one = (2, 3 if links else 5), 6 if links else 2, "link" if links else "arc"
    even = Tail(*size, kind)
    other = Tail(*size, kind, shape=Shape(**{f"{one}s": pieces}))
    for name in ("mass_matrix", "inverse_dynamics", "forward_dynamics", "energy", "tail_points"):
        given = arguments(assemble(FUNCTIONS[name], even))
        (mass,), (length,) = given.get("tail_mass", [0]), given["tail_length"]
        own = given | {f"{one}_masses": [mass / pieces] * pieces}
        own |= {f"{one}_lengths": [length / pieces] * pieces}
        if links:
            own["link_centers"] = [length / pieces / 2] * pieces
            own["link_inertias"] = given.get("link_inertia", []) * pieces
        program = assemble(FUNCTIONS[name], other)
        read = {a.name for a in (*program.of_role("parameters"), *program.of_role("input"))}
        found = outputs(program, {key: x for key, x in own.items() if key in read})
        for key, expected in outputs(assemble(FUNCTIONS[name], even), given).items():
            with row(name, key):
                most = 1e-13 * np.abs(expected).max()
                assert np.abs(found[key] - expected).max() <= most


@pytest.mark.parametrize("counts", [(3, 2, 2), (1, 4), (2,)])
def test_sweeps_in_lanes_and_by_segments_give_the_same_acceleration(counts):
    shape = Shape(counts if len(counts) > 1 else (), links=sum(counts), tilted=True)
    tail = Tail(len(counts), max(counts), shape=shape)
    for form in ("lanes", "segments"):
        assert_same("forward_dynamics", tail, form, 1e-12)


def test_stretches_number_the_pieces_of_their_kind_and_have_its_steps():
    shape = Shape((2, 5, 5, 3), ("articulated", "continuum", "continuum", "articulated"), 5, 2)
    tail = Tail(4, 5, "mixed", shape=shape)
    assert tail.runs("articulated") == (SegmentRun(0, 1, 0, 2), SegmentRun(3, 4, 4, 7, 2, 10, 2))
    assert tail.runs("continuum") == (SegmentRun(1, 3, 2, 4, 2, 2, 1),)
    assert (tail.pieces, tail.total) == (7, 15)
    counted = Shape((3, 3, 5), ("articulated", "articulated", "continuum"), 6, 1)
    draft = Draft("x", "", tail=Tail(3, 5, "mixed", shape=counted))
    kinds = [mechanism(draft).pose.__module__.rpartition(".")[2] for _ in each_segment(draft)]
    assert kinds == ["link", "arc"]
    with pytest.raises(ValueError, match="segments"):
        mechanism(draft).pose()


def test_models_tell_their_kinds():
    model = zoo.model("mixed")
    assert model.kind == "mixed"
    assert model.kinds == ("continuum", "articulated", "continuum", "articulated")
    assert model.links == (0, 2, 0, 3)
    assert model.samples == 3
    assert "an arc, 2 links, an arc, 3 links" in repr(model)
    assert model.parameters["tail_mass"] == pytest.approx(1.5e-3 + 9e-4 + 1.1e-3 + 1.5e-3)
    assert model.parameters["tail_length"] == pytest.approx(0.06 + 0.055 + 0.09 + 0.06)
    radii = np.array(animal_of(model).tail_radii)
    assert len(radii) == 3 + 2 + 3 + 3
    arcs = np.sqrt(np.array([1.5e-3 / 0.06, 1.1e-3 / 0.09]) / 1e3 / np.pi)
    np.testing.assert_allclose(radii[:3], arcs[0])
    np.testing.assert_allclose(radii[5:8], arcs[1])
    np.testing.assert_allclose(radii[3], np.sqrt(2 * 2e-9 / 5e-4))
    other = model.with_parameters(arc_masses=[1e-3, 2e-3], link_masses=[1e-4] * 5)
    assert other.parameters["tail_mass"] == pytest.approx(3.5e-3)


def test_parameters_of_a_wrong_length_and_arcs_that_bend_too_far_are_refused():
    model = zoo.model("mixed")
    for name, values in (("arc_masses", [0.1]), ("link_lengths", [0.1] * 4)):
        with pytest.raises(st.ModelError, match=rf"{name}.*0\.1"):
            model.with_parameters(**{name: values})
    q, v, tau = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv - 6)
    q[3], q[9] = 1, 20.0
    model.forward_dynamics(q, v, tau)
    q[11] = 6.3
    with pytest.raises(st.StateError):  # links may turn as far as they like
        model.forward_dynamics(q, v, tau)


def test_bends_of_a_flight_are_labelled_and_warned_of():
    model = zoo.model("mixed")
    q, v = np.zeros(model.nq), 2 * np.random.default_rng(5).normal(size=model.nv)
    q[3], q[7:] = 1, [1.5, 2.9, 1.2, 0, 0.3, 0.2, -0.2, 1.3]
    run = st.simulate(model, q, v, t_span=0.3, method="tsit5", rtol=1e-11)
    names = ["a_1", "b_1", "alpha_2", "beta_2", "a_3", "b_3", "alpha_4", "beta_4"]
    assert contents(run).labels["joint"] == names
    bent = [each for each in run.warnings if "bent" in each]
    assert ["segment 1 " in bent[0], "segment 4 " in bent[1]] == [True, True]
