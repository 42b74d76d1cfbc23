"""A jump made for its landing keeps its limits, as the summary says; its first guess does not."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

import serpentail as st
from serpentail.sequence import optimise
from serpentail.sequence.search import push_measures
from serpentail.sequence.sequence import PhaseStart
from tests.sequence.test_phases import DAMPING, kick, rat, sequence, settled
from tests.support.rows import row

CROUCH = {"at": 0.02, "gamma": 3.2, "delta": -0.6, "duration": 0.07, "shape": "quintic"}
PUSH = {"at": 0.16, "gamma": 4.9, "delta": -1.4, "duration": 0.042, "shape": "accelerate"}
STRETCH = {"before_landing": 0.12, "gamma": 3.93, "delta": -1.13, "duration": 0.08}
YIELD = {"at": "touch_down", "gamma": 3.93, "delta": -0.35, "duration": 0.03}
GOAL = st.Goal(torso_rate=None, tail=[radians(-20), 0.0], tail_rate=[0.0, 0.0])
PLAN = {"goal": GOAL, "bounds": st.Bounds(angle=(pi / 3, 1e-3), torque=0.02)}


def slippery():
    return rat().with_parameters(mu=0.55)


def leap():
    """A crouch and a push on slippery ground, a flight in its plane, and legs that yield."""
    flight = st.Phase("flight", 1.5, until="landing", plan=PLAN, moves=[STRETCH])
    land = st.Phase("land", 1.0, controller=DAMPING, moves=[YIELD | {"shape": "decelerate"}])
    return replace(sequence(kick(moves=[CROUCH, PUSH]), flight, land), model=slippery())


@pytest.mark.slow  # some 1000 runs and a plan
def test_what_is_found_keeps_its_limits():
    limits = {"push": 20, "landing": 22, "tilt": "60 deg", "spin": 3e-4}
    first = leap().simulate(*settled())
    assert not st.summary(slippery(), first.trajectory)["landed"]
    found = st.optimise(leap(), *settled(), limits=limits, goal={"rise": 0.25}, time_limit=600)
    again = found.sequence.simulate(*settled())
    told, measures = st.summary(slippery(), again.trajectory), found.report["measures"]
    assert found.success and again.complete and told["landed"]
    assert told["com_rise_m"] == pytest.approx(measures["rise"]) and told["com_rise_m"] >= 0.25
    assert told["tilt_max_deg"] <= 60 and again.phases[1].plan.success
    assert np.linalg.norm(told["angular_momentum_at_take_off"]) <= 3e-4
    force = told["peak_ground_force_weights"]
    assert force == pytest.approx(max(measures["push"], measures["landing"])) and force <= 22
    assert {doubt.partition(": ")[0] for doubt in found.doubts} <= {*found.report["repeats"]}


def test_a_push_is_measured_as_the_sequence_makes_it():
    pushed = replace(sequence(kick(moves=[CROUCH, PUSH])), model=slippery()).simulate(*settled())
    measures = push_measures(leap(), PhaseStart(0.0, *settled()), None)
    told = st.summary(slippery(), pushed.trajectory)
    spin = np.linalg.norm(told["angular_momentum_at_take_off"])
    assert measures["push"] == pytest.approx(told["peak_ground_force_weights"], rel=1e-2)
    assert measures["spin"] == pytest.approx(spin, rel=1e-2)


def test_only_a_push_that_is_right_is_asked_for_less_spin(monkeypatch):
    """One that is too low is searched for again with the same limits."""
    for rise, share in ((0.5, 1.0), (0.05, optimise.LESS)):
        asked = []

        def kept(sequence, _unknowns, _measured, wanted, *_, asked=asked, **_settings):
            asked.append(wanted.limits["spin"])
            return sequence

        monkeypatch.setattr(optimise, "searched", kept)
        monkeypatch.setattr(optimise, "TURNS", 2)
        with row(rise):
            limits = {"spin": 1e-2, "tilt": "0.1 deg"}
            st.optimise(leap(), *settled(), limits=limits, goal={"rise": rise})
            assert asked == [1e-2, share * 1e-2]


def test_what_cannot_be_is_refused():
    def of(k, **changes):
        phases = [*leap().phases]
        return replace(
            leap(), phases=[*phases[:k], replace(phases[k], **changes), *phases[k + 1 :]]
        )

    for given, settings, told in (
        (leap(), {"goal": {"rise": 0.4}, "limits": {"push": 2}}, "limits.push: value 2"),
        (leap(), {"limits": {"landing": 0.5}}, "limits.landing: value 0.5"),
        (leap(), {"limits": {"torque": 0.1}}, "limits.torque: value 0.1"),
        (leap(), {"goal": {"rise": -1.0}}, "goal.rise: value -1.0"),
        (leap(), {"best": "speed"}, "best: value 'speed'"),
        (sequence(kick()), {}, "leap"),
        (of(0, moves=[{"at": 0.1, "delta": -1, "rate": 70}]), {}, "rate: value 70"),
        (of(2, moves=[]), {}, "'land'.*touch_down"),
        (of(1, plan=None, moves=[]), {}, "'flight'.*plan"),
    ):
        with row(told), pytest.raises(st.SimulationError, match=told):
            st.optimise(given, *settled(), **settings)
