"""Phases are one motion, each ends where it says, and what cannot be is refused."""

from dataclasses import replace

import numpy as np
import pytest

import serpentail as st

from .landing import DAMPING, DELTA, GAMMA, KICK, SETTINGS, kick, rat, sequence, settled


def test_phases_are_the_motion_that_one_run_makes():
    """What acts is the same, but for where steps end: states, books and events agree."""
    q, v, bristles = settled()
    table = st.TorqueTable([0.0, 0.05, 0.1], np.array([[0, 0], [2, 1], [0, 0]]) * 1e-4, 1e-3)
    fall = st.Phase("fall", 0.2, controller=table)
    run = sequence(kick(until=[("take_off", "feet")]), fall).simulate(q, v, bristles)
    leaves = run.phases[0].end
    whole = st.simulate(
        rat(),
        q,
        v,
        bristles0=bristles,
        controller=st.Phases([(0.0, DAMPING), (leaves, table)]),
        legs=st.Legs.moves(GAMMA, DELTA, [KICK]),
        t_span=leaves + 0.2,
        rtol=1e-8,
        atol=1e-8,
    )
    motion = run.trajectory
    assert [(phase.name, phase.ended_by) for phase in run.phases] == [
        ("kick", "take_off of feet"),
        ("fall", "duration"),
    ]
    assert run.complete and (np.diff(motion.t) > 0).all() and motion.t[-1] == whole.t[-1]
    np.testing.assert_allclose(motion.q[-1], whole.q[-1], atol=2e-4)
    for name in ("work_J", "impulse_N_s"):
        for of, value in whole.info[name].items():
            np.testing.assert_allclose(motion.info[name][of], value, atol=1e-4, err_msg=of)
    kinds, wanted = ([(e["kind"], e["group"]) for e in m.events] for m in (motion, whole))
    assert kinds == wanted and motion.info["imbalance"]["relative"] < 1e-4
    acting = (motion.t > leaves) & (motion.t < leaves + 0.1)
    given = motion.tau[acting] + 1e-3 * motion.v[acting, 6:]
    wanted = [
        np.interp(motion.t[acting] - leaves, table.times, c) for c in np.transpose(table.torques)
    ]
    np.testing.assert_allclose(given, np.transpose(wanted), atol=1e-12)


def test_airborne_is_where_nothing_touches_and_all_is_high():
    run = sequence(kick()).simulate(*settled())
    contact = run.trajectory.contact
    lowest, force = contact.points[..., 2].min(axis=1), contact.forces[..., 2].max(axis=1)
    assert lowest[-1] > 0.01 and force[-1] == 0 and run.phases[0].ended_by == "airborne"
    assert run.trajectory.events[-1]["time"] < run.phases[0].end < 0.5
    earlier = st.simulate(
        rat(),
        *settled()[:2],
        bristles0=settled()[2],
        controller=DAMPING,
        legs=st.Legs.moves(GAMMA, DELTA, [KICK]),
        t_span=run.phases[0].end - 1.0 / 400,
        **SETTINGS,
    ).contact
    assert earlier.points[-1, :, 2].min() < 0.01 or earlier.forces[-1].max() > 0


def test_an_end_that_never_comes_ends_the_motion_and_says_so():
    first = kick(moves=(), duration=0.1)
    run = sequence(first, st.Phase("fly", 0.1)).simulate(*settled())
    assert not run.complete and [phase.name for phase in run.phases] == ["kick"]
    words = "phase 'kick' ended without flight clear of the ground within 0.1 s"
    assert words in run.trajectory.warnings
    last = kick(moves=(), duration=0.1, until=[("take_off", "feet"), ("take_off", "tail")])
    run = sequence(last).simulate(*settled())
    assert not run.complete and "ended without take_off of feet or take_off of tail" in str(
        run.trajectory.warnings
    )


def test_an_error_names_its_phase_and_keeps_the_motion():
    wrong = st.Phase("spin", 0.1, controller=lambda t, q, v: [np.nan, 0] if t > 0.05 else [0, 0])
    with pytest.raises(st.SimulationError, match="phase 'spin': the controller gave") as caught:
        sequence(kick(), wrong).simulate(*settled())
    motion = caught.value.trajectory
    assert 0.5 < motion.t[-1] < 0.55 and motion.t[0] == 0


PHASE = {"name": "a", "duration": 1.0}
WRONG = [
    ({"name": ""}, "Phase: name: value ''"),
    ({"duration": 0}, "phase 'a': duration: value 0: needs a number above 0"),
    ({"until": "landed"}, "phase 'a': until: value 'landed': needs 'airborne', 'landing'"),
    ({"until": [("leave", "feet")]}, "until: value"),
    ({"until": [3]}, "until: value"),
    ({"until": []}, "until: value"),
    ({"clearance": 0.1}, "clearance: value 0.1: it belongs to until = 'airborne'"),
    ({"until": "airborne", "clearance": -1}, "clearance: value -1"),
    ({"controller": 3}, "controller: value 3: needs None"),
    ({"controller": st.Phases([(0.0, None)])}, "give each of its controllers a phase"),
    ({"plan": 3}, "plan: value 3: needs a mapping"),
    ({"plan": {"start": 3}}, "plan.start: value 3: needs none"),
    ({"plan": {"free_start": {}}}, "plan.free_start: value {}: needs none"),
    ({"plan": {"design": {}}}, "plan.design: value {}: needs none: all phases have the sequence's"),
    ({"plan": {}, "controller": DAMPING}, "has a controller and a plan"),
    ({"moves": [{"delta": 1.0, "rate": 1.0}]}, "needs at"),
    ({"moves": [{"before_landing": 0.1, "delta": 1.0}]}, "key"),
    ({"moves": [{"att": 0.1}]}, "did you mean 'at'"),
    ({"moves": 3}, "moves: value 3: needs an array"),
]


@pytest.mark.parametrize(("changes", "words"), WRONG, ids=lambda x: str(x)[:40])
def test_what_is_no_phase_is_refused(changes, words):
    with pytest.raises(st.SimulationError) as caught:
        st.Phase(**PHASE | changes)
    assert words in str(caught.value)


def test_what_is_no_sequence_is_refused():
    flier = st.load(rat_without_ground())
    cases = [
        (sequence, "phases: value (): needs a list of st.Phase"),
        (lambda: sequence(3), "needs a list of st.Phase"),
        (lambda: st.Sequence(rat(), 3), "needs a list of st.Phase"),
        (lambda: sequence(kick(), kick()), "two are called 'kick'"),
        (lambda: sequence(kick(), gamma=None), "gamma: value None"),
        (lambda: sequence(kick(until=[("take_off", "hands")], clearance=0.0)), "'hands'"),
        (lambda: st.Sequence(flier, [st.Phase("a", 1.0)], gamma=1.0), "has no legs"),
        (lambda: st.Sequence(flier, [kick(moves=())]), "has no contacts"),
        (lambda: st.Sequence(flier, [st.Phase("a", 1.0, moves=[KICK])]), "has no legs"),
        (lambda: sequence(st.Phase("a", 1.0, controller=st.Damping(-1))), "phase 'a': damping"),
        (lambda: st.Tracking(kp=-1), "kp: value -1"),
    ]
    for make, words in cases:
        with pytest.raises(st.SimulationError) as caught:
            make()
        assert words in str(caught.value)


def rat_without_ground():
    """A folder of a model that flies."""
    from tests.support.models import model_folder

    return model_folder(1, 3, functions=["rollout", "energy", "momentum"])


def test_a_flight_without_ground_has_phases_too():
    model = st.load(rat_without_ground())
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], v[3:6], v[6] = 1.0, [3.0, 1.0, 0.0], 5.0
    laws = [DAMPING, st.Damping(2e-3)]
    phases = [st.Phase(str(k), 0.1, controller=law) for k, law in enumerate(laws)]
    run = st.Sequence(model, phases, settings={"rtol": 1e-10}).simulate(q, v)
    law = st.Phases([(0.0, laws[0]), (0.1, laws[1])])
    whole = st.simulate(model, q, v, controller=law, t_span=0.2, rtol=1e-10)
    np.testing.assert_allclose(run.trajectory.q[-1], whole.q[-1], atol=1e-8)
    assert run.trajectory.contact is None and run.complete


def test_the_samples_of_a_sequence_are_those_of_its_phases():
    run = sequence(kick(until=[("take_off", "feet")]), st.Phase("fly", 0.01)).simulate(*settled())
    t = run.trajectory.t
    assert run.phases[0].end in t and t[-1] == pytest.approx(run.phases[0].end + 0.01)
    assert run.trajectory.contact.points.shape[0] == len(t)
    again = replace(run.trajectory)
    np.testing.assert_array_equal(again.energy, run.trajectory.energy)
