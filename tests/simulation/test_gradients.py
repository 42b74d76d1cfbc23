"""Gradients of runs against differences of runs by tsit5 at 1e-12, and what has none."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

HELD = np.radians([230.0, -20.0])  # of the legs
LEGS = st.Legs.fixed(*HELD)
SPAN, DAMPED = 0.03, st.Damping(1e-3)
EXACT = {"method": "tsit5", "rtol": 1e-12, "output_step": SPAN}


def rat():
    return zoo.model("taped")


def dropped(rng=None):
    """A start just above the ground: oblique, spinning, with one foot lower."""
    model, turn, v = rat(), np.array([-0.1, 0.05, 0.3, 0.1, 0.2]), np.zeros(8)
    v[1:6] = 0.1, -1, 1.5, 0.3, 0.1
    height = 3e-4
    if rng:
        turn = rng.normal(size=5) * [0.15, 0.1, 0.5, 0.3, 0.3]
        v = rng.normal(size=8) * [0.3, 0.3, 0, 3, 3, 3, 5, 5]
        v[2], height = -rng.uniform(0.3, 2), rng.uniform(1e-4, 2e-3)
    q = model.integrate([0, 0, 0, 1, 0, 0, 0, 0, 0], np.r_[np.zeros(3), turn], 1.0)
    q[2] += height - model.contact_points(q, v, np.r_[HELD, HELD, np.zeros(4)])[0][:, 2].min()
    return q, v


def number(q, v):
    return v[3] + 3 * q[2]


def landed(q, v, model=None, **how):
    settings = {"legs": LEGS, "controller": DAMPED, "t_span": SPAN} | EXACT
    return st.simulate(model or rat(), q, v, **(settings | how))


def slope(value, step):
    """The derivative of a function at 0, of fourth order."""
    first, second = ((value(e) - value(-e)) / (2 * e) for e in (step, step / 2))
    return (4 * second - first) / 3


def ended(*start, **how):
    end = landed(*start, **how).end
    return number(end.q, end.v)


def gradient(q, v, rtol=1e-6, **how):
    return st.gradient(rat(), number, q, v, SPAN, rtol=rtol, **({"legs": LEGS} | how))[1]


@pytest.fixture(scope="module")
def of_a_drop():
    return gradient(*dropped(), controller=DAMPED)


def test_by_the_start(of_a_drop):
    (q, v), model = dropped(), rat()
    by_q = [slope(lambda e, r=r: ended(model.integrate(q, r, e), v), 2e-5) for r in np.eye(8)]
    by_v = [slope(lambda e, r=r: ended(q, v + e * r), 5e-5) for r in np.eye(8)]
    np.testing.assert_allclose(of_a_drop.q0, by_q, atol=1e-4 * np.abs(by_q).max())
    np.testing.assert_allclose(of_a_drop.v0, by_v, atol=2e-5 * np.abs(by_v).max())
    np.testing.assert_allclose(of_a_drop.q0[:2], 0, atol=1e-9)  # the ground is alike everywhere
    u = np.random.default_rng(0).normal(size=(6, 2)) * 1e-4
    assert of_a_drop.bristles0.shape == u.shape and of_a_drop.exists and not of_a_drop.doubts
    assert 1 < of_a_drop.condition < 1e4


def test_errors_fall_with_the_tolerance():
    """Here a point begins to slide, at a time that bristles move."""
    start = dropped(np.random.default_rng(13))
    found, exact = (gradient(*start, rtol=r, controller=DAMPED).q0 for r in (1e-8, 1e-11))
    np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max())


def test_by_parameters_and_damping(of_a_drop):
    q, v = dropped()
    for name in ("K_n", "D_n", "D_f", "torso_mass", "tail_mass", "tail_length", "gravity"):
        with row(name):
            at = rat().parameters[name]

            def value(e, name=name, at=at):
                return ended(q, v, rat().with_parameters(**{name: at * (1 + e)}))

            np.testing.assert_allclose(of_a_drop.by(name), slope(value, 2e-5) / at, rtol=2e-4)
    expected = slope(lambda e: ended(q, v, controller=st.Damping(1e-3 + e)), 1e-5)
    np.testing.assert_allclose(of_a_drop.by(lambda x: st.Damping(x[0]), 1e-3), expected, rtol=1e-4)


TURNS = {"gamma": 4.1, "delta": -0.45, "duration": 0.011}
RAMP = [0.004, 0.012, -0.03]


def moved(x, shape="linear"):
    move = dict(zip(TURNS, x, strict=True)) | {"at": "touch_down", "shape": shape}
    return st.Legs.moves(*HELD, [move])


def ramp(x):
    return st.Legs([0, x[0], x[1]], HELD[0] + np.array([0, 0.05, x[2]]), HELD[1])


def test_changes_are_the_transpose_of_gradients():
    """Through touches, kinks, a landing and breaks; the gradients are compared with differences."""
    (q, v), rng = dropped(), np.random.default_rng(3)

    def torques(x):
        return st.TorqueTable([0, x[0], x[1]], np.reshape(x[2:8], (3, 2)), damping=x[8:])

    driven = (torques, [0.009, 0.02, 0, 0.01, 0.02, -0.01, 0, 0.005, 1e-3, 2e-3])
    for method, *made in (
        ({"method": "switching"},),
        ({"method": "switching"}, (moved, [*TURNS.values()]), driven),
        ({"method": "switching"}, (ramp, RAMP), driven),
        ({"method": "auto", "rtol": 1e-5}, (torques, driven[1])),
    ):
        how = {key: f(x) for (f, x), key in zip(made[::-1], ("controller", "legs"), strict=False)}
        run = landed(q, v, **{"rtol": 1e-6} | method | how)
        weights, change = ([*rng.normal(size=(2, 8)), rng.normal(size=(6, 2))] for _ in range(2))
        own = {name: rng.normal() * rat().parameters[name] for name in ("mu", "K_n", "tail_length")}
        given = [(f, x, rng.normal(size=len(x)) * x) for f, x in made]
        found, by = run.jvp(*change, own, given), run.vjp(*weights)
        ends = zip(weights, (found.q, found.v, found.bristles), strict=True)
        starts = [np.vdot(*pair) for pair in zip(change, (by.q0, by.v0, by.bristles0), strict=True)]
        starts += [by.by(name)[0] * size for name, size in own.items()]
        starts += [by.by(f, x) @ dx for f, x, dx in given]
        with row(how):
            total = sum(np.vdot(*pair) for pair in ends)
            assert abs(total - sum(starts)) < 1e-10 * np.abs(starts).max() and found.exists


def test_by_legs_and_torques():
    """Their numbers, and the times at which they break: there forces jump."""
    q, v = dropped()

    def torques(x):
        return st.TorqueTable([0, 0.01, x[0]], np.reshape(x[1:], (3, 2)), damping=1e-3)

    driven = [0.02, 0.01, 0, 0.02, -0.01, 0, 0.005]
    for key, make, x in (
        ("legs", ramp, RAMP),
        ("legs", lambda x: moved(x, "accelerate"), [*TURNS.values()]),
        ("legs", lambda x: moved(x, "linear"), [*TURNS.values()]),
        ("controller", torques, driven),
    ):
        with row(key, x):
            how = {"controller": DAMPED} | {key: make(x)}
            found, expected = gradient(q, v, 1e-7, **how).by(make, x), []
            for r in np.diag(np.maximum(np.abs(x), 1e-2)) * 1e-4:
                at = {key: lambda e, r=r, make=make, x=x: make(x + e * r)}
                slopes = slope(lambda e: ended(q, v, **how | {key: at[key](e)}), 1.0)  # noqa: B023
                expected.append(slopes / np.abs(r).max())
            np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())


def test_steps_that_stay_where_they_are_see_wrong_slopes():
    """By the speed of the fall: right to 1e-5, and wrong by 1e-4 if no node moves with a kink."""
    (q, v), weights = dropped(), np.eye(8)[3]
    run = landed(q, v, method="switching", rtol=1e-6)
    right, tape = run.vjp(v=weights).v0[2], vars(run)["again"].tape
    tape.moves.kinds[:] = 0
    wrong = run.vjp(v=weights).v0[2]
    expected = slope(lambda e: landed(q, v + e * np.eye(8)[2]).v[-1][3], 5e-5)
    assert abs(right / expected - 1) < 1e-5
    assert abs(wrong / expected - 1) > 1e-4


@pytest.mark.slow
def test_most_drops_have_gradients_to_four_digits():
    errors, model = [], rat()
    for seed in range(50):
        rng = np.random.default_rng([11, seed])
        q, v = dropped(rng)
        dq, dv = rng.normal(size=(2, 8)) * [[0.01] * 3 + [0.1] * 5, [1] * 3 + [3] * 5]
        run = landed(q, v, method="auto", rtol=1e-5)
        end = lambda e: landed(model.integrate(q, dq, e), v + e * dv).v[-1]  # noqa: B023, E731
        expected, rows = slope(end, 2e-5), [run.vjp(v=w) for w in np.eye(8)]
        found = np.array([g.q0 @ dq + g.v0 @ dv for g in rows])
        if rows[0].exists:
            errors.append(np.abs(found - expected).max() / np.abs(expected).max())
    assert len(errors) > 45 and np.mean(np.array(errors) <= 1e-4) >= 0.9


def test_flights():
    """Heights fall by t^2 / 2 of gravity, and follow the velocity."""
    q, v = np.r_[0, 0, 1, 1, np.zeros(5)], np.r_[0, 0, 0, 1, 2, 3, 1, 2]
    make = lambda x: st.TorqueTable([0.0, 0.05], [x, x])  # noqa: E731
    run = landed(q, v, method="auto", rtol=1e-8, controller=make([1e-3, -2e-3]))
    fall = run.vjp(q=np.eye(8)[2])
    np.testing.assert_allclose([fall.v0[2], fall.q0[2]], [SPAN, 1], rtol=1e-9)
    np.testing.assert_allclose(fall.by("gravity"), -(SPAN**2) / 2, rtol=1e-6)
    expected = slope(lambda e: landed(q, v, controller=make([1e-3 + e, -2e-3])).q[-1][2], 1e-4)
    np.testing.assert_allclose(fall.by(make, [1e-3, -2e-3])[0], expected, rtol=1e-4)


def test_in_air_and_with_motors():
    """By velocities and the wind, of a tail in air; and runs that motors limit have none."""
    model = zoo.model("taped_air")
    start = model.state(velocity=[1, -2, 1], bend=0.3)

    def fly(e=0.0, wind=0.0):
        own = model.with_parameters(wind=np.add(model.parameters["wind"], [0, wind, 0]))
        return st.simulate(own, start.q, start.v + e * np.arange(8), SPAN, rtol=1e-9)

    found = fly().vjp(v=np.eye(8)[7])
    expected = slope(lambda e: fly(e).v[-1][7], 1e-3)
    np.testing.assert_allclose(found.v0 @ np.arange(8), expected, rtol=1e-6)
    expected = slope(lambda e: fly(wind=e).v[-1][7], 1e-2)
    np.testing.assert_allclose(found.by("wind")[1], expected, rtol=1e-4)
    driven, law = zoo.model("motors"), st.TorqueTable([0.0], [[1.0, 0.0]])
    with pytest.raises(st.SimulationError, match=r"^motors.* has no derivatives"):
        st.simulate(driven, driven.state(), SPAN, controller=law).vjp(v=np.eye(8)[0])


def test_a_graze_has_no_derivative_and_says_when():
    """A run that ends while a point has just touched."""
    q, v = dropped()
    found = landed(q, v, t_span=3.02e-4, output_step=3.02e-4, method="auto", rtol=1e-4)
    found = found.vjp(v=np.eye(8)[2])
    assert not found.exists and "grazes the ground at t = 0.0003" in found.doubts[0]


def test_two_points_that_touch_at_once_are_told():
    model, v = rat(), np.r_[0, 0, -1, np.zeros(5)]
    q = model.integrate([0, 0, 0, 1, 0, 0, 0, 0, 0], np.r_[np.zeros(3), -0.1, np.zeros(4)], 1.0)
    q[2] += 1e-4 - model.contact_points(q, v, np.r_[HELD, HELD, np.zeros(4)])[0][:, 2].min()
    found = gradient(q, v, controller=DAMPED)
    assert found.exists and "at once" in found.doubts[0]
    expected = slope(lambda e: ended(q, v + e * np.eye(8)[2]), 5e-5)
    np.testing.assert_allclose(found.v0[2], expected, rtol=1e-4)


def test_refusals():
    (q, v), law = dropped(), lambda t, q, v: np.zeros(2)
    for how, field in (
        ({"method": "implicit_euler"}, "method 'implicit_euler'"),
        ({"controller": law}, "controller"),
        ({"stop_at": [("touch_down", "feet")]}, "stop_at"),
    ):
        exact = {} if "method" in how else {"method": "auto"}
        settings = {"legs": LEGS, "t_span": SPAN} | exact | how
        with row(field), pytest.raises(st.SimulationError, match=f"^{field}.* has no derivatives"):
            st.simulate(rat(), q, v, **settings).vjp()
    run = landed(q, v, method="auto", rtol=1e-4)
    with pytest.raises(st.SimulationError, match=r"^v: value .*8 finite numbers"):
        run.vjp(v=[1.0])
    with pytest.raises(st.SimulationError, match=r"^parameter: value 'mew'"):
        run.vjp(v=np.eye(8)[0]).by("mew")
    with pytest.raises(st.SimulationError, match=r"^parameters.mu: value .*1 finite numbers"):
        run.jvp(parameters={"mu": [1.0, 2.0]})
    with pytest.raises(st.SimulationError, match="schedules: value"):
        run.jvp(schedules=[(3, [1.0], [1.0])])
    with pytest.raises(st.SimulationError, match="nothing that the run had"):
        model = zoo.model("taped_air")
        st.simulate(model, model.state(), t_span=0.01).jvp(schedules=[(ramp, RAMP, RAMP)])
    with pytest.raises(st.SimulationError, match=r"^loss: value nan"):
        st.gradient(rat(), lambda q, v: np.nan, q, v, 0.01, legs=LEGS)
    with pytest.raises(ValueError, match=r"^vjp: only motions of simulate"):
        st.simulate(rat(), [q, q], [v, v], 0.01, legs=LEGS)[0].vjp()
