"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import numpy as np
import pytest

import serpentail as st

from .thrown import DAMPING, NQ, NT, V0, both

# Torque laws


@both
def test_function_acts_as_damping_does(fly, settings):
    own = fly(t_span=0.1, controller=st.Damping(DAMPING), **settings)
    user = fly(t_span=0.1, controller=lambda t, q, v: -np.array(DAMPING) * v[6:], **settings)
    for name in ("q", "v", "tau"):
        np.testing.assert_allclose(getattr(user, name), getattr(own, name), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(own.tau, -own.v[:, 6:] * DAMPING, rtol=1e-15)


@both
def test_one_damping_is_for_all_joints(fly, settings):
    one, each = (
        fly(t_span=0.02, controller=st.Damping(d), **settings) for d in (2e-6, (2e-6,) * NT)
    )
    np.testing.assert_array_equal(one.q, each.q)
    assert (one.q != fly(t_span=0.02, **settings).q).any()


NODES = [2.02, 2.05, 2.06]
TORQUES = np.array([[1, 2, 3, 4], [-4, 1, 0, 2], [0, 5, 1, -1]]) * 1e-5


def interpolated(t):
    return np.stack([np.interp(t, NODES, column) for column in TORQUES.T], axis=-1)


@both
@pytest.mark.parametrize("damping", [0.0, DAMPING], ids=["undamped", "damped"])
def test_table_is_linear_in_between_and_held_outside(fly, settings, damping):
    span = {"t_span": (2.0, 2.1), "output_step": 1e-3}
    flight = fly(controller=st.TorqueTable(NODES, TORQUES, damping), **span, **settings)
    np.testing.assert_allclose(
        flight.tau, interpolated(flight.t) - flight.v[:, 6:] * damping, rtol=0, atol=1e-17
    )
    assert (flight.tau[0] != flight.tau[30]).all()
    laws = [
        (begin, lambda t, q, v, begin=begin: interpolated(begin + t) - damping * v[6:])
        for begin in (2.0, *NODES)
    ]
    user = fly(controller=st.Phases(laws), **span, **settings)
    np.testing.assert_allclose(user.q, flight.q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("size", [1e308, 1e200])
def test_table_beyond_numbers_is_refused_without_a_warning(fly, size):
    beyond = np.zeros((2, NT))
    beyond[:, 0] = size, -size
    with pytest.raises(st.SimulationError):
        fly(controller=st.TorqueTable([0.0, 1e-3], beyond), t_span=0.1)


@pytest.mark.parametrize("given", [set(), "1", [[1.0], [2.0, 3.0]]], ids=repr)
def test_function_that_gives_no_numbers_is_refused(fly, given):
    with pytest.raises(st.SimulationError, match=r"the controller gave .* not 4 finite torques"):
        fly(controller=lambda t, q, v: given, t_span=0.1)


def test_table_of_one_node_is_a_constant(fly):
    for node in (-1.0, 0.05, 7.0):
        flight = fly(controller=st.TorqueTable([node], TORQUES[:1]), t_span=0.1)
        np.testing.assert_array_equal(flight.tau, np.broadcast_to(TORQUES[0], flight.tau.shape))


@both
def test_start_time_is_the_clock_of_the_laws(fly, settings):
    times = []
    if (
        settings.get("method") == "dop853"
    ):  # the table has kinks, where steps depend on the last bit of t
        settings = settings | {"rtol": 1e-12, "atol": 1e-14}
    early = fly(t_span=0.05, controller=st.TorqueTable([0.01, 0.02], TORQUES[:2]), **settings)
    late = fly(t_span=(3.0, 3.05), controller=st.TorqueTable([3.01, 3.02], TORQUES[:2]), **settings)
    fly(t_span=(-1.0, -0.95), controller=lambda t, q, v: times.append(t) or TORQUES[0], **settings)
    np.testing.assert_allclose(late.t, early.t + 3, rtol=0, atol=1e-15)
    np.testing.assert_allclose(late.q, early.q, rtol=0, atol=1e-9)
    assert min(times) == -1.0 and max(times) == pytest.approx(-0.95, abs=1e-15)


@both
def test_function_gets_the_state_in_arrays_of_its_own(fly, settings):
    kept = []

    def spoil(t, q, v):
        kept.append((t, q.copy(), v.copy(), q, v))
        q[:], v[:] = np.nan, np.nan
        return [0.0] * NT

    flight, free = (fly(t_span=0.01, controller=law, **settings) for law in (spoil, None))
    np.testing.assert_array_equal(flight.q, free.q)
    assert kept[0][0] == 0.0 and kept[0][1].shape == (NQ,)
    np.testing.assert_array_equal(kept[0][2], V0)
    assert np.isnan(kept[0][3]).all()


@both
@pytest.mark.parametrize("number", [1, 2, 50])
@pytest.mark.parametrize(
    "raised", [KeyError("mine"), KeyboardInterrupt(), st.StateError("mine")], ids=repr
)
def test_exception_of_the_function_comes_through(fly, settings, number, raised):
    calls = []

    def law(t, q, v):
        calls.append(t)
        if len(calls) == number:
            raise raised
        return [0.0] * NT

    with pytest.raises(type(raised)) as caught:
        fly(t_span=0.1, controller=law, **settings)
    assert caught.value is raised and len(calls) == number


@both
@pytest.mark.parametrize(
    "answer", [None, [0.0] * (NT + 1), [[0.0] * NT], 0.0, [np.nan] * NT, [np.inf] * NT]
)
def test_wrong_answer_of_the_function_is_named(fly, settings, answer):
    words = rf"the controller gave (?s:.*) at t = 2 s, not {NT} finite torques"
    with pytest.raises(st.SimulationError, match=words):
        fly(t_span=(2, 3), controller=lambda t, q, v: answer, **settings)


@both
def test_function_keeps_its_warnings(fly, settings):
    """dop853 ignores overflows of its own, not those of the user's function."""
    with pytest.raises(RuntimeWarning, match="divide by zero"):
        fly(t_span=0.01, controller=lambda t, q, v: np.ones(NT) / 0, **settings)
