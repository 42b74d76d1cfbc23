"""Motion on the ground: methods agree, touch-downs and take-offs are found, and runs that are
stopped or paused are what they are whole. Sliders stop where Coulomb says, forces move the centre
of mass, and books balance.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.runs import single
from tests.support import zoo
from tests.support.rows import row

from .runs import centre_of_mass, summed

DEGREES = np.pi / 180
GAMMA, CROUCH, STRETCH = np.radians([210.0, -15.0, -75.0])
KICK = st.Legs.ramp(GAMMA, (CROUCH, STRETCH), at=0.4, rate=-70)
PASSIVE = st.Damping(1e-3)
FIXED = st.Legs.fixed(GAMMA, CROUCH)


def rat():
    """The model whose feet alone touch the ground."""
    return zoo.model("feet")


@cache
def crouched():
    """Settled in a crouch: q, v, bristles; the paper's start of the kick."""
    q = np.array([0, 0, 0.0178, np.cos(0.11), np.sin(0.11), 0, 0, 0, 0])
    acting = {"controller": PASSIVE, "legs": FIXED}
    return st.simulate(rat(), q, np.zeros(8), t_span=1.5, rtol=1e-6, **acting)


def kick(model=None, **settings):
    still = crouched()
    bristles = still.contact.bristles[-1]
    own = {"controller": PASSIVE, "legs": KICK, "t_span": 1.2, "bristles0": bristles}
    return st.simulate(model or rat(), still.q[-1], 0 * still.v[-1], **own | settings)


def test_a_crouched_rat_comes_to_rest():
    flight, weight = crouched(), (0.10572 + 0.00351) * 9.8
    assert flight.info["method"] == "switching" and "contact" in flight.info["reason"]
    assert np.abs(flight.v[-1, :6]).max() < 1e-3 and np.abs(flight.v[-1, 6:]).max() < 1e-2
    assert flight.contact.forces[-1].sum(axis=0) == pytest.approx([0, 0, weight], abs=2e-3)
    assert st.pitch_roll_yaw(flight.q[-1])[0] / DEGREES == pytest.approx(12.8, abs=0.3)
    assert flight.q[-1, 2] == pytest.approx(0.0178, abs=3e-4)


def test_methods_agree():
    reference = kick(method="dop853", t_span=0.5)
    rows = [
        ({"method": "ros34pw2", "rtol": 1e-6}, 1e-4),
        ({"method": "ros34pw2"}, 3e-3),
        # Rounding decides where steps end next to a change of contact, and so the error: of 300
        # starts 1e-14 rad apart the median is 4e-8, the largest 1.1e-6; at rtol 1e-8: 7e-6.
        ({"method": "tsit5", "rtol": 1e-9}, 1e-5),
        ({"method": "lsoda"}, 1e-6),
        ({"method": "implicit_euler", "step": 2e-5}, 6e-2),
    ]
    for settings, limit in rows:
        with row(settings):
            assert np.abs(kick(t_span=0.5, **settings).q - reference.q).max() < limit


def test_fixed_steps_never_blow_up():
    for step in (1e-3, 5e-3):
        flight = kick(step=step, t_span=3.0)
        assert flight.info["method"] == "implicit_euler"
        assert flight.q[:, 2].max() < 2 and flight.contact.depth.max() < 0.2


def test_a_model_in_single_precision_lands_too():
    q, v = np.zeros(9), np.zeros(8)
    q[2:5], v[:4] = (0.13, np.cos(0.2), np.sin(0.2)), (0.3, 0.2, 0, 1)
    how = {"legs": FIXED, "controller": PASSIVE, "t_span": 0.25}
    runs = [st.simulate(zoo.model(n), q, v, **how) for n in ("ground", "single_ground")]
    assert 0 < np.abs(runs[1].q - runs[0].q).max() < 0.01
    assert runs[1].info["warnings"] == [] and runs[1].info["imbalance"]["relative"] < 0.1
    first, other = (run.events[0] for run in runs)
    assert first["group"] == other["group"]
    assert other["time"] == pytest.approx(first["time"], abs=1e-3)


def test_a_run_stops_at_take_off_and_its_friction_springs_are_told():
    """An implicit step from there is the run's own: with the bristles of the start it is not."""
    how = {"rtol": 1e-6, "output_step": 1e-3}
    whole, part = kick(**how), kick(stop_at=[("take_off", "feet")], **how)
    assert part.t[-1] == part.events[-1]["time"] == pytest.approx(whole.events[0]["time"], abs=1e-9)
    assert len(part.events) == 1 and (np.diff(part.t) > 0).all()
    np.testing.assert_allclose(part.q[:-1], whole.q[: len(part.q) - 1], atol=1e-12)
    assert np.abs(part.contact.forces[-1]).max() < 1e-3
    bristles = part.contact.bristles
    change = np.abs(np.diff(bristles, axis=0)).max(axis=(1, 2))
    assert np.abs(bristles[-1] - bristles[0]).max() > 10 * change[-1]
    assert change[-1] <= 2 * change[-10:-1].max()


def test_samples_change_no_events_and_a_run_that_stops_has_all_before():
    often, seldom = kick(output_step=1e-3), kick(output_step=0.3)
    assert often.events == seldom.events
    for output_step in (0.1, 1e-2, 1e-3):
        stopped = kick(stop_at=[("touch_down", "feet")], output_step=output_step)
        times = np.linspace(0, 1.2, round(1.2 / output_step) + 1)
        before = times[times < stopped.t[-1]]
        np.testing.assert_allclose(stopped.t[:-1], before, rtol=0, atol=1e-12)


def test_a_run_that_is_paused_after_each_few_steps_gives_the_same_bits(monkeypatch):
    rows = [{"method": "ros34pw2"}, {"method": "tsit5"}]
    for settings in (*rows, {"method": "implicit_euler", "step": 1e-3}):
        how = settings | {"t_span": 0.5, "output_step": 0.01}
        whole = kick(**how)
        monkeypatch.setattr(single, "PAUSE", 3)
        paused = kick(**how)
        monkeypatch.undo()
        with row(settings):
            for name in ("q", "v", "tau", "kinetic"):
                np.testing.assert_array_equal(getattr(paused, name), getattr(whole, name))
            np.testing.assert_array_equal(paused.contact.bristles, whole.contact.bristles)
            assert paused.events == whole.events and paused.info["steps"] == whole.info["steps"]


def test_a_step_may_be_so_short_that_its_square_is_zero():
    """A phase that begins after next to no time: the first step ends there."""
    q, v = np.eye(1, 9, 3)[0], np.full(8, 0.1)
    q[2] = 0.3
    for method in ("tsit5", "ros34pw2", "rk4"):
        how = {"t_span": 2e-3, "legs": FIXED, "method": method}
        plain = st.simulate(rat(), q, v, **how)
        for begin in (1e-160, 1e-180, 1e-300, 5e-324):
            with row(method, begin):
                phases = st.Phases([(0.0, PASSIVE), (begin, None)])
                found = st.simulate(rat(), q, v, controller=phases, **how)
                assert found.events == [] and found.info["steps"] < 300
                np.testing.assert_allclose(found.q, plain.q, rtol=0, atol=1e-12)


def test_contact_is_what_the_model_says_also_from_a_file(tmp_path):
    bristles = crouched().contact.bristles[-1].copy()
    flight = kick(t_span=0.45, bristles0=bristles)
    np.testing.assert_array_equal(bristles, crouched().contact.bristles[-1])
    k = int(np.argmax(flight.contact.forces[..., 2].max(axis=1)))
    legs = np.concatenate(KICK.curve.at(flight.t[k])[:2])
    points, _ = rat().contact_points(flight.q[k], flight.v[k], legs)
    np.testing.assert_allclose(flight.contact.points[k], points, atol=1e-15)
    assert flight.contact.of("feet").forces.shape == flight.contact.forces.shape
    with pytest.raises(KeyError, match=r"'tail'.*feet"):
        flight.contact.of("tail")
    again = st.Trajectory.load(flight.save(tmp_path / "kick"))
    for name in ("points", "forces", "bristles"):
        np.testing.assert_array_equal(getattr(again.contact, name), getattr(flight.contact, name))
    assert again.contact.groups == {"feet": 6} and again.events == flight.events
    assert again.resample([0.1, 0.2]).contact.points.shape == (2, 6, 3)


WRONG = [
    ({"legs": None}, "feet: give Legs"),
    ({"legs": 3.0}, "feet: give Legs"),
    ({"bristles0": np.zeros((5, 2))}, r"bristles0 .*\(5, 2\).*\(6, 2\)"),
    ({"bristles0": np.full((6, 2), np.nan)}, "finite"),
    ({"stop_at": [("take_off", "tail")]}, r"pairs out of \('touch_down', 'feet'\)"),
    ({"stop_at": 3}, "pairs"),
]
LEGS = [
    (lambda: st.Legs([0, 0], [1, 2], 0), "increasing times"),
    (lambda: st.Legs([0, 1], [1, 2, 3], 0), r"gamma .*\(3,\)"),
    (lambda: st.Legs([0, 1], 1, [[1, 2, 3]] * 2), r"delta .*\(2, 3\)"),
    (lambda: st.Legs([0, np.nan], 1, 2), "value nan"),
    (lambda: st.Legs(["0"], 1, 2), r"times: value \['0'\].*not texts"),
    (lambda: st.Legs.ramp(1, (1, 1), 0, 1), "two angles that differ"),
    (lambda: st.Legs.ramp(1, (1, 2), 0, 0), "rate: value 0"),
]
# no time, no angle, no speed, two speeds
MOVES = [{"gamma": 3.0, "rate": 5.0}, {"at": 0.1, "rate": 5.0}, {"at": 0.1, "gamma": 3.0}]
MOVES += [{"at": 0.1, "gamma": 3.0, "rate": 5.0, "duration": 1.0}]


def test_wrong_settings_and_legs_are_named():
    for settings, words in WRONG:
        with row(settings), pytest.raises(st.SimulationError, match=words):
            kick(**settings)
    for make, words in LEGS:
        with row(words), pytest.raises(st.SimulationError, match=words):
            make()
    for move in MOVES:
        with row(move), pytest.raises(st.SimulationError, match=r"needs at, gamma or delta"):
            st.Legs.moves(3.6, -0.3, [move])


def test_each_leg_has_its_own_angles():
    curve = st.Legs([0, 1], 3.5, [[-0.2, -0.4], [-0.6, -0.4]]).curve
    values, rates, _ = curve.at(0.25)
    np.testing.assert_allclose(values, [3.5, -0.3, 3.5, -0.4])
    np.testing.assert_allclose(rates, [0, -0.4, 0, 0])
    assert KICK.curve.kinks() == pytest.approx([0.4, 0.4 + (CROUCH - STRETCH) / 70])


G, MU, STOP = 9.8, 0.5, 1 / (2 * 0.5 * 9.8)  # m/s^2, and 102 mm from 1 m/s


LAWS = {"cone": "ground", "smooth": "smooth", "paper": "paper"}


def slide(friction, heading):
    """The motion of a torso of 0.1 kg that cannot turn, and whose tail and feet hang in the air."""
    model = zoo.model(LAWS[friction]).with_parameters(
        torso_mass=0.1, tail_mass=1e-9, torso_inertia=(1e3,) * 3, mu=MU, tail_mount=(0, 0, 0.3)
    )
    depth = (0.1 * G / model.parameters["K_n"]) ** (2 / 3)
    q, v = np.zeros(9), np.zeros(8)
    q[2:4] = model.parameters["torso_semi_axes"][2] - depth, 1
    v[:2] = np.cos(heading), np.sin(heading)
    lifted = st.Legs.fixed(np.pi / 2, np.pi / 2)  # feet above the torso
    how = {"legs": lifted, "controller": st.Damping(1e-9), "rtol": 1e-7, "output_step": 1e-3}
    return st.simulate(model, q, v, t_span=0.6, **how)


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnlikeBodies")
def test_sliders_stop_where_coulomb_says():
    """At any heading; smooth laws creep, the paper's pulls back."""
    for heading in np.radians([0, 30, 45, 117, 200, 315]):
        way = slide("cone", heading).q[-1, :2]
        with row(heading):
            assert np.linalg.norm(way) == pytest.approx(STOP, rel=0.01)
            assert way @ [np.sin(heading), -np.cos(heading)] == pytest.approx(0, abs=1e-6)
    way = slide("smooth", 0.7).q[-1, :2]
    assert STOP < np.linalg.norm(way) < 1.1 * STOP
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.7, abs=1e-6)
    # a spring holds MU * 0.98 N, and gives back no more than 63 mm/s, but by the paper's law
    spring = MU * 0.1 * G / np.sqrt(0.1 * 600)
    assert slide("cone", 0.0).v[:, 0].min() > -spring > 5 * slide("paper", 0.0).v[:, 0].min()


@pytest.mark.parametrize(
    ("name", "height"),
    [("ground", 0.13), pytest.param("ground_mixed", 0.3, marks=pytest.mark.slow)],
)
def test_external_forces_alone_move_the_centre_of_mass(name, height):
    """Momentum is the impulse of weight and ground; angular momentum about the centre that of the
    ground's moments. The first touch is where the lowest point reaches the ground.
    """
    model = zoo.model(name)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:5], q[7:] = (height, np.cos(0.2), np.sin(0.2)), 0.05
    v[:5] = 0.3, 0.2, 10 * (0.13 - height), 1, 0.5
    how = {"legs": FIXED, "controller": PASSIVE, "rtol": 1e-8, "output_step": 2e-5}
    flight = st.simulate(model, q, v, t_span=0.22, **how)
    forces, points, t = flight.contact.forces, flight.contact.points, flight.t
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    impulse = summed(forces.sum(axis=1) - [0, 0, mass * G], t)
    momentum = flight.linear_momentum
    assert np.ptp(impulse[:, 2]) > 0.05  # it landed
    np.testing.assert_allclose(momentum - momentum[0], impulse, atol=2e-4 * np.abs(momentum).max())
    centre = centre_of_mass(model, flight)
    np.testing.assert_allclose(centre - centre[0], summed(momentum / mass, t), atol=1e-7)
    moments = np.cross(points - centre[:, None], forces).sum(axis=1)
    angular = flight.angular_momentum
    most = 1e-3 * np.abs(angular).max()
    np.testing.assert_allclose(angular - angular[0], summed(moments, t), atol=most)
    lowest = points[..., 2].min(axis=1)
    k = int(np.argmax(lowest < 0))
    share = lowest[k - 1] / (lowest[k - 1] - lowest[k])
    assert flight.events[0]["kind"] == "touch_down"
    assert flight.events[0]["time"] == pytest.approx(t[k - 1] + share * 2e-5, abs=1e-6)


@pytest.mark.parametrize(
    "name", ["ground_arcs", pytest.param("ground_mixed", marks=pytest.mark.slow)]
)
def test_other_tails_land_with_books_that_balance_better_with_the_tolerance(name):
    model, left = zoo.model(name), []
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:5], v[:6] = (0.12, np.cos(0.3), np.sin(0.3)), (0.3, 0.2, 0.0, 1.0, 0.5, 0.2)
    q[7:9] = -0.4, 0.2
    how = {"t_span": 0.35, "legs": FIXED, "controller": PASSIVE}
    for rtol in (1e-4, 1e-6):
        run = st.simulate(model, q, v, rtol=rtol, **how)
        left.append(run.info["imbalance"]["relative"])
        assert run.info["work_J"]["ground"] < 0 and run.info["work_J"]["damping"] < 0
        assert {event["group"] for event in run.events} >= {"tail", "feet"}
    assert left[1] < 1e-4 and left[1] < 0.2 * left[0]
