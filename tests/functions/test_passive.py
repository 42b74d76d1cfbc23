"""Springs, damping and stops inside all functions of the dynamics: each against the same tail
without them, whose torques are less by what an independent reference says.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.scene.passive import PASSIVE, PASSIVE_NAMES
from tests.references.metrics import block_error
from tests.references.mujoco_chain import MujocoChain
from tests.references.parameters import TABLE_1, random_states
from tests.references.passive import PassiveTail
from tests.support.elastic import elastic_model, plain_model, unequal

FORMS = {
    "straight": (1, 3, {"emission": "straight"}),
    "loops": (2, 2, {"emission": "loops"}),
    "lanes": (2, 3, {"emission": "lanes"}),
    "segments": (3, 2, {"emission": "segments"}),
    "arcs": (2, None, {}),
}
TAIL = slice(6, None)


class Pair:
    """A passive tail with parameters of its own in each coordinate, one without, the reference."""

    def __init__(self, form):
        segments, links, options = FORMS[form]
        self.segments, self.links = segments, links
        folder = elastic_model(segments, links, functions="all", **options).folder
        self.plain = plain_model(segments, links, functions="all", **options)
        self.parameters = unequal(segments)
        self.elastic = st.load(folder, parameters=self.parameters)
        self.reference = PassiveTail(self.parameters, 2 * segments)

    def states(self, count=6):
        """Random states: of coordinates in their range, in stops and beyond."""
        q, v, v_dot, tau = random_states(self.segments, 3, count, "random")
        for k in range(count):
            yield q[k], v[k], v_dot[k], tau[k]

    def force(self, q, v):
        """What the passive parts ask for."""
        return self.reference.force(q[7:], v[TAIL])

    def slopes(self, q):
        """Matrices of stiffness and damping."""
        stiffness = self.reference.stiffness(q[7:])
        return np.diag(stiffness), np.diag(self.parameters["tail_damping"])


@pytest.fixture(scope="module", params=FORMS)
def pair(request):
    """A passive tail and the same without its passive parts."""
    return Pair(request.param)


def assert_near(found, expected, limit=1e-11):
    scale = np.abs(expected).max() or 1.0
    assert np.abs(np.asarray(found) - expected).max() <= limit * scale


@pytest.mark.parametrize("name", ["forward_dynamics", "energy", "implicit_factor"])
@pytest.mark.parametrize("part", [None, "spring", "damping", "stops"])
def test_only_the_parts_of_a_scene_are_emitted(name, part):
    """A program knows the parameters of its parts alone, and is longer by these."""
    own = {p.name for p in PASSIVE if p.needs == part}
    bare, program = (
        assemble(CATALOGUE[name], Tail(2, 2, passive=passive))
        for passive in ((), () if part is None else (part,))
    )
    known = {a.name for a in program.of_role("parameters")} & set(PASSIVE_NAMES)
    assert known == own and not {a.name for a in bare.of_role("parameters")} & set(PASSIVE_NAMES)
    longer = not (part is None or (part, name) == ("damping", "energy"))
    assert (executed(program) > executed(bare)) == longer


@pytest.mark.parametrize("name", ["bias_force", "bias_force_world"])
def test_bias_has_the_passive_forces(pair, name):
    for q, v, _, _ in pair.states():
        expected = getattr(pair.plain, name)(q, v)
        expected[TAIL] += pair.force(q, v)
        assert block_error(getattr(pair.elastic, name)(q, v), expected) < 1e-12


def test_inverse_dynamics_has_the_passive_forces(pair):
    for q, v, v_dot, _ in pair.states():
        expected = pair.plain.inverse_dynamics(q, v, v_dot)
        expected[TAIL] += pair.force(q, v)
        assert block_error(pair.elastic.inverse_dynamics(q, v, v_dot), expected) < 1e-12


def test_forward_dynamics_has_the_passive_forces(pair):
    for q, v, _, tau in pair.states():
        left = tau - pair.force(q, v)
        expected = pair.plain.forward_dynamics(q, v, left)
        assert block_error(pair.elastic.forward_dynamics(q, v, tau), expected) < 1e-10
        load = np.linspace(-1, 1, 6 + 3 * len(pair.plain.tail_points(q)))
        pushed = pair.plain.forward_dynamics(q, v, left, load)
        assert block_error(pair.elastic.forward_dynamics(q, v, tau, load), pushed) < 1e-10


def test_mujoco_with_these_torques_accelerates_alike():
    pair = Pair("lanes")
    peer = MujocoChain(TABLE_1, pair.segments, pair.links)
    for q, v, _, tau in pair.states():
        expected = peer.forward_dynamics(q, v, tau - pair.force(q, v))
        assert block_error(pair.elastic.forward_dynamics(q, v, tau), expected) < 1e-9


def test_batches_are_those_of_single_states(pair):
    q, v, _, tau = random_states(pair.segments, 5, 21, "random")
    rows = pair.elastic.forward_dynamics(q, v, tau)
    for k in range(len(q)):
        one = pair.elastic.forward_dynamics(q[k], v[k], tau[k])
        assert block_error(rows[k], one) < 1e-11


def test_energy_has_what_springs_and_stops_store(pair):
    for q, v, _, _ in pair.states():
        kinetic, potential = pair.plain.energy(q, v)
        stored = pair.reference.energy(q[7:])
        found = pair.elastic.energy(q, v)
        assert found[0] == kinetic and stored > 0
        assert found[1] == pytest.approx(potential + stored, rel=1e-13, abs=1e-15)


def test_energy_derivatives_are_the_elastic_forces(pair):
    for q, v, _, _ in pair.states():
        kinetic_dq, kinetic_dv, expected = pair.plain.energy_derivatives(q, v)
        expected[TAIL] += pair.force(q, 0 * v)
        found = pair.elastic.energy_derivatives(q, v)
        assert_near(found[0], kinetic_dq), assert_near(found[1], kinetic_dv)
        assert_near(found[2], expected)


def test_jacobians_of_inverse_dynamics(pair):
    for q, v, v_dot, _ in pair.states():
        stiffness, damping = pair.slopes(q)
        dq, dv = pair.plain.inverse_dynamics_derivatives(q, v, v_dot)
        dq[TAIL, TAIL] += stiffness
        dv[TAIL, TAIL] += damping
        found = pair.elastic.inverse_dynamics_derivatives(q, v, v_dot)
        assert_near(found[0], dq), assert_near(found[1], dv)


def test_jacobians_of_forward_dynamics(pair):
    for q, v, _, tau in pair.states():
        stiffness, damping = pair.slopes(q)
        dq, dv, dtau = pair.plain.forward_dynamics_derivatives(q, v, tau - pair.force(q, v))
        dq[:, TAIL] -= dtau @ stiffness
        dv[:, TAIL] -= dtau @ damping
        found = pair.elastic.forward_dynamics_derivatives(q, v, tau)
        for one, expected in zip(found, (dq, dv, dtau), strict=True):
            assert_near(one, expected, 1e-9)


def test_products_are_those_of_the_jacobians(pair):
    rng = np.random.default_rng(8)
    for q, v, v_dot, tau in pair.states():
        d_q, d_v, weights = rng.normal(size=(3, pair.plain.nv))
        d_tau = rng.normal(size=len(tau))
        dq, dv, dtau = pair.elastic.forward_dynamics_derivatives(q, v, tau)
        jvp = pair.elastic.forward_dynamics_jvp(q, v, tau, d_q, d_v, d_tau)
        assert_near(jvp, dq @ d_q + dv @ d_v + dtau @ d_tau, 1e-9)
        vjp = pair.elastic.forward_dynamics_vjp(q, v, tau, weights)
        for one, matrix in zip(vjp, (dq, dv, dtau), strict=True):
            assert_near(one, weights @ matrix, 1e-9)
        dq, dv = pair.elastic.inverse_dynamics_derivatives(q, v, v_dot)
        vjp = pair.elastic.inverse_dynamics_vjp(q, v, v_dot, weights)
        H = pair.plain.mass_matrix(q)
        for one, matrix in zip(vjp, (dq, dv, H), strict=True):
            assert_near(one, weights @ matrix)


def test_hessian_has_how_stops_stiffen(pair):
    """That of a stop changes on the way into it: by central differences of the reference."""
    for q, v, v_dot, _ in pair.states():
        weights, h = np.linspace(-1, 2, pair.plain.nv), 1e-6
        rise = pair.reference.stiffness(q[7:] + h) - pair.reference.stiffness(q[7:] - h)
        qq, *others = pair.plain.inverse_dynamics_hessian(q, v, v_dot, weights)
        qq[TAIL, TAIL] += np.diag(weights[TAIL] * rise / (2 * h))
        found = pair.elastic.inverse_dynamics_hessian(q, v, v_dot, weights)
        assert_near(found[0], qq, 1e-8)
        for one, expected in zip(found[1:], others, strict=True):
            assert_near(one, expected)


def test_derivatives_by_the_passive_parameters(pair):
    """Columns of the struct's numbers, by central differences of the reference."""
    names = [p["name"] for p in pair.elastic.manifest["parameters"] if p["in_struct"]]
    sizes = [p["size"] for p in pair.elastic.manifest["parameters"] if p["in_struct"]]
    first = dict(zip(names, np.cumsum([0, *sizes]), strict=False))
    for q, v, v_dot, tau in pair.states(3):
        by_force = pair.elastic.inverse_dynamics_parameter_derivatives(q, v, v_dot)
        by_motion = pair.elastic.forward_dynamics_parameter_derivatives(q, v, tau)
        *_, dtau = pair.plain.forward_dynamics_derivatives(q, v, tau)
        for name, values in pair.parameters.items():
            for k in range(len(values)):
                slope = slope_by(pair, name, k, q, v)
                column = by_force[:, first[name] + k]
                assert not column[:6].any()
                np.testing.assert_allclose(column[TAIL], slope, rtol=1e-6, atol=1e-9)
                expected, found = -dtau @ slope, by_motion[:, first[name] + k]
                np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-4)


def slope_by(pair, name, k, q, v):
    """How the passive forces follow one number."""
    h, ends = 1e-6, []
    for sign in (1, -1):
        moved = {n: np.array(x) for n, x in pair.parameters.items()}
        moved[name][k] += sign * h
        ends.append(PassiveTail(moved, 2 * pair.segments).force(q[7:], v[TAIL]))
    return (ends[0] - ends[1]) / (2 * h)


def test_pfl_adds_what_the_tail_itself_asks_for(pair):
    for q, v, v_dot, _ in pair.states():
        wanted = v_dot[TAIL]
        expected = pair.plain.pfl(q, v, wanted) + pair.force(q, v)
        tau = pair.elastic.pfl(q, v, wanted)
        assert_near(tau, expected)
        assert_near(pair.elastic.forward_dynamics(q, v, tau)[TAIL], wanted, 1e-9)


def test_casadi_functions_mean_the_same():
    pytest.importorskip("casadi")
    pair = Pair("arcs")
    for q, v, v_dot, tau in pair.states(3):
        found = pair.elastic.casadi.forward_dynamics(q, v, tau).full().ravel()
        assert block_error(found, pair.elastic.forward_dynamics(q, v, tau)) < 1e-10
        found = pair.elastic.casadi.inverse_dynamics(q, v, v_dot).full().ravel()
        assert block_error(found, pair.elastic.inverse_dynamics(q, v, v_dot)) < 1e-12
        kinetic, potential = map(float, pair.elastic.casadi.energy(q, v))
        assert (kinetic, potential) == pytest.approx(pair.elastic.energy(q, v), rel=1e-12)


@pytest.mark.parametrize("gains", [(0.0, 0.0), (4e4, 400.0)], ids=["free", "tracked"])
def test_implicit_systems_have_stiffness_and_damping(pair, gains):
    """(1 - w J) k = r with J of the tail's springs, stops and both dampings; a tracked one is rid
    of its own.
    """
    rng, own = np.random.default_rng(2), gains == (0.0, 0.0)
    given, nv = np.linspace(1e-4, 1e-3, 2 * pair.segments), pair.plain.nv
    for q, v, _, _ in pair.states():
        stiffness, damping = (own * each for each in pair.slopes(q))
        H, J = pair.plain.mass_matrix(q), np.zeros((2 * nv, 2 * nv))
        by_q, by_v = np.zeros((2, nv, nv))
        by_q[TAIL, TAIL] = -stiffness - gains[0] * H[TAIL, TAIL]
        by_v[TAIL, TAIL] = -damping - np.diag(given) - gains[1] * H[TAIL, TAIL]
        J[:nv, nv:] = np.eye(nv)
        J[nv:, :nv], J[nv:, nv:] = np.linalg.solve(H, by_q), np.linalg.solve(H, by_v)
        for w in (1e-5, 1e-3, 0.1):
            r_q, r_v = rng.normal(size=(2, nv))
            factors = pair.elastic.kernel("implicit_factor")(q, v, given, gains, [w])
            found = np.concatenate(pair.elastic.kernel("implicit_solve")(factors, r_q, r_v))
            expected = np.linalg.solve(np.eye(2 * nv) - w * J, np.concatenate([r_q, r_v]))
            assert_near(found, expected, 1e-9)
