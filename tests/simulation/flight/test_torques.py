"""Torque laws act as they are written, whichever method integrates them."""

import numpy as np
import pytest

import serpentail as st
from tests.support.rows import row

from ..runs import NQ, NT, V0, fly

METHODS = ("rk4", "tsit5", "dop853")
DAMPING = (2e-6, 1e-6, 3e-6, 4e-6)
NODES = [2.02, 2.05, 2.06]
TORQUES = np.array([[1, 2, 3, 4], [-4, 1, 0, 2], [0, 5, 1, -1]]) * 1e-5


def on_all_methods(**settings):
    """Yield each method's name in the settings of a flight; a failure names it."""
    for method in METHODS:
        with row(method):
            yield {"method": method} | settings


def test_a_function_acts_as_damping_does_and_one_damping_is_for_all_joints():
    for how in on_all_methods():
        own = fly(t_span=0.1, controller=st.Damping(DAMPING), **how)
        user = fly(t_span=0.1, controller=lambda t, q, v: -np.array(DAMPING) * v[6:], **how)
        for name in ("q", "v", "tau"):
            np.testing.assert_allclose(getattr(user, name), getattr(own, name), 1e-13, 1e-15)
        np.testing.assert_allclose(own.tau, -own.v[:, 6:] * DAMPING, rtol=1e-15)
        one, each = (fly(t_span=0.02, controller=st.Damping(d), **how) for d in (2e-6, (2e-6,) * 4))
        np.testing.assert_array_equal(one.q, each.q)
        assert (one.q != fly(t_span=0.02, **how).q).any()


def interpolated(t):
    return np.stack([np.interp(t, NODES, column) for column in TORQUES.T], axis=-1)


@pytest.mark.parametrize("damping", [0.0, DAMPING], ids=["undamped", "damped"])
def test_a_table_is_linear_in_between_and_held_outside(damping):
    for how in on_all_methods(t_span=(2.0, 2.1), output_step=1e-3):
        flight = fly(controller=st.TorqueTable(NODES, TORQUES, damping), **how)
        wanted = interpolated(flight.t) - flight.v[:, 6:] * damping
        np.testing.assert_allclose(flight.tau, wanted, rtol=0, atol=1e-17)
        assert (flight.tau[0] != flight.tau[30]).all()
        laws = [
            (begin, lambda t, q, v, begin=begin: interpolated(begin + t) - damping * v[6:])
            for begin in (2.0, *NODES)
        ]
        user = fly(controller=st.Phases(laws), **how)
        np.testing.assert_allclose(user.q, flight.q, rtol=0, atol=1e-9)


def test_a_table_of_one_node_is_a_constant():
    for node in (-1.0, 0.05, 7.0):
        flight = fly(controller=st.TorqueTable([node], TORQUES[:1]), t_span=0.1)
        np.testing.assert_array_equal(flight.tau, np.broadcast_to(TORQUES[0], flight.tau.shape))


def test_a_table_beyond_numbers_is_refused_without_a_warning():
    for size in (1e308, 1e200):
        beyond = st.TorqueTable([0.0, 1e-3], np.outer([size, -size], np.eye(1, NT)))
        with row(size), pytest.raises(st.SimulationError):
            fly(controller=beyond, t_span=0.1, most_steps=2000)


def test_the_start_time_is_the_clock_of_laws():
    for how in on_all_methods():
        times = []
        if how["method"] == "dop853":  # at kinks, its steps depend on the last bit of t
            how |= {"rtol": 1e-12, "atol": 1e-14}
        early = fly(t_span=0.05, controller=st.TorqueTable([0.01, 0.02], TORQUES[:2]), **how)
        late = fly(t_span=(3.0, 3.05), controller=st.TorqueTable([3.01, 3.02], TORQUES[:2]), **how)
        law = lambda t, q, v, times=times: times.append(t) or TORQUES[0]  # noqa: E731
        fly(t_span=(-1.0, -0.95), controller=law, **how)
        np.testing.assert_allclose(late.t, early.t + 3, rtol=0, atol=1e-15)
        np.testing.assert_allclose(late.q, early.q, rtol=0, atol=1e-9)
        assert min(times) == -1.0 and max(times) == pytest.approx(-0.95, abs=1e-15)


def test_a_function_gets_the_state_in_arrays_of_its_own():
    kept = []

    def spoil(t, q, v):
        kept.append((t, q.copy(), v.copy(), q, v))
        q[:], v[:] = np.nan, np.nan
        return [0.0] * NT

    for how in on_all_methods(t_span=0.01):
        kept.clear()
        flight, free = (fly(controller=law, **how) for law in (spoil, None))
        np.testing.assert_array_equal(flight.q, free.q)
        assert kept[0][0] == 0.0 and kept[0][1].shape == (NQ,)
        np.testing.assert_array_equal(kept[0][2], V0)
        assert np.isnan(kept[0][3]).all()


@pytest.mark.parametrize(
    "raised", [KeyError("mine"), KeyboardInterrupt(), st.StateError("mine")], ids=repr
)
def test_an_exception_of_the_function_comes_through_at_once(raised):
    calls = []

    def law(t, q, v):
        calls.append(t)
        if len(calls) == number:
            raise raised
        return [0.0] * NT

    for number in (1, 2, 50):
        for how in on_all_methods():
            calls.clear()
            with row(number), pytest.raises(type(raised)) as caught:
                fly(t_span=0.1, controller=law, **how)
            assert caught.value is raised and len(calls) == number
            if number == 50 and isinstance(raised, KeyboardInterrupt):
                assert repr(caught.value.motion).endswith("failed: interrupted>")


def test_a_wrong_answer_of_the_function_is_named():
    five, nested, nan, inf = [0.0] * 5, [[0.0] * NT], [np.nan] * NT, [np.inf] * NT
    tsit5, others = "tsit5", ("rk4", "dop853")
    rows = [(tsit5, x) for x in (set(), "1", [[1], [2, 3]], None, five, nested, 0.0, nan, inf)]
    for method, answer in rows + [(method, x) for method in others for x in (None, nan)]:
        wanted = r"the controller gave (?s:.*) at t = 2 s, not 4 finite torques"
        with row(method, answer), pytest.raises(st.SimulationError, match=wanted):
            fly(t_span=(2, 3), controller=lambda *_, answer=answer: answer, method=method)


def test_a_function_keeps_its_warnings():
    """dop853 ignores overflows of its own, not those of the user's function."""
    for how in on_all_methods(t_span=0.01):
        with pytest.raises(RuntimeWarning, match="divide by zero"):
            fly(controller=lambda t, q, v: np.ones(NT) / 0, **how)
