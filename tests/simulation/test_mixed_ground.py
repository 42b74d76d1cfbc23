"""Tails of links and arcs on the ground: momentum, energy and touches of a drop."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.shape import Shape
from tests.functions.test_columns import arguments, outputs
from tests.mechanics.test_contact import near_ground
from tests.support.models import folder_of

FUNCTIONS = ("energy", "momentum", "rollout", "implicit", "tail_points", "center_of_mass")
SEGMENTS = [
    {"kind": "articulated", "links": 2, "length": 0.08, "mass": 0.0015},
    {"kind": "continuum", "length": 0.06, "mass": 0.001},
    {"kind": "articulated", "links": 3, "link_lengths": [0.03, 0.02, 0.02], "mass": 0.0008},
]
G = 9.8
DAMPED = {"controller": st.Damping(1e-3)}


@cache
def touching(contacts, functions):
    """Links, an arc and links that touch the ground."""
    keys = {"kind": "mixed", "segments": SEGMENTS, "samples": 3}
    keys |= {"contacts": list(contacts), "functions": list(functions)}
    return st.load(folder_of(parse_scene(keys, "rat")))


def rat():
    """The tail and the torso touch the ground."""
    return touching(("tail", "torso"), (*FUNCTIONS, "forward_dynamics"))


def start(model):
    """A bent tail that comes down first, while the torso turns."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:5] = 0.16, np.cos(0.3), np.sin(0.3)
    q[7:] = 0.1, 0.1, -0.5, -0.4, -0.5, 0.2
    v[:6] = 0.3, 0.2, 0.0, 1.0, 0.5, 0.2
    return q, v


@cache
def drop(rtol=1e-8, **settings):
    model = rat()
    return st.simulate(model, *start(model), t_span=0.35, rtol=rtol, **DAMPED, **settings)


def integral(values, t):
    """Trapezoidal integral from the start, (K, n)."""
    steps = (values[1:] + values[:-1]) / 2 * np.diff(t)[:, None]
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(steps, axis=0)])


def test_the_ground_and_gravity_alone_change_the_momenta():
    flight, model = drop(output_step=2e-5), rat()
    forces, points = flight.contact.forces, flight.contact.points
    tail = forces[:, : model.contacts["tail"]]
    assert np.count_nonzero(tail.max(axis=(0, 2))) > 3  # of links and of the arc
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    impulse = integral(forces.sum(axis=1) - [0, 0, mass * G], flight.t)
    linear, angular = model.momentum(flight.q, flight.v)
    assert np.ptp(impulse[:, 2]) > 0.05
    np.testing.assert_allclose(linear - linear[0], impulse, atol=2e-4 * np.abs(linear).max())
    centre = model.center_of_mass(flight.q, flight.v)[0]
    moments = np.cross(points - centre[:, None], forces).sum(axis=1)
    turned = integral(moments, flight.t)
    np.testing.assert_allclose(angular - angular[0], turned, atol=1e-3 * np.abs(angular).max())


def test_books_balance_better_with_the_tolerance():
    left = [drop(rtol).info["imbalance"]["relative"] for rtol in (1e-4, 1e-6)]
    assert left[1] < 1e-4 and left[1] < 0.2 * left[0]
    work = drop(1e-6).info["work_J"]
    assert work["ground"] < 0 and work["damping"] < 0


def test_touch_downs_are_where_points_of_the_tail_reach_the_ground():
    flight, model = drop(output_step=2e-5), rat()
    first = flight.events[0]
    assert (first["group"], first["kind"]) == ("tail", "touch_down")
    lowest = model.tail_points(flight.q)[:, 1:, 2].min(axis=1)
    k = int(np.argmax(lowest < 0))
    share = lowest[k - 1] / (lowest[k - 1] - lowest[k])
    assert first["time"] == pytest.approx(flight.t[k - 1] + share * 2e-5, abs=1e-6)


def test_batches_are_those_of_single_states():
    """So many states that they are evaluated side by side."""
    model = touching(("feet", "tail", "torso"), ("contact_dynamics",))
    states = near_ground(model, 3, 1000)
    together = model.contact_dynamics(*states)
    alone = [model.contact_dynamics(*(rows[k] for rows in states)) for k in range(50)]
    assert together[2].any()
    for found, expected in zip(together, map(np.array, zip(*alone, strict=True)), strict=True):
        assert np.abs(found[:50] - expected).max() <= 1e-11 * np.abs(expected).max()


def test_methods_agree():
    other = drop(1e-9, method="tsit5")
    assert np.abs(other.q - drop().q).max() < 1e-4


@pytest.mark.parametrize("name", ["contact_points", "contact_dynamics", "implicit_factor"])
def test_links_alone_are_the_articulated_tail(name):
    """Bit for bit, although the generator takes them as segments of a mixed tail."""
    counts = (2, 3)
    given = {"contacts": ("tail", "torso"), "shape": Shape(counts, links=5)}
    pure = assemble(CATALOGUE[name], Tail(2, 3, **given))
    given["shape"] = Shape(counts, ("articulated", "articulated"), links=5)
    mixed = assemble(CATALOGUE[name], Tail(2, 3, "mixed", **given))
    values = arguments(pure)
    expected, found = outputs(pure, values), outputs(mixed, values)
    for key in expected:
        np.testing.assert_array_equal(found[key], expected[key])
