"""Plans that choose parts of their start: the best of many ordinary plans, and true."""

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import angle_deg, pitch_roll_yaw
from tests.support.tumbling import AGAIN, DURATION, integrated, planned, rat, start

RATES = 6.0  # rad/s
FREE = {"tail": (-0.5, 0.5), "tail_rate": (-RATES, RATES)}


def freed(model=None, **settings) -> st.Plan:
    """A plan whose start is free, as far as the settings say."""
    model = rat() if model is None else model
    return st.plan(model, **AGAIN | {"start": start(rat()), "guess": planned()} | settings)


def one_rate(model, value) -> tuple[np.ndarray, np.ndarray]:
    """The start with another rate of the tail's first coordinate."""
    q, v = start(model)
    v[6] = value
    return q, v


@pytest.fixture(scope="module")
def chosen() -> st.Plan:
    """The start of least effort, on a mesh that is fine enough."""
    settings = {"bounds": st.Bounds(angle=np.pi / 3), "track": False}
    return st.plan(rat(), start=start(rat()), duration=DURATION, free_start=FREE, **settings)


def test_the_plan_is_true_from_the_found_start(chosen):
    q0, v0 = chosen.start
    assert chosen.success and chosen.report["start"] == {
        "tail": q0[7:].tolist(),
        "tail_rate": v0[6:].tolist(),
    }
    assert (np.abs(q0[7:]) <= 0.5).all() and (np.abs(v0[6:]) <= RATES).all()
    given = start(rat())
    np.testing.assert_array_equal(q0[:7], given[0][:7])
    np.testing.assert_array_equal(v0[:6], given[1][:6])
    q, v = integrated(rat(), chosen)
    end = chosen.trajectory
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), end.attitude[-1]) < 0.011
    np.testing.assert_allclose(v[3:], end.v[-1, 3:], atol=0.01)


def test_the_momentum_follows_from_the_found_start(chosen):
    wanted = rat().momentum(*chosen.start)[1]
    given = rat().momentum(*start(rat()))[1]
    assert np.linalg.norm(wanted - given) > 1e-3 * np.linalg.norm(given)
    flight = chosen.trajectory
    np.testing.assert_allclose(
        flight.angular_momentum, np.tile(wanted, (len(flight.t), 1)), atol=1e-12
    )


def test_no_ordinary_plan_is_better():
    """Over one rate of the tail: plans from known starts on the same mesh, by compiled C."""
    other = start(rat())[1][7]
    free = {"tail_rate": ((-RATES, other), (RATES, other))}
    plan = freed(free_start=free)
    best, rate = plan.report["objective"], plan.start[1][6]
    assert plan.report["converged"] and abs(rate) < RATES - 0.5

    def ordinary(value):
        return freed(start=one_rate(rat(), value), guess=plan).report["objective"]

    assert ordinary(rate) == pytest.approx(best, rel=1e-6)
    near = [ordinary(rate + step) for step in (-0.2, 0.2)]
    assert min(near) > best
    vertex = rate + 0.1 * (near[0] - near[1]) / (near[0] + near[1] - 2 * best)
    assert vertex == pytest.approx(rate, abs=0.02)
    far = [ordinary(value) for value in np.linspace(-RATES, RATES, 5)]
    assert min(far) > best * (1 - 1e-6)


def test_a_range_of_no_width_is_no_choice():
    q, v = start(rat())
    narrow = {"tail_rate": (v[6:], v[6:] + 1e-12), "tail": (q[7:], q[7:] + 1e-12)}
    same, again = freed(free_start=narrow), freed()
    assert same.report["objective"] == pytest.approx(again.report["objective"], rel=1e-6)
    times = np.linspace(0, DURATION, 50)
    np.testing.assert_allclose(same.torque(times), again.torque(times), atol=1e-6)


@pytest.mark.parametrize("formulation", ["translation-free", "full"])
def test_formulations_choose_the_same(chosen, formulation):
    plan = freed(formulation=formulation, free_start=FREE, guess=chosen)
    assert plan.report["converged"]
    assert plan.report["objective"] == pytest.approx(chosen.report["objective"], rel=1e-3)
    np.testing.assert_allclose(plan.start[1], chosen.start[1], atol=0.05)


def test_attitude_and_torso_rate_may_be_free():
    """Upright at the end is easier from a start that is nearly upright."""
    free = {"attitude": ((0.2, 0, 0), (0.9, 0, 0)), "torso_rate": (-1, 1)}
    plan = freed(attitude="euler", free_start=free, guess=None)
    assert plan.report["converged"]
    q0, v0 = plan.start
    angles = pitch_roll_yaw(q0)
    assert angles[0] + 1e-12 >= 0.2 and angles[0] < 0.9
    np.testing.assert_allclose(angles[1:], 0, atol=1e-9)
    assert (np.abs(v0[3:6]) <= 1).all()
    q, _ = integrated(rat(), plan)
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), plan.trajectory.attitude[-1]) < 0.1


def test_a_path_holds_from_the_start_on():
    """The lowest throw begins at the floor, though no node of Radau's rule is at the start."""
    floor = 0.32
    settings = {
        "path": ((lambda point: point.height, floor, np.inf),),
        "objective": lambda point: ca.sumsqr(point.torque / 1e-3) + 100 * point.height,
        "free_start": {"position": ((0, 0, 0.2), (0, 0, 0.5))},
    }
    plan = freed(**settings)
    assert plan.report["converged"]
    assert plan.start[0][2] == pytest.approx(floor, rel=1e-6)
    assert plan.trajectory.q[:, 2].min() >= floor * (1 - 1e-3)


def test_both_at_once_and_again(chosen):
    """Start and length; the plan of both is a guess for the next, in another formulation, too."""
    plan = freed(free_start=FREE, design={"tail_length": (0.08, 0.25)}, guess=chosen)
    assert plan.report["converged"]
    assert plan.report["objective"] < chosen.report["objective"]
    model = rat().with_parameters(**plan.design)
    known = freed(model, start=plan.start, guess=plan)
    assert known.report["objective"] == pytest.approx(plan.report["objective"], rel=1e-6)
    full = freed(
        formulation="full", free_start=FREE, design={"tail_length": (0.08, 0.25)}, guess=plan
    )
    assert full.design["tail_length"] == pytest.approx(plan.design["tail_length"], rel=1e-2)


@pytest.mark.slow
def test_least_energy_needs_slower_torques():
    """Without a bound of torque rates the best motion has pulses that no mesh resolves."""
    bounds = st.Bounds(angle=np.pi / 3, torque_rate=1.0)
    settings = {"objective": "energy", "guess": None, "tolerance": 0.01, "bounds": bounds}
    known, free = freed(**settings), freed(**settings, free_start=FREE)
    assert known.success and free.success
    assert free.report["energy_J"] < known.report["energy_J"]


@pytest.mark.slow
def test_least_time_and_several_guesses():
    settings = {"duration": (0.1, DURATION), "bounds": st.Bounds(angle=np.pi / 3, torque=0.005)}
    settings |= {"objective": "time", "guess": None, "tolerance": 0.01, "multi_start": 3}
    both = {"free_start": FREE, "design": {"tail_length": (0.08, 0.25)}}
    known, free, all_free = (freed(**settings, **more) for more in ({}, {"free_start": FREE}, both))
    assert known.success and free.success and all_free.success
    assert all_free.duration < free.duration < known.duration


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"free_start": 3}, "free_start: value 3: needs a mapping of parts of the start"),
        ({"free_start": {"tails": (0, 1)}}, "free_start: part: value 'tails': did you mean 'tail'"),
        ({"free_start": {"tail": 0.1}}, "free_start.tail: value 0.1: needs (least, most)"),
        ({"free_start": {"tail": (1, 0)}}, "free_start.tail: value (1, 0): needs least below most"),
        ({"free_start": {"tail": (1, 1)}}, "needs least below most"),
        (
            {"free_start": {"tail": ((0, 0, 0), 1)}},
            "free_start.tail: value (0, 0, 0): needs",
        ),
        ({"free_start": {"torso_rate": (0, np.inf)}}, "free_start.torso_rate: value inf"),
        ({"free_start": {"attitude": (0, 1)}}, "free_start.attitude: is of pitch, roll and yaw"),
        ({"free_start": {"tail": (1.2, 1.3)}}, "bounds.angle: the start's tail coordinate 0"),
        ({"free_start": FREE, "solver": "fatrop"}, "'fatrop': free_start is given: it takes"),
    ],
)
def test_wrong_ranges_are_refused(changes, words):
    with pytest.raises(st.PlanningError) as caught:
        freed(guess=None, **changes)
    assert words in str(caught.value)
