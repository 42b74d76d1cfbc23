"""Physics on the ground: sliders stop where Coulomb says, no law but the paper's makes energy,
forces move the centre of mass, and books balance.
"""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from .runs import centre_of_mass, summed

LAWS = {"cone": "ground", "box": "box", "smooth": "smooth", "paper": "paper"}
GAMMA, CROUCH, STRETCH = np.radians([210.0, -15.0, -75.0])
LIFTED = st.Legs.fixed(np.pi / 2, np.pi / 2)  # feet above the torso
FIXED = st.Legs.fixed(GAMMA, CROUCH)
G, MU, STOP = 9.8, 0.5, 1 / (2 * 0.5 * 9.8)  # m/s^2, and 102 mm from 1 m/s


def slide(friction, heading):
    """The motion of a torso of 0.1 kg that cannot turn, and whose tail and feet hang in the air."""
    model = zoo.model(LAWS[friction]).with_parameters(
        torso_mass=0.1, tail_mass=1e-9, torso_inertia=(1e3,) * 3, mu=MU, tail_mount=(0, 0, 0.3)
    )
    depth = (0.1 * G / model.parameters["K_n"]) ** (2 / 3)
    q, v = np.zeros(9), np.zeros(8)
    q[2:4] = model.parameters["torso_semi_axes"][2] - depth, 1
    v[:2] = np.cos(heading), np.sin(heading)
    how = {"legs": LIFTED, "controller": st.Damping(1e-9), "rtol": 1e-7, "output_step": 1e-3}
    return st.simulate(model, q, v, t_span=0.6, **how)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
@pytest.mark.filterwarnings("ignore::serpentail.errors.UnlikeBodies")
def test_sliders_stop_where_coulomb_says():
    """At any heading; a box is stronger on diagonals, and a smooth law creeps."""
    for heading in np.radians([0, 30, 45, 117, 200, 315]):
        way = slide("cone", heading).q[-1, :2]
        with row(heading):
            assert np.linalg.norm(way) == pytest.approx(STOP, rel=0.01)
            assert way @ [np.sin(heading), -np.cos(heading)] == pytest.approx(0, abs=1e-6)
    along, across = (np.linalg.norm(slide("box", h).q[-1, :2]) for h in (np.pi / 2, np.pi / 4))
    assert along == pytest.approx(STOP, rel=0.01)
    assert across == pytest.approx(STOP / np.sqrt(2), rel=0.02)
    way = slide("smooth", 0.7).q[-1, :2]
    assert STOP < np.linalg.norm(way) < 1.1 * STOP
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.7, abs=1e-6)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
@pytest.mark.filterwarnings("ignore::serpentail.errors.UnlikeBodies")
def test_a_slider_of_the_papers_law_is_pulled_back():
    """A spring holds MU * 0.98 N, and gives back no more speed than that at its own frequency: 63
    mm/s.
    """
    spring = MU * 0.1 * G / np.sqrt(0.1 * 600)
    assert slide("cone", 0.0).v[:, 0].min() > -spring > 5 * slide("paper", 0.0).v[:, 0].min()


@pytest.mark.parametrize(("name", "height"), [("ground", 0.13), ("ground_mixed", 0.3)])
def test_external_forces_alone_move_the_centre_of_mass(name, height):
    """Momentum is the impulse of weight and ground; angular momentum about the centre that of the
    ground's moments. The first touch is where the lowest point reaches the ground.
    """
    model = zoo.model(name)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:5], q[7:] = (height, np.cos(0.2), np.sin(0.2)), 0.05
    v[:5] = 0.3, 0.2, 10 * (0.13 - height), 1, 0.5
    how = {"legs": FIXED, "controller": st.Damping(1e-3), "rtol": 1e-8, "output_step": 2e-5}
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


def kick(**settings):
    q = np.zeros(9)
    q[2:5] = 0.0178, np.cos(0.11), np.sin(0.11)
    legs = st.Legs.ramp(GAMMA, (CROUCH, STRETCH), at=0.4, rate=-70)
    how = {"controller": st.Damping(1e-3), "legs": legs, "t_span": 0.5} | settings
    return st.simulate(zoo.model("feet"), q, np.zeros(8), **how)


def test_tolerance_converges_at_the_methods_order_across_breaks_and_blows():
    """Error over steps of a method of order 3: a break at 0.4 s, a blow and take-offs leave it as
    in smooth motion.
    """
    reference = kick(method="dop853", rtol=1e-12, atol=1e-13).q[-1]
    runs = [kick(method="ros34pw2", rtol=rtol) for rtol in (1e-5, 1e-7, 1e-9)]
    errors = [np.abs(run.q[-1] - reference).max() for run in runs]
    steps = [run.info["steps"] for run in runs]
    slope = -np.log(errors[-1] / errors[0]) / np.log(steps[-1] / steps[0])
    assert errors[0] < 1e-3 and slope > 2.5


@pytest.mark.parametrize("method", ["ros34pw2", "tsit5"])
def test_no_step_jumps_into_the_ground(method):
    """A free fall is exact in one step, however long: it must not end below the ground, unseen by
    its stages.
    """
    model, how = zoo.model("ground"), {"t_span": 0.6, "method": method, "output_step": 1e-4}
    for height in np.geomspace(0.1, 1, 12):
        q = np.zeros(9)
        q[2:4] = height, 1
        with row(height):
            fall = st.simulate(model, q, np.zeros(8), legs=LIFTED, **how)
            first = np.sqrt(2 * (height - 0.027) / G)
            assert (fall.events[0]["group"], fall.events[0]["kind"]) == ("torso", "touch_down")
            assert fall.events[0]["time"] == pytest.approx(first, rel=1e-3)
            assert fall.contact.depth.max() < 0.02


@pytest.mark.parametrize("name", ["ground_mixed", "ground_arcs"])
def test_other_tails_land_with_books_that_balance_better_with_the_tolerance(name):
    model, left = zoo.model(name), []
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:5], v[:6] = (0.12, np.cos(0.3), np.sin(0.3)), (0.3, 0.2, 0.0, 1.0, 0.5, 0.2)
    q[7:9] = -0.4, 0.2
    how = {"t_span": 0.35, "legs": FIXED, "controller": st.Damping(1e-3)}
    for rtol in (1e-4, 1e-6):
        run = st.simulate(model, q, v, rtol=rtol, **how)
        left.append(run.info["imbalance"]["relative"])
        assert run.info["work_J"]["ground"] < 0 and run.info["work_J"]["damping"] < 0
        assert {event["group"] for event in run.events} >= {"tail", "feet"}
    assert left[1] < 1e-4 and left[1] < 0.2 * left[0]
    other = st.simulate(model, q, v, method="tsit5", rtol=1e-9, **how)
    assert np.abs(other.q - run.q).max() < 1e-3
