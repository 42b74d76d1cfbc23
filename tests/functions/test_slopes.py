"""Gravity in any direction: against a peer, and against a level world that is turned."""

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.attitude import product
from serpentail.planning.program.build import plan_program
from serpentail.planning.result.excess import path_values
from serpentail.planning.result.full_state import com_at_start, full_state
from tests.references.metrics import block_error
from tests.references.parameters import TABLE_1, random_states
from tests.support import zoo
from tests.support.tumbling import keyed, start

VECTOR = (9.8 * np.sin(np.radians(25)), 0.0, -9.8 * np.cos(np.radians(25)))
TURN = np.array([np.cos(np.radians(12.5)), 0, -np.sin(np.radians(12.5)), 0])  # to its axes
UP = 9 * np.eye(9)[2]  # m: clear of the ground


def turned(q, v):
    """The same state in the axes of the slope."""
    R = st.rotation_matrix(TURN)
    q = np.r_[R @ q[:3], product(TURN, q[3:7]), q[7:]]
    return q, np.r_[R @ v[:3], v[3:]]


def test_it_is_pinocchios():
    pytest.importorskip("pinocchio")
    from tests.references.pinocchio_tree import chain

    vector = (3.0, -5.0, 2.0)
    model = zoo.model("slope").with_parameters(gravity_vector=vector)
    peer = chain(TABLE_1 | {"gravity_vector": vector}, 1, 3)
    for q, v, v_dot, tau in zip(*random_states(1, 8, 20, "random"), strict=True):
        expected = peer.forward_dynamics(q, v, tau)
        for found in (model.forward_dynamics(q, v, tau), model.casadi.forward_dynamics(q, v, tau)):
            assert block_error(np.array(found).ravel(), expected) < 1e-11
        expected = peer.inverse_dynamics(q, v, v_dot)
        assert block_error(model.inverse_dynamics(q, v, v_dot), expected) < 1e-12
        np.testing.assert_allclose(model.energy(q, v), peer.energy(q, v), rtol=1e-12)
        wrench, expected = model.mount_wrench(q, v, v_dot), peer.mount_wrench(q, v, v_dot)
        np.testing.assert_allclose(wrench[0], expected[0], atol=1e-12 * np.abs(expected[0]).max())


def test_flights_and_their_books_are_those_of_a_turned_world():
    level, model = zoo.model("m1_n3"), zoo.model("slope")
    assert model.parameters["gravity_vector"] == pytest.approx(VECTOR, abs=1e-15)
    q, v = start(level)
    flown = st.simulate(level, q, v, 0.4, rtol=1e-11)
    q0, v0 = turned(q, v)
    motion = st.simulate(model, q0 + UP, v0, 0.4, rtol=1e-11)
    end_q, end_v = turned(flown.q[-1], flown.v[-1])
    np.testing.assert_allclose(motion.q[-1] - UP, end_q, atol=1e-8)
    np.testing.assert_allclose(motion.v[-1], end_v, atol=1e-6)
    lifted = 9 * 9.8 * np.cos(np.radians(25)) * (TABLE_1["torso_mass"] + TABLE_1["tail_mass"])
    np.testing.assert_allclose(motion.potential - lifted, flown.potential, atol=1e-9)
    assert motion.info["imbalance"]["relative"] < 1e-8 and not motion.warnings
    ours, theirs = (st.summary(*pair) for pair in ((model, motion), (level, flown)))
    for name in ("body_weight_N", "com_rise_m"):
        assert ours[name] == pytest.approx(theirs[name], rel=1e-8)


def test_plans_fall_along_it():
    """Points of a plan are where its true flight is: the centre of mass on a tilted parabola."""
    model, times = zoo.model("slope"), np.linspace(0, 0.4, 7)
    q0, v0 = start(model)

    def seen(point):
        import casadi

        return casadi.vertcat(point.center_of_mass, point.position)

    settings = {"intervals": 8, "tolerance": None, "track": False, "duration": 0.4}
    plan = keyed(model, start=(q0, v0), path=((seen, -50.0, 50.0),), **settings)
    program = plan_program(model, plan.problem, plan.mesh, plan.rule, 0.0)
    blocks = plan.curve.at(times)
    com, speed = com_at_start(model, plan.start)
    flown = com + speed * times[:, None] + times[:, None] ** 2 / 2 * VECTOR
    found = path_values(program, plan.solution.samples, times, blocks, plan.start)
    q, v = full_state(model, plan.start, times, blocks)
    np.testing.assert_allclose(found, np.hstack([flown, q[:, :3]]), atol=1e-9)
    fallen = model.momentum(q, v)[0] / model.mass_matrix(q)[0, 0, 0]
    np.testing.assert_allclose(fallen, speed + np.outer(times, VECTOR), atol=1e-9)
