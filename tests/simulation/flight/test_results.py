"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import numpy as np
import pytest

import serpentail as st

from ...support.models import model_folder
from .thrown import DAMPING, LINKS, METHODS, Q0, SEGMENTS, V0, WANTED, both

# Results


@pytest.mark.parametrize(
    ("span", "output_step", "intervals"),
    [
        (0.3, None, 200),
        ((-1.0, 0.1), 0.1, 11),
        ((0.7, 1.7), 0.3, 3),
        (0.1, 1.0, 1),
        ((1.0, 1.01), 1e-4, 100),
    ],
)
@both
def test_samples_are_evenly_spaced_from_start_to_end(fly, settings, span, output_step, intervals):
    own = {"step": 1e-3} if settings["method"] == "rk4" else {"rtol": 1e-6}
    flight = fly(t_span=span, output_step=output_step, **settings, **own)
    start, end = span if isinstance(span, tuple) else (0.0, span)
    assert (len(flight.t), flight.t[0], flight.t[-1]) == (intervals + 1, start, end)
    np.testing.assert_allclose(np.diff(flight.t), (end - start) / intervals, rtol=1e-10)
    np.testing.assert_array_equal(flight.v[0], V0)
    assert flight.info["method"] == settings["method"] and flight.info["model"] == "tail"


def test_step_divides_the_samples(fly):
    for step, used, steps in ((3e-3, 2.5e-3, 8), (2.5e-3, 2.5e-3, 8), (1.0, 5e-3, 4)):
        info = fly(t_span=0.02, output_step=5e-3, step=step).info
        assert (info["step"], info["steps"], info["evaluations"]) == (
            pytest.approx(used),
            steps,
            4 * steps,
        )


def test_looser_tolerances_cost_less(fly):
    costs = [
        fly(t_span=0.1, method="dop853", rtol=r, atol=r).info["evaluations"]
        for r in (1e-4, 1e-7, 1e-10)
    ]
    assert costs == sorted(set(costs))


def test_result_holds_energies_momenta_and_parameters(model):
    own = model.with_parameters(tail_mass=0.01)
    flight = st.simulate(own, Q0, V0, t_span=0.01)
    kinetic, potential = own.energy(flight.q, flight.v)
    linear, angular = own.momentum(flight.q, flight.v)
    for found, expected in [
        (flight.kinetic, kinetic),
        (flight.potential, potential),
        (flight.linear_momentum, linear),
        (flight.angular_momentum, angular),
    ]:
        np.testing.assert_array_equal(found, expected)
    assert flight.info["parameters"]["tail_mass"] == 0.01
    assert flight.info["parameters"]["link_inertia"] == list(own.parameters["link_inertia"])


def test_flight_comes_back_from_its_file(fly, tmp_path):
    flight = fly(t_span=(1.0, 1.1), controller=st.Damping(DAMPING))
    again = st.Trajectory.load(flight.save(tmp_path / "flight"))
    for name in (
        "t",
        "q",
        "v",
        "tau",
        "kinetic",
        "potential",
        "linear_momentum",
        "angular_momentum",
    ):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))
    assert again.info == flight.info


def test_flight_between_its_samples(fly):
    """Coarse samples, resampled, follow the fine flight; samples themselves stay."""
    fine, coarse = (
        fly(t_span=0.1, output_step=step, controller=st.Damping(DAMPING)) for step in (1e-4, 5e-4)
    )
    np.testing.assert_allclose(coarse.resample(coarse.t).q, coarse.q, rtol=0, atol=1e-15)
    between = coarse.resample(fine.t)
    for name, limit in (("q", 1e-7), ("v", 1e-2), ("kinetic", 1e-6)):
        assert np.abs(getattr(between, name) - getattr(fine, name)).max() < limit


def test_float_model_flies(fly):
    single = st.load(model_folder(SEGMENTS, LINKS, name="tail", functions=WANTED, real="float"))
    reference = fly(t_span=0.1, controller=st.Damping(DAMPING))
    flights = [
        st.simulate(single, Q0, V0, t_span=0.1, controller=law, **settings)
        for law in (st.Damping(DAMPING), lambda t, q, v: -np.array(DAMPING) * v[6:])
        for settings in METHODS.values()
    ]
    for flight in flights:
        assert 0 < np.abs(flight.q - reference.q).max() < 1e-3
        assert flight.info["evaluations"] < 10_000
        assert flight.q.dtype == np.float64
