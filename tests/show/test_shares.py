"""Who turned the body: against two bodies at a pin, against sets of bodies, and sums."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

import serpentail as st
from tests.functions.test_trees import TREE
from tests.motion.conftest import made, simulated
from tests.references.body_set import exact
from tests.support import own_tails, zoo
from tests.support.rows import row

RIGHT, AT_REST = np.r_[np.zeros(3), 1, np.zeros(3)], np.zeros(8)


def swung(spin=(0.0, 0.0, 0.0)):
    """The rat with one link, whose torque swings it to and fro in pitch for 0.3 s."""
    model = zoo.model("m1_n1").with_parameters(tail_mount=[0, -0.0405, 0])
    law = st.TorqueTable([0, 0.08, 0.2], [[6e-3, 0], [-7e-3, 0], [2e-3, 0]])
    v = np.r_[np.zeros(3), spin, np.zeros(2)]
    motion = st.simulate(
        model, np.r_[RIGHT, 0.4, 0], v, t_span=0.3, controller=law, output_step=1e-4
    )
    return model, motion


def turn_per_bend(model, bend):
    """d theta / d bend of a torso at rest, in the plane: two bodies at a pin."""
    p = model.parameters
    m, half, J_t = p["tail_mass"], p["tail_length"] / 2, p["link_inertia"][0]
    mu, r = m * p["torso_mass"] / (m + p["torso_mass"]), 0.0405
    tail = J_t + mu * (half**2 + r * half * np.cos(bend))
    both = mu * r * (r + half * np.cos(bend))
    return -tail / (p["torso_inertia"][0] + both + tail)


def test_a_tail_turns_a_planar_torso_as_two_bodies_at_a_pin():
    model, motion = swung()
    shares = st.momentum_shares(model, SimpleNamespace(trajectory=motion))  # as a plan has it
    bends = motion.q[:, 7]
    assert np.ptp(bends) > 0.5
    for k in range(0, len(bends), 300):
        expected = quad(lambda bend: turn_per_bend(model, bend), bends[0], bends[k])[0]
        assert shares.turns["tail"][k, 0] == pytest.approx(expected, abs=1e-6)
    assert np.abs(shares.turned - shares.turns["tail"]).max() < 1e-9
    assert np.abs(shares.turned[:, 1:]).max() < 1e-12
    pitch = st.pitch_roll_yaw(motion.q, unwrap=True)[:, 0]
    np.testing.assert_allclose(shares.turned[:, 0], pitch, atol=1e-6)


def test_spin_is_what_a_stiff_animal_would_turn_by_with_its_momentum():
    model, motion = swung((5.0, 0, 0))
    shares = st.momentum_shares(model, motion)
    h, rate = motion.angular_momentum[0], np.diff(shares.turns["spin"][:, 0]) / 1e-4
    for k in (0, 1500, 2990):
        q, v = np.array(motion.q[k]), AT_REST.copy()
        v[3] = rate[k]
        assert model.momentum(q, v)[1] == pytest.approx(h, rel=2e-3, abs=1e-12)


def test_momenta_of_the_parts_of_a_tree_are_those_of_its_bodies():
    model = zoo.model("tree")
    states = [state[:2] for state in own_tails.states(model.nq, 2)]
    q, v = (np.array(each) for each in zip(*states, strict=True))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    shares = st.momentum_shares(model, dataclasses.replace(made(model, q), v=v))
    sizes = {"torso": 1, "tail": 5, "leg": 4, "second": 24, "third": 2}
    assert list(shares.momentum) == list(sizes)
    for k in range(len(q)):
        bodies, rates = TREE.bodies(exact(q[k]))[0], TREE._rates(exact(q[k]), exact(v[k]))
        mass = sum(b[0] for b in bodies)
        com = sum(b[0] * b[1] for b in bodies) / mass
        drift = sum(b[0] * u for b, (u, _) in zip(bodies, rates, strict=True)) / mass
        each = [
            m * np.cross(place - com, u - drift) + (R * moments).dot(R.T).dot(w)
            for (m, place, R, moments), (u, w) in zip(bodies, rates, strict=True)
        ]
        for name, size in sizes.items():
            own, each = sum(each[:size]), each[size:]
            with row(name, k):
                found = shares.momentum[name][k]
                assert np.abs(found - own.astype(float)).max() < 1e-13


def test_shares_add_up_and_the_ground_is_outside():
    leap = simulated("tail_support_jump")
    shares = st.momentum_shares(leap.model, leap)
    total = sum(shares.turns.values())
    assert np.abs(total - shares.turned).max() < 1e-12
    h = leap.angular_momentum
    assert np.abs(sum(shares.momentum.values()) - h).max() < 1e-12 * np.abs(h).max()
    outside = np.abs(shares.turns["outside"]).max(axis=0)
    assert outside[0] > 0.1
    flight = (leap.t > 0.5) & (leap.t < 1.0)
    assert np.ptp(shares.turns["spin"][flight], axis=0).max() < 0.02  # it began at rest
    assert str(shares).count("deg") == 4


def test_what_has_no_motion_and_other_models_are_refused():
    model, motion = swung()
    with pytest.raises(ValueError, match="motion: value 3: needs a Trajectory"):
        st.momentum_shares(model, 3)
    with pytest.raises(st.StateError, match="q"):
        st.momentum_shares(zoo.model("m2_n2"), motion)
    with pytest.raises(st.ModelError, match="fixed"):
        st.momentum_shares(zoo.model("fixed"), motion)
    with pytest.raises(st.ModelError, match="baked"):
        st.momentum_shares(zoo.model("baked"), motion)


def test_the_figure_has_a_panel_for_each_axis(tmp_path):
    model, motion = swung((5.0, 0, 0))
    _, axes = st.momentum_shares(model, motion).plot(tmp_path / "shares.png")
    assert [len(each.lines) for each in axes] == [4]
    assert (tmp_path / "shares.png").stat().st_size > 1000
