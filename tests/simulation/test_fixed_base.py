"""Runs of tails on a base that never moves: integration, books, tracking."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail.bridges.containers.contents import contents
from serpentail.motion.summary import summary
from serpentail.show.pictures.frames import frames
from tests.references.parameters import TABLE_1
from tests.support import zoo
from tests.support.rows import row

REST = np.array([0, 0, 0, 1.0, 0, 0, 0])
MASS = TABLE_1["tail_mass"]
START = np.array([0.3, -0.2, 0.4, 0.1]), np.array([2.0, 1.0, -3.0, 0.5])


def chain():
    """Two segments of two links."""
    return zoo.model("fixed")


def swing(**settings):
    return st.simulate(chain(), *START, **{"t_span": 0.1} | settings)


@pytest.fixture(scope="module")
def peer():
    """The same tail by Pinocchio, whose torso is held."""
    pytest.importorskip("pinocchio")
    from tests.references import pinocchio_tree

    return pinocchio_tree.chain(TABLE_1, 2, 2)


def test_runs_are_those_of_another_integrator_and_derivation(peer):
    def torque(t, q, v):
        return 1e-4 * np.sin(20 * t + np.arange(4)) - 2e-6 * v

    def x_dot(t, x):
        q, v = x[:4], x[4:]
        there = np.concatenate([REST, q]), np.concatenate([np.zeros(6), v])
        H, bias = peer.mass_matrix(there[0]), peer.bias_force(*there)
        return np.concatenate([v, np.linalg.solve(H[6:, 6:], torque(t, q, v) - bias[6:])])

    how = {"rtol": 1e-10, "atol": 1e-12, "method": "DOP853"}
    expected = solve_ivp(x_dot, (0, 0.15), np.concatenate(START), **how).y[:, -1]
    settings = {
        "tsit5": {"rtol": 1e-10},
        "rk4": {},
        "ros34pw2": {"rtol": 1e-8},
        "dp8": {},
        "dop853": {},
    }
    settings |= {"lsoda": {}, "implicit_euler": {"step": 1e-5}}
    for method, own in settings.items():
        run = swing(controller=torque, t_span=0.15, method=method, **own)
        found = np.concatenate([run.q[-1], run.v[-1]])
        limit = {"ros34pw2": 1e-4, "implicit_euler": 1e-3}.get(method, 1e-7)
        with row(method):
            assert np.abs(found - expected).max() <= limit * np.abs(expected).max()
            assert run.info["imbalance"]["relative"] < limit
            assert not run.info["warnings"]


def test_momentum_is_that_of_the_tail(peer):
    """Of all bodies but the torso, about their own centre of mass."""
    q, v = START
    H = peer.mass_matrix(np.concatenate([REST, q]))
    whole = np.concatenate([np.zeros(6), v])
    linear, angular = chain().momentum(q, v)
    np.testing.assert_allclose(linear, H[:3] @ whole, rtol=1e-12)
    R = -H[:3, 3:6]  # skew of the first moment about B
    arm = np.array([R[2, 1], R[0, 2], R[1, 0]]) / MASS
    np.testing.assert_allclose(angular, H[3:6] @ whole - np.cross(arm, linear), rtol=1e-9)


def test_tracking_is_exact_and_errors_decay():
    """e'' + kd e' + kp e = 0: kp = 400, kd = 40 is critical, e = (1 + 20 t) e0 exp(-20 t)."""
    reference = st.Reference([0.0, 1.0], np.zeros((2, 4)))
    start = np.array([0.4, -0.3, 0.2, 0.1])
    lacking = zoo.own("fixed")
    del lacking.kernels["pfl"]  # as of a scene that left it out
    for model, feedforward in ((chain(), True), (chain(), False), (lacking, True)):
        law = st.Pfl(model, reference, kp=400, kd=40, feedforward=feedforward)
        for controller in (law, law.__call__):
            run = st.simulate(chain(), start, 0 * start, controller=controller, t_span=0.2)
            expected = np.outer((1 + 20 * run.t) * np.exp(-20 * run.t), start)
            assert np.abs(run.tail - expected).max() < 1e-6
    tau, wanted = chain().pfl(*START, np.ones(4)), chain().inverse_dynamics(*START, np.ones(4))
    np.testing.assert_allclose(tau, wanted, rtol=1e-14)
    law = st.Pfl(chain(), ([0.0, 1.0], np.zeros((2, 4))), torque=1e-3)
    assert np.abs(swing(controller=law).tau).max() == 1e-3


def test_many_runs_the_choice_of_a_method_and_settling():
    starts, gravity = START[0] * np.linspace(0.5, 1, 10)[:, None], {"gravity": [5.0] * 10}
    how = {"t_span": 0.05, "output_step": 1e-3}
    runs = st.simulate(chain(), starts, np.zeros(4), parameters=gravity, **how)
    one = st.simulate(chain().with_parameters(gravity=5.0), starts[3], np.zeros(4), **how)
    np.testing.assert_array_equal(runs.q[3], one.q)
    assert not any(runs.warnings) and np.all(runs.audit.momentum == 0)
    for damping, reason in ((0, "fixed base"), (1e-5, "fixed base, damping")):
        run = swing(controller=st.Damping(damping), t_span=0.01)
        assert run.info["method"] == "tsit5" and run.info["reason"].startswith(reason)
        assert "flight" not in f"{run!r} {run.info}"
    with pytest.raises(st.ModelError, match="fixed base"):
        st.settle(chain(), np.zeros(4))


def test_motions_have_a_tail_alone(tmp_path):
    run = swing()
    assert run.q.shape == run.v.shape == (201, 4) and run.segments == 2
    np.testing.assert_array_equal(run.pose, np.tile(REST, (201, 1)))
    np.testing.assert_array_equal(run.tail_rate, run.v)
    again = st.Trajectory.load(run.save(tmp_path / "swing"))
    np.testing.assert_array_equal(again.q, run.q)
    fine, whole = run.resample(np.linspace(0, 0.1, 1001)), swing(output_step=1e-4)
    np.testing.assert_allclose(fine.q, whole.q, rtol=0, atol=1e-6)
    told = summary(chain(), run)
    assert [told[name] for name in ("apex_m", "pitch_at_end_rad", "tilt_end_deg")] == [None] * 3
    assert told["body_weight_N"] == pytest.approx(9.8 * MASS) and "on a fixed base" in repr(run)
    assert contents(run).labels["coordinate"] == ["alpha_1", "beta_1", "alpha_2", "beta_2"]
    drawn = frames(chain(), run, [0], 0.0)[0]
    assert drawn.animal.fixed
    assert drawn.animal.semi_axes == pytest.approx([np.linalg.norm(TABLE_1["tail_mount"])] * 3)
