"""Elastic tails in simulations: books of long runs, stops, methods, tracking."""

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.numbers import com_rise
from tests.references.passive import PassiveTail
from tests.support.elastic import ALL, SIZES, SPRING, STOPS, bent, of_parameters

# ---- books ---------------------------------------------------------------------------------------

METHODS = {"tsit5": (1e-5, 1e-7, 1e-9), "ros34pw2": (1e-3, 1e-5, 1e-7), "dop853": (1e-6, 1e-9)}


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("part", ["spring", "all"])
def test_energy_balances_over_long_runs_and_better_with_tolerance(name, method, part):
    """Kinetic, potential and stored energy and what damping lost, over 5 s of tumbling flight."""
    model = of_parameters(name, SPRING if part == "spring" else ALL)
    q, v = bent(model, [0.5, -0.4, 0.3, 0.7])
    v[3:] = 1, 2, 3, 5, -5, 5, 5
    errors = []
    for rtol in METHODS[method]:
        run = st.simulate(model, q, v, t_span=5.0, method=method, rtol=rtol)
        share = run.info["imbalance"]["relative"]  # of the energy about the centre of mass
        most = 500 if method == "ros34pw2" else 100  # which is of low order, and the run is long
        assert share < most * rtol
        assert bool(run.info["warnings"]) == (share > 100 * rtol)
        work = run.info["work_J"]
        moved = model.energy(q, v)[0] + abs(work["damping"])
        left = run.energy[-1] - run.energy[0] - work["damping"] - work["torques"]
        assert left == pytest.approx(run.info["imbalance"]["energy_J"], abs=1e-12)
        assert (work["damping"] < -1e-4) == (part == "all") and work["torques"] == 0
        errors.append(abs(left) / moved)
    # over the kinetic energy of the start: springs move more than that; below 1e-9 is rounding
    assert errors[-1] < 2e-4 and errors[-1] < max(0.1 * errors[0], 1e-9)


def test_damping_of_the_tail_and_of_a_controller_add_up():
    model = of_parameters("chain", ALL)
    q, v = bent(model, [0.3, -0.2, 0.2, 0.1])
    v[6:] = 10
    own = model.with_parameters(tail_damping=3e-4)
    alone = st.simulate(own, q, v, t_span=0.5, rtol=1e-10, method="tsit5")
    both = st.simulate(
        model, q, v, t_span=0.5, rtol=1e-10, method="tsit5", controller=st.Damping(1e-4)
    )
    np.testing.assert_allclose(alone.tail, both.tail, atol=1e-8)
    assert alone.info["work_J"]["damping"] == pytest.approx(
        both.info["work_J"]["damping"], rel=1e-7
    )
    assert not alone.tau.any() and both.tau.any()


def test_work_of_the_tails_damping_is_the_integral_of_its_power():
    model = of_parameters("arcs", ALL)
    q, v = bent(model, [0.3, -0.2, 0.2, 0.1])
    run = st.simulate(model, q, v, t_span=0.2, output_step=1e-4, rtol=1e-9, method="tsit5")
    power = -ALL["tail_damping"] * (run.v[:, 6:] ** 2).sum(axis=1)
    assert run.info["work_J"]["damping"] == pytest.approx(np.trapezoid(power, run.t), rel=1e-4)


def test_a_rise_is_that_of_the_centre_of_mass_whatever_a_tail_stores():
    model = of_parameters("chain", SPRING)
    q, v = bent(model, 0.8)
    v[2] = 1.0
    run = st.simulate(model, q, v, t_span=0.3, rtol=1e-9, output_step=1e-4)
    expected = run.linear_momentum[0, 2] ** 2 / (2 * 9.8 * (0.10572 + 3.51e-3) ** 2)
    assert com_rise(model, run) == pytest.approx(expected, rel=1e-4)


# ---- stops ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SIZES)
def test_a_tail_thrown_at_its_stops_comes_back_with_its_energy(name):
    """20 rad/s at stops at 0.5 rad of 10 N m/rad: an overshoot of less than 0.1 rad stores it."""
    given = {"tail_stop_lower": -0.5, "tail_stop_upper": 0.5, "tail_stop_stiffness": 10.0}
    given |= {"tail_stop_width": 0.05, "gravity": 0}
    model = of_parameters(name, given)
    q, v = bent(model, 0.0)
    v[6] = 20.0
    run = st.simulate(model, q, v, t_span=1.0, rtol=1e-9, method="tsit5", output_step=1e-4)
    most = np.abs(run.tail).max(axis=0)
    kinetic = run.kinetic[0]
    assert most[0] > 0.5 and (most < 0.6).all()
    # what a stop stores at the largest way into it is at most all there was
    assert PassiveTail(given, 4).energy(most * np.eye(4)[0]) <= kinetic * (1 + 1e-9)
    np.testing.assert_allclose(run.energy, kinetic, rtol=5e-6)
    assert run.kinetic.min() < 0.9 * kinetic < run.kinetic[-2000:].max()
    # between the stops nothing acts
    free = of_parameters(name, given | {"tail_stop_lower": -3.0, "tail_stop_upper": 3.0})
    other = st.simulate(free, q, v, t_span=1.0, rtol=1e-9, method="tsit5", output_step=1e-4)
    before = np.flatnonzero(np.abs(run.tail).max(axis=1) > 0.5)[0]
    np.testing.assert_allclose(run.tail[:before], other.tail[:before], atol=1e-6)


@pytest.mark.parametrize("angle", [-0.61, 0.71])
def test_a_start_behind_its_stops_is_refused(angle):
    model = of_parameters("chain", STOPS)
    q, v = bent(model, [0, 0, angle, 0])
    end = "lower" if angle < 0 else "upper"
    with pytest.raises(st.StateError, match=f"coordinate 2 is {angle} rad, behind tail_stop_{end}"):
        st.simulate(model, q, v, t_span=0.01)
    with pytest.raises(st.StateError, match="behind tail_stop"):
        st.simulate(model, np.stack([bent(model, 0.0)[0], q]), v, t_span=0.01)
    st.simulate(model, *bent(model, 0.0), t_span=0.01)  # a run that waits
    with pytest.raises(st.StateError, match="behind tail_stop"):
        st.simulate(model, q, v, t_span=0.01)
    q[9] -= np.sign(angle) * 0.02  # on the way into a stop
    st.simulate(model, q, v, t_span=0.01)


# ---- methods and tracking ------------------------------------------------------------------------


def test_stiff_springs_get_a_method_for_them():
    model = of_parameters("arcs", SPRING)
    q, v = bent(model, 0.1)
    slow = st.simulate(model, q, v, t_span=0.01)
    assert slow.info["method"] == "tsit5" and "springs" in slow.info["reason"]
    stiff = model.with_parameters(tail_stiffness=50.0)
    run = st.simulate(stiff, q, v, t_span=0.01)
    mobility = np.linalg.inv(model.mass_matrix(q))[6:, 6:]
    fastest = np.sqrt(50.0 * np.linalg.eigvalsh(mobility).max())
    told = float(run.info["reason"].split(" at ")[1].split()[0])
    assert run.info["method"] == "ros34pw2" and told == pytest.approx(fastest, rel=0.05)
    # tracking makes up for springs
    held = st.Pfl(stiff, ([0.0, 0.01], np.tile(q[7:], (2, 1))))
    tracked = st.simulate(stiff, q, v, t_span=0.01, controller=held)
    assert tracked.info["method"] == "tsit5" and tracked.info["steps"] < 50


def test_implicit_steps_are_stable_far_beyond_a_stiff_tail():
    """Explicit steps would have to be below 1e-5 s; a damped tail comes to rest by 1 ms."""
    model = of_parameters("chain", ALL).with_parameters(tail_stiffness=300.0, tail_damping=1.0)
    q, v = bent(model, 0.16)
    run = st.simulate(model, q, v, t_span=0.5, method="implicit_euler", step=1e-3)
    np.testing.assert_allclose(run.tail[-1], ALL["tail_rest"], atol=1e-3)


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2"])
def test_a_passive_tail_is_tracked_as_one_without(method):
    model = of_parameters("chain", ALL)
    q, v = bent(model, 0.0)
    times = np.linspace(0, 0.5, 11)
    wanted = 0.4 * np.sin(8 * times)[:, None] * [1, -1, 0.5, 1]
    v[6:] = 0.4 * 8 * np.array([1, -1, 0.5, 1])
    run = st.simulate(
        model, q, v, t_span=0.5, controller=st.Pfl(model, (times, wanted)), method=method, rtol=1e-6
    )
    np.testing.assert_allclose(run.tail[::40], wanted[::2], atol=0.02)
    # the torques move the tail, and make up for what it asks for itself
    bare = of_parameters("chain", {"tail_stiffness": 0.0})
    torques = [
        bare.pfl(*state) for state in zip(run.q, run.v, accelerations(model, run), strict=True)
    ]
    own = [PassiveTail(ALL, 4).force(a, b) for a, b in zip(run.tail, run.v[:, 6:], strict=True)]
    np.testing.assert_allclose(run.tau, np.add(torques, own), atol=1e-6)


def accelerations(model, run):
    """What the torques of a run give its tail."""
    return [model.forward_dynamics(*state)[6:] for state in zip(run.q, run.v, run.tau, strict=True)]
