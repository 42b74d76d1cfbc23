"""A jump by torques of limbs is made for its landing as one by moves is, and within their bound."""

from copy import copy
from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

import serpentail as st
from serpentail.sequence import search
from serpentail.sequence.unknowns import strongest_of, unknowns_of, with_curve, with_numbers
from serpentail.sequence.wanted import wanted_of
from tests.support.rows import row

LEVELS = np.array([0, 0, -0.035, 0.03, -0.02, -0.035, 0.03, -0.02])  # N m: tail, right, left
PUSH, LAND = ([0, 0.02, 0.04, 0.05], [0, 1, 1, 0]), ([0, 0.03, 0.05], [1, 1, 0])
BOUND = {"hind": 0.06, "hind_knee": "65 mN m"}
CROUCH = [0, 0, *np.radians([50, -105, 137, 50, -105, 137])]


def table(nodes, damping=0.0):
    return st.TorqueTable(nodes[0], np.outer(nodes[1], LEVELS), damping)


def leap(model, **changes):
    """A push, a flight that ends on stretched legs, and limbs that yield to their stops."""
    ends = {"tail": [radians(-20), 0.0], "hind": np.radians([20, -45, 55])}
    goal = st.Goal(torso_rate=None, chains=ends, chain_rates={"tail": 0, "hind": 0})
    bounds = st.Bounds({"tail": pi / 3, "beta_1": 1e-3, "hind": 2.5}, torque=BOUND)
    phases = [
        st.Phase("push", 0.3, "airborne", 0.003, changes.get("push", table(PUSH))),
        st.Phase("flight", 1.0, "landing", plan={"goal": goal, "bounds": bounds}),
        st.Phase("land", 1.0, controller=changes.get("land", table(LAND))),
    ]
    return st.Sequence(model, phases, settings={"rtol": 1e-5, "output_step": 1e-3})


def as_curves(sequence):
    return replace(sequence, phases=[with_curve(sequence.model, p) for p in sequence.phases])


@pytest.mark.slow  # it makes its model, and searches
def test_limbs_jump_and_land_within_their_torque(monkeypatch):
    monkeypatch.setattr(search, "ROUNDS", 12)
    rat = st.build("rat_kick", purpose=["plan"])
    start = st.settle(rat, rat.state(height=0.035, bend=CROUCH), duration=0.5)
    limits = {"push": 20, "landing": 22, "tilt": "60 deg", "spin": 4e-4, "torque": BOUND}
    found = st.optimise(leap(rat), *start, limits=limits, goal={"rise": 0.11}, time_limit=600)
    run = found.sequence.simulate(*start)
    motion, told = run.trajectory, st.summary(rat, run.trajectory)
    assert found.success and run.complete and told["landed"] and told["com_rise_m"] >= 0.11
    assert told["tilt_max_deg"] <= 60 and told["peak_ground_force_weights"] <= 22
    assert np.linalg.norm(told["angular_momentum_at_take_off"]) <= 4e-4
    hip, knee, ankle = np.abs(motion.tau[:, 2:5]).max(axis=0)
    assert max(hip, ankle) <= 0.06 * (1 + 1e-9) and knee <= 0.065 * (1 + 1e-9)
    np.testing.assert_allclose(motion.q[:, 9:12], motion.q[:, 12:15], atol=2e-3)
    assert found.report["measures"]["leg_rate"] == pytest.approx(np.abs(motion.v[:, 8:]).max())


def test_numbers_of_a_curve_are_levels_and_durations():
    sequence = as_curves(leap(st.scenario("rat_kick").model))
    bound = strongest_of(sequence, BOUND)
    np.testing.assert_allclose(bound[2:], np.tile([0.06, 0.065, 0.06], 2))
    np.testing.assert_allclose(strongest_of(sequence, None), np.abs(LEVELS))
    assert not unknowns_of(sequence, 1, bound)
    unknowns, x = unknowns_of(sequence, 0, bound), np.array([0.05, 0.01, 0.04, 0.03, 0.015, 0.02])
    np.testing.assert_allclose([each.guess for each in unknowns][:3], np.abs(LEVELS[2:5]))
    np.testing.assert_allclose([each.most for each in unknowns], [*bound[2:5], 0.04, 0.04, 0.02])
    curve = with_numbers(sequence, unknowns, x).phases[0].controller.torques
    t = np.linspace(0, 0.07, 50)
    shape = np.interp(t, [0, 0.03, 0.045, 0.065], PUSH[1])
    expected = np.outer(shape, [0, 0, *np.tile([-0.05, 0.01, -0.04], 2)])
    np.testing.assert_allclose(curve.at(t)[0], expected, atol=1e-15)


def test_no_try_exceeds_the_bound(monkeypatch):
    """A search that wants the most torque ends near the bound, from a guess beyond it."""
    monkeypatch.setattr(search, "ROUNDS", 5)
    sequence = as_curves(leap(st.scenario("rat_kick").model))
    bound, tried = strongest_of(sequence, {"hind": 0.025}), []

    def measured(each):
        curve = each.phases[2].controller.torques
        tried.append(np.abs(curve.at(np.linspace(0, 0.2, 999))[0]).max(axis=0)[2:])
        return {"push": 1 / tried[-1].sum()}

    unknowns = unknowns_of(sequence, 2, bound)
    wanted = wanted_of({"push": 1.0}, {}, None)
    measured(search.searched(sequence, unknowns, measured, wanted, np.inf))
    assert np.max(tried) <= 0.025 * (1 + 1e-12) and tried[-1].min() > 0.9 * 0.025


def test_limbs_that_cannot_push_are_refused():
    model, start = st.scenario("rat_kick").model, (np.eye(15)[3], np.zeros(14))
    chains = [replace(c, driven=(False,) * len(c.driven)) for c in model.layout.chains]
    given = [replace(c, given=("hip",)) for c in model.layout.chains]
    passive, prescribed = copy(model), copy(model)
    passive.layout = replace(model.layout, chains=tuple(chains))
    prescribed.layout = replace(model.layout, chains=tuple(given))
    damped = table(LAND, [0, 0, 0, 1e-4, 0, 0, 1e-4, 0])
    for sequence, limits, error, told in (
        (leap(model, push=st.Damping(1e-3)), {}, st.SimulationError, "'push'.*of hind_hip"),
        (leap(model, land=None), {}, st.SimulationError, "'land'.*TorqueCurve"),
        (leap(model, push=st.TorqueTable([0], np.eye(8)[:1])), {}, st.SimulationError, "'push'"),
        (leap(model, land=damped), {}, st.SimulationError, "damping: of hind_knee: value 0.0001"),
        (leap(passive), {}, st.SimulationError, 'no legs that push.*drive = "torque"'),
        (leap(prescribed), {}, st.ModelError, "prescribed joints, in"),
        (leap(model), {"torque": {"knee": 0.1}}, st.SimulationError, "limits.torque.*'knee'"),
        (leap(model), {"torque": "0 N m"}, st.SimulationError, "limits.torque: value '0 N m'"),
        (leap(model), {"landing": 1.5}, st.SimulationError, "limits.landing: value 1.5"),
    ):
        with row(told), pytest.raises(error, match=told):
            st.optimise(sequence, *start, limits=limits, goal={"rise": 0.2})
