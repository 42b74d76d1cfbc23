"""What motions are asked for: states at any time, numbers by name, the end, the summary."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

ADAPTIVE = ("tsit5", "ros34pw2", "dop853")


def flight(model=None, **settings):
    """A flight of 0.2 s with coarse samples."""
    model = model or zoo.model("m2_n2")
    start = model.state(height=0.3, pitch=0.4, velocity=[0, 0.2, 2], spin=[4, 0, 1], bend_rate=9)
    return st.simulate(model, start, 0.2, **{"output_step": "20 ms"} | settings)


def test_states_at_any_time_are_those_of_the_run_s_own_steps():
    for name in ADAPTIVE:
        with row(name):
            motion, fine = flight(method=name), flight(method=name, output_step="1 ms")
            found = motion.at(fine.t[::-1])
            for array in ("q", "v"):
                every = getattr(fine, array)[::-1]
                np.testing.assert_array_equal(getattr(found, array), every)


def test_steps_of_a_fixed_length_are_as_exact_between_samples_as_at_them():
    for name, model in (("rk4", "m2_n2"), ("implicit_euler", "ground_m2_n2")):
        body, rest = zoo.model(model), {}
        if body.contacts:
            rest = {"legs": st.Legs.fixed(3.67, -0.26)}
        exact = flight(body, method="tsit5", rtol=1e-11, output_step="1 ms", **rest)
        motion = flight(body, method=name, step="0.4 ms", **rest)
        with row(name):
            found = motion.at(exact.t)
            at_samples = np.abs(motion.v - exact.v[::20]).max()
            assert 0 < np.abs(found.v - exact.v).max() < 3 * at_samples
            np.testing.assert_array_equal(motion.at(motion.t).q, motion.q)


def test_at_a_touch_down_a_foot_is_on_the_ground():
    model = zoo.model("ground_m2_n2")
    legs = st.Legs.fixed(3.67, -0.26)
    motion = st.simulate(model, model.state(height=0.2), 0.3, legs=legs, output_step=0.1)
    event = next(e for e in motion.events if e["group"] == "feet" and e["kind"] == "touch_down")
    assert not np.isclose(event["time"], motion.t, atol=1e-3).any()
    angles = np.concatenate([legs.curve.at(0.0)[0], np.zeros(4)])
    points, _ = model.contact_points(*motion.at(event["time"]), angles)
    assert abs(points[:6, 2].min()) < 1e-9


def test_phases_are_asked_each_for_its_part():
    model = zoo.model("m2_n2")
    phases = [st.Phase("first", "0.1 s", controller=st.Damping(1e-4)), st.Phase("last", 0.1)]
    run = st.Sequence(model, phases, settings={"output_step": "20 ms"})
    start = model.state(height=1, bend_rate=20)
    motion = run.simulate(start).trajectory
    times = motion.t[::-1]
    np.testing.assert_array_equal(motion.at(times).q, motion.q[::-1])
    np.testing.assert_array_equal(motion.at(times).v, motion.v[::-1])
    alone = st.simulate(model, start, 0.1, controller=phases[0].controller)
    np.testing.assert_allclose(motion.at(0.0333).q, alone.at(0.0333).q, rtol=0, atol=1e-7)


def test_motions_that_cannot_be_made_again_are_interpolated(tmp_path):
    motion = flight(output_step="1 ms")
    read = st.Trajectory.load(motion.save(tmp_path / "flight"))
    times = [0.1234, 0.0301]
    np.testing.assert_array_equal(read.at(times).q, read.resample(times[::-1]).q[::-1])
    np.testing.assert_allclose(read.at(times).v, motion.at(times).v, atol=1e-4)
    assert read["pitch_1"].tolist() == motion["alpha_1"].tolist()
    with pytest.raises(ValueError, match=r"no model: use st\.summary"):
        read.summary()


def test_numbers_by_name_the_end_and_the_summary():
    motion = flight()
    assert len(motion) == len(motion.t) and motion.summary() == st.summary(motion.model, motion)
    for array, names in (("q", "coordinates"), ("v", "velocities"), ("tau", "torques")):
        columns = [motion[name] for name in getattr(motion.model, names)]
        np.testing.assert_array_equal(np.stack(columns, axis=1), getattr(motion, array))
    for state in (motion.end, motion.at(motion.t[-1]), motion.at("200 ms")):
        np.testing.assert_array_equal(state.q, motion.q[-1])
        np.testing.assert_array_equal(state.v, motion.v[-1])
    for name, words in (("alfa_1", "mean 'alpha_1'"), ("q", "take .q"), (3, "value 3")):
        with row(name), pytest.raises(KeyError, match=words):
            motion[name]
    for times, words in (([0.1, 0.3], "t = 0.3 s is outside"), ("1 m", "a length where a time")):
        with row(words), pytest.raises(ValueError, match=words):
            motion.at(times)
