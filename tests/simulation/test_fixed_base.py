"""Runs of tails on a base that never moves, and without weight: integration, books, tracking."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import serpentail as st
from serpentail.containers.contents import contents
from serpentail.motion.summary import summary
from serpentail.pictures.frames import frames
from serpentail.scenes.simulate import scenario_of
from serpentail.verification import report
from serpentail_codegen.scene.parse import parse_scene
from tests.references.body_set import Animal, Arc
from tests.references.mujoco_chain import MujocoChain
from tests.references.parameters import TABLE_1
from tests.support.models import folder_of

REST = np.array([0, 0, 0, 1.0, 0, 0, 0])
MASS, LENGTH = TABLE_1["tail_mass"], TABLE_1["tail_length"]
KINDS = {"chain": {"kind": "articulated", "links": 3}, "arcs": {"kind": "continuum"}}


def bench(name="chain", parameters=None, segments=2, **keys):
    """The model of a tail on a fixed base."""
    table = {"segments": segments, "base": "fixed", **KINDS[name], **keys}
    return st.load(folder_of(parse_scene({**table, "parameters": parameters or {}}, "bench")))


@pytest.fixture(scope="module")
def chain():
    """Two segments of three links, with all functions that a fixed base has."""
    return bench(functions="all")


def torque(t, q, v):
    """Torques that push and damp."""
    return 1e-4 * np.sin(20 * t + np.arange(4)) - 2e-6 * v


# ---- against other derivations -------------------------------------------------------------------


def peer(t, x):
    """x_dot by MuJoCo, whose torso is held."""
    q, v = x[:4], x[4:]
    there = np.concatenate([REST, q]), np.concatenate([np.zeros(6), v])
    H, bias = PEER.mass_matrix(there[0]), PEER.bias_force(*there)
    return np.concatenate([v, np.linalg.solve(H[6:, 6:], torque(t, q, v) - bias[6:])])


PEER = MujocoChain(TABLE_1, 2, 3)
START = np.array([0.3, -0.2, 0.4, 0.1]), np.array([2.0, 1.0, -3.0, 0.5])


@pytest.mark.parametrize("method", ["tsit5", "rk4", "ros34pw2", "dop853", "lsoda"])
def test_runs_are_those_of_another_integrator_and_derivation(chain, method):
    there = solve_ivp(
        peer, (0, 0.15), np.concatenate(START), rtol=1e-10, atol=1e-12, method="DOP853"
    )
    settings = {"tsit5": {"rtol": 1e-10}, "ros34pw2": {"rtol": 1e-8}}.get(method, {})
    run = st.simulate(chain, *START, controller=torque, t_span=0.15, method=method, **settings)
    found = np.concatenate([run.q[-1], run.v[-1]])
    expected = there.y[:, -1]
    limit = 1e-4 if method == "ros34pw2" else 1e-7
    np.testing.assert_allclose(found, expected, rtol=0, atol=limit * np.abs(expected).max())
    assert run.info["imbalance"]["relative"] < limit
    assert not run.info["warnings"]


@pytest.mark.parametrize(
    ("damping", "reason"), [(0, "fixed base"), (1e-5, "fixed base, damping and springs act at")]
)
def test_the_choice_of_a_method_tells_of_the_base(chain, damping, reason):
    run = st.simulate(chain, *START, controller=st.Damping(damping), t_span=0.01)
    assert run.info["method"] == "tsit5" and run.info["reason"].startswith(reason)
    assert "flight" not in f"{run!r} {run.info}"


def test_implicit_euler_comes_to_the_same(chain):
    ends = [
        st.simulate(
            chain, *START, controller=st.Damping(1e-4), t_span=0.02, method=name, step=step
        ).q[-1]
        for name, step in (("rk4", 2e-5), ("implicit_euler", 2e-5), ("implicit_euler", 1e-5))
    ]
    coarse, fine = (np.abs(end - ends[0]).max() for end in ends[1:])
    assert fine < 1e-3
    assert coarse / fine == pytest.approx(2, rel=0.1)  # order 1


@pytest.mark.parametrize("name", KINDS)
def test_small_oscillations_are_those_of_a_held_tail(name):
    """Without weight, in each mode at 1e-4 rad, and D = d K: x'' + d w^2 x' + w^2 x = 0."""
    stiffness, d = np.array([2e-3, 3e-3, 1e-3, 4e-3]), 2e-3
    given = {"tail_stiffness": stiffness.tolist(), "tail_damping": (d * stiffness).tolist()}
    model = bench(name, given, weightless=True, functions="all")
    if name == "chain":
        H = PEER.mass_matrix(np.concatenate([REST, np.zeros(4)]))
    else:
        arc = Arc(MASS / 2, LENGTH / 2)
        bodies = Animal((arc, arc), 1.0, (1.0, 1.0, 1.0), TABLE_1["tail_mount"])
        H = bodies.mass_matrix(np.concatenate([REST, np.zeros(4)]))
    squares, shapes = eigh(np.diag(stiffness), H[6:, 6:])
    for square, shape in zip(squares, shapes.T, strict=True):
        start = 1e-4 * shape / np.abs(shape).max()
        span = 3 * 2 * np.pi / np.sqrt(square)
        run = st.simulate(model, start, 0 * start, t_span=span, method="tsit5", rtol=1e-10)
        roots = np.roots([1, d * square, square])
        parts = np.linalg.solve([[1, 1], roots], [1, 0])
        x = np.real(np.exp(np.outer(run.t, roots)) @ parts)
        assert np.abs(run.tail - np.outer(x, start)).max() < 2e-7
        assert run.info["imbalance"]["relative"] < 1e-5


def test_a_single_link_is_a_pendulum():
    """(1, 1) hanging, small: w^2 = m g l / (I + m l^2), in both planes."""
    model = bench(
        parameters={"mount_angles": [np.pi / 2, 0, 0], "tail_mount": [0, 0, 0]},
        segments=1,
        links=1,
    )
    inertia, half = model.parameters["link_inertia"][0], LENGTH / 2
    w = np.sqrt(MASS * 9.8 * half / (inertia + MASS * half**2))
    run = st.simulate(model, [1e-4, 0], [0, 0], t_span=4 * np.pi / w, rtol=1e-11)
    np.testing.assert_allclose(run.tail[:, 0], 1e-4 * np.cos(w * run.t), rtol=0, atol=1e-10)


def test_without_weight_the_centre_of_mass_flies_straight():
    table = {"kind": "articulated", "segments": 1, "links": 2, "weightless": True}
    model = st.load(folder_of(parse_scene(table, "orbit")))
    run = st.simulate(model, [*REST, 0.3, -0.2], np.arange(8.0), t_span=0.2, rtol=1e-10)
    places, speeds = model.center_of_mass(run.q, run.v)[:2]
    straight = places[0] + np.outer(run.t, speeds[0])
    np.testing.assert_allclose(places, straight, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-8)
    assert np.all(run.potential == 0)
    assert not run.warnings


# ---- controllers ---------------------------------------------------------------------------------


def test_tracking_is_exact_and_errors_decay(chain):
    """e'' + kd e' + kp e = 0: kp = 400, kd = 40 is critical, e = (1 + 20 t) e0 exp(-20 t)."""
    reference = st.Reference([0.0, 1.0], np.zeros((2, 4)))
    start = np.array([0.4, -0.3, 0.2, 0.1])
    for feedforward in (True, False):
        law = st.Pfl(chain, reference, kp=400, kd=40, feedforward=feedforward)
        for controller in (law, lambda t, q, v, law=law: law(t, q, v)):
            run = st.simulate(chain, start, 0 * start, controller=controller, t_span=0.2)
            expected = np.outer((1 + 20 * run.t) * np.exp(-20 * run.t), start)
            assert np.abs(run.tail - expected).max() < 1e-6
    tau = chain.pfl(*START, np.ones(4))
    np.testing.assert_allclose(tau, chain.inverse_dynamics(*START, np.ones(4)), rtol=1e-14)


def test_tracking_without_its_function_is_made_of_others():
    model = bench(functions=["inverse_dynamics", "energy", "momentum", "rollout"])
    law = st.Pfl(model, ([0.0, 0.5, 1.0], np.zeros((3, 4))), kp=400, kd=40)
    run = st.simulate(model, START[0], np.zeros(4), controller=law, t_span=0.1)
    expected = (1 + 20 * 0.1) * np.exp(-2.0) * START[0]
    np.testing.assert_allclose(run.tail[-1], expected, rtol=0, atol=1e-6)


def test_torques_within_limits(chain):
    law = st.Pfl(chain, ([0.0, 1.0], np.zeros((2, 4))), torque=1e-3)
    run = st.simulate(chain, START[0], np.zeros(4), controller=law, t_span=0.05)
    assert np.abs(run.tau).max() == 1e-3


def test_many_runs(chain):
    starts = START[0] * np.linspace(0.5, 1, 10)[:, None]
    runs = st.simulate(chain, starts, np.zeros(4), t_span=0.05, parameters={"gravity": [5.0] * 10})
    one = st.simulate(chain.with_parameters(gravity=5.0), starts[3], np.zeros(4), t_span=0.05)
    np.testing.assert_array_equal(runs.q[3], one.q)
    assert not any(runs.warnings)
    assert np.all(runs.audit.momentum == 0)


# ---- motions -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(chain):
    """A swing."""
    return st.simulate(chain, *START, t_span=0.1)


def test_motions_have_a_tail_alone(chain, run, tmp_path):
    assert run.q.shape == run.v.shape == (201, 4)
    assert run.segments == 2
    np.testing.assert_array_equal(run.pose, np.tile(REST, (201, 1)))
    np.testing.assert_array_equal(run.tail_rate, run.v)
    again = st.Trajectory.load(run.save(tmp_path / "swing"))
    np.testing.assert_array_equal(again.q, run.q)
    fine = run.resample(np.linspace(0, 0.1, 1001))
    whole = st.simulate(chain, *START, t_span=0.1, output_step=1e-4)
    np.testing.assert_allclose(fine.q, whole.q, rtol=0, atol=1e-6)
    np.testing.assert_allclose(fine.v, whole.v, rtol=0, atol=1e-3)


def test_momentum_is_that_of_the_tail(chain):
    """Of all bodies but the torso, about their own centre of mass."""
    q, v = START
    whole = np.concatenate([REST, q]), np.concatenate([np.zeros(6), v])
    J = PEER.mass_matrix(whole[0])[:3]
    linear, angular = chain.momentum(q, v)
    np.testing.assert_allclose(linear, J @ whole[1], rtol=1e-12)
    about_b = PEER.mass_matrix(whole[0])[3:6] @ whole[1]
    R = -PEER.mass_matrix(whole[0])[:3, 3:6]  # skew of the first moment about B
    arm = np.array([R[2, 1], R[0, 2], R[1, 0]]) / MASS
    np.testing.assert_allclose(angular, about_b - np.cross(arm, linear), rtol=1e-9)


def test_numbers_pages_and_tables_know_no_torso(chain, run, tmp_path):
    told = summary(chain, run)
    assert [told[name] for name in ("apex_m", "pitch_at_end_rad", "tilt_end_deg")] == [None] * 3
    assert told["body_weight_N"] == pytest.approx(9.8 * MASS)
    assert "on a fixed base" in repr(run)
    text = run.view(tmp_path / "run.html").read_text()
    assert "joint torques" in text
    assert "height of the torso" not in text
    labels = contents(run).labels
    assert labels["coordinate"] == ["alpha_1", "beta_1", "alpha_2", "beta_2"]
    assert labels["rate"][0] == "alpha_1_dot"


@pytest.mark.parametrize("keys", [{}, {"weightless": True}, {"parameters": {"tail_damping": 1e-5}}])
@pytest.mark.parametrize("name", KINDS)
def test_laws_hold(name, keys):
    checks = report.laws(bench(name, segments=1, functions="all", **keys))
    assert not [check for check in checks if not check.passed]
    held = {check.name for check in checks if check.status == "passed"}
    assert {"energy is constant in flight", "implicit steps solve their system"} <= held
    assert "momentum is constant in flight" not in held


def test_bases_have_no_head(chain, run):
    drawn = animal_of(chain, run)
    assert not drawn.body.marked
    assert drawn.body.semi_axes == pytest.approx([np.linalg.norm(TABLE_1["tail_mount"])] * 3)
    np.testing.assert_allclose(drawn.tail[1], TABLE_1["tail_mount"], atol=1e-15)


def animal_of(model, run):
    """The first frame of a picture."""
    return frames(model, run, [0], 0.0)[0]


# ---- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["fmu", "urdf", "mjcf"])
def test_exports_are_of_torsos_that_move(chain, kind, tmp_path):
    with pytest.raises(st.ExportError, match="torso that moves"):
        st.export(chain, kind, tmp_path / f"bench.{'xml' if kind == 'mjcf' else kind}")


def test_plans_and_settling_are_for_torsos_that_move(chain):
    for call in (
        lambda: st.settle(chain, np.zeros(4)),
        lambda: st.plan(chain, start=START, duration=1.0),
    ):
        with pytest.raises(st.ModelError, match="has a fixed base, which neither flies nor lands"):
            call()


@pytest.mark.parametrize("table", [{"height": 0.1}, {"pitch": 0.1, "bends": [[0.1, 0.0], [0, 0]]}])
def test_scenes_start_by_bends_alone(chain, table):

    with pytest.raises(
        st.SimulationError, match=r"simulate\.start\.(height|pitch): this scene has"
    ):
        scenario_of(chain, {"duration": 0.1, "start": table}, Path())
    found = scenario_of(chain, {"duration": 0.1, "start": {"bends": [[0.3, 0.1], [0, 0]]}}, Path())
    np.testing.assert_allclose(found.q0, [0.1, 0.1 / 3, 0, 0])
    assert found.simulate().q.shape == (201, 4)
