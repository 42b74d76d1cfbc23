"""What a flight is told as: samples, counts, energies and momenta, in files and between samples."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import ARRAYS, V0, fly, tail

DAMPING = st.Damping((2e-6, 1e-6, 3e-6, 4e-6))
METHODS = {"rk4": {"step": 1e-3}, "tsit5": {"rtol": 1e-6}, "dop853": {"rtol": 1e-6}}
SPANS = [
    (0.3, None, 200),
    ((-1.0, 0.1), 0.1, 11),
    ((0.7, 1.7), 0.3, 3),
    (0.1, 1.0, 1),
    ((1.0, 1.01), 1e-4, 100),
]


def test_samples_are_evenly_spaced_from_start_to_end():
    rows = [(method, *each) for method in METHODS for each in SPANS]
    for method, span, output_step, intervals in rows:
        with row(method, span):
            flight = fly(t_span=span, output_step=output_step, method=method, **METHODS[method])
            start, end = span if isinstance(span, tuple) else (0.0, span)
            assert (len(flight.t), flight.t[0], flight.t[-1]) == (intervals + 1, start, end)
            np.testing.assert_allclose(np.diff(flight.t), (end - start) / intervals, rtol=1e-10)
            np.testing.assert_array_equal(flight.v[0], V0)
            assert flight.info["method"] == method and flight.info["model"] == "m2_n2"


def test_a_step_divides_the_samples():
    for step, used, steps in ((3e-3, 2.5e-3, 8), (2.5e-3, 2.5e-3, 8), (1.0, 5e-3, 4)):
        info = fly(t_span=0.02, output_step=5e-3, step=step).info
        found = info["step"], info["steps"], info["evaluations"]
        assert found == (pytest.approx(used), steps, 4 * steps)


def test_looser_tolerances_cost_less():
    for method in ("tsit5", "dop853"):
        how = [{"method": method, "rtol": r, "atol": r} for r in (1e-4, 1e-7, 1e-10)]
        costs = [fly(t_span=0.1, **each).info["evaluations"] for each in how]
        assert costs == sorted(set(costs)), method


def test_results_hold_parameters_and_come_back_from_files(tmp_path):
    own = tail().with_parameters(tail_mass=0.01)
    flight = fly(own, t_span=(1.0, 1.1), controller=DAMPING)
    assert flight.info["parameters"]["tail_mass"] == 0.01
    assert flight.info["parameters"]["link_inertia"] == list(own.parameters["link_inertia"])
    again = st.Trajectory.load(flight.save(tmp_path / "flight"))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))
    assert again.info == flight.info


def test_a_flight_between_its_samples():
    """Coarse samples, resampled, follow the fine flight; samples themselves stay."""
    fine, coarse = (fly(t_span=0.1, output_step=h, controller=DAMPING) for h in (1e-4, 5e-4))
    np.testing.assert_allclose(coarse.resample(coarse.t).q, coarse.q, rtol=0, atol=1e-15)
    between = coarse.resample(fine.t)
    for name, limit in (("q", 1e-7), ("v", 1e-2), ("kinetic", 1e-6)):
        assert np.abs(getattr(between, name) - getattr(fine, name)).max() < limit


def test_a_model_in_single_precision_flies():
    reference = fly(t_span=0.1, controller=DAMPING)
    for law in (DAMPING, lambda t, q, v: -np.array(DAMPING.damping) * v[6:]):
        for method in METHODS:
            single = zoo.model("single")
            flight = fly(single, t_span=0.1, controller=law, method=method)
            assert 0 < np.abs(flight.q - reference.q).max() < 1e-3, method
            assert flight.info["evaluations"] < 10_000 and flight.q.dtype == np.float64
