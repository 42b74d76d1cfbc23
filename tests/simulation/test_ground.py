"""Motion on the ground: the paper's jumps come out, methods agree, and touch-downs and take-offs
are found.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder

DEGREES = np.pi / 180
GAMMA, CROUCH, STRETCH = 210 * DEGREES, -15 * DEGREES, -75 * DEGREES
FUNCTIONS = ["energy", "momentum", "rollout", "implicit", "pfl", "tail_points"]
KICK = st.Legs.ramp(GAMMA, (CROUCH, STRETCH), at=0.4, rate=-70)
PASSIVE = st.Damping(1e-3)


@cache
def rat(*contacts, **options):
    return st.load(model_folder(1, 3, contacts=list(contacts), functions=FUNCTIONS, **options))


@cache
def crouched():
    """Settled in a crouch: q, v, bristles; the paper's start of the kick."""
    model = rat("feet")
    q = np.zeros(model.nq)
    q[2:5] = 0.0178, np.cos(0.11), np.sin(0.11)
    legs = st.Legs.fixed(GAMMA, CROUCH)
    return st.simulate(
        model, q, np.zeros(model.nv), controller=PASSIVE, legs=legs, t_span=1.5, rtol=1e-6
    )


def kick(model=None, **settings):
    still = crouched()
    settings = {
        "controller": PASSIVE,
        "legs": KICK,
        "t_span": 1.2,
        "bristles0": still.contact.bristles[-1],
    } | settings
    return st.simulate(model or rat("feet"), still.q[-1], 0 * still.v[-1], **settings)


def test_a_crouched_rat_comes_to_rest():
    flight = crouched()
    weight = (0.10572 + 0.00351) * 9.8
    assert flight.info["method"] == "ros34pw2" and "contact" in flight.info["reason"]
    assert np.abs(flight.v[-1, :6]).max() < 1e-3 and np.abs(flight.v[-1, 6:]).max() < 1e-2
    assert flight.contact.forces[-1].sum(axis=0) == pytest.approx([0, 0, weight], abs=2e-3)
    assert st.pitch_roll_yaw(flight.q[-1])[0] / DEGREES == pytest.approx(12.8, abs=0.3)
    assert flight.q[-1, 2] == pytest.approx(0.0178, abs=3e-4)


def test_the_kick_is_the_papers():
    """Sect. 4: take-off, about 0.6 m, and landing at 1.08 s or so (Eq. 48)."""
    flight = kick(rtol=1e-6, output_step=0.01)
    take_off, touch_down = flight.events
    assert (take_off["kind"], touch_down["kind"]) == ("take_off", "touch_down")
    assert take_off["group"] == touch_down["group"] == "feet"
    assert take_off["time"] == pytest.approx(0.404, abs=1e-3) and touch_down[
        "time"
    ] == pytest.approx(1.095, abs=2e-3)
    apex = flight.q[:, 2].max()
    assert apex == pytest.approx(0.632, abs=2e-3)
    at = int(np.argmin(np.abs(flight.t - 0.5)))
    assert flight.v[at, 3] == pytest.approx(26.2, abs=0.1) and flight.tail[at, 0] == pytest.approx(
        -0.558, abs=2e-3
    )
    airborne = (flight.t > take_off["time"]) & (flight.t < touch_down["time"])
    assert not flight.contact.forces[airborne].any() and flight.contact.forces[flight.t < 0.4].any()


@pytest.mark.parametrize(
    ("settings", "limit"),
    [
        ({"method": "ros34pw2", "rtol": 1e-6}, 1e-4),
        ({"method": "ros34pw2"}, 3e-3),
        # Rounding decides where steps end next to a change of contact, and so the error: of 300
        # starts 1e-14 rad apart the median is 4e-8, the largest 1.1e-6; at rtol 1e-8: 7e-6.
        ({"method": "tsit5", "rtol": 1e-9}, 1e-5),
        ({"method": "lsoda"}, 1e-6),
        ({"method": "implicit_euler", "step": 2e-5}, 6e-2),
    ],
    ids=lambda x: "-".join(map(str, x.values())) if isinstance(x, dict) else None,
)
def test_methods_agree(settings, limit):
    reference = kick(method="dop853", t_span=0.5)
    flight = kick(t_span=0.5, **settings)
    assert np.abs(flight.q - reference.q).max() < limit


def test_a_run_stops_at_take_off():
    whole, part = kick(rtol=1e-6), kick(rtol=1e-6, stop_at=[("take_off", "feet")])
    assert part.t[-1] == part.events[-1]["time"] == pytest.approx(whole.events[0]["time"], abs=1e-9)
    assert len(part.events) == 1 and (np.diff(part.t) > 0).all()
    np.testing.assert_allclose(part.q[:-1], whole.q[: len(part.q) - 1], atol=1e-12)
    assert np.abs(part.contact.forces[-1]).max() < 1e-3


def test_events_do_not_depend_on_the_samples():
    often, seldom = kick(output_step=1e-3), kick(output_step=0.3)
    assert often.events == seldom.events


def test_fixed_steps_never_blow_up():
    for step in (1e-3, 5e-3):
        flight = kick(step=step, t_span=3.0)
        assert flight.info["method"] == "implicit_euler"
        assert flight.q[:, 2].max() < 2 and flight.contact.depth.max() < 0.2


def test_arguments_are_left_alone():
    bristles = crouched().contact.bristles[-1].copy()
    first, second = kick(bristles0=bristles), kick(bristles0=bristles)
    np.testing.assert_array_equal(bristles, crouched().contact.bristles[-1])
    np.testing.assert_array_equal(first.q, second.q)


def test_contact_is_what_the_model_says():
    flight = kick(t_span=0.42)
    k = int(np.argmax(flight.contact.forces[..., 2].max(axis=1)))
    legs = np.concatenate(KICK.curve.at(flight.t[k])[:2])
    points, _ = rat("feet").contact_points(flight.q[k], flight.v[k], legs)
    np.testing.assert_allclose(flight.contact.points[k], points, atol=1e-15)
    assert flight.contact.of("feet").forces.shape == flight.contact.forces.shape
    with pytest.raises(KeyError, match="no group 'tail': this motion has feet"):
        flight.contact.of("tail")


def test_contact_comes_back_from_its_file(tmp_path):
    flight = kick(t_span=0.45)
    again = st.Trajectory.load(flight.save(tmp_path / "kick"))
    for name in ("points", "forces", "bristles"):
        np.testing.assert_array_equal(getattr(again.contact, name), getattr(flight.contact, name))
    assert again.contact.groups == {"feet": 6} and again.events == flight.events
    assert again.resample([0.1, 0.2]).contact.points.shape == (2, 6, 3)


def test_a_dropped_tail_and_torso_touch_down():
    model = rat("tail", "torso")
    q = np.zeros(model.nq)
    q[2:4] = 0.2, 1
    flight = st.simulate(model, q, np.zeros(model.nv), controller=PASSIVE, t_span=1.0)
    first = {
        event["group"]: event["time"]
        for event in reversed(flight.events)
        if event["kind"] == "touch_down"
    }
    height = 0.2 - 0.027
    assert first["torso"] == pytest.approx(np.sqrt(2 * height / 9.8), rel=0.05)
    assert set(first) == {"tail", "torso"}
    assert flight.energy[-1] < flight.energy[0]
    assert flight.contact.depth[-1].max() < 0.01 and np.abs(flight.v[-1, :3]).max() < 0.05


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"legs": None}, "this model has feet: give Legs"),
        ({"legs": 3.0}, "this model has feet: give Legs"),
        ({"bristles0": np.zeros((5, 2))}, r"bristles0 has shape \(5, 2\): give \(6, 2\)"),
        ({"bristles0": np.full((6, 2), np.nan)}, "finite"),
        (
            {"stop_at": [("take_off", "tail")]},
            r"needs a list of pairs out of \('touch_down', 'feet'\)",
        ),
        ({"stop_at": 3}, "needs a list of pairs"),
    ],
)
def test_wrong_setting_is_named(settings, words):
    with pytest.raises(st.SimulationError, match=words):
        kick(**settings)


def test_start_in_the_ground_is_refused_with_its_depth():
    model = rat("feet")
    q = crouched().q[-1].copy()
    q[2] -= 0.05
    with pytest.raises(
        st.SimulationError,
        match=r"^q0: point \d \(feet\) is 5\d(\.\d)? mm deep .*: raise q0\[2\] by 0\.05",
    ):
        st.simulate(model, q, np.zeros(model.nv), legs=KICK)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: st.Legs([0, 0], [1, 2], 0), "needs increasing times"),
        (
            lambda: st.Legs([0, 1], [1, 2, 3], 0),
            r"gamma has shape \(3,\), not a number, \(2,\) or \(2, 2\)",
        ),
        (lambda: st.Legs([0, 1], 1, [[1, 2, 3]] * 2), r"delta has shape \(2, 3\)"),
        (lambda: st.Legs([0, np.nan], 1, 2), r"\]: value nan: needs a finite number"),
        (lambda: st.Legs(["0"], 1, 2), "times: type .*: needs real numbers"),
        (lambda: st.Legs.ramp(1, (1, 1), 0, 1), "two angles that differ"),
        (lambda: st.Legs.ramp(1, (1, 2), 0, 0), "rate: value 0: needs a number that is not 0"),
    ],
)
def test_wrong_legs_are_named(make, words):
    with pytest.raises(st.SimulationError, match=words):
        make()


def test_each_leg_has_its_own_angles():
    curve = st.Legs([0, 1], 3.5, [[-0.2, -0.4], [-0.6, -0.4]]).curve
    values, rates, _ = curve.at(0.25)
    np.testing.assert_allclose(values, [3.5, -0.3, 3.5, -0.4])
    np.testing.assert_allclose(rates, [0, -0.4, 0, 0])
    assert KICK.curve.kinks(2) == pytest.approx([0.4, 0.4 + (CROUCH - STRETCH) / 70])


def test_baked_and_single_precision_rats_kick_too():
    reference = kick(t_span=0.5)
    for options in ({"baked": True}, {"real": "float"}):
        model = rat("feet", **options)
        flight = kick(model, t_span=0.5)
        assert np.abs(flight.q - reference.q).max() < 0.05
        assert flight.events[0]["time"] == pytest.approx(reference.events[0]["time"], abs=1e-3)
