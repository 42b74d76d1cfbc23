"""The blocks of docs/recipes.md run, and come to what the model does."""

import subprocess
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest

from tests.docs.running import PAGES, run_page

pytest.importorskip("fmpy")
pytestmark = pytest.mark.slow  # it compiles and links as a user does


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The names that the Python blocks made, in the folder where all blocks ran."""
    page = run_page(PAGES["recipes"], tmp_path_factory.mktemp("recipes"))
    with chdir(page.folder):
        page.names["compiled_jacobians"] = page.names["casadi"].external("f_jac", "./f.so")
        yield page.names


def state(model):
    q = np.array([0, 0, 0.34, 0.9, 0.3, -0.2, 0.1, 0.2, 0.1])
    q[3:7] /= np.linalg.norm(q[3:7])
    v = np.array([0.1, 0.2, 0.3, 4.0, -5.0, 6.0, 7.0, -8.0])
    return np.concatenate([q, v]), np.array([1e-3, -2e-3])


def test_generated_casadi_code_calls_the_model(ran):
    model = ran["model"]
    x, u = state(model)
    np.testing.assert_allclose(ran["compiled"](x, u), model.x_dot(x, u)[:, None], rtol=1e-12)
    wanted = model.x_dot_derivatives(x, u)
    for found, one in zip(ran["compiled_jacobians"](x, u), wanted, strict=True):
        np.testing.assert_allclose(found, one, rtol=0, atol=1e-9 * np.abs(one).max())
    assert "rat_casadi_forward_dynamics(" in Path("f.c").read_text()


def test_generated_code_links_with_the_library_of_acados_recipe(ran):
    subprocess.run(
        [
            "cc",
            "-shared",
            "-fPIC",
            "f.c",
            "-L.",
            "-lrat",
            "-Wl,-rpath,$ORIGIN",
            "-lm",
            "-o",
            "g.so",
        ],
        check=True,
    )
    x, u = state(ran["model"])
    found = ran["casadi"].external("f", "./g.so")(x, u)
    np.testing.assert_allclose(found, ran["model"].x_dot(x, u)[:, None], rtol=1e-12)


def test_the_unit_flies_as_the_model_does(ran):
    st, model, flown = ran["st"], ran["model"], ran["flown"]
    q, v = np.zeros(9), np.zeros(8)
    q[[2, 3]], v[3] = (2.0, 1.0), 5.0
    law = st.TorqueTable([0.0, 1.0], [[1e-3, 0.0]] * 2)
    motion = st.simulate(model, q, v, controller=law, t_span=0.2)
    for k in range(1, 10):
        assert flown[f"q[{k}]"][-1] == pytest.approx(motion.q[-1, k - 1], abs=1e-6)


def test_the_c_gives_the_models_accelerations(ran):
    model, block = ran["model"], ran["block"]
    wanted = model.forward_dynamics(block["q"], block["v"], block["tau"])
    assert ran["status"] == 0
    np.testing.assert_allclose(block["v_dot"], wanted, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(np.loadtxt("v_dot.txt"), wanted, rtol=1e-10, atol=1e-12)
