"""Physics on the ground: sliders stop where Coulomb says, no law but the paper's makes energy,
forces move the COM.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder

LAWS = ("cone", "box", "smooth", "paper")
FUNCTIONS = [
    "energy",
    "momentum",
    "rollout",
    "implicit",
    "tail_points",
    "contact_points",
    "contact_dynamics",
]
GAMMA, CROUCH, STRETCH = np.radians([210.0, -15.0, -75.0])
KICK = st.Legs.ramp(GAMMA, (CROUCH, STRETCH), at=0.4, rate=-70)
G, MU, STOP = 9.8, 0.5, 1 / (2 * 0.5 * 9.8)  # m/s^2, and 102 mm from 1 m/s


@cache
def animal(friction, *contacts):
    return st.load(
        model_folder(1, 3, contacts=list(contacts), functions=FUNCTIONS, friction=friction)
    )


@cache
def slider(friction):
    """A point of 0.1 kg that cannot turn: no tail to speak of, and great moments of inertia."""
    changes = {"torso_mass": 0.1, "tail_mass": 1e-9, "torso_inertia": (1e3, 1e3, 1e3), "mu": MU}
    return animal(friction, "torso").with_parameters(**changes)


def slide(friction, heading, seconds=0.6, **settings):
    model = slider(friction)
    depth = (0.1 * G / model.parameters["K_n"]) ** (2 / 3)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:4] = model.parameters["torso_semi_axes"][2] - depth, 1
    v[:2] = np.cos(heading), np.sin(heading)
    return st.simulate(
        model, q, v, t_span=seconds, **{"rtol": 1e-7, "output_step": 1e-3} | settings
    )


@pytest.mark.parametrize("heading", np.radians([0, 30, 45, 117, 200, 315]))
def test_slider_stops_where_coulomb_says_at_any_heading(heading):
    way = slide("cone", heading).q[-1, :2]
    assert np.linalg.norm(way) == pytest.approx(STOP, rel=0.01)
    assert way @ [np.sin(heading), -np.cos(heading)] == pytest.approx(0, abs=1e-6)


def test_box_is_coulombs_law_along_the_axes_and_stronger_on_diagonals():
    assert np.linalg.norm(slide("box", np.pi / 2).q[-1, :2]) == pytest.approx(STOP, rel=0.01)
    assert np.linalg.norm(slide("box", np.pi / 4).q[-1, :2]) == pytest.approx(
        STOP / np.sqrt(2), rel=0.02
    )


def test_smooth_law_is_coulombs_but_for_its_creep():
    way = slide("smooth", 0.7).q[-1, :2]
    assert STOP < np.linalg.norm(way) < 1.1 * STOP
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.7, abs=1e-6)


def test_slider_of_the_papers_law_is_pulled_back():
    """A spring holds MU * 0.98 N, and gives back no more speed than that at its own frequency: 63
    mm/s.
    """
    spring = MU * 0.1 * G / np.sqrt(0.1 * 600)
    assert slide("cone", 0.0).v[:, 0].min() > -spring > 5 * slide("paper", 0.0).v[:, 0].min()


def stored(model, flight):
    """Energy (K,), J, with that of the ground's springs: K_n z^(5/2) 2/5 and K_f u^2 / 2 of every
    point.
    """
    p, contact = model.parameters, flight.contact
    normal = 0.4 * p["K_n"] * np.maximum(contact.depth, 0) ** 2.5
    friction = 0.5 * p["K_f"] * (contact.bristles**2).sum(axis=-1)
    return flight.energy + (normal + friction).sum(axis=1)


def drop(friction, seed, **settings):
    model, random = animal(friction, "feet", "tail", "torso"), np.random.default_rng(seed)
    q = np.concatenate([[0, 0, 0.12], random.normal(size=4), random.uniform(-0.3, 0.3, 2)])
    v = np.concatenate([random.uniform(-0.3, 0.3, 3), random.uniform(-6, 6, 3), [0, 0]])
    legs = st.Legs.fixed(GAMMA, CROUCH)
    settings = {
        "controller": st.Damping(1e-3),
        "legs": legs,
        "t_span": 0.8,
        "rtol": 1e-6,
        "output_step": 1e-3,
    } | settings
    return model, st.simulate(model, q, v, **settings)


@pytest.mark.parametrize("friction", ["cone", "box", "smooth"])
@pytest.mark.parametrize("seed", range(4))
def test_no_law_makes_energy(friction, seed):
    model, flight = drop(friction, seed)
    energy = stored(model, flight)
    assert np.diff(energy).max() < 1e-5 * energy[0] and energy[-1] < 0.6 * energy[0]


def test_the_papers_law_makes_energy():
    """The control of the test above: its anchor stays behind while the force does not."""
    gains = [np.diff(stored(*drop("paper", seed))).max() for seed in range(4)]
    assert max(gains) > 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_contact_never_pulls_and_stays_inside_the_cone(seed):
    model, flight = drop("cone", seed)
    forces = flight.contact.forces
    assert forces[..., 2].min() >= 0 and forces[..., 2].max() > 1
    sideways = np.linalg.norm(forces[..., :2], axis=-1)
    assert (sideways <= model.parameters["mu"] * forces[..., 2] * (1 + 1e-12) + 1e-15).all()
    assert not forces[flight.contact.depth <= 0].any()


def centre_of_mass(model, flight):
    points = model.tail_points(flight.q)
    torso, tail = model.parameters["torso_mass"], model.parameters["tail_mass"]
    middles = (points[:, 1:] + points[:, :-1]) / 2
    return (torso * flight.q[:, :3] + tail * middles.mean(axis=1)) / (torso + tail)


def integral(values, t):
    """Trapezoidal integral from the start, (K, n)."""
    steps = (values[1:] + values[:-1]) / 2 * np.diff(t)[:, None]
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(steps, axis=0)])


def test_external_forces_alone_move_the_centre_of_mass():
    """Momentum is the impulse of weight and ground; angular momentum about the COM that of the
    ground's moments.
    """
    model = animal("cone", "feet", "tail", "torso")
    q = np.zeros(model.nq)
    q[2:5], q[7] = (0.13, np.cos(0.2), np.sin(0.2)), 0.1
    v = np.array([0.3, 0.2, 0, 1, 0.5, 0, 0, 0])
    legs = st.Legs.fixed(GAMMA, CROUCH)
    flight = st.simulate(
        model,
        q,
        v,
        legs=legs,
        controller=st.Damping(1e-3),
        t_span=0.25,
        rtol=1e-8,
        output_step=2e-5,
    )
    forces, points = flight.contact.forces, flight.contact.points
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    impulse = integral(forces.sum(axis=1) - [0, 0, mass * G], flight.t)
    momentum = flight.linear_momentum
    assert np.ptp(impulse[:, 2]) > 0.05  # it landed
    np.testing.assert_allclose(momentum - momentum[0], impulse, atol=2e-4 * np.abs(momentum).max())
    centre = centre_of_mass(model, flight)
    np.testing.assert_allclose(centre - centre[0], integral(momentum / mass, flight.t), atol=1e-7)
    moments = np.cross(points - centre[:, None], forces).sum(axis=1)
    angular = flight.angular_momentum
    np.testing.assert_allclose(
        angular - angular[0], integral(moments, flight.t), atol=1e-3 * np.abs(angular).max()
    )


def test_at_rest_forces_carry_the_weight_and_turn_nothing():
    model = animal("cone", "feet", "tail", "torso")
    q = np.zeros(model.nq)
    q[2:4] = 0.06, 1
    legs = st.Legs.fixed(GAMMA, np.radians(-40))
    q, v, bristles = st.settle(
        model, q, rounds=20, duration=0.25, controller=st.Damping(1e-3), legs=legs, rtol=1e-6
    )
    still = st.simulate(model, q, v, bristles0=bristles, legs=legs, t_span=1e-6)
    forces, weight = still.contact.forces[0], (0.10572 + 0.00351) * G
    assert forces.sum(axis=0) == pytest.approx([0, 0, weight], abs=1e-3 * weight)
    moment = np.cross(still.contact.points[0] - centre_of_mass(model, still)[0], forces).sum(axis=0)
    assert moment == pytest.approx(np.zeros(3), abs=1e-3 * weight * 0.05)


def kick(**settings):
    model = animal("cone", "feet")
    q = np.zeros(model.nq)
    q[2:5] = 0.0178, np.cos(0.11), np.sin(0.11)
    return st.simulate(
        model, q, np.zeros(model.nv), controller=st.Damping(1e-3), legs=KICK, t_span=0.5, **settings
    )


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
@pytest.mark.parametrize("height", np.geomspace(0.1, 1, 12))
def test_no_step_jumps_into_the_ground(method, height):
    """A free fall is exact in one step, however long: it must not end below the ground, unseen by
    its stages.
    """
    model = animal("cone", "torso")
    q = np.zeros(model.nq)
    q[2:4] = height, 1
    fall = st.simulate(model, q, np.zeros(model.nv), t_span=2.0, method=method, output_step=1e-4)
    assert fall.events[0]["time"] == pytest.approx(np.sqrt(2 * (height - 0.027) / G), rel=1e-3)
    assert fall.contact.depth.max() < 0.02
    assert np.diff(stored(model, fall)).max() < 2e-3
