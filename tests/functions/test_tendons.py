"""Lengths of tendons and the torques of tensions: against MuJoCo, a formula, and runs."""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.problems import SceneError
from tests.support import zoo
from tests.support.rows import row

KICK = np.array([0, 0, 0.34, np.cos(1.9), np.sin(1.9), 0, 0, -0.558, 0])
SPIN = np.array([0, -0.3, 2.39, 26.2, 0, 0, 4.7, 0])


def spatial(model, q):
    """Lengths and derivatives by MuJoCo's spatial tendons, along a chain of hinges."""
    mujoco = pytest.importorskip("mujoco")
    p, tables = model.parameters, model.manifest["scene"]["tendon"]
    joints, m = model.joints_each, model.segments
    links = np.array(p.get("link_lengths", [p["tail_length"] / joints.sum()] * joints.sum()))
    ends = [t.get("to", m) for t in tables.values() for _ in range(t.get("count", 1))]
    counts = [joints[:to].sum() for to in ends]
    offsets, guides = np.reshape(p["tendon_offsets"], (-1, 2)), np.array(p["tendon_guides"])
    last = np.reshape(p.get("tendon_ends", offsets), (-1, 2))
    roots = p.get("tendon_roots", (1 - guides) * links[0])

    def sites(g):
        along = [offsets[k] + (last[k] - offsets[k]) * g / n for k, n in enumerate(counts)]
        back = roots if g == 0 else -guides * links[g - 1]
        rows = [(k, x, back[k], z) for k, (x, z) in enumerate(along) if g <= counts[k]]
        return "".join(
            f'<site name="s{k}_{g}" pos="{x:.17g} {y:.17g} {z:.17g}"/>' for k, x, y, z in rows
        )

    body = sites(0)
    for g, length in enumerate([0.0, *links[:-1]]):
        body += f'<body pos="0 {-length:.17g} 0"><joint axis="1 0 0"/><joint axis="0 0 1"/>'
        body += '<geom size="1e-3"/>' + sites(g + 1)
    paths = (
        "".join(f'<site site="s{k}_{g}"/>' for g in range(n + 1)) for k, n in enumerate(counts)
    )
    pulled = "".join(f"<spatial>{path}</spatial>" for path in paths)
    text = f"<mujoco><compiler angle='radian'/><worldbody>{body}{'</body>' * len(links)}"
    text += f"</worldbody><tendon>{pulled}</tendon></mujoco>"
    chain = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(chain)
    data.qpos[:] = np.repeat(q[model.layout.tail_q].reshape(m, 2), joints, axis=0).ravel()
    B = np.zeros((len(counts), 2 * m))
    for k, rates in enumerate(np.eye(2 * m)):  # the rates of lengths at a rate of 1
        data.qvel[:] = np.repeat(rates.reshape(m, 2), joints, axis=0).ravel()
        mujoco.mj_forward(chain, data)
        B[:, k] = data.ten_velocity
    return data.ten_length, B


@pytest.mark.parametrize("name", ["tendons", "tendons_own"])
def test_lengths_and_their_derivatives_are_those_of_mujoco(name):
    model, rng = zoo.model(name), np.random.default_rng(3)
    for tail in rng.uniform(-1, 1, (20, model.layout.nt)):
        q = np.append(model.state().q[: model.layout.tail_q.start], tail)
        lengths, B = spatial(model, q)
        np.testing.assert_allclose(model.tendon_lengths(q)[0], lengths, atol=1e-15, rtol=1e-14)
        np.testing.assert_allclose(model.tendon_lengths(q)[1], B, atol=1e-15, rtol=1e-14)


def test_tendons_of_arcs_are_parallel_to_the_centre_line():
    model = zoo.model("tendons_arcs")
    q = np.append(model.state().q[:7], [0.3, -0.5, 1.1, 0.2])
    x, z = np.reshape(model.parameters["tendon_offsets"], (-1, 2)).T
    lengths, B = model.tendon_lengths(q)
    expected = model.parameters["tail_length"] - (-0.5 + 0.2) * x + (0.3 + 1.1) * z
    np.testing.assert_allclose(lengths, expected, rtol=1e-15)
    np.testing.assert_allclose(B, np.column_stack([z, -x, z, -x]), rtol=1e-15)


def test_a_run_by_tensions_is_the_run_by_their_torques(tmp_path):
    model, pulls = zoo.model("tendons"), [[3.0, 0.0, 1.0], [0.0, 0.5, 0.0]]
    law = st.TensionTable([0.0, 0.05], pulls)
    start = {"q0": model.state().q, "v0": np.zeros(model.nv), "t_span": 0.05, "rtol": 1e-10}
    run = st.simulate(model, **start, controller=law)
    np.testing.assert_allclose(run.tensions[[0, -1]], pulls, atol=1e-12)
    assert (st.Trajectory.load(run.save(tmp_path / "run")).tensions == run.tensions).all()
    parts = [st.Phase("free", 0.01, controller=None), st.Phase("pull", 0.05, controller=law)]
    both = st.Sequence(model, parts).simulate(model.state()).trajectory
    assert not both.tensions[both.t < 0.01].any()
    np.testing.assert_allclose(both.tensions[-1], pulls[1], atol=1e-12)

    def torques(t, q, v):
        return model.tendon_torques(q, pulls[0] + t / 0.05 * np.diff(pulls, axis=0)[0])

    same = st.simulate(model, **start, controller=torques)
    np.testing.assert_allclose(run.v[-1], same.v[-1], atol=1e-6 * np.abs(same.v).max())
    np.testing.assert_allclose(run.tau, model.tendon_torques(run.q, run.tensions), atol=1e-15)
    for wrong in ([[0, -1, 0]], [[0, 6, 0]], [[1, 1]]):
        with row(wrong), pytest.raises(st.SimulationError, match="tensions"):
            st.simulate(model, **start, controller=st.TensionTable([0], wrong))


def test_plans_of_tensions_are_true_and_pull_alone():
    task = {"start": (KICK, SPIN), "goal": st.Goal(torso_rate=None), "duration": 0.58}
    model = st.build("righting_m1_n3", tendons=zoo.RING)
    for solver in ("fatrop", "ipopt"):
        plan = st.plan(model, **task, solver=solver, bounds=st.Bounds(tension="0.4 N"))
        run = st.simulate(model, KICK, SPIN, controller=plan.controller, t_span=0.58, rtol=1e-9)
        pulls = plan.tension(np.linspace(0, plan.duration, 2000))
        assert plan.success and st.summary(model, run)["tilt_end_deg"] < 0.01
        assert pulls.min() >= -1e-8 and pulls.max() <= 0.4  # 0.47 without
        assert plan.report["iterations"] < 100  # whose derivatives are exact


def test_what_tendons_cannot_be_is_refused():
    ok = {"offset": [0.004, 0], "tension": 5}
    rows = [
        (("links", 3), {"offset": [0, 0], "tension": 5}, "offset", [0, 0]),
        (("links", 3), ok | {"to": 2}, "to", 2),
        (("links", 3), ok | {"tension": -1}, "tension", -1),
        (("links", 3), {"count": 10**9, "radius": 1, "tension": 5}, "count", 10**9),
        (("links", 3), ok | {"end_offset": [0.002, 0]}, "root", None),
        (("links", 3), ok | {"radius": 0.004}, "count", None),
        (("samples", 3), ok | {"guides": 0.5}, "guides", 0.5),
    ]
    for (key, count), table, name, value in rows:
        kind = "articulated" if key == "links" else "continuum"
        scene = {"kind": kind, "segments": 1, key: count, "tendon": {"left": table}}
        with row(table), pytest.raises(SceneError) as error:
            parse_scene(scene, "wrong")
        found = {problem.field: problem.value for problem in error.value.problems}
        assert found[f"tendon.left.{name}"] == value
