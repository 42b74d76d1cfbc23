"""Springs, damping and stops inside all functions of the dynamics: each against the same tail
without them, whose torques are less by what an independent reference says.
"""

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import executed
from serpentail_scene.parameters import PASSIVE, PASSIVE_NAMES
from tests.functions.test_columns import assert_same
from tests.references.metrics import block_error
from tests.references.parameters import random_states
from tests.references.passive import PassiveTail
from tests.support import zoo
from tests.support.rows import row

# passive tails, and the same without
PAIRS = {"elastic": "m2_n2", "damped_stops": "m2_n2", "elastic_arcs": "arcs2"}
PARTS = ("spring", "damping", "stops")
TAIL = slice(6, None)


class Pair:
    """A passive tail with parameters of its own in each coordinate, one without, the reference."""

    def __init__(self, name):
        self.plain = zoo.model(PAIRS[name])
        elastic, numbers = zoo.model(name), unequal(self.plain.segments).items()
        self.parameters = {n: x for n, x in numbers if n in elastic.parameters}
        self.elastic = elastic.with_parameters(**self.parameters)
        self.reference = PassiveTail(self.parameters, 2 * self.plain.segments)

    def states(self, count=6):
        """Random states: of coordinates in their range, in stops and beyond."""
        return zip(*random_states(self.plain.segments, 3, count, "random"), strict=True)

    def force(self, q, v):
        """What the passive parts ask for."""
        return self.reference.force(q[7:], v[TAIL])


def unequal(segments):
    """Return parameters of all passive parts, different ones for each coordinate."""
    rng, size = np.random.default_rng(17), 2 * segments
    ranges = {"tail_stiffness": (0.001, 0.01), "tail_rest": (-0.3, 0.3)}
    ranges |= {"tail_damping": (1e-5, 1e-3), "tail_stop_lower": (-0.9, -0.2)}
    ranges |= {"tail_stop_upper": (0.2, 0.9), "tail_stop_stiffness": (0.01, 0.1)}
    ranges |= {"tail_stop_width": (0.02, 0.2), "tail_stop_damping": (1e-4, 1e-3)}
    return {name: rng.uniform(*ends, size) for name, ends in ranges.items()}


@pytest.fixture(scope="module", params=PAIRS)
def pair(request):
    return Pair(request.param)


def assert_near(found, expected, limit=1e-11):
    scale = np.abs(expected).max() or 1.0
    assert np.abs(np.asarray(found) - expected).max() <= limit * scale


def test_only_the_parts_of_a_scene_are_emitted():
    """A program knows the parameters of its parts alone, and is longer by these."""
    for name in ("forward_dynamics", "energy", "implicit_factor"):
        bare = assemble(CATALOGUE[name], Tail(2, 2))
        assert not {a.name for a in bare.of_role("parameters")} & set(PASSIVE_NAMES)
        for part in PARTS:
            program = assemble(CATALOGUE[name], Tail(2, 2, passive=(part,)))
            known = {a.name for a in program.of_role("parameters")} & set(PASSIVE_NAMES)
            with row(name, part):
                assert known == {p.name for p in PASSIVE if p.needs == part}
                longer = (part, name) != ("damping", "energy")
                assert (executed(program) > executed(bare)) == longer


@pytest.mark.parametrize("form", ["lanes", "segments"])
def test_every_form_has_the_same_acceleration(form):
    for name in ("forward_dynamics", "forward_dynamics_external"):
        assert_same(name, Tail(3, 2, passive=PARTS), form, 1e-12)


def test_dynamics_and_energy_have_the_passive_parts(pair):
    for q, v, v_dot, tau in pair.states():
        force = np.r_[np.zeros(6), pair.force(q, v)]
        for name, *given in (
            ("bias_force", q, v),
            ("bias_force_world", q, v),
            ("inverse_dynamics", q, v, v_dot),
        ):
            found, expected = (getattr(m, name)(*given) for m in (pair.elastic, pair.plain))
            with row(name):
                assert block_error(found, expected + force) < 1e-12
        wanted = v_dot[TAIL]
        torques = pair.elastic.pfl(q, v, wanted)
        assert_near(torques, pair.plain.pfl(q, v, wanted) + force[TAIL])
        assert_near(pair.elastic.forward_dynamics(q, v, torques)[TAIL], wanted, 1e-9)
        left, load = tau - force[TAIL], np.linspace(-1, 1, 6 + 3 * len(pair.plain.tail_points(q)))
        for pushed in ((), (load,)):
            expected = pair.plain.forward_dynamics(q, v, left, *pushed)
            found = pair.elastic.forward_dynamics(q, v, tau, *pushed)
            assert block_error(found, expected) < 1e-10
        kinetic, potential = pair.plain.energy(q, v)
        stored, found = pair.reference.energy(q[7:]), pair.elastic.energy(q, v)
        assert found[0] == pytest.approx(kinetic, rel=1e-15) and stored > 0
        assert found[1] == pytest.approx(potential + stored, rel=1e-13, abs=1e-15)


@pytest.mark.parametrize("gains", [(0.0, 0.0), (4e4, 400.0)], ids=["free", "tracked"])
def test_implicit_systems_have_stiffness_and_damping(pair, gains):
    """(1 - w J) k = r with J of the tail's springs, stops and both dampings; a tracked one is rid
    of its own.
    """
    rng, own = np.random.default_rng(2), gains == (0.0, 0.0)
    nv = pair.plain.nv
    given = np.linspace(1e-4, 1e-3, nv - 6)
    for q, v, _, _ in pair.states():
        stiffness = own * np.diag(pair.reference.stiffness(q[7:]))
        damping = own * np.diag(pair.reference.damping(q[7:]))
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
