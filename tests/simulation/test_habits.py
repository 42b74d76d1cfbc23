"""Habits of other programs: one state in place of two, texts with units, other names."""

from functools import partial
from types import SimpleNamespace

import casadi
import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

LEGS = st.Legs.fixed(3.67, -0.26)
REFUSED = [  # arguments of simulate after the model, settings, and what is told
    (("state", "v"), {}, r"v0: .*whole state leave it out"),
    (("state", 0.1), {"t_span": 0.1}, r"v0: .*whole state leave it out"),
    (("q",), {}, r"v0: value None: needs 10 numbers.*model\.neutral"),
    (("q", 0.1), {}, r"v0: value 0.1: needs 10 numbers.*model\.neutral"),
    (("state",), {"t_eval": [0.1]}, r"t_eval: .*output_step= apart; motion\.at\(times\)"),
    (("state",), {"dt": 0.1}, r"dt: .*output_step= apart, .*step= long"),
    (("state",), {"output_step": "1 mm"}, r"output_step: .*a length where a time"),
    (("state",), {"t_span": (0, "1 kg")}, r"t_span: .*a mass where a time"),
    (("state",), {"most_step": "1 m"}, r"most_step: .*a length where a time"),
    (("state",), {"controller": st.Damping("1 N m")}, r"damping: .*a torque where a damping"),
]
SAME = [  # with units, and plain
    (st.Reference("0, 100 ms", [["10 deg", 0], [0, "20 deg"]]).curve, [[10, 0], [0, 20]]),
    (st.Legs("0, 100 ms", ["10 deg", 0], [0, "20 deg"]).curve, [[10, 0] * 2, [0, 20] * 2]),
    (st.Legs.ramp("10 deg", (0, "20 deg"), "0 ms", "200 deg/s").curve, [[10, 0] * 2, [10, 20] * 2]),
]


def start():
    """A model and a state of it."""
    model = zoo.model("m2_n2")
    return model, model.state(height=0.3, pitch=0.3, bend_rate=5)


def test_one_argument_stands_in_place_of_q_and_v():
    model, state = start()
    q, v = state
    expected = st.simulate(model, q, v, t_span=(0, 0.1)).v
    for arguments in (
        *((q, v, 0.1), (q, v, (0, "0.1 s")), (state, 0.1), (state, ["0 s", "100 ms"])),
        *(([q, v], 0.1), ((q.tolist(), v), "0.1 s"), (np.concatenate([q, v]), 0.1)),
    ):
        with row(arguments):
            np.testing.assert_array_equal(st.simulate(model, *arguments).v, expected)
    stepped = model.step(q, v, np.ones(4), 1e-3)
    for whole in (state, [q, v]):
        np.testing.assert_array_equal(model.step(whole, np.ones(4), "1 ms")[1], stepped[1])
    run = st.Sequence(model, [st.Phase("fall", "100 ms")]).simulate(state)
    np.testing.assert_array_equal(run.trajectory.q[-1], st.simulate(model, state, 0.1).q[-1])
    fixed = zoo.model("fixed")
    given = fixed.state(bend=0.1)
    assert np.array_equal(st.simulate(fixed, given, 0.1).q, st.simulate(fixed, *given, 0.1).q)


def test_settling_sweeps_and_episodes_begin_at_a_state():
    ground = zoo.model("ground_m2_n2")
    low = ground.state(height="5 cm", bend=0.1)
    settings = {"legs": LEGS, "duration": "20 ms", "at": "0 s"}
    for one, other in zip(
        st.settle(ground, low, **settings), st.settle(ground, low.q, **settings), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(st.SimulationError, match="q0: a start that settles has no velocity"):
        st.settle(ground, ground.state(velocity=[0, 0, 1]), **settings)
    model, state = start()
    over, rest = {"tail_mass": st.grid([3e-3])}, {"t_span": 0.01}
    swept = st.sweep(model, over, settings={"q0": state} | rest)
    plain = st.sweep(model, over, settings={"q0": state.q, "v0": state.v} | rest)
    assert swept[0]["q_end"] == plain[0]["q_end"]
    worlds = st.environments(model, "righting", 2, start=state)
    worlds.reset(seed=1)
    np.testing.assert_array_equal(worlds.worlds.q, [state.q] * 2)
    with pytest.raises(st.StateError, match=r"start: .*state of this model"):
        st.environment(model, "righting", start=zoo.model("m1_n3").neutral())


def test_what_cannot_be_is_told_with_our_names():
    model, state = start()
    known = {"state": state, "q": state.q, "v": state.v}
    for arguments, settings, words in REFUSED:
        given = [known.get(each, each) for each in arguments]
        with row(words), pytest.raises((st.StateError, st.SimulationError), match=words):
            st.simulate(model, *given, **settings)
    with pytest.raises(st.SimulationError, match=r"step: dt: .* is h="):
        model.step(state, np.zeros(4), dt=1e-3)
    with pytest.raises(st.StateError, match=r"x: type MX: .*model\.casadi"):
        model.x_dot(casadi.MX.sym("x", 21), np.zeros(4))
    for whole in (st.simulate(model, state, 0.1), [state]):
        with row(whole), pytest.raises(st.StateError, match=r"q0: type (Traj.* \.q |list)"):
            st.simulate(model, whole, 0.1)
    with pytest.raises(st.StateError, match=r"mass_matrix: q: type State: .*its \.q or \.v"):
        model.mass_matrix(state)
    for other, words in ((SimpleNamespace(model=model), r"its \.model"), (state, r"st\.build")):
        for call in (
            partial(st.simulate, other, state),
            partial(st.plan, other, start=state, duration=0.3),
            partial(st.Pfl, other, state),
            partial(st.export, other, "fmu"),
            partial(st.identify, other, None, {}),
            partial(st.environment, other, "righting"),
        ):
            with row(call), pytest.raises(st.SerpentailError, match=f"model: .*{words}"):
                call()
    with pytest.raises(st.SimulationError, match=r"folder: .*changes={"):
        st.scenario("kick", {"duration": 0.1})


def test_texts_with_units_are_numbers_of_arguments():
    for curve, degrees in SAME:
        with row(degrees):
            found = [curve.at(t)[0] for t in (0.0, 0.1)]
            np.testing.assert_allclose(found, np.radians(degrees), atol=1e-15)
    table = st.TorqueTable("0, 100 ms", [["1 mN m", 0], [0, "2 mN m"]]).parts(2)
    np.testing.assert_allclose(table.torques.at(0.1)[0], [0, 2e-3], atol=1e-18)
    phase = st.Phase("hop", "20 ms", moves=[{"at": "5 ms", "delta": "90 deg", "rate": "60 rpm"}])
    assert phase.duration == 0.02 and phase.moves[0]["delta"] == np.pi / 2
    assert st.Sampled(lambda t, q, v: v, "0.2 kHz", "2 ms").rate == 200
    assert (zoo.model("m2_n2").nu, zoo.model("m2_n2").total_mass) == (4, pytest.approx(0.10923))


def test_x_dot_of_casadi_takes_the_model_s_parameters_unless_others_are_given():
    model, state = start()
    x, u = np.concatenate([*state]), np.full(4, 1e-3)
    function, expected = model.casadi.x_dot, model.x_dot(x, u)
    heavy = model.with_parameters(tail_mass="6 g")
    for found, wanted in (
        (function(x, u), expected),
        (function(x=x, u=u)["x_dot"], expected),
        (function(x, u, heavy.parameter_vector), heavy.x_dot(x, u)),
        (function(x=x, u=u, p=heavy.parameter_vector)["x_dot"], heavy.x_dot(x, u)),
    ):
        np.testing.assert_allclose(np.array(found).ravel(), wanted, rtol=1e-9, atol=1e-9)


def test_a_scene_with_phases_takes_settings_by_both_spellings():
    model, state = start()
    phases = (st.Phase("first", 0.02), st.Phase("last", 0.02))
    scene = st.Scenario(model, *state, 0.0, phases=phases)
    assert len(scene.simulate(output_step="2 ms")) == 21
    with pytest.raises(st.SimulationError, match=r"t_span: .*phase\.push\.duration"):
        scene.simulate(t_span=1)
    short = {"duration": "10 ms", "simulate.output_step": "1 ms"}
    assert len(st.scenario("kick", changes=short).simulate()) == 11
