"""Faults of the derivation, which all functions share, break laws, too."""

import pytest
from sympy import eye

import serpentail as st
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.mechanics import link, loads, torso
from serpentail_codegen.mechanics.shapes import M33, V1, V3, V6
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
from tests.support.faults import laws_broken


def without_gyroscopic_torque(let, link: V6, w: V3, w_dot: V3, a_joint: V3, swing: V3):
    """A link's wrench without omega x I omega, which does no work."""
    wrench = LINK_WRENCH(let, link, w, w_dot, a_joint, swing)["F"]
    return {"F": wrench - LINK_WRENCH(let, link, w, 0 * w_dot, 0 * a_joint, 0 * swing)["F"]}


def without_joint_acceleration(let, link: V6, w: V3, w_dot: V3, a_joint: V3, swing: V3):
    """A link's wrench whose moment leaves out how its joint accelerates."""
    F = LINK_WRENCH(let, link, w, w_dot, a_joint, swing)["F"]
    still = LINK_WRENCH(let, link, w, w_dot, 0 * a_joint, swing)["F"]
    return {"F": F[0:3, :].col_join(still[3:6, :])}


def with_flat_load(let, R: M33, f_torso: V6, F_beyond: V6):
    """Loads at B taken as if B were upright."""
    return LOAD_AT_TORSO(let, eye(3), f_torso, F_beyond)


def with_weak_gravity(let, R: M33, p_ddot: V3, gravity: V1):
    """Gravity in C and forward dynamics that differs from the potential's."""
    return TORSO_ACCELERATION(let, R, p_ddot, gravity * 2)


def with_load_at_the_wrong_place(let, R: M33, P: V3, f_point: V3, F_beyond: V6):
    """Tail loads that act 1 % too far from B."""
    return LOAD_AT_POINT(let, R, P * 101 / 100, f_point, F_beyond)


LINK_WRENCH, TORSO_ACCELERATION = link.link_wrench, torso.torso_acceleration
LOAD_AT_TORSO, LOAD_AT_POINT = loads.load_at_torso, loads.load_at_point
# a model of its own for each: the derivation is wrong; it has what the law is about
DYNAMICS = ["mass_matrix", "inverse_dynamics", "forward_dynamics"]
FAULTS = {
    "momentum is constant in flight": (
        (link, "link_wrench", without_gyroscopic_torque),
        ["rollout", "energy", "momentum"],
    ),
    "energy changes by the power of the torques": (
        (link, "link_wrench", without_joint_acceleration),
        ["energy", "forward_dynamics"],
    ),
    "pose in the world turns all alike": (
        (loads, "load_at_torso", with_flat_load),
        ["forward_dynamics_external"],
    ),
    "forward dynamics needs the torques it was given": (
        (torso, "torso_acceleration", with_weak_gravity),
        DYNAMICS,
    ),
    "loads accelerate by their generalised force": (
        (loads, "load_at_point", with_load_at_the_wrong_place),
        [*DYNAMICS, "forward_dynamics_external", "tail_point_jacobians"],
    ),
}


@pytest.fixture(autouse=True)
def _derived_anew():
    """The generator assembles a function once a process; here each time, and again afterwards."""
    assemble.cache_clear()
    yield
    assemble.cache_clear()


@pytest.mark.parametrize("law", FAULTS)
def test_faults_of_the_derivation_break_a_law(law, monkeypatch, tmp_path):
    changed, functions = FAULTS[law]
    monkeypatch.setattr(*changed)
    generate(scene_for("articulated", 1, 1, name="faulty", functions=functions), tmp_path)
    assert law in laws_broken(st.load(tmp_path / "faulty"))
