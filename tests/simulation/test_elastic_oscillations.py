"""Small oscillations of elastic tails: those of linear mechanics, of cantilevers and of arcs."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eigh

import serpentail as st
from tests.references.exact_continuum import ExactContinuum
from tests.references.mujoco_chain import MujocoChain
from tests.references.parameters import TABLE_1
from tests.support.elastic import SIZES, bent, elastic_model, of_parameters

LENGTH, DENSITY = TABLE_1["tail_length"], TABLE_1["tail_mass"] / TABLE_1["tail_length"]
# beta L of the first two modes of a cantilever: roots of cos x cosh x = -1
CANTILEVER = np.array([1.8751040687119611, 4.694091132974175])
BENDING = 1e-4  # N m^2, EI
HEAVY = {"torso_mass": 1e6 * TABLE_1["torso_mass"]}
HEAVY |= {"torso_inertia": tuple(1e6 * each for each in TABLE_1["torso_inertia"])}


def peer(name):
    """Another derivation of the same tail, without springs."""
    segments, links = SIZES[name]
    chain = MujocoChain(TABLE_1, segments, links) if links else ExactContinuum(TABLE_1, segments)
    return chain


def modes(H, stiffness):
    """Frequencies (rad/s) and shapes of K x = w^2 M x, M being the tail's inertia on a free
    torso.
    """
    M = np.linalg.inv(np.linalg.inv(H)[6:, 6:])
    squares, shapes = eigh(np.diag(stiffness), M)
    return np.sqrt(squares), shapes


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("damping", [0.0, 2e-3], ids=["undamped", "damped"])
def test_small_oscillations_are_those_of_the_linear_tail(name, damping):
    """Started in a mode at 1e-4 rad, without gravity, a tail keeps it: K and D = 2e-3 K alike."""
    stiffness = np.array([2e-3, 3e-3, 1e-3, 4e-3])
    given = {"tail_stiffness": stiffness.tolist(), "tail_rest": [0.2, -0.1, 0.3, 0.0]}
    given |= {"tail_damping": (damping * stiffness).tolist(), "gravity": 0}
    model, rest = of_parameters(name, given), np.array(given["tail_rest"])
    frequencies, shapes = modes(peer(name).mass_matrix(bent(model, rest)[0]), stiffness)
    for w, shape in zip(frequencies, shapes.T, strict=True):
        start, period = 1e-4 * shape / np.abs(shape).max(), 2 * np.pi / w
        run = st.simulate(
            model, *bent(model, rest + start), t_span=3 * period, method="tsit5", rtol=1e-10
        )
        # x'' + damping w^2 x' + w^2 x = 0 from x = 1, x' = 0
        roots = np.roots([1, damping * w**2, w**2])
        parts = np.linalg.solve([[1, 1], roots], [1, 0])
        x = np.real(np.exp(np.outer(run.t, roots)) @ parts)
        error = np.abs(run.tail - rest - np.outer(x, start)).max()
        assert error < 2e-7


def linear_frequencies(model):
    """Frequencies (rad/s) of a straight tail, by differences of its accelerations."""
    (q, v), nt, h = bent(model, 0.0), model.layout.nt, 1e-6
    rows = np.concatenate([q + np.eye(model.nq)[7:] * h, q - np.eye(model.nq)[7:] * h])
    found = model.forward_dynamics(rows, v + np.zeros((2 * nt, 1)), np.zeros((2 * nt, nt)))[:, 6:]
    slopes = (found[:nt] - found[nt:]).T / (2 * h)
    return np.sqrt(np.sort(np.linalg.eigvals(-slopes).real))


def clamped(segments, links, stiffness):
    """Frequencies of a tail on a torso that is a million times as heavy, over a cantilever's
    first.
    """
    model = elastic_model(
        segments,
        links,
        {"tail_stiffness": stiffness, "gravity": 0} | HEAVY,
        functions=["forward_dynamics", "mass_matrix"],
    )
    first = CANTILEVER[0] ** 2 * np.sqrt(BENDING / (DENSITY * LENGTH**4))
    return linear_frequencies(model) / first


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_arcs_converge_to_the_euler_bernoulli_cantilever():
    """1 to 8 arcs of stiffness EI / L_arc; a single one has sqrt(20 EI / (rho L^4))."""
    ratio = (CANTILEVER[1] / CANTILEVER[0]) ** 2
    first, second = [], []
    for arcs in range(1, 9):
        found = clamped(arcs, None, BENDING / (LENGTH / arcs))
        first.append(found[0] - 1)
        second += [found[2] / ratio - 1] if arcs > 1 else []
        assert found[1] == pytest.approx(found[0], rel=1e-6)  # both planes
    assert first[0] + 1 == pytest.approx(np.sqrt(20) / CANTILEVER[0] ** 2, rel=1e-5)
    for errors in (first, second):
        assert (np.diff(errors) < 0).all() and min(errors) > 0
    # the error falls as the square of their number
    assert first[7] < 0.0031 and second[6] < 0.022
    assert first[3] / first[7] == pytest.approx(4, rel=0.02)
    assert second[2] / second[6] == pytest.approx(4, rel=0.1)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
@pytest.mark.parametrize("segments", [1, 2])
def test_links_converge_to_arcs(segments):
    """n links whose joints have EI / l each, k = EI n^2 / L_segment in their common angle: the
    error falls as 1 / n.
    """
    arc = LENGTH / segments
    limit = clamped(segments, None, BENDING / arc)[::2]
    errors = [
        np.abs(clamped(segments, n, BENDING * n**2 / arc)[::2] / limit - 1) for n in (8, 16, 32)
    ]
    assert (errors[2] < 0.05).all()
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(2, rel=0.15)
