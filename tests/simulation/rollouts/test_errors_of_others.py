"""What is no error of a run ends all runs as it is; moves that say too little are refused."""

import pytest

import serpentail as st

from .many import starts, tail


@pytest.mark.parametrize("method", ["rk4", "tsit5", "lsoda"])
def test_an_error_of_the_users_function_ends_all_runs(method):
    calls = []

    def absent(t, q, v):
        calls.append(t)
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        st.simulate(tail(), *starts(tail(), 3), controller=absent, t_span=0.01, method=method)
    assert len(calls) == 1


@pytest.mark.parametrize(
    "move",
    [
        {"gamma": 3.0, "rate": 5.0},
        {"at": 0.1, "rate": 5.0},
        {"at": 0.1, "gamma": 3.0},
        {"at": 0.1, "gamma": 3.0, "rate": 5.0, "duration": 1.0},
    ],
    ids=["no time", "no angle", "no speed", "two speeds"],
)
def test_moves_that_say_too_little_or_too_much_are_refused(move):
    with pytest.raises(st.SimulationError, match=r"needs at, gamma or delta, and one of rate"):
        st.Legs.moves(3.6, -0.3, [move])
