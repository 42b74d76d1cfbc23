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


LINK_WRENCH, LOAD_AT_TORSO, LOAD_AT_POINT = (
    link.link_wrench,
    loads.load_at_torso,
    loads.load_at_point,
)


TORSO_ACCELERATION = torso.torso_acceleration


DERIVATION_FAULTS = {
    "gyroscopic": (
        link,
        "link_wrench",
        without_gyroscopic_torque,
        "momentum is constant in flight",
    ),
    "acceleration": (
        link,
        "link_wrench",
        without_joint_acceleration,
        "energy changes by the power of the torques",
    ),
    "flat load": (loads, "load_at_torso", with_flat_load, "pose in the world turns all alike"),
    "gravity": (
        torso,
        "torso_acceleration",
        with_weak_gravity,
        "forward dynamics needs the torques it was given",
    ),
    "load": (
        loads,
        "load_at_point",
        with_load_at_the_wrong_place,
        "loads accelerate by their generalised force",
    ),
}


@pytest.fixture(autouse=True)
def _derived_anew():
    """The generator assembles a function once a process; here each time, and again afterwards."""
    assemble.cache_clear()
    yield
    assemble.cache_clear()


@pytest.mark.parametrize("fault", DERIVATION_FAULTS)
def test_faults_of_the_derivation_break_a_law(fault, monkeypatch, tmp_path):
    module, name, wrong, expected = DERIVATION_FAULTS[fault]
    monkeypatch.setattr(module, name, wrong)
    scene = scene_for("articulated", 1, 1, name="faulty")
    generate(scene, tmp_path)
    assert expected in laws_broken(st.load(tmp_path / "faulty"))
