"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st

from .many import LEGS, NQ, NV, alone, rat, same, starts, tail

# What is refused.


def row_with(array, where, value):
    changed = array.copy()
    changed[where] = value
    return changed


Q, V = starts(SimpleNamespace(nq=NQ, nv=NV, contacts={}), 4)
WRONG_STATES = {
    "a number that is none": (
        (row_with(Q, (2, 1), np.nan), V),
        r"q0\[1\] of run 2: value nan: needs a finite number",
    ),
    "a velocity without end": (
        (Q, row_with(V, (3, 0), np.inf)),
        r"v0\[0\] of run 3: value inf: needs a finite number",
    ),
    "no attitude": (
        (row_with(Q, (1, slice(3, 7)), 0), V),
        r"q0\[3:7\] of run 1 is the zero quaternion",
    ),
    "numbers that differ": ((Q, V[:3]), "q0 has 4 runs, v0 3"),
    "a wrong width": ((Q[:, 1:], V), rf"q0 has shape \(4, {NQ - 1}\), not .* of k runs"),
    "no rows": ((Q[:0], V[:0]), rf"q0 has shape \(0, {NQ}\)"),
}


@pytest.mark.parametrize(("states", "words"), WRONG_STATES.values(), ids=WRONG_STATES)
def test_wrong_states_are_named(states, words):
    with pytest.raises(st.StateError, match=words):
        st.simulate(tail(), *states)


WRONG_PARAMETERS = {
    "unknown": ({"tail_mas": [1.0] * 4}, "tail_mas: no such parameter; did you mean 'tail_mass'"),
    "too few": (
        {"tail_mass": [0.1] * 3},
        r"tail_mass: value \[0.1, 0.1, 0.1\]: needs .* for each of 4 runs",
    ),
    "one for all": ({"tail_mass": 0.1}, r"tail_mass: value 0.1: needs .* for each of 4 runs"),
    "no vectors": (
        {"tail_mount": [0.1] * 4},
        r"tail_mount: value .*: needs 3 finite numbers .* for each of 4 runs",
    ),
    "unphysical": (
        {"tail_mass": [0.1, 0.1, -0.1, 0.1]},
        r"tail_mass of run 2: value -0.1: needs .* above 0",
    ),
    "not finite": ({"gravity": [0.1, np.nan, 0.1, 0.1]}, r"gravity of run 1: value nan"),
    "no body": (
        {"torso_inertia": [[1, 1, 1], [1, 1, 3], [1, 1, 1], [1, 1, 1]]},
        r"torso_inertia of run 1: value \[1.0",
    ),
    "both": (
        {"link_radius": [0.1] * 4, "link_inertia": [[1, 1, 1]] * 4},
        "give one of them, not both",
    ),
    "no mapping": ([("tail_mass", 1.0)], "needs a mapping"),
}


@pytest.mark.parametrize(("own", "words"), WRONG_PARAMETERS.values(), ids=WRONG_PARAMETERS)
def test_wrong_parameters_are_named(own, words):
    with pytest.raises(st.ModelError, match=words):
        st.simulate(tail(), Q, V, parameters=own)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_bodies_of_unlike_size_in_one_run_are_warned_of_where_it_is_called():
    with pytest.warns(st.UnlikeBodies, match=r"differ by a factor of 3\.9e\+06") as caught:
        st.simulate(
            tail(), Q, V, parameters={"tail_length": [0.2, 200.0, 0.2, 0.2]}, t_span=1e-3, step=1e-3
        )
    assert {warning.filename for warning in caught} == {__file__}


def test_parameters_of_a_single_run_are_a_models():
    with pytest.raises(st.ModelError, match=r"one start only: .*model\.with_parameters"):
        st.simulate(tail(), Q[0], V[0], parameters={"tail_mass": 0.1})


def test_baked_parameters_stay():
    baked = tail(baked=True)
    with pytest.raises(st.ModelError, match="baked into this model"):
        st.simulate(baked, Q, V, parameters={"tail_mass": [0.1] * 4})
    same(st.simulate(baked, Q, V, t_span=0.01, parameters={}), alone(baked, Q, V, t_span=0.01))


def test_too_many_samples_are_refused():
    with pytest.raises(
        st.SimulationError, match=r"more than \d+ samples of 4 runs: give 4e-07 s or more"
    ):
        st.simulate(tail(), Q, V, t_span=1.0, output_step=1e-7)


def test_a_start_deep_in_the_ground_is_named():
    q, v = starts(rat(), 3)
    q[1, 2] = -0.3
    with pytest.raises(
        st.SimulationError, match=r"q0 of run 1: point \d+ \(\w+\) is \d+ mm deep at the start"
    ):
        st.simulate(rat(), q, v, legs=LEGS)


def test_a_weight_beyond_all_numbers_is_refused():
    q, v = starts(rat(), 3)
    heavy = {"tail_mass": [1e308] * 3}
    with pytest.raises(st.ModelError, match="tail_mass and gravity give no finite weight"):
        st.simulate(rat(), q, v, legs=LEGS, t_span=0.002, method="rk4", parameters=heavy)


def test_bristles_of_another_number_of_runs_are_refused():
    q, v = starts(rat(), 3)
    with pytest.raises(
        st.SimulationError, match=r"bristles0 has shape \(2, \d+, 2\): give \(\d+, 2\)"
    ):
        st.simulate(
            rat(), q, v, legs=LEGS, bristles0=np.zeros((2, sum(rat().contacts.values()), 2))
        )


def test_many_starts_do_not_settle():
    q, _ = starts(rat(), 3)
    with pytest.raises(st.StateError, match="settle one start state after another"):
        st.settle(rat(), q, legs=LEGS)
