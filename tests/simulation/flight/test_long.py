"""Long flights without damping keep energy and momentum to 1e-10, and "auto" sees to it."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import DAMPING, LEGS, Q0, V0, fly, rat, tail
from .test_motion import TIGHT

LONG = {"t_span": 60.0, "output_step": 0.3}


def tumbling(model, spin):
    """A bent tail at rest on a torso that tumbles about all axes."""
    q, v = np.eye(1, model.nq, 3)[0], np.zeros(model.nv)
    q[7:], v[3:6] = 0.1, np.array([1.0, 0.05, -0.1]) * spin
    return q, v


def drift(flight):
    """Largest changes of kinetic energy and angular momentum, relative."""
    energy, momentum = flight.kinetic, flight.angular_momentum
    lost = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
    return max(lost, np.abs(energy - energy[0]).max() / energy[0])


def test_a_minute_of_tumbling_conserves():
    for name, spin in (("m1_n3", 20), ("m2_n2", 5), ("arcs2", 10)):
        model = zoo.model(name).with_parameters(gravity=0.0)
        with row(name, spin):
            flight = st.simulate(model, *tumbling(model, spin), **LONG)
            assert flight.info["method"] == "dp8"
            assert drift(flight) < 1e-10
            assert drift(st.simulate(model, *tumbling(model, spin), method="tsit5", **LONG)) > 1e-9


def test_samples_between_steps_are_as_accurate_as_steps():
    how = {"t_span": 0.5, "output_step": 2e-3}
    exact, found = fly(**TIGHT, **how), fly(method="dp8", rtol=1e-8, **how)
    assert found.info["steps"] < 0.3 * len(found.t)
    assert np.abs(found.q - exact.q).max() < 1e-7
    seldom = fly(method="dp8", rtol=1e-8, t_span=0.5, output_step=0.1)
    np.testing.assert_allclose(found.q[::50], seldom.q, rtol=0, atol=1e-14)


def test_auto_takes_it_for_long_runs_that_nothing_acts_on():
    damped, coarse = zoo.model("elastic_arcs"), {"t_span": 10.0, "rtol": 1e-3}
    rows = [
        ("dp8", tail(), {}),
        ("dp8", tail(), {"controller": st.Phases([(0.0, None), (5.0, None)])}),
        ("tsit5", tail(), {"t_span": 9.9}),
        ("tsit5", tail(), {"controller": DAMPING}),
        ("tsit5", tail(), {"controller": lambda t, q, v: np.zeros(4)}),
        ("ros34pw2", damped, {}),
    ]
    for method, model, settings in rows:
        with row(settings):
            run = st.simulate(model, *tumbling(model, 1.0), **coarse | settings)
            assert run.info["method"] == method
    assert st.simulate(tail(), Q0, [V0, V0], **coarse).info["method"] == "tsit5"
    assert fly(t_span=10.0, step=1e-3).info["method"] == "rk4"


def test_models_with_contacts_do_not_have_it():
    q, v = tumbling(rat(), 0.0)
    q[2] = 1.0
    with pytest.raises(st.SimulationError, match=r"method.*dp8"):
        st.simulate(rat(), q, v, legs=LEGS, method="dp8")
