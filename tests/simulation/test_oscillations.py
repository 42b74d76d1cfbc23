"""Small oscillations of elastic tails: those of linear mechanics, of cantilevers and of arcs."""

import numpy as np
import pytest
from scipy.linalg import eigh

import serpentail as st
from tests.references.exact_continuum import ExactContinuum
from tests.references.parameters import TABLE_1
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row

LENGTH, DENSITY = TABLE_1["tail_length"], TABLE_1["tail_mass"] / TABLE_1["tail_length"]
# beta L of the first two modes of a cantilever: roots of cos x cosh x = -1
CANTILEVER = np.array([1.8751040687119611, 4.694091132974175])
BENDING = 1e-4  # N m^2, EI
HEAVY = {"torso_mass": 1e6 * TABLE_1["torso_mass"]}
HEAVY |= {"torso_inertia": tuple(1e6 * each for each in TABLE_1["torso_inertia"])}
STIFFNESS = np.array([2e-3, 3e-3, 1e-3, 4e-3])
REST = np.array([0.2, -0.1, 0.3, 0.0])


def bent(angles):
    """A start at rest with an upright torso."""
    return np.concatenate([[0, 0, 0, 1, 0, 0, 0], angles]), np.zeros(10)


def check_modes(model, begin, M, rest, damping):
    """Started in a mode at 1e-4 rad a tail keeps it: K x + damping K x' + M x'' = 0; the runs."""
    runs, (squares, shapes) = [], eigh(np.diag(STIFFNESS), M)
    for square, shape in zip(squares, shapes.T, strict=True):
        start = 1e-4 * shape / np.abs(shape).max()
        how = {"t_span": 6 * np.pi / np.sqrt(square), "method": "tsit5", "rtol": 1e-10}
        run = st.simulate(model, *begin(rest + start), **how)
        # x'' + damping w^2 x' + w^2 x = 0 from x = 1, x' = 0
        roots = np.roots([1, damping * square, square])
        parts = np.linalg.solve([[1, 1], roots], [1, 0])
        x = np.real(np.exp(np.outer(run.t, roots)) @ parts)
        assert np.abs(run.tail - rest - np.outer(x, start)).max() < 2e-7
        runs.append(run)
    return runs


def springs(damping):
    """Parameters of springs, and of damping that is ``damping`` times as much."""
    given = {"tail_rest": REST, "tail_stiffness": STIFFNESS, "tail_damping": damping * STIFFNESS}
    return {name: each.tolist() for name, each in given.items()}


@pytest.mark.parametrize("name", ["elastic", "elastic_arcs"])
def test_small_oscillations_are_those_of_the_linear_tail(name):
    """Of the tail's inertia on a torso that is free, by another derivation of the same tail."""
    if name == "elastic":
        pytest.importorskip("mujoco")
        from tests.references.mujoco_chain import MujocoChain

        peer = MujocoChain(TABLE_1, 2, 2)
    else:
        peer = ExactContinuum(TABLE_1, 2)
    H = peer.mass_matrix(bent(REST)[0])
    far = {"tail_stop_lower": -3, "tail_stop_upper": 3, "gravity": 0}
    for damping in (0.0, 2e-3):
        model = zoo.model(name).with_parameters(**far, **springs(damping))
        with row(damping):
            check_modes(model, bent, np.linalg.inv(np.linalg.inv(H)[6:, 6:]), REST, damping)


def test_small_oscillations_on_a_fixed_base_are_those_of_a_held_tail():
    """The model is of its own: no other has springs on a base that never moves."""
    pytest.importorskip("mujoco")
    from tests.references.mujoco_chain import MujocoChain

    H = MujocoChain(TABLE_1, 2, 2).mass_matrix(bent(REST)[0])[6:, 6:]
    own = {"functions": ["energy", "momentum", "rollout"], "parameters": springs(2e-3)}
    model = st.load(model_folder(2, 2, base="fixed", weightless=True, **own))
    runs = check_modes(model, lambda angles: (angles, np.zeros(4)), H, REST, 2e-3)
    assert max(run.info["imbalance"]["relative"] for run in runs) < 1e-5


def clamped(model, stiffness):
    """Frequencies of a straight tail on a torso that is a million times as heavy, over a
    cantilever's first.
    """
    q = np.zeros(model.nq)
    q[3] = 1
    M = np.linalg.inv(np.linalg.inv(model.with_parameters(**HEAVY).mass_matrix(q))[6:, 6:])
    squares = eigh(stiffness * np.eye(len(M)), M, eigvals_only=True)
    first = CANTILEVER[0] ** 2 * np.sqrt(BENDING / (DENSITY * LENGTH**4))
    return np.sqrt(squares) / first


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_arcs_converge_to_the_euler_bernoulli_cantilever():
    """Arcs of stiffness EI / L_arc; a single one has sqrt(20 EI / (rho L^4)), and the error falls
    as the square of their number.
    """
    ratio, first, second = (CANTILEVER[1] / CANTILEVER[0]) ** 2, [], []
    for arcs in (1, 2, 3):
        found = clamped(zoo.model(f"arcs{arcs}"), BENDING / (LENGTH / arcs))
        first.append(found[0] - 1)
        second += [found[2] / ratio - 1] if arcs > 1 else []
        assert found[1] == pytest.approx(found[0], rel=1e-6)  # both planes
    assert first[0] + 1 == pytest.approx(np.sqrt(20) / CANTILEVER[0] ** 2, rel=1e-5)
    for errors in (first, second):
        assert (np.diff(errors) < 0).all() and min(errors) > 0
    assert first[1] / first[2] == pytest.approx((3 / 2) ** 2, rel=0.1)
