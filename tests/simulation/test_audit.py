"""Every run's books balance, and are right: work and impulses against integrals of its samples."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.summary import summary
from tests.support.models import model_folder

FUNCTIONS = ["energy", "momentum", "rollout", "implicit", "pfl"]
GAMMA, DELTA = np.radians(210), np.radians(-40)
METHODS = {
    "ros34pw2": (1e-3, 1e-4, 1e-6),
    "tsit5": (1e-4, 1e-6, 1e-8),
    "dop853": (1e-8,),
    "lsoda": (1e-8,),
}


@cache
def animal(*contacts, **options):
    return st.load(model_folder(2, 3, contacts=list(contacts), functions=FUNCTIONS, **options))


def dropped(model, seed):
    """Return a tumbling start above the ground."""
    rng = np.random.default_rng(seed)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    attitude = rng.normal(size=4)
    q[2], q[3:7] = 0.35, attitude / np.linalg.norm(attitude)
    q[7:] = rng.uniform(-0.2, 0.2, model.nq - 7)
    v[:6] = rng.normal(size=6) * [0.5, 0.5, 0.5, 5, 5, 5]
    return q, v


def landed(model, seed, span=0.6, **how):
    own = {"controller": st.Damping(1e-3), "legs": st.Legs.fixed(GAMMA, DELTA)}
    return st.simulate(model, *dropped(model, seed), t_span=span, **own | how)


def integral(t, rates):
    """Simpson's rule over equal samples (an odd number of them)."""
    weights = np.ones(len(t))
    weights[1:-1:2], weights[2:-1:2] = 4, 2
    return np.tensordot(weights, rates, 1) * (t[1] - t[0]) / 3


def test_work_and_impulses_are_the_integrals_of_the_samples():
    """Against Simpson's rule over samples 2 us apart: forces, powers of torques and damping."""
    model, legs = animal("feet", "tail"), st.Legs.ramp(GAMMA, (DELTA, -1.0), at=0.005, rate=-40)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:7] = 0.055, np.cos(0.15), np.sin(0.15), 0.05, 0
    v[2] = -0.5
    damping, torque = np.array([1e-3, 2e-3, 1e-3, 2e-3]), np.array([2e-3, -1e-3, 1e-3, 0])
    control = (st.Damping(damping), st.TorqueTable([0.0, 1.0], np.tile(torque, (2, 1))))
    for controller in control:
        run = st.simulate(
            model,
            q,
            v,
            controller=controller,
            legs=legs,
            t_span=0.02,
            method="tsit5",
            rtol=1e-9,
            output_step=2e-6,
        )
        work, rates = run.info["work_J"], run.v[:, 6:]
        for group, impulse in run.info["impulse_N_s"].items():
            expected = integral(run.t, run.contact.of(group).forces.sum(axis=1))
            assert impulse == pytest.approx(expected, abs=4e-6), group
        damped = isinstance(controller, st.Damping)
        lost = integral(run.t, -(rates**2) @ damping) if damped else 0.0
        done = 0.0 if damped else integral(run.t, rates @ torque)
        assert work["damping"] == pytest.approx(lost, abs=1e-9 + 1e-5 * abs(lost))
        assert work["torques"] == pytest.approx(done, abs=1e-9 + 1e-5 * abs(done))
        # the ground on the points as they move in the world; the legs' drives by their drift
        angles = np.concatenate(legs.curve.at(run.t)[:2], axis=-1)
        speeds = model.contact_points(run.q, run.v, angles)[1]
        still = model.contact_points(run.q, run.v, angles * (np.arange(8) < 4))[1]
        forces = run.contact.forces
        ground = integral(run.t, (forces * speeds).sum(axis=(1, 2)))
        drives = integral(run.t, (forces * (still - speeds)).sum(axis=(1, 2)))
        assert work["ground"] == pytest.approx(ground, rel=1e-3)
        assert work["legs"] == pytest.approx(drives, rel=1e-3) and drives > 1e-4
        assert run.info["warnings"] == []


@pytest.mark.parametrize("name", METHODS)
def test_the_books_of_drops_balance(name):
    check_drops(name, range(4))


@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_the_books_of_many_drops_balance(name):
    check_drops(name, range(1000) if name in ("ros34pw2", "tsit5") else range(20))


def check_drops(name, seeds):
    model = animal("feet", "tail", "torso")
    for rtol in METHODS[name]:
        for seed in seeds:
            run = landed(model, seed, method=name, rtol=rtol, atol=rtol)
            assert run.info["warnings"] == [], (rtol, seed)
            assert run.info["imbalance"]["relative"] < 100 * rtol


def inner_energy(model, run):
    """Energy of a flight about its centre of mass, J."""
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    return run.kinetic - np.sum(run.linear_momentum**2, axis=1) / (2 * mass)


def test_the_energy_of_a_fall_hides_no_loss():
    model = animal()
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7:], v[1], v[3] = 1, (0.5, 0, 0.3, 0), 10, 20  # in one plane: a motion without chaos
    how = {"t_span": 1.0, "method": "implicit_euler", "step": 2e-3, "output_step": 0.1}
    many = st.simulate(model, np.tile(q, (2, 1)), v, **how)
    for run in (st.simulate(model, q, v, **how), many[1]):
        energy = inner_energy(model, run)
        change = abs(energy[-1] - energy[0]) / energy.max()
        assert change > 0.15 and abs(run.energy[-1] - run.energy[0]) < 1e-3 * run.kinetic[-1]
        assert run.info["imbalance"]["relative"] == pytest.approx(change, rel=0.1)
        assert "% of what was moved is not accounted for" in run.info["warnings"][0]
    assert [len(each) for each in many.warnings] == [1, 1]
    fine = st.simulate(model, q, v, t_span=1.0, method="tsit5", rtol=1e-8, atol=1e-8)
    assert fine.info["warnings"] == [] and fine.info["imbalance"]["relative"] < 1e-6
    # a fall that does not turn has nothing inside to lose: roundings are no loss
    still = st.simulate(model, np.eye(1, model.nq, 3)[0], 0 * v, t_span=20.0)
    assert still.info["warnings"] == [] and still.info["imbalance"]["relative"] < 1e-9


def swing(model, duration=0.45):
    """Return a tail's way 0, 90, -60, 0 degrees, from rest to rest."""
    pitch = np.radians([0, 90, -60, 0])
    times = np.linspace(0, duration, 4)
    return st.Pfl(model, st.Reference.of_bends(model, times, np.tile(pitch[:, None], (1, 2))))


def swings(rtol, runs):
    """Return a model, and single flights from rest to rest or those of rollouts."""
    model = animal()
    q, v = np.eye(1, model.nq, 3)[0], np.zeros(model.nv)
    how = {"controller": swing(model), "t_span": 0.45, "rtol": rtol, "atol": rtol}
    if runs == 1:
        return model, [st.simulate(model, q, v, **how)]
    return model, list(st.simulate(model, np.tile(q, (runs, 1)), v, **how))


@pytest.mark.parametrize("runs", [1, 3])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
def test_a_swing_from_rest_to_rest_balances(rtol, runs):
    """Both ends and the net work are about zero; what was moved is the energy in between."""
    model, found = swings(rtol, runs)
    for run in found:
        lost = abs(run.info["imbalance"]["energy_J"]) / inner_energy(model, run).max()
        assert run.info["warnings"] == [] and lost < 10 * rtol
        assert run.info["imbalance"]["relative"] == pytest.approx(lost, rel=0.1)


@pytest.mark.parametrize("runs", [1, 3])
def test_a_fault_in_a_swing_from_rest_to_rest_is_found(runs, monkeypatch):
    """Work that is wrong by twice and by half the allowed share of the swing's energy."""
    from serpentail.simulation import audit

    named = audit.named
    for share, warnings in ((2.0, 1), (0.5, 0)):
        model, found = swings(1e-8, runs)
        wrong = share * 100 * 1e-8 * inner_energy(model, found[0]).max()

        def worked(*given, wrong=wrong):
            work, impulses = named(*given)
            return work | {"torques": work["torques"] + wrong}, impulses

        monkeypatch.setattr(audit, "named", worked)
        for run in found:
            assert len(run.info["warnings"]) == warnings
            assert run.info["imbalance"]["energy_J"] == pytest.approx(-wrong, rel=0.1)
        monkeypatch.undo()


def test_flights_balance_in_lanes_as_singly(monkeypatch):
    from serpentail.simulation import parallel_runs

    model = animal()
    starts = [dropped(model, seed) for seed in range(9)]
    q, v = (np.array(each) for each in zip(*starts, strict=True))
    how = {"controller": st.Damping(1e-3), "t_span": 0.05, "method": "rk4", "step": 1e-5}
    monkeypatch.setattr(parallel_runs, "worth_batching", lambda *_: False)
    singly = st.simulate(model, q, v, **how)
    monkeypatch.setattr(parallel_runs, "worth_batching", lambda *_: True)
    abreast = st.simulate(model, q, v, **how)
    assert abreast.info["abreast"] > 1 == singly.info["abreast"]
    for runs in (singly, abreast):
        assert runs.audit.relative.max() < 1e-9 and not any(runs.warnings)
        assert (runs.audit.work["damping"] < 0).all()
    np.testing.assert_allclose(
        abreast.audit.work["damping"], singly.audit.work["damping"], rtol=1e-9
    )


def test_rollouts_audit_each_run_up_to_where_it_stopped():
    model = animal("feet", "tail", "torso")
    starts = [dropped(model, seed) for seed in range(6)]
    q, v = (np.array(each) for each in zip(*starts, strict=True))
    q[2, 2] = 50.0  # never lands
    runs = st.simulate(
        model,
        q,
        v,
        controller=st.Damping(1e-3),
        legs=st.Legs.fixed(GAMMA, DELTA),
        t_span=0.5,
        stop_at=[("take_off", group) for group in model.contacts],
    )
    for k in range(6):
        books = runs[k].info
        assert books["imbalance"]["relative"] == pytest.approx(runs.audit.relative[k], rel=1e-6)
        assert books["work_J"]["ground"] == pytest.approx(runs.audit.work["ground"][k])
        assert runs.warnings[k] == books["warnings"] == []
    assert runs.audit.work["ground"][2] == 0 and runs.ends[2] == 0.5 > runs.ends[0]


def test_what_does_not_balance_is_reported():
    """Steps of a fixed length that are too long for the ground's blow gain energy."""
    run = landed(animal("feet", "tail", "torso"), 1, method="rk4", step=4e-4)
    assert run.info["imbalance"]["relative"] > 0.05
    assert "not accounted for" in run.warnings[0] and "shorter step" in run.warnings[0]
    assert summary(animal("feet", "tail", "torso"), run)["warnings"] == run.warnings


def test_float_models_balance_by_their_own_roundings():
    model = animal("feet", "tail", "torso", real="float")
    run = landed(model, 3, method="ros34pw2")
    assert run.info["warnings"] == [] and run.info["imbalance"]["relative"] < 0.1
