"""A built model gets functions that it lacks when they are asked for; a loaded one refuses."""

import copy
import os
import pickle
import threading
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from serpentail.building import generator
from serpentail.identification.identify import check_model
from serpentail.model import growth
from serpentail.planning.program.nodes import FUNCTIONS, is_compiled
from serpentail_codegen.scene.problems import SceneError
from tests.support import zoo

from ..support.rows import row

Q, V, TAU = np.array([0, 0, 0.3, 1, 0, 0, 0, 0.4, -0.2]), np.linspace(-1, 1, 8), [2e-3, -1e-3]
SPAN = {"t_span": 0.02, "output_step": 0.01}


@pytest.fixture
def small(generations):
    return st.build(tail="articulated", segments=1, links=1, functions=["energy"])


def planned(model):
    assert is_compiled(model, SimpleNamespace(is_free=False))


def tracked(model):
    return st.Pfl(model, st.Reference([0, 1], [[0, 0], [1, 1]]))(0.5, Q, V)


ASKS = {  # who asks -> the question, a function that is there then
    "method": (lambda m: m.bias_force(Q, V), "bias_force"),
    "casadi": (lambda m: np.array(m.casadi.mass_matrix(Q)), "mass_matrix"),
    "external": (lambda m: m.casadi.external("x_dot", 1).name(), "forward_dynamics_derivatives"),
    "simulate": (lambda m: st.simulate(m, Q, V, **SPAN).q, "rollout"),
    "step": (lambda m: m.step(Q, V, TAU, 1e-3)[0], "rollout"),
    "stiff": (lambda m: m.step(Q, V, TAU, 1e-3, method="implicit_euler")[0], "implicit"),
    "pfl": (tracked, "pfl"),
    "plan": (planned, FUNCTIONS["curvature"]),
    "identify": (lambda m: check_model(m, ["tail_mass"]), "forward_dynamics_parameter_derivatives"),
}


@pytest.mark.slow
def test_whoever_asks_gets_what_was_missing(small):
    whole, kernel = zoo.model("m1_n1"), small.kernel("energy")
    for who, (ask, name) in ASKS.items():
        model = copy.copy(small)
        with row(who):
            found, expected = ask(model), ask(whole)
            assert name in model.generated and "energy" in model.generated
            if isinstance(found, np.ndarray):
                np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
            else:
                assert type(found) is type(expected)
    assert small.generated == ("energy",)  # copies grow by themselves
    assert kernel(Q, V) == pytest.approx(whole.energy(Q, V))


def test_copies_grow_too_and_each_set_of_functions_is_generated_once(small, generations):
    heavy, again = small.with_parameters(tail_mass=0.01), pickle.loads(pickle.dumps(small))
    expected = zoo.model("m1_n1").with_parameters(tail_mass=0.01).mass_matrix(Q)
    np.testing.assert_allclose(heavy.mass_matrix(Q), expected, rtol=1e-12)
    for model in (small, again):
        assert model.inverse_dynamics(Q, V, V).shape == (8,)
        assert {*model.generated} == {*heavy.generated}
    assert len(generations) == 2


def test_threads_that_ask_at_once_get_all_of_it(small, generations):
    begin, found = threading.Barrier(4), {}

    def ask(key, name):
        begin.wait()
        found[key] = small.kernel(name).name

    names = ["mass_matrix", "mass_matrix", "energy_derivatives", "forward_dynamics_jvp"]
    threads = [threading.Thread(target=ask, args=pair) for pair in enumerate(names)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == dict(enumerate(names)) and {*names} <= {*small.generated}
    assert len(generations) == 4


def test_a_run_goes_on_while_its_model_grows(small):
    """With "pfl" the records of a simulation have other members."""

    def growing(t, q, v):
        small.need("pfl")
        return TAU

    found = st.simulate(small, Q, V, controller=growing, **SPAN)
    expected = st.simulate(zoo.model("m1_n1"), Q, V, controller=lambda *_: TAU, **SPAN)
    np.testing.assert_allclose(found.q, expected.q, rtol=1e-9, atol=1e-12)
    assert "pfl" in small.generated


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_child_that_is_forked_meanwhile_can_ask(small):
    with growth._gate():
        child = os.fork()
        if child == 0:
            os._exit(small.mass_matrix(Q).shape != (8, 8))
    assert os.waitpid(child, 0)[1] == 0


def test_what_ends_early_leaves_the_model_as_it_was(small, monkeypatch):
    before = dict(vars(small))
    with monkeypatch.context() as broken:
        broken.setattr(generator, "generate", lambda *_: os.kill(os.getpid(), 2))
        with pytest.raises(KeyboardInterrupt):
            small.mass_matrix(Q)
        broken.setattr(generator, "find_spec", lambda name: None)
        broken.setattr(generator, "generator_digest", missing)
        with pytest.raises(st.ModelError, match="without the package serpentail_codegen"):
            small.mass_matrix(Q)
    assert vars(small) == before and small.mass_matrix(Q).shape == (8, 8)


def missing():
    raise ModuleNotFoundError("no package", name="serpentail_codegen")


def test_a_loaded_model_and_what_no_model_has_are_refused(small):
    loaded, flat = st.load(small.folder), st.load(small.folder, compiled=False)
    refused = (st.ModelError, SceneError)  # the generator of these tests runs in this process
    for ask, words in (
        (lambda: loaded.mass_matrix(Q), r"without 'mass_matrix' .*\+mass_matrix"),
        (lambda: st.simulate(loaded, Q, V, t_span=0.1), r"'rollout', 'momentum' .*\+rollout"),
        (lambda: flat.casadi.momentum, r"without 'momentum' .*\+momentum"),
        (lambda: small.kernel("mass_matrx"), "did you mean 'mass_matrix'"),
        (lambda: small.casadi.crba, "did you mean 'mass_matrix'"),
        (lambda: small.leg_points(Q, [0] * 4), "leg_points.*needs points that touch"),
    ):
        with row(words), pytest.raises(refused, match=f"(?s){words}"):
            ask()
    with pytest.raises(AttributeError):
        _ = small.mass_matrx
