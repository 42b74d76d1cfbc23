"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

import ctypes
import pickle
import signal
import threading
import time
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from serpentail.model.compiler import compile_library
from serpentail.simulation import batched_runs, rollouts
from tests.support.models import model_folder

SEGMENTS, LINKS = 2, 2
NQ, NV, NT = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS
WANTED = ["forward_dynamics", "energy", "momentum", "rollout", "implicit", "pfl"]
ARRAYS = ("t", "q", "v", "tau", "kinetic", "potential", "linear_momentum", "angular_momentum")
PER_RUN = ARRAYS[1:]
DAMPING = st.Damping(1e-6)
LEGS = st.Legs.ramp(3.66, (-0.26, -1.3), at=0.01, rate=-70)


@cache
def tail(**options):
    return st.load(model_folder(SEGMENTS, LINKS, name="tail", functions=WANTED, **options))


@cache
def rat():
    """A model with feet and a tail that touch the ground."""
    return st.load(model_folder(1, 3, contacts=["feet", "tail"], functions=WANTED))


def starts(model, count, seed=0):
    """Random poses (count, nq), upright and clear of the ground, and velocities."""
    rng = np.random.default_rng(seed)
    q, v = 0.1 * rng.normal(size=(count, model.nq)), rng.normal(size=(count, model.nv))
    q[:, 2] += 1.0 if not model.contacts else 0.1
    q[:, 3:7] = [1, 0, 0, 0] + 0.05 * rng.normal(size=(count, 4))
    return q, v * ([0.1] * 3 + [1.0] * (model.nv - 3))


def alone(model, q, v, **settings):
    """Every run by a call of its own."""
    return [st.simulate(model, *state, **settings) for state in zip(q, v, strict=True)]


def same(rollouts, flights):
    """Assert that all arrays of rollouts are those of single flights, bit for bit."""
    for k, flight in enumerate(flights):
        np.testing.assert_array_equal(rollouts.t, flight.t)
        for name in PER_RUN:
            np.testing.assert_array_equal(
                getattr(rollouts, name)[k], getattr(flight, name), err_msg=name
            )


def own_info(info):
    """What does not depend on the machine, or on the other runs."""
    return {name: x for name, x in info.items() if name not in ("seconds", "cpu_seconds", "reason")}


SETTINGS = {
    "tsit5": {"method": "tsit5"},
    "ros34pw2": {"method": "ros34pw2"},
    "rk4": {"method": "rk4", "step": 1e-3},
    "implicit_euler": {"method": "implicit_euler", "step": 1e-3},
    "dop853": {"method": "dop853"},
    "auto": {},
    "stiff": {"controller": st.Damping(1e-2)},
    "table": {
        "controller": st.TorqueTable([0.0, 0.02], [[1e-5] * NT, [-1e-5] * NT], 1e-6),
        "t_span": (-0.01, 0.05),
    },
    "function": {"controller": lambda t, q, v: -1e-6 * v[6:]},
    "phases": {"controller": st.Phases([(0.0, None), (0.02, DAMPING)])},
}


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_each_run_is_what_it_is_alone(settings):
    settings = {"t_span": 0.05, "output_step": 5e-3, "controller": DAMPING} | settings
    q, v = starts(tail(), 5)
    flights, found = alone(tail(), q, v, **settings), st.simulate(tail(), q, v, **settings)
    same(found, flights)
    assert len(found) == 5 and found.errors == [None] * 5
    assert found.info["method"] == flights[0].info["method"]
    assert found.info["steps"] == sum(flight.info["steps"] for flight in flights)
    for k, flight in enumerate(flights):
        assert own_info(found[k].info) == own_info(flight.info)
        assert found.ends[k] == flight.t[-1]
        np.testing.assert_array_equal(found[k].q, flight.q)


@pytest.mark.parametrize("real", ["double", "float"])
def test_a_tracked_reference_and_single_precision(real):
    model = tail(real=real)
    law = st.Pfl(model, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT]))
    settings = {"controller": law, "t_span": 0.05, "method": "tsit5"}
    q, v = starts(model, 3)
    found = st.simulate(model, q, v, **settings)
    same(found, alone(model, q, v, **settings))
    assert found.q.dtype == found.kinetic.dtype == np.float64


@pytest.mark.parametrize("method", ["ros34pw2", "tsit5", "implicit_euler"])
def test_on_the_ground(method):
    settings = {
        "legs": LEGS,
        "controller": st.Damping(1e-3),
        "t_span": 0.3,
        "method": method,
        "output_step": 0.02,
    }
    q, v = starts(rat(), 4)
    flights, found = alone(rat(), q, v, **settings), st.simulate(rat(), q, v, **settings)
    assert any(flight.events for flight in flights)
    same(found, flights)
    for k, flight in enumerate(flights):
        assert found[k].events == flight.events
        np.testing.assert_array_equal(found.bristles[k], flight.contact.bristles)
        for name in ("points", "forces", "bristles"):
            np.testing.assert_array_equal(
                getattr(found[k].contact, name), getattr(flight.contact, name)
            )


def test_runs_that_stop_at_events():
    settings = {
        "legs": LEGS,
        "t_span": 0.3,
        "output_step": 0.02,
        "stop_at": [("touch_down", "tail")],
        "rtol": 1e-6,
    }
    q, v = starts(rat(), 6)
    q[0, 2] += 5  # which does not come down in time
    flights, found = alone(rat(), q, v, **settings), st.simulate(rat(), q, v, **settings)
    assert len({len(flight.t) for flight in flights}) > 2
    for k, flight in enumerate(flights):
        stopped = flight.t[-1] < 0.3
        rows = len(flight.t) - stopped
        assert found.errors[k] is None and found.ends[k] == flight.t[-1]
        np.testing.assert_array_equal(found.q[k, :rows], flight.q[:rows])
        assert all(
            np.isnan(getattr(found, name)[k, rows:]).all() for name in (*PER_RUN, "bristles")
        )
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(found[k], name), getattr(flight, name))
    assert not np.isnan(found.q[0]).any() and np.isnan(found.q[1:, -1]).all()


# Parameters.


def test_each_run_has_its_own_parameters():
    q, v = starts(tail(), 4)
    rng = np.random.default_rng(1)
    own = {"tail_mass": rng.uniform(0.002, 0.005, 4), "tail_mount": 0.02 * rng.normal(size=(4, 3))}
    settings = {"t_span": 0.05, "controller": st.Damping(1e-3)}
    found = st.simulate(tail(), q, v, parameters=own, **settings)
    for k in range(4):
        model = tail().with_parameters(**{name: values[k] for name, values in own.items()})
        flight = st.simulate(model, q[k], v[k], method=found.info["method"], **settings)
        for name in PER_RUN:
            np.testing.assert_array_equal(getattr(found, name)[k], getattr(flight, name))
        assert found[k].info["parameters"] == flight.info["parameters"]
        np.testing.assert_array_equal(found[k].kinetic, flight.kinetic)
    assert len(np.unique(found.kinetic[:, 0])) == 4


@pytest.mark.parametrize(
    "own",
    [
        {"link_radius": [0.001, 0.002, 0.003]},
        {"link_inertia": [[1e-7, 1e-8, 2e-7], [3e-7, 1e-8, 2e-7], [1e-7, 2e-8, 2e-7]]},
        {
            "tail_length": [0.1, 0.2, 0.3],
            "tail_mass": [0.002, 0.003, 0.004],
            "gravity": [0, 1, 9.8],
        },
    ],
    ids="-".join,
)
def test_parameters_of_runs_are_those_of_models(own):
    vectors = tail().parameters_of_runs(own, 3).vectors
    models = [
        tail().with_parameters(**{name: values[k] for name, values in own.items()})
        for k in range(3)
    ]
    np.testing.assert_array_equal(vectors, [model.parameter_vector for model in models])


def test_the_ground_may_differ_from_run_to_run():
    q, v = starts(rat(), 3)
    own, settings = (
        {"mu": [0.0, 0.5, 1.0], "K_n": [500.0, 1000.0, 2000.0]},
        {"legs": LEGS, "t_span": 0.2},
    )
    found = st.simulate(rat(), q, v, parameters=own, **settings)
    for k in range(3):
        model = rat().with_parameters(mu=own["mu"][k], K_n=own["K_n"][k])
        flight = st.simulate(model, q[k], v[k], **settings)
        np.testing.assert_array_equal(found.q[k], flight.q)
        np.testing.assert_array_equal(found[k].contact.forces, flight.contact.forces)


def test_the_stiffest_run_chooses_the_method():
    q, v = starts(tail(), 3)
    settings = {"controller": st.Damping(1e-2), "t_span": 0.01}
    light = {"tail_mass": [0.1, 0.1, 0.001]}
    methods = [
        st.simulate(tail().with_parameters(tail_mass=m), q[0], v[0], **settings)
        for m in (0.1, 0.001)
    ]
    assert [flight.info["method"] for flight in methods] == ["tsit5", "ros34pw2"]
    assert st.simulate(tail(), q, v, parameters=light, **settings).info["method"] == "ros34pw2"
    assert (
        st.simulate(tail(), q[:2], v[:2], parameters={"tail_mass": [0.1, 0.1]}, **settings).info[
            "method"
        ]
        == "tsit5"
    )


# Order and sharing.


def test_runs_do_not_depend_on_their_order_or_on_threads(monkeypatch):
    q, v = starts(tail(), 40)
    settings = {"t_span": 0.02, "controller": DAMPING, "method": "tsit5"}
    own = np.random.default_rng(2).uniform(0.002, 0.005, 40)
    order = np.random.default_rng(3).permutation(40)
    found = []
    for threads in (1, 7):
        monkeypatch.setattr(rollouts, "cores", lambda threads=threads: threads)
        found.append(st.simulate(tail(), q, v, parameters={"tail_mass": own}, **settings))
        found.append(
            st.simulate(
                tail(), q[order], v[order], parameters={"tail_mass": own[order]}, **settings
            )
        )
        assert [each.info["threads"] for each in found[-2:]] == [threads] * 2
    for name in PER_RUN:
        first = getattr(found[0], name)
        np.testing.assert_array_equal(getattr(found[2], name), first)
        for other in found[1::2]:
            np.testing.assert_array_equal(getattr(other, name), first[order])


def test_a_single_state_is_repeated():
    q, v = starts(tail(), 3)
    settings = {"t_span": 0.01, "step": 1e-3}
    for state in ((q[0], v), (q, v[0])):
        found = st.simulate(tail(), *state, **settings)
        same(
            found, alone(tail(), *(np.broadcast_to(a, (3, a.shape[-1])) for a in state), **settings)
        )


def test_one_row_is_one_of_many():
    q, v = starts(tail(), 1)
    found = st.simulate(tail(), q, v, t_span=0.01)
    assert len(found) == 1 and found.q.shape == (1, 201, NQ)
    np.testing.assert_array_equal(found[-1].q, found.q[0])
    with pytest.raises(IndexError):
        found[1]


def test_arguments_are_left_alone_and_results_are_read_only():
    q, v = starts(rat(), 2)
    given = [a.copy() for a in (q, v)]
    bristles = np.full((2, sum(rat().contacts.values()), 2), 1e-5)
    found = st.simulate(rat(), q, v, legs=LEGS, t_span=0.1, bristles0=bristles)
    np.testing.assert_array_equal([*q.ravel(), *v.ravel()], [*given[0].ravel(), *given[1].ravel()])
    assert (bristles == 1e-5).all() and (found.bristles[:, 0] == 1e-5).all()
    with pytest.raises(ValueError, match="read-only"):
        found.q[0, 0, 0] = 1


def test_rollouts_can_be_pickled():
    q, v = starts(rat(), 2)
    found = st.simulate(rat(), q, v, legs=LEGS, t_span=0.1, parameters={"mu": [0.3, 0.6]})
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again[1].contact.forces, found[1].contact.forces)


# Failures.

PUSHED = {
    "t_span": (5, 6),
    "controller": st.TorqueTable([5.0], [[1e-4] * NT]),
    "output_step": 0.05,
    "method": "tsit5",
}


@pytest.mark.parametrize("threads", [1, 3])
def test_a_run_that_fails_loses_no_other(monkeypatch, threads):
    monkeypatch.setattr(rollouts, "cores", lambda: threads)
    q, v = starts(tail(), 5)
    v[2] *= 1e160  # overflows at once
    v[4] *= 100  # takes too many steps
    settings = PUSHED | {"most_steps": 600}
    found = st.simulate(tail(), q, v, **settings)
    for k in range(5):
        try:
            flight = st.simulate(tail(), q[k], v[k], **settings)
        except st.SimulationError as error:
            own = found.errors[k]
            assert str(own) == str(error) and isinstance(own, st.SimulationError)
            with pytest.raises(st.SimulationError) as caught:
                found[k]
            assert caught.value is own
            flight, rows = (
                error.trajectory,
                0 if error.trajectory is None else len(error.trajectory.t),
            )
            assert (own.trajectory is None) == (flight is None)
            assert rows or np.isnan(found.kinetic[k]).all()
        else:
            assert found.errors[k] is None
            rows = len(flight.t)
        for name in PER_RUN:
            array = getattr(found, name)[k]
            assert np.isnan(array[max(rows, 1) :]).all()
            if rows:
                np.testing.assert_array_equal(array[:rows], getattr(flight, name))
    assert [error is None for error in found.errors] == [True, True, False, True, False]
    assert "most_steps" in str(found.errors[4]) and len(found.errors[4].trajectory.t) > 1
    assert 5 < found.ends[4] < 6 and found.ends[0] == 6


def test_an_energy_beyond_numbers_is_its_runs_error():
    q, v = starts(tail(), 3)
    v[1] = [1e200] + [0] * (NV - 1)
    found = st.simulate(tail(), q, v, t_span=0.5, output_step=0.1, step=0.1)
    assert "energy: the result of state 0 is not finite" in str(found.errors[1])
    assert np.isnan(found.kinetic[1]).all() and np.isfinite(found.kinetic[[0, 2]]).all()


def test_a_function_of_python_runs_in_the_calling_thread():
    q, v = starts(tail(), 4)
    threads = set()

    def law(t, q, v):
        threads.add(threading.current_thread())
        return [0.0] * NT

    assert st.simulate(tail(), q, v, t_span=0.01, controller=law).info["threads"] == 1
    assert threads == {threading.current_thread()}


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_what_a_function_raises_ends_all_but_a_simulation_error_its_run(method):
    q, v = starts(tail(), 3)
    q[1, 0] = 50.0

    def law(error):
        def torque(t, q, v):
            if q[0] > 40 and t > 0.005:
                raise error
            return [0.0] * NT

        return torque

    settings = {"t_span": 0.01, "output_step": 1e-3, "method": method}
    with pytest.raises(KeyError, match="mine"):
        st.simulate(tail(), q, v, controller=law(KeyError("mine")), **settings)
    found = st.simulate(tail(), q, v, controller=law(st.SimulationError("mine")), **settings)
    assert [str(error) for error in found.errors] == ["None", "mine", "None"]
    assert len(found.errors[1].trajectory.t) > 2


@pytest.mark.parametrize("threads", [1, 2])
def test_a_compiled_torque_that_refuses_ends_its_run(monkeypatch, threads):
    monkeypatch.setattr(rollouts, "cores", lambda: threads)
    real = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, q, _v, _tau):
        return int(q[0] > 40 and t > 0.005)

    q, v = starts(tail(), 3)
    q[1, 0] = 50.0
    found = st.simulate(
        tail(), q, v, t_span=0.01, controller=st.NativeTorque(torque), method="tsit5"
    )
    assert [error is None for error in found.errors] == [True, False, True]
    assert "the compiled torque function did not return 0" in str(found.errors[1])


@pytest.mark.parametrize("many", [1, 10**12], ids=["abreast", "alone"])
def test_ctrl_c_ends_all_threads_within_a_second(monkeypatch, many):
    monkeypatch.setattr(rollouts, "cores", lambda: 2)
    monkeypatch.setattr(batched_runs, "MIN_BATCHED_STEPS", many)
    monkeypatch.setattr(batched_runs, "MAX_SHARED_STEPS", 10**12)
    q, v = starts(tail(), 50)
    tail().batch_library.rollouts.function(
        "tail_side_by_side_flights"
    )  # compiled before the clock runs
    before, asked = threading.active_count(), []

    def ask():
        asked.append(time.monotonic())
        signal.raise_signal(signal.SIGINT)

    timer = threading.Timer(1.5, ask)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        st.simulate(tail(), q, v, t_span=20, step=1e-5, method="rk4", output_step=20)
    assert time.monotonic() - asked[0] < 1
    timer.join()
    assert threading.active_count() == before


# Flights abreast: by rk4, lanes of vectors.


@pytest.fixture
def any_number_is_many(monkeypatch):
    monkeypatch.setattr(batched_runs, "MIN_BATCHED_STEPS", 1)


LAWS = {
    "none": None,
    "damping": st.Damping((1e-6, 2e-6, 3e-6, 4e-6)),
    "table": st.TorqueTable(
        [0.0, 0.0123, 0.031], np.outer([1, -1, 2], [1e-5, 2e-5, -1e-5, 1e-5]), 1e-6
    ),
    "jumps": st.TorqueCurve(
        st.Piecewise(
            np.array([0.01, 0.0207, 0.04]), 1e-5 * np.array([[[1.0, 0]] * NT, [[-2.0, 9]] * NT])
        )
    ),
}
FLIGHT = {"t_span": (0.005, 0.05), "method": "rk4", "step": 3e-4, "output_step": 5e-3}


def near(rollouts, flights, digits=1e-11):
    """Assert that all arrays of rollouts are those of single flights but for rounding."""
    for name in PER_RUN:
        expected = np.array([getattr(flight, name) for flight in flights])
        error = np.abs(getattr(rollouts, name) - expected).max()
        assert error <= digits * max(np.abs(expected).max(), 1e-9), (name, error)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_flights_abreast_are_what_they_are_alone(law):
    q, v = starts(tail(), 19)
    settings = FLIGHT | {"controller": law}
    flights = alone(tail(), q, v, **settings)
    for count in (2, 8, 9, 19):
        found = st.simulate(tail(), q[:count], v[:count], **settings)
        assert found.info["abreast"] == 8 and found.errors == [None] * count
        near(found, flights[:count])
        assert found[1].info["steps"] == flights[1].info["steps"]
        assert found.info["evaluations"] == sum(
            flight.info["evaluations"] for flight in flights[:count]
        )


FORMS = {
    "loops": ((2, 2), {"emission": "loops"}, 1e-11),
    "baked": ((2, 2), {"baked": True}, 1e-11),
    "float": ((2, 2), {"real": "float"}, 1e-3),
    "continuum": ((2, None), {}, 1e-11),
}


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize(("sizes", "options", "digits"), FORMS.values(), ids=FORMS)
def test_every_form_of_a_model_flies_abreast(sizes, options, digits):
    model = st.load(model_folder(*sizes, name="form", functions=WANTED, **options))
    q, v = starts(model, 9)
    settings = FLIGHT | {"controller": LAWS["table"]}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == (16 if options.get("real") == "float" else 8)
    near(found, alone(model, q, v, **settings), digits)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", [None, LAWS["damping"]], ids=["none", "damping"])
def test_the_reproducible_profile_gives_the_same_bits(law):
    model = st.load(tail().folder, profile="reproducible")
    q, v = starts(model, 11)
    settings = {"t_span": 0.05, "method": "rk4", "step": 1e-3, "controller": law}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == 8
    same(found, alone(model, q, v, **settings))


@pytest.mark.usefixtures("any_number_is_many")
def test_each_lane_has_its_own_parameters():
    q, v = starts(tail(), 11)
    rng = np.random.default_rng(1)
    own = {"tail_mass": rng.uniform(0.002, 0.02, 11), "tail_mount": 0.02 * rng.normal(size=(11, 3))}
    found = st.simulate(tail(), q, v, parameters=own, **FLIGHT)
    models = [
        tail().with_parameters(**{name: values[k] for name, values in own.items()})
        for k in range(11)
    ]
    near(found, [st.simulate(model, q[k], v[k], **FLIGHT) for k, model in enumerate(models)])


@pytest.mark.usefixtures("any_number_is_many")
def test_a_flight_that_fails_abreast_loses_no_other():
    q, v = starts(tail(), 12)
    v[2] *= 1e160
    found = st.simulate(tail(), q, v, **FLIGHT)
    with pytest.raises(st.SimulationError) as caught:
        st.simulate(tail(), q[2], v[2], **FLIGHT)
    assert [k for k in range(12) if found.errors[k]] == [2] and str(found.errors[2]) == str(
        caught.value
    )
    others = [k for k in range(12) if k != 2]
    for k in others:
        flight = st.simulate(tail(), q[k], v[k], **FLIGHT)
        np.testing.assert_allclose(found.q[k], flight.q, rtol=0, atol=1e-12)
    assert np.isnan(found.q[2, 1:]).all()


def test_few_steps_compile_nothing_and_other_laws_fly_alone(monkeypatch):
    built = []
    compiled = compile_library
    monkeypatch.setattr(
        "serpentail.model.batch.compile_library", lambda *a: built.append(a) or compiled(*a)
    )
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 1 and not built
    monkeypatch.setattr(batched_runs, "MIN_BATCHED_STEPS", 1)
    laws = [st.Phases([(0.0, None), (0.02, DAMPING)]), lambda t, q, v: [0.0] * NT]
    laws.append(st.Pfl(model, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])))
    for settings in ({"method": "tsit5", "step": None}, *({"controller": law} for law in laws)):
        own = {name: x for name, x in (FLIGHT | settings).items() if x is not None}
        assert st.simulate(model, q, v, **own).info["abreast"] == 1
    assert not built
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 8 and len(built) == 1
    st.simulate(model.with_parameters(torso_mass=1.0), q, v, **FLIGHT)
    assert len(built) == 1


def test_the_models_library_has_no_lanes():
    """Batches and flights are compiled when they are needed."""
    for name in ("side_by_side_forward_dynamics", "side_by_side_flights"):
        with pytest.raises(AttributeError):
            getattr(tail().library, f"tail_{name}")


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


def test_bodies_of_unlike_size_in_one_run_are_warned_of_where_it_is_called():
    with pytest.warns(st.UnlikeBodies, match=r"unlike by 3\.9e\+06") as caught:
        st.simulate(
            tail(), Q, V, parameters={"tail_length": [0.2, 200.0, 0.2, 0.2]}, t_span=1e-3, step=1e-3
        )
    assert caught[0].filename == __file__


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
