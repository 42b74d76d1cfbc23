"""Legs that move at shapes of their own, and from a touch-down on: closed forms, SciPy's dop853 as
a reference that is told when the touch-down is, and what cannot be.
"""

import dataclasses

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.runs import single
from tests.support import zoo
from tests.support.rows import row

GRAVITY, HEIGHT, SPEED = 9.8, 0.12, -1.0  # m/s^2, m of B, m/s
GAMMA, DELTA = np.radians([250.0, -55.0])
YIELD = {"at": "touch_down", "gamma": 3.6, "delta": -0.5, "duration": 0.02}
PASSIVE = st.Damping(1e-3)


def legs(**changes):
    return st.Legs.moves(GAMMA, DELTA, [YIELD | changes])


def dropped(name="ground", height=HEIGHT, **how):
    """A level rat that falls onto its feet."""
    q, v = np.eye(1, 9, 3)[0], SPEED * np.eye(1, 8, 2)[0]
    q[2] = height
    given = {"controller": PASSIVE, "t_span": 0.06, "output_step": 1e-3}
    return st.simulate(zoo.model(name), q, v, **given | how)


def first_touch():
    """When the lowest foot has fallen to the ground (s): the rat does not turn."""
    motion = dropped(legs=st.Legs.fixed(GAMMA, DELTA), t_span=1e-3)
    height = motion.contact.of("feet").points[0, :, 2].min()
    return (SPEED + np.sqrt(SPEED**2 + 2 * GRAVITY * height)) / GRAVITY


def test_shapes_are_closed_forms():
    """Shares of the way by time, and `rate`, which is the largest one."""
    s = np.linspace(0, 1, 1001)
    rows = [
        ("linear", s, 1.0),
        ("accelerate", s**2, 2.0),
        ("decelerate", s * (2 - s), 2.0),
        ("quintic", s**3 * (10 - 15 * s + 6 * s**2), 15 / 8),
    ]
    for shape, share, fastest in rows:
        move = {"at": 0.1, "delta": DELTA - 0.8, "shape": shape}
        curve = st.Legs.moves(GAMMA, DELTA, [move | {"duration": 0.04}]).curve
        values, rates, _ = curve.at(0.1 + 0.04 * s * (1 - 1e-12))
        with row(shape):
            np.testing.assert_allclose(values[:, 3], DELTA - 0.8 * share, atol=1e-9)
            np.testing.assert_allclose(rates[:, 3].min(), -fastest * 0.8 / 0.04, rtol=1e-5)
            by_rate = st.Legs.moves(GAMMA, DELTA, [move | {"rate": fastest * 20}]).curve
            np.testing.assert_allclose(by_rate.times, curve.times, rtol=1e-12)
            assert curve.at(0.2)[0][3] == pytest.approx(DELTA - 0.8)


@pytest.mark.parametrize("shape", ["linear", "accelerate", "quintic"])
def test_legs_yield_from_the_touch_down_on(shape):
    """As in a run by dop853 that is told the time of the touch-down, which free fall gives."""
    touch = first_touch()
    told = st.Legs.moves(GAMMA, DELTA, [YIELD | {"at": touch, "shape": shape}])
    stops = st.Phases([(0.0, PASSIVE), (touch, PASSIVE)])  # else it steps over the touch-down
    wanted = dropped(legs=told, method="dop853", controller=stops)
    for how in ({"method": "tsit5", "rtol": 1e-7}, {"method": "ros34pw2", "rtol": 1e-6}):
        found = dropped(legs=legs(shape=shape), **how)
        with row(how):
            assert found.info["landed_at"] == pytest.approx(touch, abs=1e-9)
            assert [e["kind"] for e in found.events][:1] == ["touch_down"]
            np.testing.assert_allclose(found.q, wanted.q, atol=2e-5)
            np.testing.assert_allclose(found.contact.legs, wanted.contact.legs, atol=1e-7)
            assert found.info["imbalance"]["relative"] < 1e-4
    for how in ({"method": "implicit_euler"}, {"method": "rk4"}):
        found = dropped(legs=legs(shape=shape), step=1e-5, **how)
        with row(how):  # from the end of a step on
            assert 0 <= found.info["landed_at"] - touch < 2e-5
            np.testing.assert_allclose(found.q, wanted.q, atol=5e-3)


def test_many_runs_each_have_their_own_touch_down(monkeypatch):
    """Alone or beside others, paused or watched, and in single precision."""
    heights, parts = [0.1, 0.2, 0.12], []
    q = np.tile(np.eye(1, 9, 3), (3, 1))
    q[:, 2] = heights
    v = SPEED * np.tile(np.eye(1, 8, 2), (3, 1))
    how = {"legs": legs(), "controller": PASSIVE, "t_span": 0.06, "output_step": 1e-3}
    many = st.simulate(zoo.model("ground"), q, v, **how)
    for k, height in enumerate(heights):
        alone = dropped(height=height, **how)
        np.testing.assert_array_equal(many[k].q, alone.q)
        np.testing.assert_array_equal(many[k].contact.legs, alone.contact.legs)
    assert "landed_at" not in many[1].info and many[1].events == []
    monkeypatch.setattr(single, "PAUSE", 3)
    paused = dropped(watch=parts.append, **how)
    np.testing.assert_array_equal(paused.q, many[2].q)
    seen = np.concatenate([part.contact.legs for part in parts])
    np.testing.assert_array_equal(seen, paused.contact.legs)
    coarse = dropped("single_ground", **how)
    assert coarse.info["landed_at"] == pytest.approx(first_touch(), abs=1e-5)


def test_only_a_touch_down_after_the_moves_before_counts():
    """Nor does one while the rat settles, or one of the tail; legs that wait are held."""
    last = {"at": 0.05, "delta": DELTA + 0.01, "duration": 0.01}
    waits = st.Legs.moves(GAMMA, DELTA, [last, YIELD])
    motion = dropped(legs=waits)
    assert motion.events[0]["time"] < 0.05 and "landed_at" not in motion.info
    np.testing.assert_allclose(motion.contact.legs[-1], [GAMMA, DELTA + 0.01] * 2)
    how = {"duration": 0.3, "at": 5.0, "controller": PASSIVE}
    q = dropped(legs=legs(), t_span=1e-3).q[0]
    still, yielding = (
        st.settle(zoo.model("ground"), q, legs=each, **how)[0]
        for each in (st.Legs.fixed(GAMMA, DELTA), legs())
    )
    np.testing.assert_array_equal(still, yielding)


def test_phases_yield_at_a_touch_down_also_of_the_phase_before():
    """In two phases the first of which ends there, or earlier, and in one with a rest: as in a
    single run. A move whose touch-down does not come in its phase is dropped.
    """
    how, feet = {"rtol": 1e-6, "output_step": 1e-3}, ("touch_down", "feet")
    one = dropped(legs=legs(), **how)
    touch = one.info["landed_at"]
    rows = [
        [st.Phase("onto", 0.06, until=[feet]), st.Phase("land", 0.06 - touch, moves=[YIELD])],
        [st.Phase("earlier", 0.9 * touch), st.Phase("land", 0.06 - 0.9 * touch, moves=[YIELD])],
        [st.Phase("both", 0.05, moves=[YIELD]), st.Phase("rest", 0.01)],
        [st.Phase("fall", 0.9 * touch, moves=[YIELD]), st.Phase("later", 0.06 - 0.9 * touch)],
    ]
    for phases, lands in zip(rows, (True, True, True, False), strict=True):
        parts = [dataclasses.replace(phase, controller=PASSIVE) for phase in phases]
        sequence = st.Sequence(zoo.model("ground"), parts, GAMMA, DELTA, how)
        motion = sequence.simulate(one.q[0], one.v[0]).trajectory
        held = one.contact.legs[-1] if lands else [GAMMA, DELTA] * 2
        with row(phases[0].name):
            assert motion.t[-1] == pytest.approx(0.06)
            np.testing.assert_allclose(motion.contact.legs[-1], held, atol=1e-6)
            assert (np.abs(motion.q[-1] - one.q[-1]).max() < 1e-4) == lands


def test_moves_that_cannot_be_are_named():
    later = {"at": 0.5, "delta": 0.0, "duration": 0.1}
    rows = [
        ([YIELD, later], r"moves\[1\]: .*follows a move at touch_down"),
        ([YIELD | {"at": "take_off"}], r"moves\[0\].at: value 'take_off'"),
        ([YIELD | {"shape": "cubic"}], r"moves\[0\].shape.*'cubic'"),
        ([YIELD | {"duration": 0.0}], r"moves\[0\]: takes 0.0 s"),
    ]
    for moves, words in rows:
        with row(words), pytest.raises(st.SimulationError, match=words):
            st.Legs.moves(GAMMA, DELTA, moves)
    with pytest.raises(st.SimulationError, match="touch_down: dop853 does not detect events"):
        dropped(legs=legs(), method="dop853")
