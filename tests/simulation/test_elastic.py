"""Elastic tails in simulations: books of long runs, stops, methods, tracking, the ground; small
oscillations are those of linear mechanics.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

import serpentail as st
from serpentail.motion.numbers import com_rise
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.parameters import TABLE_1
from tests.references.passive import PassiveTail
from tests.support import zoo
from tests.support.rows import row
from tests.support.zoo import ELASTIC

TAILS = ("elastic", "elastic_arcs")
METHODS = {"tsit5": (1e-5, 1e-7, 1e-9), "ros34pw2": (1e-3, 1e-5, 1e-7), "dop853": (1e-6, 1e-9)}
FREE = {"tail_damping": 0, "tail_stop_lower": -3, "tail_stop_upper": 3}
BARE = FREE | {"tail_stiffness": 0}
EXACT = {"method": "tsit5", "rtol": 1e-10}
FINE = {"rtol": 1e-9, "method": "tsit5", "output_step": 1e-4}


def elastic(name="elastic", **changes):
    """A model, with some numbers of its own."""
    return zoo.model(name).with_parameters(**changes) if changes else zoo.model(name)


def bent(angles):
    """A start at rest with an upright torso."""
    return np.append([0, 0, 0, 1.0, 0, 0, 0], np.broadcast_to(angles, 4)), np.zeros(10)


@pytest.mark.parametrize("name", TAILS)
def test_energy_balances_over_long_runs_and_better_with_tolerance(name):
    """Kinetic, potential and stored energy and what damping lost, over 3 s of tumbling flight."""
    q, v = bent([0.5, -0.4, 0.3, 0.5])
    v[3:] = 1, 2, 3, 5, -5, 5, 5
    for part, changes in (("all", {}), ("spring", FREE)):
        model = elastic(name, **changes)
        for method, tolerances in METHODS.items():
            errors = []
            for rtol in tolerances:
                run = st.simulate(model, q, v, t_span=3.0, method=method, rtol=rtol)
                share, work = run.info["imbalance"]["relative"], run.info["work_J"]
                with row(part, method, rtol):
                    most = 500 if method == "ros34pw2" else 100  # of low order, and the run is long
                    assert share < most * rtol
                    told = any("accounted" in each for each in run.info["warnings"])
                    assert told == (share > min(100 * rtol, 0.01))
                    left = run.energy[-1] - run.energy[0] - work["damping"] - work["torques"]
                    told = run.info["imbalance"]["energy_J"]
                    assert left == pytest.approx(told, abs=1e-12) and work["torques"] == 0
                    assert (work["damping"] < -1e-4) == (part == "all")
                    errors.append(abs(left) / (model.energy(q, v)[0] + abs(work["damping"])))
            # over the kinetic energy of the start: springs move more than that
            assert errors[-1] < 2e-4 and errors[-1] < max(0.1 * errors[0], 1e-9)


def test_books_count_what_damping_of_the_stops_takes():
    """The first two joints go into their stops in one run, and none does in the other."""
    q, v = bent(0.0)
    v[6:] = 20, -15, 25, -18
    for model in (zoo.model("damped_stops"), zoo.model("damped_stops").with_parameters(**FREE)):
        run = st.simulate(model, q, v, t_span=0.3, **EXACT)
        assert run.info["imbalance"]["relative"] < 1e-8
        reached = np.abs(run.tail).max(axis=0) > np.abs(model.parameters["tail_stop_upper"])
        assert reached[:2].all() == (model is zoo.model("damped_stops"))


def test_damping_of_the_tail_and_of_a_controller_add_up():
    q, v = bent([0.3, -0.2, 0.2, 0.1])
    v[6:] = 10
    how = {"t_span": 0.5, "rtol": 1e-10, "method": "tsit5"}
    own = elastic(tail_damping=np.add(ELASTIC["tail_damping"], 1e-4))
    alone = st.simulate(own, q, v, **how)
    both = st.simulate(elastic(), q, v, controller=st.Damping(1e-4), **how)
    np.testing.assert_allclose(alone.tail, both.tail, atol=1e-8)
    found, expected = (run.info["work_J"]["damping"] for run in (both, alone))
    assert found == pytest.approx(expected, rel=1e-7)
    assert not alone.tau.any() and both.tau.any()


def test_a_rise_is_that_of_the_centre_of_mass_whatever_a_tail_stores():
    q, v = bent(0.5)
    v[2] = 1.0
    run = st.simulate(elastic(), q, v, t_span=0.3, **FINE)
    expected = run.linear_momentum[0, 2] ** 2 / (2 * 9.8 * (0.10572 + 3.51e-3) ** 2)
    assert com_rise(elastic(), run) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("name", TAILS)
def test_a_tail_thrown_at_its_stops_comes_back_with_its_energy(name):
    """20 rad/s at stops at 0.5 rad of 10 N m/rad: an overshoot of less than 0.1 rad stores it."""
    given = {"tail_stop_lower": -0.5, "tail_stop_upper": 0.5, "tail_stop_stiffness": 10.0}
    given |= {"tail_stop_width": 0.05}
    model = elastic(name, gravity=0, **BARE | given)
    q, v = bent(0.0)
    v[6] = 20.0
    run = st.simulate(model, q, v, t_span=0.5, **FINE)
    most, kinetic = np.abs(run.tail).max(axis=0), run.kinetic[0]
    assert most[0] > 0.5 and (most < 0.6).all()
    # what a stop stores at the largest way into it is at most all there was
    assert PassiveTail(given, 4).energy(most * np.eye(4)[0]) <= kinetic * (1 + 1e-9)
    np.testing.assert_allclose(run.energy, kinetic, rtol=5e-6)
    assert run.kinetic.min() < 0.9 * kinetic < run.kinetic[-2000:].max()
    # between the stops nothing acts
    free = elastic(name, gravity=0, **BARE)
    other = st.simulate(free, q, v, t_span=0.5, **FINE)
    before = np.flatnonzero(np.abs(run.tail).max(axis=1) > 0.5)[0]
    np.testing.assert_allclose(run.tail[:before], other.tail[:before], atol=1e-6)


def test_a_run_that_ends_behind_a_stop_is_continued_and_told():
    """In one row, in one of several, and by a run that waits."""
    model, (q, v) = elastic(tail_stop_width=0.05), bent(0.0)
    v[6] = 40.0
    run = st.simulate(model, q, v, t_span=0.02)
    assert "alpha_1 is" in run.warnings[-1] and "behind tail_stop_upper 0.6" in run.warnings[-1]
    k = int(run.tail[:, 0].argmax())
    assert run.tail[k, 0] > 0.65 and f"{run.tail[k, 0]:.6g} rad" in run.warnings[-1]
    # which is one motion
    whole = st.simulate(model, q, v, t_span=2 * run.t[k], output_step=run.t[k], **EXACT)
    rest = {"t_span": run.t[k], "output_step": run.t[k], **EXACT}
    first = st.simulate(model, q, v, **rest)
    then = st.simulate(model, first.q[-1], first.v[-1], **rest)
    np.testing.assert_allclose(then.q[-1], whole.q[-1], rtol=0, atol=1e-8)
    starts = np.stack([q, first.q[-1]]), np.stack([v, first.v[-1]])
    np.testing.assert_array_equal(st.simulate(model, *starts, **rest).q[1], then.q)
    assert not any("behind" in each for each in st.simulate(model, *bent(0.1)).warnings)


def test_damping_is_stiff_and_oscillation_is_not():
    """The limit rises as the tolerance falls, so that the faster method is taken, and a tolerance
    is the same accuracy on both sides.
    """
    q, v = bent(0.1)
    swinging = elastic("elastic_arcs", **BARE | {"tail_stiffness": 20.0, "tail_damping": 5e-4})
    run = st.simulate(swinging, q, v, t_span=0.02)
    assert run.info["method"] == "tsit5" and run.info["rtol"] == 1e-8
    mobility = np.linalg.inv(swinging.mass_matrix(q))[6:, 6:]
    rates = np.zeros((8, 8))
    rates[:4, 4:], rates[4:, :4], rates[4:, 4:] = np.eye(4), -20 * mobility, -5e-4 * mobility
    told = float(run.info["reason"].split(" at ")[1].split()[0])
    assert told == pytest.approx(-np.linalg.eigvals(rates).real.min(), rel=0.05)
    damped = elastic("elastic_arcs", **BARE | {"tail_stiffness": 20.0, "tail_damping": 1e-2})
    exact = st.simulate(damped, q, v, t_span=0.02, **EXACT)
    for rtol, method in ((1e-2, "ros34pw2"), (1e-5, "ros34pw2"), (1e-9, "tsit5")):
        run = st.simulate(damped, q, v, t_span=0.02, rtol=rtol)
        with row(rtol):
            assert run.info["method"] == method and run.info["steps"] < 5000
            assert np.abs(run.q[-1] - exact.q[-1]).max() < rtol
    # tracking makes up for it
    held = st.Pfl(damped, ([0.0, 0.01], np.tile(q[7:], (2, 1))))
    tracked = st.simulate(damped, q, v, t_span=0.01, controller=held, rtol=1e-5)
    assert tracked.info["method"] == "tsit5" and tracked.info["steps"] < 50


def test_a_passive_tail_is_tracked_as_one_without():
    model, bare, own = elastic(), zoo.model("m2_n2"), PassiveTail(ELASTIC, 4)
    (q, v), times = bent(0.0), np.linspace(0, 0.5, 11)
    wanted = 0.4 * np.sin(8 * times)[:, None] * [1, -1, 0.5, 1]
    v[6:] = 0.4 * 8 * np.array([1, -1, 0.5, 1])
    law = st.Pfl(model, (times, wanted))
    for method in ("tsit5", "ros34pw2"):
        run = st.simulate(model, q, v, t_span=0.5, controller=law, method=method, rtol=1e-6)
        np.testing.assert_allclose(run.tail[::40], wanted[::2], atol=0.02)
        # the torques move the tail, and make up for what it asks for itself
        given = model.forward_dynamics(run.q, run.v, run.tau)[:, 6:]
        asked = [own.force(a, b) for a, b in zip(run.tail, run.v[:, 6:], strict=True)]
        torques = bare.pfl(run.q, run.v, given) + asked
        np.testing.assert_allclose(run.tau, torques, atol=1e-6, err_msg=method)


@pytest.mark.parametrize("stiffness", [0.004, 1.0])
def test_an_elastic_tail_lands_with_books_that_balance(stiffness):
    """By implicit steps, which take about as many for a stiff tail; better with the tolerance."""
    model, left = elastic("elastic_ground", tail_stiffness=stiffness, tail_damping=1e-3), []
    q = [0, 0, 0.12, np.cos(0.2), np.sin(0.2), 0.1, 0, 0.3, 0.1, -0.2, 0.1]
    v = [0, 0.3, -0.5, 2, 1, 0, 0, 0, 0, 0]
    legs = st.Legs.fixed(np.radians(210), np.radians(-40))
    for rtol in (1e-4, 1e-6):
        run = st.simulate(model, q, v, t_span=0.4, legs=legs, rtol=rtol)
        assert run.info["method"] == "switching"
        assert all("behind tail_stop" in each for each in run.info["warnings"])
        assert run.info["work_J"]["damping"] < 0 and run.info["events"]
        left.append(run.info["imbalance"]["relative"])
    assert left[1] < 1e-4 and left[1] < 0.4 * left[0]


STIFFNESS = np.array([2e-3, 3e-3, 1e-3, 4e-3])
REST = np.array([0.2, -0.1, 0.3, 0.0])
RESTING = bent(REST)[0]


def check_modes(model, M, damping):
    """Started in a mode at 1e-4 rad a tail keeps it: K x + damping K x' + M x'' = 0."""
    squares, shapes = eigh(np.diag(STIFFNESS), M)
    for square, shape in zip(squares, shapes.T, strict=True):
        start = 1e-4 * shape / np.abs(shape).max()
        how = {"t_span": 6 * np.pi / np.sqrt(square), "method": "tsit5", "rtol": 1e-10}
        run = st.simulate(model, *bent(REST + start), **how)
        # x'' + damping w^2 x' + w^2 x = 0 from x = 1, x' = 0
        roots = np.roots([1, damping * square, square])
        parts = np.linalg.solve([[1, 1], roots], [1, 0])
        x = np.real(np.exp(np.outer(run.t, roots)) @ parts)
        assert np.abs(run.tail - REST - np.outer(x, start)).max() < 2e-7


@pytest.mark.parametrize("name", TAILS)
def test_small_oscillations_are_those_of_the_linear_tail(name):
    """Of the tail's inertia on a torso that is free, by another derivation of the same tail."""
    exact = ExactChain(TABLE_1, 2, 2) if name == "elastic" else ExactContinuum(TABLE_1, 2)
    M = np.linalg.inv(np.linalg.inv(exact.mass_matrix(RESTING))[6:, 6:])
    far = {"tail_stop_lower": -3, "tail_stop_upper": 3, "gravity": 0, "tail_rest": REST}
    for damping in (0.0, 2e-3):
        springs = {"tail_stiffness": STIFFNESS, "tail_damping": damping * STIFFNESS}
        with row(damping):
            check_modes(zoo.model(name).with_parameters(**far, **springs), M, damping)
