"""URDF and MJCF: Pinocchio and MuJoCo read them, and find the model's own inertia and poses."""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.weight import total_mass
from tests.support import zoo
from tests.support.rows import row

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")
import mujoco
import pinocchio as pin

TAILS = ("m1_n1", "m1_n3", "m3_n4", "own_links", "weightless", "elastic", "limbs")
CHANGED = {
    "torso_mass": 0.1234567890123,
    "torso_inertia": (7.1e-5, 4.3e-5, 6.9e-5),
    "tail_mount": (0.0011, -0.0423, 0.0037),
    "tail_length": 0.17,
    "gravity": 3.7,
    "link_inertia": (3.1e-9, 1.7e-9, 2.9e-9),
}


def tails():
    """Yield names and tails, each with its scene's parameters and with others."""
    for name in TAILS:
        model = zoo.model(name)
        if name in ("own_links", "limbs"):  # inertias of the zoo's are not all those of a body
            rows = np.linspace([3, 2, 4], [2, 1, 2], 7 if name == "own_links" else 2) * 1e-8
            model = model.with_parameters(link_inertias=rows)
        independent = {parameter["name"] for parameter in model.manifest["parameters"]}
        changes = {key: value for key, value in CHANGED.items() if key in independent}
        yield name, model
        yield f"{name}, changed", model.with_parameters(**changes)


def configurations(model, count=5):
    """Random configurations, their quaternions of any norm, and what these are as unit ones."""
    for q in np.random.default_rng(7).normal(size=(count, model.nq)):
        yield q, q[3:7] / np.linalg.norm(q[3:7])


def without_springs(model):
    """A model without what URDF lacks: springs and rotors."""
    names = [
        n for n in model.parameters if n.endswith(("tail_stiffness", "leg_stiffness", "rotors"))
    ]
    return model.with_parameters(**{n: np.zeros_like(model.parameters[n]) for n in names})


def pinocchio_model(model, folder):
    path = st.export(model, "urdf", folder / "rat.urdf")
    return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer(), True)


def pinocchio_state(model, read, q, turned):
    """Pinocchio's configuration, and T of its velocity T v: its torso moves in the body's axes."""
    w, *xyz = turned
    state, turn = np.zeros(read.nq), np.eye(read.nv)
    state[:3], state[3:7] = q[:3], (*xyz, w)
    turn[:3, :3] = pin.Quaternion(*turned).toRotationMatrix().T
    for k, name in enumerate(model.names.tail):
        joint = read.joints[read.getJointId(name if read.existJointName(name) else f"{name}_1")]
        state[joint.idx_q] = q[7 + k]
        turn[joint.idx_v, 6:] = np.eye(model.nv - 6)[k]
    return state, turn


def test_pinocchio_finds_inertia_and_points_of_the_model(tmp_path):
    for name, model in ((name, without_springs(model)) for name, model in tails()):
        read, counts = pinocchio_model(model, tmp_path), model.joints_each
        counts = counts[model.layout["tail"].segments]
        links = [(i + 1, j + 1) for i, count in enumerate(counts) for j in range(count)]
        data, names = read.createData(), [f"link_{i}_{j}" for i, j in links]
        assert (read.nq, read.nv) == (model.nq, model.nv), name
        for q, turned in configurations(model):
            state, turn = pinocchio_state(model, read, q, turned)
            upper = np.triu(pin.crba(read, read.createData(), state, pin.Convention.LOCAL))
            H = turn.T @ (upper + np.triu(upper, 1).T) @ turn
            expected = model.mass_matrix(q)
            scale = np.sqrt(np.diag(expected))  # of each coordinate: the tail's moments are small
            assert (np.abs(H - expected) <= 2e-14 * np.outer(scale, scale)).all(), name
            pin.framesForwardKinematics(read, data, state)
            places = [data.oMf[read.getFrameId(each)].translation for each in [*names, "tip"]]
            assert np.abs(places - model.tail_points(q)[: len(places)]).max() < 1e-12, name


def test_pinocchio_finds_limits_and_damping_and_needs_the_models_torques(tmp_path):
    model = without_springs(zoo.model("elastic"))
    read, p, rng = pinocchio_model(model, tmp_path), model.parameters, np.random.default_rng(5)
    lower, upper, damping = (
        np.array(p[f"tail_{x}"]) for x in ("stop_lower", "stop_upper", "damping")
    )
    read.gravity.linear = np.array([0, 0, -p["gravity"]])
    for q, turned in configurations(model):
        q[7:] = rng.uniform(lower, upper)
        v, tau = rng.normal(size=model.nv), rng.normal(size=model.nv - 6)
        state, turn = pinocchio_state(model, read, q, turned)
        tail = turn[:, 6:].T  # entries of the coordinates
        for found, wanted in (
            (tail @ read.damping, damping),
            (tail @ read.lowerPositionLimit[-read.nv :], lower),
            (tail @ read.upperPositionLimit[-read.nv :], upper),
        ):
            np.testing.assert_array_equal(found, wanted)
        rates = turn @ model.forward_dynamics(q, v, tau)
        rates[:3] -= np.cross(v[3:6], turn[:3, :3] @ v[:3])  # as the body sees its velocity
        torques = pin.rnea(read, read.createData(), state, turn @ v, rates)
        torques += read.damping * (turn @ v)
        expected = turn @ np.append(np.zeros(6), tau)
        assert np.abs(torques - expected).max() < 1e-12


def mujoco_model(model, folder):
    return mujoco.MjModel.from_xml_path(str(st.export(model, "mjcf", folder / "rat.xml")))


def of_links(model, angles):
    """Angles or rates of the free chain; each link of a segment turns as the segment's first."""
    each = zip(np.split(angles, model.layout.firsts[1:]), model.joints_each, strict=True)
    return np.concatenate([np.tile(own, count) for own, count in each])


def tie_of(model):
    """The free chain's velocities by those of the model."""
    tail = np.array([of_links(model, unit) for unit in np.eye(model.nv - 6)]).T
    return np.block([[np.eye(6), np.zeros((6, model.nv - 6))], [np.zeros((len(tail), 6)), tail]])


def unbalanced(model, read, q, v):
    """Forces (..., nv) that MuJoCo's model lacks to accelerate as ours does."""
    data, tie, turned = mujoco.MjData(read), tie_of(model), q[3:7] / np.linalg.norm(q[3:7])
    data.qpos[:] = np.concatenate([q[:3], turned, of_links(model, q[7:])])
    data.qvel[:] = tie @ v
    mujoco.mj_forward(read, data)
    full = np.zeros((read.nv, read.nv))
    mujoco.mj_fullM(read, data, full)
    rates = model.forward_dynamics(q, v, np.zeros(model.nv - 6))
    return tie.T @ (full @ tie @ rates - data.qfrc_smooth)


def test_mujoco_has_springs_damping_and_stops(tmp_path):
    """Also far behind the stops; within their width they push less, by a bound that is reached."""
    model, rng = zoo.model("elastic"), np.random.default_rng(5)
    read, names = mujoco_model(model, tmp_path), ("lower", "upper", "stiffness", "width")
    lower, upper, k, w = (np.array(model.parameters[f"tail_stop_{x}"]) for x in names)
    deep = w * rng.uniform(1, 3, 4)
    for tail, short in (
        (rng.uniform(lower, upper), 0),
        (upper + deep, 0),
        (lower - deep, 0),
        (upper + w / 2, 3 / 32 * k * w),
        (lower - w / 2, -3 / 32 * k * w),
    ):
        q, v = np.append(rng.normal(size=7), tail), rng.normal(size=model.nv)
        lacking = unbalanced(model, read, q, v)
        assert lacking == pytest.approx(np.append(np.zeros(6), -short * np.ones(4)), abs=1e-12)


def check_mujoco(model, folder):
    """Inertia, points, and the free chain's work at the motors, which is that of the torques."""
    read = mujoco_model(model, folder)
    data, tau = mujoco.MjData(read), np.random.default_rng(3).normal(size=model.nv - 6)
    tie = tie_of(model)
    data.ctrl[:] = tau
    for q, turned in configurations(model):
        data.qpos[:] = np.concatenate([q[:3], turned, of_links(model, q[7:])])
        mujoco.mj_forward(read, data)
        assert np.abs(data.site_xpos - model.tail_points(q)).max() < 1e-12
        assert np.abs(data.efc_pos).max(initial=0) < 1e-12  # the equalities hold
        full = np.zeros((read.nv, read.nv))
        mujoco.mj_fullM(read, data, full)
        expected = model.mass_matrix(q)
        assert np.abs(tie.T @ full @ tie - expected).max() <= 1e-12 * np.abs(expected).max()
        np.testing.assert_array_equal(tie.T[6:] @ data.qfrc_actuator, tau)
    p = model.parameters
    assert read.opt.gravity.tolist() == [0, 0, -p.get("gravity", 0.0)]
    assert read.body_subtreemass[1] == pytest.approx(total_mass(p), rel=1e-14)


def check_flight(model, folder):
    """MuJoCo's equalities are soft, and its integrator is of first order: 0.2 mm in 50 ms."""
    read = mujoco_model(model, folder)
    data, span = mujoco.MjData(read), 0.05
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2], q[3], q[7:] = 0.3, 1, 0.1
    v[3:] = np.linspace(1, 2, model.nv - 3)
    flight = st.simulate(model, q, v, t_span=span)
    read.opt.timestep = 1e-4
    data.qpos[:] = np.concatenate([q[:7], of_links(model, q[7:])])
    data.qvel[:] = np.concatenate([v[:6], of_links(model, v[6:])])
    for _ in range(round(span / read.opt.timestep)):
        mujoco.mj_step(read, data)
    mujoco.mj_forward(read, data)
    assert np.abs(data.site_xpos - model.tail_points(flight.q[-1])).max() < 2e-4


def test_mujoco_finds_inertia_points_motors_and_gravity_and_flies_as_the_model(tmp_path):
    for name, model in tails():
        with row(name):
            check_mujoco(model, tmp_path)
            if "changed" not in name:
                check_flight(model, tmp_path)


def test_torso_and_tail_are_capsules_of_the_models_size(tmp_path):
    model = zoo.model("m1_n3")
    read = mujoco_model(model, tmp_path)
    torso, *links = range(read.ngeom)
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    assert (read.geom_type == int(capsule)).all()
    spread = np.array(model.parameters["torso_inertia"])
    axes = np.sqrt(2.5 / model.parameters["torso_mass"] * (spread.sum() - 2 * spread))
    radius, half = read.geom_size[torso, :2]
    assert radius + half == pytest.approx(axes[1])
    assert radius**2 == pytest.approx(axes[0] * axes[2])
    for link in links:
        radius, half = read.geom_size[link, :2]
        assert radius == model.parameters["link_radius"]
        assert 2 * half == pytest.approx(model.parameters["tail_length"] / 3)
    ball = model.with_parameters(torso_inertia=(5e-5, 5e-5, 5e-5))  # as wide as long
    pinocchio_model(ball, tmp_path)
    read = mujoco_model(ball, tmp_path)
    assert read.geom_type[0] == int(mujoco.mjtGeom.mjGEOM_SPHERE)
