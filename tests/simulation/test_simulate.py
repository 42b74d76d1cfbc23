"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import functools
import warnings

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from tests.support.models import model_folder

SEGMENTS, LINKS = 2, 2
NQ, NV, NT = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS
WANTED = ["mass_matrix", "forward_dynamics", "energy", "momentum", "tail_points", "rollout"]
Q0 = np.array([0.1, -0.2, 0.3, 0.8, -0.4, 0.4, 0.2, 0.5, -0.4, 0.3, 0.6])
V0 = np.array([0.3, -0.5, 1.2, 4.0, -2.0, 3.0, 8.0, -6.0, 5.0, 7.0])
DAMPING = (2e-6, 1e-6, 3e-6, 4e-6)  # N m s, small enough for a tail that swings
METHODS = {name: {"method": name} for name in ("rk4", "tsit5", "dop853")}
both = pytest.mark.parametrize("settings", METHODS.values(), ids=METHODS)
TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-15}


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(SEGMENTS, LINKS, name="tail", functions=WANTED))


@pytest.fixture(scope="module")
def fly(model):
    """Simulate from Q0, V0."""
    return functools.partial(st.simulate, model, Q0, V0)


@pytest.fixture(scope="module")
def tight(fly):
    """A quarter of a second without torques, as exact as can be."""
    return fly(t_span=0.25, **TIGHT)


def total_mass(model):
    return model.parameters["torso_mass"] + model.parameters["tail_mass"]


def centre_of_mass(model, flight):
    """Centre of mass (K, 3) from the positions of torso and links."""
    points = model.tail_points(flight.q)
    links = (points[:, 1:] + points[:, :-1]) / 2
    torso, tail = model.parameters["torso_mass"], model.parameters["tail_mass"]
    return (torso * flight.q[:, :3] + tail * links.mean(axis=1)) / (torso + tail)


def error(flight, reference):
    """Largest difference of states."""
    return max(
        np.abs(flight.q - reference.q).max(),
        np.abs(flight.v - reference.v).max() / np.abs(V0).max(),
    )


# Methods


def test_rk4_has_order_four(fly, tight):
    errors = [error(fly(t_span=0.25, step=step), tight) for step in (1.25e-3, 6.25e-4, 3.125e-4)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] > 1e-11 and ((orders > 3.7) & (orders < 4.4)).all(), (errors, orders)


def test_methods_agree(fly, tight):
    assert error(fly(t_span=0.25, step=1e-5), tight) < 1e-11
    assert error(fly(t_span=0.25, method="rk4"), tight) < 1e-7
    assert error(fly(t_span=0.25, rtol=1e-10), tight) < 1e-8
    assert error(fly(t_span=0.25, method="lsoda"), tight) < 1e-6
    assert error(fly(t_span=0.25, method="dop853"), tight) < 1e-7


@both
def test_velocities_are_the_rates_of_positions(fly, settings):
    flight = fly(t_span=0.05, output_step=1e-4, **settings)
    rates = (flight.q[2:] - flight.q[:-2]) / 2e-4
    assert np.abs(rates[:, :3] - flight.v[1:-1, :3]).max() < 1e-3
    assert np.abs(rates[:, 7:] - flight.v[1:-1, 6:]).max() < 1e-2
    w, turn = flight.q[1:-1, 3], flight.q[1:-1, 4:7]
    omega = 2 * (w[:, None] * rates[:, 4:7] - rates[:, 3:4] * turn - np.cross(turn, rates[:, 4:7]))
    assert np.abs(omega - flight.v[1:-1, 3:6]).max() < 1e-2


@both
def test_quaternion_stays_on_the_unit_sphere(fly, settings):
    norms = np.linalg.norm(fly(t_span=0.25, **settings).attitude, axis=1)
    assert np.abs(norms - 1).max() < 1e-15


def test_flight_does_not_depend_on_where_it_is_sampled(fly):
    often, seldom = (fly(t_span=0.1, output_step=step) for step in (1e-3, 1e-2))
    np.testing.assert_array_equal(often.q[::10], seldom.q)
    np.testing.assert_array_equal(often.v[::10], seldom.v)


def test_norm_of_the_first_quaternion_does_not_matter(model, fly):
    scaled = Q0 * ([1] * 3 + [2.0**30] * 4 + [1] * NT)
    np.testing.assert_array_equal(st.simulate(model, scaled, V0, t_span=0.02).q, fly(t_span=0.02).q)


def test_arguments_are_left_alone(model):
    q0, v0 = Q0 * 2, V0.copy()
    st.simulate(model, q0, v0, t_span=0.01)
    np.testing.assert_array_equal([*q0, *v0], [*(Q0 * 2), *V0])


# Conservation


@pytest.mark.parametrize(("settings", "drift"), [({}, 1e-8), (TIGHT, 1e-12)], ids=["rk4", "dop853"])
def test_free_flight_conserves(model, fly, settings, drift):
    flight = fly(t_span=0.25, **settings)
    assert not flight.tau.any()
    assert np.abs(flight.energy - flight.energy[0]).max() < drift * flight.kinetic.max()
    angular, linear = flight.angular_momentum, flight.linear_momentum
    assert np.abs(angular - angular[0]).max() < drift * np.linalg.norm(angular[0])
    fallen = linear + np.outer(flight.t, [0, 0, total_mass(model) * model.parameters["gravity"]])
    assert np.abs(fallen - linear[0]).max() < drift * np.linalg.norm(linear[0])
    assert np.ptp(flight.kinetic) > 1e-3 * flight.kinetic.max()


@pytest.mark.parametrize("gravity", [0.0, 9.8])
def test_centre_of_mass_flies_a_parabola(model, gravity):
    flight = st.simulate(model.with_parameters(gravity=gravity), Q0, V0, t_span=0.25, **TIGHT)
    centres, t = centre_of_mass(model, flight), flight.t[:, None]
    speed = flight.linear_momentum[0] / total_mass(model)
    parabola = centres[0] + speed * t - gravity * t**2 / 2 * [0, 0, 1]
    np.testing.assert_allclose(centres, parabola, atol=1e-13)
    assert np.abs(flight.q[:, :3] - centres).max() > 1e-3


@pytest.mark.parametrize(
    "controller",
    [st.Damping(DAMPING), lambda t, q, v: -np.array(DAMPING) * v[6:]],
    ids=["Damping", "function"],
)
def test_damping_takes_energy_by_its_power(model, fly, controller):
    flight = fly(
        t_span=0.25, controller=controller, output_step=1.25e-4, method="tsit5", rtol=1e-10
    )
    power = flight.v[:, 6:] ** 2 @ DAMPING
    lost = flight.energy[0] - flight.energy[-1]
    assert lost > 1e-3 * flight.kinetic[0]
    assert lost == pytest.approx(simpson(power, x=flight.t), rel=1e-8)
    angular = flight.angular_momentum
    assert np.abs(angular - angular[0]).max() < 1e-8 * np.linalg.norm(angular[0])


def test_torques_work(fly):
    """Energy changes by the work of the torques."""
    flight = fly(
        t_span=0.25,
        controller=lambda t, q, v: 1e-5 * np.cos(9 * t + np.arange(NT)),
        output_step=1.25e-4,
    )
    work = simpson((flight.tau * flight.v[:, 6:]).sum(axis=1), x=flight.t)
    assert abs(work) > 1e-6 and flight.energy[-1] - flight.energy[0] == pytest.approx(
        work, rel=1e-6
    )


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
    function = lambda t, q, v: interpolated(t) - damping * v[6:]  # noqa: E731
    user = fly(controller=st.Phases([(t, function) for t in (2.0, *NODES)]), **span, **settings)
    np.testing.assert_allclose(user.q, flight.q, rtol=0, atol=1e-9)


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


# What is refused


LAST = [*Q0[:-1], np.nan]


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ((Q0[:-1], V0), rf"q0 has shape \({NQ - 1},\), not \({NQ},\)"),
        ((Q0, [*V0, 0]), rf"v0 has shape \({NV + 1},\), not \({NV},\)"),
        (([[Q0]], V0), r"q0 has shape \(1, 1, \d+\).*one start state"),
        ((0.0, V0), r"q0 has shape \(\)"),
        ((None, V0), "q0: type .*: needs real numbers"),
        (([[1], [1, 2]], V0), "q0: type .*: needs real numbers"),
        (([str(x) for x in Q0], V0), "q0: type .*: needs real numbers"),
        ((Q0, V0.astype(complex)), "v0: type .*: needs real numbers"),
        ((Q0, V0 > 0), "v0: type .*: needs real numbers"),
        ((LAST, V0), rf"q0\[{NQ - 1}\]: value .*: needs a finite number"),
        ((Q0, [np.inf, *V0[1:]]), r"v0\[0\]: value .*: needs a finite number"),
        ((np.zeros(NQ), V0), r"q0\[3:7\] is the zero quaternion: upright is \(1, 0, 0, 0\)"),
    ],
)
def test_wrong_start_is_named(model, start, words):
    with pytest.raises(st.StateError, match=words):
        st.simulate(model, *start)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        *[
            ({"t_span": span}, "t_span")
            for span in (0, -1, (1, 1), (2, 1), (0, np.nan), (0, np.inf), (0, 1, 2), "1")
        ],
        *[
            ({"t_span": span}, "t_span")
            for span in (None, (), [[0], [1]], ("0", "1"), (0, None), True, (0, 1j))
        ],
        *[
            ({name: x}, name)
            for name in ("step", "output_step")
            for x in (0, -1e-3, np.nan, np.inf, "1", True, [1], 1j)
        ],
        *[({"method": "dop853", name: 0}, name) for name in ("rtol", "atol")],
        (
            {"method": "euler"},
            "method: value 'euler': needs 'auto' or 'rk4' or 'tsit5' or 'dop853' or 'lsoda'",
        ),
        ({"method": "rk4", "rtol": 1e-6}, "rk4 has no setting 'rtol'; it has step, output_step"),
        ({"step": 1e-6, "rtol": 1e-6}, "rk4 has no setting 'rtol'; it has step, output_step"),
        (
            {"method": "dop853", "step": 1},
            "dop853 has no setting 'step'; it has rtol, atol, output_step",
        ),
        ({"stp": 1}, "no setting 'stp'"),
        (
            {"controller": 3.0},
            "controller: value 3.0: needs None, Damping, TorqueTable, .* or a function",
        ),
        *[
            ({"controller": st.Damping(d)}, "damping")
            for d in (-1.0, np.nan, (1, 2), "1", None, [[0.0] * NT])
        ],
        (
            {"controller": st.TorqueTable([0, 1], [[0] * NT])},
            r"times \(2,\) and torques \(1, 4\), not \(K,\) and \(K, 4",
        ),
        ({"controller": st.TorqueTable([], [])}, "TorqueTable"),
        ({"controller": st.TorqueTable(0, [0] * NT)}, "TorqueTable"),
        ({"controller": st.TorqueTable([1, 1], [[0] * NT] * 2)}, "needs increasing times"),
        (
            {"controller": st.TorqueTable([0], [[np.nan] * NT])},
            r"\]: value nan: needs a finite number",
        ),
        (
            {"controller": st.TorqueTable(["0"], [[0] * NT])},
            "TorqueTable: times: type .*: needs real numbers",
        ),
        (
            {"controller": st.TorqueTable([0, 1], [[0] * NT, [0]])},
            "TorqueTable: torques: type .*: needs real numbers",
        ),
        (
            {"controller": st.TorqueTable([0], [[0] * NT], damping=-1)},
            "damping: value -1: needs one or .* numbers from 0",
        ),
    ],
)
def test_wrong_setting_is_named(fly, settings, words):
    with pytest.raises(st.SimulationError, match=words):
        fly(**settings)


@pytest.mark.parametrize("left_out", ["rollout", "energy", "momentum"])
def test_function_left_out_is_named_before_the_flight(left_out):
    wanted = [
        each for each in ("forward_dynamics", "energy", "momentum", "rollout") if each != left_out
    ]
    model = st.load(model_folder(1, 1, name="tail", functions=wanted))
    with pytest.raises(
        st.ModelError, match=f"tail was generated without '{left_out}' .*add it to `functions`"
    ):
        st.simulate(
            model,
            [0, 0, 0, 1, 0, 0, 0, 0, 0],
            [0] * 8,
            controller=lambda *_: pytest.fail("was called"),
        )


# Runs that diverge


PUSH = st.TorqueTable([0], [[1e6] * NT])


@pytest.mark.parametrize(
    ("start", "settings"),
    [
        (V0, {"controller": PUSH, "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": lambda t, q, v: [1e6] * NT, "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": lambda t, q, v: 1e3 * v[6:], "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": st.TorqueTable([0], [[1e300] * NT]), "method": "dop853"}),
        (V0 * 1e160, {"method": "dop853"}),
        (V0 * 1e160, {}),
    ],
    ids=["table", "function", "feedback", "dop853", "dop853 at once", "rk4 at once"],
)
def test_diverging_run_names_the_time(model, start, settings):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(st.SimulationError, match=r"^at t = 5(\.\d+)? s .*: is the ") as caught:
            st.simulate(model, Q0, start, **{"t_span": (5, 6)} | settings)
    assert caught.value.__cause__ is None


def test_energy_beyond_numbers_names_the_sample(model):
    fast = [1e200] + [0] * (NV - 1)
    with pytest.raises(
        st.SimulationError,
        match=r"^from t = 5 s to 5\.5 s, by sample: energy: the result of state 0 is not",
    ):
        st.simulate(model, Q0, fast, t_span=(5, 5.5), step=0.1, output_step=0.1)


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
