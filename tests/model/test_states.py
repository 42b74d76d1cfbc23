"""States by words, the names of their numbers, and the manifold on which configurations lie."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

MODELS = ("m2_n2", "arcs2", "mixed", "polar", "fixed", "fixed_mixed", "single")
DEG = np.pi / 180
WORDS = [  # a state of "m2_n2", and what it sets: numbers by name
    ({}, {}),
    ({"height": "30 cm"}, {"z": 0.3}),
    ({"position": [0.1, "2 cm", 0.3]}, {"x": 0.1, "y": 0.02, "z": 0.3}),
    ({"pitch": "180 deg"}, {"qw": np.cos(np.pi / 2), "qx": 1.0}),
    ({"velocity": [0, "3.6 km/h", 2]}, {"vy": 1.0, "vz": 2.0}),
    ({"spin": ["60 rpm", 0, 1]}, {"omega_x": 2 * np.pi, "omega_z": 1.0}),
    ({"rate": ["60 rpm", 0, 1]}, {"omega_x": 2 * np.pi, "omega_z": 1.0}),
    # each of two links takes half a bend
    ({"bend": "20 deg"}, {"alpha_1": 10 * DEG, "alpha_2": 10 * DEG}),
    ({"bends": [0.2, 0.4]}, {"alpha_1": 0.1, "alpha_2": 0.2}),
    ({"bend": [0.2, 0.4, 0, 0.6]}, {"alpha_1": 0.1, "beta_1": 0.2, "beta_2": 0.3}),
    ({"bend": [[0.2, 0.4], ["20 deg", 0]]}, {"alpha_1": 0.1, "beta_1": 0.2, "alpha_2": 10 * DEG}),
    ({"bend_rate": [0, 4]}, {"alpha_2_dot": 2.0}),
]
REFUSED = [  # and what the error names
    ({"heigth": 1}, r"word: value 'heigth': did you mean 'height'"),
    ({"height": "3 kg"}, "height: value '3 kg': a mass where a length"),
    ({"height": [1]}, r"height: value \[1\]: needs a"),
    ({"pitch": np.nan}, "pitch: value nan"),
    ({"spin": [1, 2]}, r"spin: value \[1, 2\]: needs three"),
    ({"bend": [1, 2, 3]}, r"bend: value \[1, 2, 3\]: needs pitch and yaw .*4 numbers"),
    ({"height": 1, "position": [0, 0, 1]}, "position: beside height"),
    ({"bends": 1, "bend": 1}, "bend: beside bends"),
    ({"spin": [0] * 3, "rate": [0] * 3}, "rate: beside spin"),
]


def test_words_set_the_numbers_that_they_name_and_no_others():
    model = zoo.model("m2_n2")
    for words, expected in WORDS:
        with row(words):
            state = model.state(**words)
            found = dict(
                zip([*model.coordinates, *model.velocities], [*state.q, *state.v], strict=True)
            )
            straight = dict.fromkeys(found, 0.0) | {"qw": 1.0} | expected
            assert found == pytest.approx(straight, rel=1e-15, abs=1e-15)
            assert all(state[name] == x for name, x in found.items())


def test_the_angles_of_a_state_are_those_of_the_convention():
    state = zoo.model("m2_n2").state(pitch=0.3, roll="-20 deg", yaw=1.1)
    np.testing.assert_allclose(st.pitch_roll_yaw(state.q), [0.3, -20 * DEG, 1.1], atol=1e-15)


def test_wrong_words_are_named():
    for words, told in REFUSED:
        with row(words), pytest.raises(st.StateError, match=told):
            zoo.model("m2_n2").state(**words)
    with pytest.raises(st.StateError, match=r"height: .*fixed base"):
        zoo.model("fixed").state(height=1)
    with pytest.raises(st.StateError, match=r"bend: .*polar"):
        zoo.model("polar").state(bend=1)
    with pytest.raises(ValueError, match="read-only"):
        zoo.model("m2_n2").neutral().q[0] = 1


def test_each_number_has_one_name_which_tables_use_too():
    for name in MODELS:
        model = zoo.model(name)
        names = [*model.coordinates, *model.velocities, *model.torques]
        with row(name):
            sizes = model.nq, model.nv, model.nu
            lists = model.coordinates, model.velocities, model.torques
            assert tuple(map(len, lists)) == sizes and len(set(names)) == sum(sizes)
    motion = st.simulate(zoo.model("mixed"), zoo.model("mixed").state(bend=0.1), "10 ms")
    table = motion.to_dataframe()
    for name in (*motion.model.coordinates, *motion.model.velocities, *motion.model.torques):
        np.testing.assert_array_equal(table[name], motion[name], err_msg=name)


def test_integrate_turns_the_torso_about_its_axes_and_difference_is_its_inverse():
    rng = np.random.default_rng(0)
    for name in MODELS:
        model, dt = zoo.model(name), np.array([1e-9, 1e-3, 0.3, 0.5, 1.0])
        q, v = rng.normal(size=(5, model.nq)), rng.normal(size=(5, model.nv))
        q[0] *= 1e200  # quaternions have any norm
        with row(name):
            after = model.integrate(q, v, dt)
            moves = model.difference(q, after)
            scale = np.abs(q).max(axis=1, keepdims=True)
            assert (np.abs(moves - v * dt[:, None]) <= 1e-15 * np.maximum(scale, 3)).all()
            tail = model.layout.tail_q
            np.testing.assert_allclose(
                after[1:, tail], (q[:, tail] + v[:, model.layout.tail_v] * dt[:, None])[1:]
            )
            np.testing.assert_array_equal(model.integrate(q[1], v, dt)[1], after[1])
            if model.fixed:
                continue
            turn = Rotation.from_rotvec(v[:, 3:6] * dt[:, None])
            largest = np.abs(q[:, 3:7]).max(axis=1, keepdims=True)
            before = Rotation.from_quat(q[:, 3:7] / largest, scalar_first=True)
            expected = (before * turn).as_matrix()
            np.testing.assert_allclose(st.rotation_matrix(after[:, 3:7]), expected, atol=2e-15)


def test_wrong_shapes_on_the_manifold_are_named():
    model = zoo.model("m2_n2")
    q, v = model.neutral()
    for arguments, told in (
        ((q[1:], v, 1), r"q has shape \(10,\)"),
        ((q, q, 1), r"v has shape \(11,\)"),
        ((0 * q, v, 1), "zero quaternion"),
        ((q, v, "1 m"), "dt: .*a length where a time"),
        (([q] * 2, [v] * 3, 1), r"rows differ: .*2.*3"),
    ):
        with row(told), pytest.raises(st.StateError, match=told):
            model.integrate(*arguments)
