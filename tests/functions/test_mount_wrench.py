"""The tail's wrench on the torso: against a peer, and against the change of the tail's momentum."""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from tests.references.metrics import near
from tests.references.parameters import TABLE_1, random_states
from tests.support import models, zoo
from tests.support.rows import row

STENCIL = (6 / 7, -15 / 56, 5 / 63, -1 / 56, 1 / 385, -1 / 5544)  # differences of order 12


def test_it_is_the_first_joint_s_wrench_of_pinocchio():
    pytest.importorskip("pinocchio")
    from tests.references.pinocchio_tree import chain

    for name, size in (("m1_n3", (1, 3)), ("m2_n2", (2, 2)), ("m3_n4", (3, 4))):
        model, peer = zoo.model(name), chain(TABLE_1, *size)
        for q, v, v_dot, _ in zip(*random_states(size[0], 5, 20, "random"), strict=True):
            expected = peer.mount_wrench(q, v, v_dot)
            of_casadi = [x.full().ravel() for x in model.casadi.mount_wrench(q, v, v_dot)]
            for found in (model.mount_wrench(q, v, v_dot), of_casadi):
                near(found[0], expected[0], 1e-12)
                near(found[1], expected[1], 1e-12)


@pytest.mark.parametrize("name", ["fixed", "fixed_mixed"])
def test_a_tail_s_momentum_changes_by_it_and_by_weight(name):
    """On a base at rest: d/dt (P, L about the mount) = -wrench + (weight, its moment)."""
    model = zoo.model(name)
    mount, g = np.array(model.parameters["tail_mount"]), model.parameters["gravity"]
    weight, step = model.parameters["tail_mass"] * np.array([0, 0, -g]), 2e-3
    for q, v, v_dot in np.random.default_rng(3).normal(size=(5, 3, model.nq)):

        def momenta(t, q=q, v=v, v_dot=v_dot):
            now = q + t * v + t * t / 2 * v_dot, v + t * v_dot
            linear, angular = model.momentum(*now)
            arm = model.center_of_mass(*now)[0] - mount
            return np.r_[linear, angular + np.cross(arm, linear)]

        pairs = [w * (momenta(k * step) - momenta(-k * step)) for k, w in enumerate(STENCIL, 1)]
        change, arm = sum(pairs) / step, model.center_of_mass(q, v)[0] - mount
        force, moment = model.mount_wrench(q, v, v_dot)
        near(force, weight - change[:3], 2e-12)
        near(moment, np.cross(arm, weight) - change[3:], 2e-12)


def test_a_tail_beside_other_chains_has_its_own():
    tables = {**zoo.ZOO["tree"], "functions": ["mount_wrench"]}
    tree = st.load(models.folder_of(parse_scene(tables, "tree")))
    alone = st.load(models.folder_of(parse_scene({**tables, "chain": {}}, "alone")))
    rng = np.random.default_rng(4)
    q, v, v_dot = (rng.normal(size=n) for n in (tree.nq, tree.nv, tree.nv))
    expected = alone.mount_wrench(q[: alone.nq], v[: alone.nv], v_dot[: alone.nv])
    np.testing.assert_allclose(tree.mount_wrench(q, v, v_dot), expected, rtol=1e-13)


def test_along_a_motion_the_torso_accelerates_by_it_and_by_the_ground():
    model = zoo.model("ground")
    legs = st.Legs.fixed(3.67, -0.26)
    motion = st.simulate(model, model.state(height=0.045, bend=0.4), 0.1, legs=legs)
    force, moment = motion.mount_wrench
    tail = motion.contact.of("tail").forces
    assert (np.abs(tail).max(axis=(1, 2)) > 0.01).any()
    p, inertia = model.parameters, np.diag(model.parameters["torso_inertia"])
    mount = np.array(p["tail_mount"])
    for k in range(0, len(motion), 10):
        q, v, contact = motion.q[k], motion.v[k], motion.contact
        numbers = np.r_[contact.legs[k], np.zeros(4)]
        bristles = contact.bristles[k].ravel()
        v_dot, _, forces = model.contact_dynamics(q, v, motion.tau[k], bristles, numbers)
        R, on_torso = st.rotation_matrix(q[3:7]), np.ones(len(forces), bool)
        on_torso[6:-1] = False  # the tail's points
        total, pushes = forces[on_torso].sum(axis=0), forces[on_torso]
        upward = np.array([0, 0, p["gravity"]])
        needed = R.T @ (p["torso_mass"] * (v_dot[:3] + upward) - total)
        turning = np.cross(contact.points[k][on_torso] - q[:3], pushes).sum(axis=0)
        euler = inertia @ v_dot[3:6] + np.cross(v[3:6], inertia @ v[3:6]) - R.T @ turning
        with row(k):
            near(force[k], needed, 1e-8)
            near(moment[k], euler - np.cross(mount, force[k]), 1e-8)


def test_a_motion_without_its_model_has_none(tmp_path):
    model = zoo.model("m1_n1")
    motion = st.simulate(model, model.state(height=1), 0.01)
    force, moment = motion.mount_wrench
    assert force.shape == moment.shape == (len(motion), 3)
    with pytest.raises(ValueError, match="mount_wrench: this motion has no model"):
        _ = st.Trajectory.load(motion.save(tmp_path / "fall")).mount_wrench
