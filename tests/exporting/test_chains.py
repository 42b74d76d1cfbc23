"""URDF and MJCF: Pinocchio and MuJoCo read them, and find the model's own inertia and poses."""

from xml.etree import ElementTree as Xml

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from tests.support.models import folder_of, model_folder

TAILS = {f"{m} x {n}": {"segments": m, "links": n} for m, n in [(1, 1), (1, 3), (3, 4)]}
TAILS["own links on a tilted mount"] = {
    "segments": [
        {"links": 2, "length": 0.05, "mass": 2e-3, "link_radius": 3e-3},
        {"links": 3, "link_lengths": [0.03, 0.02, 0.02], "mass": 1e-3, "radii": [3e-3, 1e-3]},
    ],
    "parameters": {"mount_angles": [0.3, -0.2, 0.5]},
}
TAILS["no weight"] = {"segments": 1, "links": 2, "weightless": True}
CHANGED = {
    "torso_mass": 0.1234567890123,
    "torso_inertia": (7.1e-5, 4.3e-5, 6.9e-5),
    "tail_mount": (0.0011, -0.0423, 0.0037),
    "tail_length": 0.17,
    "gravity": 3.7,
    "link_inertia": (3.1e-9, 1.7e-9, 2.9e-9),
}


@pytest.fixture(scope="module", params=TAILS.values(), ids=TAILS)
def model(request):
    return st.load(folder_of(parse_scene({"kind": "articulated"} | request.param, "tail")))


@pytest.fixture(params=["scene's", "changed"])
def parameters(request, model):
    """The model with its scene's parameters, and with others."""
    names = [parameter["name"] for parameter in model.manifest["parameters"]]
    known = {name: value for name, value in CHANGED.items() if name in names}
    return model if request.param == "scene's" else model.with_parameters(**known)


def links(model):
    """The segment and the number, from 1, of each link."""
    return [(i + 1, j + 1) for i, count in enumerate(model.joints_each) for j in range(count)]


def configurations(model, count=5):
    """Random configurations, their quaternions of any norm."""
    return np.random.default_rng(7).normal(size=(count, model.nq))


# Pinocchio


def pinocchio_model(model, folder):
    path = st.export(model, "urdf", folder / "rat.urdf")
    return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer(), True)


def pinocchio_state(model, read, q):
    """Pinocchio's configuration, and T of its velocity T v: its torso moves in the body's axes."""
    w, x, y, z = q[3:7] / np.linalg.norm(q[3:7])
    state, turn = np.zeros(read.nq), np.eye(read.nv)
    state[:3], state[3:7] = q[:3], (x, y, z, w)
    turn[:3, :3] = pin.Quaternion(w, x, y, z).toRotationMatrix().T
    for i in range(model.segments):
        for k, axis in enumerate(("alpha", "beta")):
            joint = read.joints[read.getJointId(f"{axis}_{i + 1}_1")]
            state[joint.idx_q] = q[7 + 2 * i + k]
            turn[joint.idx_v, 6:] = np.eye(model.nv - 6)[2 * i + k]
    return state, turn


def test_pinocchio_finds_the_inertia_of_the_model(parameters, tmp_path):
    read = pinocchio_model(parameters, tmp_path)
    assert (read.nq, read.nv) == (parameters.nq, parameters.nv)
    for q in configurations(parameters):
        state, turn = pinocchio_state(parameters, read, q)
        upper = np.triu(pin.crba(read, read.createData(), state, pin.Convention.LOCAL))
        H = turn.T @ (upper + np.triu(upper, 1).T) @ turn
        expected = parameters.mass_matrix(q)
        scale = np.sqrt(np.diag(expected))  # of each coordinate: the tail's moments are small
        assert (np.abs(H - expected) <= 1e-14 * np.outer(scale, scale)).all()


def test_pinocchio_finds_the_points_of_the_tail(parameters, tmp_path):
    read = pinocchio_model(parameters, tmp_path)
    data = read.createData()
    names = [f"link_{i}_{j}" for i, j in links(parameters)]
    for q in configurations(parameters):
        pin.framesForwardKinematics(read, data, pinocchio_state(parameters, read, q)[0])
        places = [data.oMf[read.getFrameId(name)].translation for name in [*names, "tip"]]
        assert np.abs(places - parameters.tail_points(q)).max() < 1e-12


# MuJoCo


def mujoco_model(model, folder):
    return mujoco.MjModel.from_xml_path(str(st.export(model, "mjcf", folder / "rat.xml")))


def mujoco_positions(model, q):
    """Positions of the free chain; each link of a segment turns as the segment's first."""
    angles = np.repeat(np.reshape(q[7:], (-1, 2)), model.joints_each, axis=0)
    return np.concatenate([q[:3], q[3:7] / np.linalg.norm(q[3:7]), angles.ravel()])


def test_mujoco_finds_the_points_of_the_tail(parameters, tmp_path):
    read = mujoco_model(parameters, tmp_path)
    data = mujoco.MjData(read)
    for q in configurations(parameters):
        data.qpos[:] = mujoco_positions(parameters, q)
        mujoco.mj_forward(read, data)
        assert np.abs(data.site_xpos - parameters.tail_points(q)).max() < 1e-12
        assert np.abs(data.efc_pos).max(initial=0) < 1e-12  # the equalities hold


def test_mujoco_finds_the_inertia_of_the_model(parameters, tmp_path):
    read = mujoco_model(parameters, tmp_path)
    data = mujoco.MjData(read)
    of_segments = np.repeat(np.eye(parameters.segments), parameters.joints_each, axis=0)
    tie = np.kron(of_segments, np.eye(2))
    tie = np.block([[np.eye(6), np.zeros((6, tie.shape[1]))], [np.zeros((len(tie), 6)), tie]])
    for q in configurations(parameters):
        data.qpos[:] = mujoco_positions(parameters, q)
        mujoco.mj_forward(read, data)
        full = np.zeros((read.nv, read.nv))
        mujoco.mj_fullM(read, data, full)
        expected = parameters.mass_matrix(q)
        assert np.abs(tie.T @ full @ tie - expected).max() <= 1e-12 * np.abs(expected).max()


def test_mujocos_motors_and_gravity_are_the_models(parameters, tmp_path):
    """The free chain's work at the motors is that of the model's torques."""
    read = mujoco_model(parameters, tmp_path)
    data = mujoco.MjData(read)
    tau = np.random.default_rng(3).normal(size=parameters.nv - 6)
    data.qpos[:] = mujoco_positions(parameters, configurations(parameters)[0])
    data.ctrl[:] = tau
    mujoco.mj_forward(read, data)
    first = np.cumsum([0, *parameters.joints_each[:-1]])
    ties = np.add.reduceat(np.reshape(data.qfrc_actuator[6:], (-1, 2)), first)
    np.testing.assert_array_equal(ties.ravel(), tau)
    assert read.opt.gravity.tolist() == [0, 0, -parameters.parameters.get("gravity", 0.0)]
    assert read.body_subtreemass[1] == pytest.approx(
        parameters.parameters["torso_mass"] + parameters.parameters["tail_mass"], rel=1e-14
    )


def test_mujoco_flies_as_the_model_does(model, tmp_path):
    """MuJoCo's equalities are soft, and its integrator is of first order: 0.2 mm in 50 ms."""
    read = mujoco_model(model, tmp_path)
    data, span = mujoco.MjData(read), 0.05
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2], q[3], q[7:] = 0.3, 1, 0.1
    v[3:] = np.linspace(1, 2, model.nv - 3)
    flight = st.simulate(model, q, v, t_span=span)
    read.opt.timestep = 1e-4
    data.qpos[:] = mujoco_positions(model, q)
    rates = np.repeat(np.reshape(v[6:], (-1, 2)), model.joints_each, axis=0)
    data.qvel[:] = np.concatenate([v[:6], rates.ravel()])
    for _ in range(round(span / read.opt.timestep)):
        mujoco.mj_step(read, data)
    mujoco.mj_forward(read, data)
    assert np.abs(data.site_xpos - model.tail_points(flight.q[-1])).max() < 2e-4


# Shapes and texts


def test_torso_and_tail_are_capsules_of_the_models_size(tmp_path):
    model = st.load(model_folder(1, 3))
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


def test_a_torso_as_wide_as_long_is_a_ball(tmp_path):
    model = st.load(model_folder(1, 1), {"torso_inertia": (5e-5, 5e-5, 5e-5)})
    read = mujoco_model(model, tmp_path)
    assert read.geom_type[0] == int(mujoco.mjtGeom.mjGEOM_SPHERE)
    pinocchio_model(model, tmp_path)


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_files_are_the_same_twice_and_say_what_they_lack(kind, tmp_path):
    model = st.load(model_folder(1, 3))
    suffix = {"urdf": "urdf", "mjcf": "xml"}[kind]
    texts = [st.export(model, kind, tmp_path / f"{k}.{suffix}").read_bytes() for k in range(2)]
    assert texts[0] == texts[1]
    assert b"Legs and feet have no mass and are left out" in texts[0]
    masses = {
        "urdf": ".//link[@name='link_1_1']//mass",
        "mjcf": ".//body[@name='link_1_1']/inertial",
    }
    mass = Xml.fromstring(texts[0]).find(masses[kind]).attrib
    name = {"urdf": "value", "mjcf": "mass"}[kind]
    assert mass[name] == repr(model.parameters["tail_mass"] / 3)
