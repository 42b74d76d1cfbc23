"""What polar coordinates cannot do is refused, with a remedy."""

import numpy as np
import pytest

import serpentail as st
from serpentail.verification.report import laws
from serpentail_codegen.scene.parse import parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError

from .test_polar_continuum import model, polar_state


@pytest.mark.parametrize("theta", [0.0, -0.0, 1e-200])
def test_a_straight_segment_is_refused(theta):
    polar, (q, v, v_dot, tau) = model(2), polar_state(2, 1.0)
    q[10] = theta
    message = (
        r"segment 2 has theta = \S+ rad: polar coordinates have no value at "
        r"theta = 0; use coordinates = \"bend\""
    )
    calls = (
        (polar.mass_matrix, q),
        (polar.inverse_dynamics, q, v, v_dot),
        (polar.forward_dynamics, q, v, tau),
    )
    for function, *arguments in (*calls, (polar.tail_points, q), (polar.energy, q, v)):
        with pytest.raises(st.StateError, match=message):
            function(*arguments)
    with pytest.raises(st.StateError, match="segment 2 of state 1 has theta"):
        polar.mass_matrix(np.stack([polar_state(2, 1.0)[0], q]))
    assert np.isnan(np.array(polar.casadi.forward_dynamics(q, v, tau))).any()


def test_beyond_the_range_is_refused():
    with pytest.raises(
        st.StateError, match=r"segment 1 is bent by 6\.3 rad, beyond the scene's 6\.28"
    ):
        model(1).mass_matrix(polar_state(1, 6.3)[0])


def test_verification_is_refused():
    with pytest.raises(st.ModelError, match='verify the same scene with coordinates = "bend"'):
        laws(model(1))


@pytest.mark.parametrize(
    ("tail", "links", "coordinates"), [("articulated", 2, "polar"), ("continuum", None, "joint")]
)
def test_coordinates_of_the_other_tail_are_refused(tail, links, coordinates):
    with pytest.raises(SceneError) as caught:
        scene_for(tail, 1, links, coordinates=coordinates)
    (problem,) = caught.value.problems
    assert (problem.field, problem.value) == ("coordinates", coordinates)
    assert ('needs "joint"' if links else 'needs "bend" or "polar"') in problem.remedy


@pytest.mark.parametrize("name", ["airborne_rates", "forward_dynamics_derivatives"])
def test_polar_coordinates_have_no_functions_of_nodes_and_no_derivatives(name):
    with pytest.raises(SceneError, match=f"has no derivatives, such as {name}"):
        scene_for("continuum", 1, coordinates="polar", functions=[name])


def test_polar_is_a_choice_of_a_continuum_only():
    assert scene_for("continuum", 1).coordinates == "bend"
    scene = scene_for("continuum", 1, coordinates="polar")
    assert parse_scene(scene_to_dict(scene), "other") == scene
    assert "For comparison only" in (model(1).folder / "include" / "continuum_m1.h").read_text()
