"""Every run's books balance, and are right: work and impulses against integrals of its samples."""

from functools import partial

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from serpentail.simulation import audit
from tests.support import zoo
from tests.support.rows import row

from .runs import tail

GAMMA, DELTA = np.radians(210), np.radians(-40)
FIXED = {"controller": st.Damping(1e-3), "legs": st.Legs.fixed(GAMMA, DELTA)}
METHODS = {
    "ros34pw2": (1e-3, 1e-4, 1e-6),
    "tsit5": (1e-4, 1e-6, 1e-8),
    "dop853": (1e-8,),
    "lsoda": (1e-8,),
}


def grounded():
    return zoo.model("ground_m2_n2")


def dropped(model, count, first=0):
    """Tumbling starts (count, nq), (count, nv) above the ground."""
    q, v = np.zeros((count, model.nq)), np.zeros((count, model.nv))
    for k in range(count):
        rng = np.random.default_rng(first + k)
        attitude = rng.normal(size=4)
        q[k, 2], q[k, 3:7] = 0.35, attitude / np.linalg.norm(attitude)
        q[k, 7:] = rng.uniform(-0.2, 0.2, model.nq - 7)
        v[k, :6] = rng.normal(size=6) * [0.5, 0.5, 0.5, 5, 5, 5]
    return q, v


def test_work_and_impulses_are_the_integrals_of_the_samples():
    """Against Simpson's rule over samples 4 us apart: forces, powers of torques and damping."""
    model, legs = grounded(), st.Legs.ramp(GAMMA, (DELTA, -1.0), at=0.005, rate=-40)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:7] = 0.055, np.cos(0.15), np.sin(0.15), 0.05, 0
    v[2] = -0.5
    damping, torque = np.array([1e-3, 2e-3, 1e-3, 2e-3]), np.array([2e-3, -1e-3, 1e-3, 0])
    how = {"t_span": 0.02, "method": "tsit5", "rtol": 1e-9, "output_step": 4e-6}
    for law in (st.Damping(damping), st.TorqueTable([0.0, 1.0], np.tile(torque, (2, 1)))):
        run = st.simulate(model, q, v, controller=law, legs=legs, **how)
        work, rates, integral = run.info["work_J"], run.v[:, 6:], partial(simpson, x=run.t, axis=0)
        for group, impulse in run.info["impulse_N_s"].items():
            expected = integral(run.contact.of(group).forces.sum(axis=1))
            assert impulse == pytest.approx(expected, abs=8e-6), group
        lost, done = (integral(-(rates**2) @ damping), integral(rates @ torque))
        lost, done = (lost, 0.0) if isinstance(law, st.Damping) else (0.0, done)
        assert work["damping"] == pytest.approx(lost, abs=1e-9 + 1e-5 * abs(lost))
        assert work["torques"] == pytest.approx(done, abs=1e-9 + 1e-5 * abs(done))
        # the ground on the points as they move in the world; the legs' drives by their drift
        angles = np.concatenate(legs.curve.at(run.t)[:2], axis=-1)
        speeds = model.contact_points(run.q, run.v, angles)[1]
        still = model.contact_points(run.q, run.v, angles * (np.arange(8) < 4))[1]
        forces = run.contact.forces
        ground = integral((forces * speeds).sum(axis=(1, 2)))
        drives = integral((forces * (still - speeds)).sum(axis=(1, 2)))
        assert work["ground"] == pytest.approx(ground, rel=1e-3)
        assert work["legs"] == pytest.approx(drives, rel=1e-3) and drives > 1e-4
        assert run.info["warnings"] == []


@pytest.mark.parametrize("method", METHODS)
def test_the_books_of_drops_balance(method):
    model = grounded()
    for rtol in METHODS[method]:
        how = {"t_span": 0.6, "method": method, "rtol": rtol, "atol": rtol}
        runs = st.simulate(model, *dropped(model, 4), **FIXED, **how)
        with row(rtol):
            assert not any(runs.warnings)
            assert runs.audit.relative.max() < 100 * rtol


def test_coarse_runs_that_are_millimetres_off_are_told():
    model = grounded()
    q, v = (each[1:] for each in dropped(model, 4))
    how = FIXED | {"t_span": 0.6}
    true = st.simulate(model, q, v, **how, method="tsit5", rtol=1e-10)
    for method, settings in (
        *(("implicit_euler", {"step": 1e-3}), ("implicit_euler", {"step": 1e-4})),
        *(("rk4", {"step": 5e-4}), ("tsit5", {"rtol": 1e-2}), ("ros34pw2", {"rtol": 1e-2})),
    ):
        runs = st.simulate(model, q, v, **how, method=method, **settings)
        off = np.abs(runs.q - true.q)[..., :3].max(axis=(1, 2))
        with row(method, settings):
            assert any("accounted" in each for told in runs.warnings for each in told)
            assert off.max() > 1e-3


def inner_energy(run):
    """Energy of a flight about its centre of mass, J."""
    mass = sum(tail().parameters[name] for name in ("torso_mass", "tail_mass"))
    return run.kinetic - np.sum(run.linear_momentum**2, axis=1) / (2 * mass)


def test_the_energy_of_a_fall_hides_no_loss():
    model = tail()
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7:], v[1], v[3] = 1, (0.5, 0, 0.3, 0), 10, 20  # in one plane: a motion without chaos
    how = {"t_span": 1.0, "method": "implicit_euler", "step": 2e-3, "output_step": 0.1}
    many = st.simulate(model, np.tile(q, (2, 1)), v, **how)
    for run in (st.simulate(model, q, v, **how), many[1]):
        energy = inner_energy(run)
        change = abs(energy[-1] - energy[0]) / energy.max()
        assert change > 0.1 and abs(run.energy[-1] - run.energy[0]) < 1e-3 * run.kinetic[-1]
        assert run.info["imbalance"]["relative"] == pytest.approx(change, rel=0.1)
        assert "not accounted for" in run.info["warnings"][0]
    assert [len(each) for each in many.warnings] == [1, 1]
    # a fall that does not turn has nothing inside to lose: roundings are no loss
    still = st.simulate(model, np.eye(1, model.nq, 3)[0], 0 * v, t_span=20.0)
    assert still.info["warnings"] == [] and still.info["imbalance"]["relative"] < 1e-9


def swings(rtol, runs):
    """Flights whose tail goes 0, 90, -60, 0 degrees, from rest to rest: single, or of rollouts."""
    model, pitch = tail(), np.radians([0, 90, -60, 0])
    times, bends = np.linspace(0, 0.45, 4), np.tile(pitch[:, None], (1, 2))
    law = st.Pfl(model, st.Reference.of_bends(model, times, bends))
    q, v = np.eye(1, model.nq, 3)[0], np.zeros(model.nv)
    how = {"controller": law, "t_span": 0.45, "rtol": rtol, "atol": rtol}
    if runs == 1:
        return [st.simulate(model, q, v, **how)]
    return list(st.simulate(model, np.tile(q, (runs, 1)), v, **how))


def test_a_swing_from_rest_to_rest_balances_and_a_fault_in_it_is_found(monkeypatch):
    """Both ends and the net work are about zero; what was moved is the energy in between. Work that
    is wrong by twice the allowed share of it is told, by half of it not.
    """
    named = audit.named
    for rtol, runs in ((rtol, runs) for rtol in (1e-6, 1e-8, 1e-10) for runs in (1, 3)):
        for run in swings(rtol, runs):
            lost = abs(run.info["imbalance"]["energy_J"]) / inner_energy(run).max()
            with row(rtol, runs):
                assert run.info["warnings"] == [] and lost < 10 * rtol
                assert run.info["imbalance"]["relative"] == pytest.approx(lost, rel=0.1)
    for runs, share in ((1, 2.0), (1, 0.5), (3, 2.0), (3, 0.5)):
        found = swings(1e-8, runs)
        wrong = share * 100 * 1e-8 * inner_energy(found[0]).max()

        def worked(*given, wrong=wrong):
            work, impulses = named(*given)
            return work | {"torques": work["torques"] + wrong}, impulses

        monkeypatch.setattr(audit, "named", worked)
        for run in found:
            assert len(run.info["warnings"]) == (share > 1)
            assert run.info["imbalance"]["energy_J"] == pytest.approx(-wrong, rel=0.1)
        monkeypatch.undo()


def test_rollouts_audit_each_run_up_to_where_it_stopped():
    model = grounded()
    q, v = dropped(model, 6)
    q[2, 2] = 50.0  # never lands
    stops = [("take_off", group) for group in model.contacts]
    runs = st.simulate(model, q, v, **FIXED, t_span=0.5, stop_at=stops)
    for k in range(6):
        books = runs[k].info
        assert books["imbalance"]["relative"] == pytest.approx(runs.audit.relative[k], rel=1e-6)
        assert books["work_J"]["ground"] == pytest.approx(runs.audit.work["ground"][k])
        assert runs.warnings[k] == books["warnings"] == []
    assert runs.audit.work["ground"][2] == 0 and runs.ends[2] == 0.5 > runs.ends[0]
