"""Models whose links have values of their own: parameters, many runs, numbers of links."""

import numpy as np
import pytest

import serpentail as st
from serpentail.verification.report import laws
from tests.support.own_tails import folder, folder_of_tables

FUNCTIONS = ["mass_matrix", "forward_dynamics", "energy", "momentum", "rollout"]


@pytest.fixture(scope="module")
def model():
    """Three segments of 3, 2 and 2 links."""
    return st.load(folder("links", functions=FUNCTIONS))


def test_totals_follow_from_the_links(model):
    assert model.links == (3, 2, 2) and list(model.joints_each) == [3, 2, 2]
    assert model.parameters["tail_mass"] == pytest.approx(0.0026)
    assert model.parameters["tail_length"] == pytest.approx(0.135)
    lighter = model.with_parameters(link_masses=0.5 * np.array(model.parameters["link_masses"]))
    assert lighter.parameters["tail_mass"] == pytest.approx(0.0013)
    assert "3, 2, 2 links" in repr(model)


def test_moments_may_be_given_link_by_link(model):
    moments = np.reshape(model.parameters["link_inertias"], (7, 3))
    same = model.with_parameters(link_inertias=moments)
    assert same.parameters == model.parameters
    with pytest.raises(st.ModelError, match="needs 21 finite numbers, 3 of each piece"):
        model.with_parameters(link_inertias=moments[:6])
    with pytest.raises(st.ModelError, match=r"tail_mass: no such .* sum of link_masses"):
        model.with_parameters(tail_mass=0.1)
    with pytest.raises(st.ModelError, match="above 0"):
        model.with_parameters(link_lengths=[0.0] * 7)


def test_runs_have_links_of_their_own(model):
    masses = np.outer([1.0, 1.5], model.parameters["link_masses"])
    q = np.array([0, 0, 1.0, 1, 0, 0, 0, 0.2, 0.1, -0.3, 0.2, 0.4, 0.1])
    v = np.array([0, 0, 0, 1.0, 0, 0, 3.0, 0, 0, 2.0, 0, -1.0])
    both = np.tile(q, (2, 1)), np.tile(v, (2, 1))
    keys = {"t_span": (0, 0.01), "method": "rk4", "step": 1e-4}
    runs = st.simulate(model, *both, parameters={"link_masses": masses}, **keys)
    for k, run in enumerate(runs):
        alone = st.simulate(model.with_parameters(link_masses=masses[k]), q, v, **keys)
        np.testing.assert_allclose(run.q[-1], alone.q[-1], rtol=0, atol=1e-14)
    assert np.abs(runs[0].q[-1] - runs[1].q[-1]).max() > 1e-4


def test_a_single_link_has_arrays_too():
    one = {"kind": "articulated", "segments": [{"links": 1, "length": 0.1, "mass": 0.01}]}
    model = st.load(folder_of_tables(one, {}, functions=FUNCTIONS))
    assert model.parameters["link_masses"] == (0.01,)
    assert model.with_parameters(link_masses=[0.02]).parameters["tail_mass"] == 0.02


def test_bends_are_shared_among_the_links_of_each_segment(model):
    reference = st.Reference.of_bends(model, [0.0, 0.1], [[0.3, 0.4, 0.6]] * 2)
    np.testing.assert_allclose(reference.curve.at(0.05)[0], [0.1, 0, 0.2, 0, 0.3, 0])


def test_a_scene_is_built_with_links_of_its_own():
    keys = {"tail": "articulated", "segments": 1, "links": 2, "functions": ["energy"]}
    built = st.build(**keys, link_masses=[1e-3, 2e-3], link_lengths=[0.02, 0.03])
    assert built.parameters["tail_mass"] == pytest.approx(3e-3)
    tables = [{"links": 2, "length": 0.1, "mass": 1e-3}, {"links": 1, "length": 0.1, "mass": 2e-3}]
    other = st.build(tail="articulated", segments=tables, functions=["energy"], torso_mass=0.2)
    assert other.links == (2, 1) and other.parameters["torso_mass"] == 0.2


def test_second_derivatives_hold_for_links_of_their_own():
    """Their turns need the tail's mass, which is the sum over the links."""
    names = ["inverse_dynamics", "inverse_dynamics_vjp", "inverse_dynamics_hessian"]
    sound = laws(st.load(folder("links", functions=names)))
    checked = {check.name for check in sound if not check.omitted}
    assert "gradient changes by the hessian" in checked
    assert all(check.passed for check in sound)
