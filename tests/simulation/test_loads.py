"""Forces from outside during a run."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail.scenes.simulate import scenario_of
from serpentail.show.computing.again import computed_again
from serpentail.simulation.prepare import prepared
from serpentail.simulation.runs.lanes import fit_lanes
from serpentail.simulation.start import Start
from serpentail_scene.purposes import functions_of
from tests.support import zoo
from tests.support.rows import row

from .runs import LEGS, same, starts

WAVES = np.array([[0.02, 0, 0.01], [0, -0.03, 0.02], [0.01, 0.02, 0]])
PLACE = st.Load([0.01, 0.03, -0.02], [-0.1, 0.03, 0.2], WAVES)
PUSH = st.Load("torso", [0.0204, 0.0214], [30.0, 0, -20.0])
TIP = st.Load(("tail", -1), [0, 0.05], [[1e-3, 0, 0], [0, 2e-3, 0]])


def force(load, t):
    return np.array([np.interp(t, load.times, each, left=0, right=0) for each in load.force.T])


def test_runs_are_those_of_forward_dynamics_with_these_forces():
    model = zoo.model("pushed_limbs")
    (q,), (v,) = starts(model, 1)
    q[3:7] /= np.linalg.norm(q[3:7])
    chains, none = {c.name: c.points for c in model.layout.chains}, np.zeros(model.nu)
    tips = [st.Load((name, -1), [0.01, 0.05], WAVES[1:] / 50) for name in chains]
    tips.append(st.Load(("tail", 1), [0.02, 0.08], WAVES[1] / 20))

    def rate(t, y):
        x, tail = y.copy(), np.zeros((model.layout.chains[-1].points.stop, 3))
        x[3:7] /= np.linalg.norm(x[3:7])
        for load in tips:
            tail[chains[load.point[0]]][load.point[1]] += force(load, t)
        moment = np.cross(PLACE.point, st.rotation_matrix(x[3:7]).T @ force(PLACE, t))
        f_ext = model.external_force(force(PLACE, t), moment, tail)
        v_dot = model.forward_dynamics(x[: model.nq], x[model.nq :], none, f_ext)
        return np.append(model.x_dot(x, none)[: model.nq], v_dot)

    y, times = np.append(q, v), np.array([0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.1])
    for span in zip(times[:-1] + 1e-14, times[1:] - 1e-14, strict=True):
        y = solve_ivp(rate, span, y, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    run = st.simulate(model, q, v, 0.1, load=[*tips, PLACE], rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(np.append(run.q[-1], run.v[-1]), y, atol=2e-8)
    assert run.info["imbalance"]["relative"] < 1e-9 < abs(run.info["work_J"]["loads"])


def test_a_short_push_gives_its_impulse_by_every_method_and_in_many_runs():
    model = zoo.model("pushed")
    (q, v), p = starts(model, 9), model.parameters
    fall = 0.05 * (p["torso_mass"] + p["tail_mass"]) * p["gravity"]
    still = st.Pfl(model, ([0.0, 1.0], np.zeros((2, 2))))
    methods = ({"rtol": 1e-2}, {"method": "rk4", "step": 0.01}, {"method": "dop853"})
    for settings, law in [(each, law) for each in methods for law in (None, still)]:
        run = st.simulate(model, q[0], v[0], 0.05, load=PUSH, controller=law, **settings)
        gained, near = run.linear_momentum[-1] - run.linear_momentum[0], 1e-4 if law else 1e-10
        with row(settings, law):
            np.testing.assert_allclose(gained, [0.03, 0, -0.02 - fall], atol=near)
    each = {"t_span": 0.05, "load": [PUSH, PLACE], "output_step": 0.005}
    flights = [st.simulate(model, *start, **each) for start in zip(q, v, strict=True)]
    same(st.simulate(model, q, v, **each), flights)
    start = Start.checked(model, (q, v), 0.05, None)
    assert not fit_lanes(prepared(model, start, None, "tsit5", {"load": PUSH}))


def test_forces_on_feet_act_where_they_are_and_fixed_bases_have_tails_alone():
    model, legs = zoo.model("pushed_ground"), st.Legs.fixed(3.66, -0.26)
    q, v = model.state(height=0.3)
    place = model.contact_points(q, v, [3.66, -0.26] * 2 + [0] * 4)[0][4] - q[:3]
    loads = [st.Load(point, [0, 0.1], WAVES[0] / 10) for point in (("feet", 4), place)]
    one, other = (st.simulate(model, q, v, 0.1, legs=legs, load=load) for load in loads)
    np.testing.assert_allclose(one.q, other.q, atol=1e-9)
    loads = [PLACE, st.Load(("feet", 1), [0, 0.3], WAVES[1])]
    for run in (
        st.simulate(model, q, v, 0.3, legs=LEGS, load=loads, rtol=1e-7),
        st.simulate(zoo.model("pushed_fixed"), [0.3, 0], [0, 1], 0.1, load=TIP),
    ):
        assert run.info["imbalance"]["relative"] < 1e-5 and run.info["work_J"]["loads"] != 0


def test_scenes_have_loads():
    model, tip = zoo.model("pushed"), {"point": ["tail", -1], "times": [0, "50 ms"]}
    table = {"duration": 0.1, "load": [tip | {"force": [["1 mN", 0, 0], [0, "2 mN", 0]]}]}
    found = scenario_of(model, table, Path()).simulate()
    assert (found.q == st.simulate(model, model.state(), t_span=0.1, load=TIP).q).all()
    assert "loads" in functions_of({"simulate": table}) and "loads" not in functions_of({})
    for wrong in (tip, tip | {"force": [1]}):
        with row(wrong), pytest.raises(st.SimulationError, match=r"load\[0\]|Load: times"):
            scenario_of(model, table | {"load": [wrong]}, Path())


def test_what_cannot_be_is_named():
    model = zoo.model("pushed")
    start = model.state()
    for at, times, values, words in (
        ("torso", [0], [[1, 2, 3]], "times: .*two or more"),
        ("torso", [1, 0], WAVES[:2], "times: .*increasing"),
        ("torso", [0, 1], WAVES, r"force \(3, 3\), not \(K,\)"),
        ("torso", [0, 1], [[0, 0, np.nan]] * 2, "force.*nan"),
        ("tale", [0, 1], WAVES[0], "point: value 'tale'"),
        (("tale", 1), [0, 1], WAVES[0], "point: value 'tale'.*tail"),
        (("tail", 4), [0, 1], WAVES[0], "point of tail: value 4.*-4 to 3"),
        ([1, 2, 3, 4], [0, 1], WAVES[0], "point: value"),
    ):
        with row(words), pytest.raises(st.SimulationError, match=words):
            st.simulate(model, start, load=st.Load(at, times, values))
    wrong, refused, zeros = st.simulate, st.SimulationError, np.zeros(4)
    run = st.simulate(model, start, t_span=0.1, load=PUSH)
    for act, error, words in (
        (lambda: wrong(model, start, load=lambda t, q, v: WAVES[0]), refused, "a Load"),
        (lambda: wrong(zoo.model("fixed"), zeros, zeros, load=PUSH), st.ModelError, "loads"),
        (lambda: wrong(zoo.model("pushed_fixed"), zeros, load=PUSH), refused, "pair"),
        (run.vjp, refused, "load: .*no derivatives"),
        (lambda: run.mount_wrench, ValueError, "load"),
    ):
        with row(words), pytest.raises(error, match=words):
            act()
    assert "load" in computed_again(model, run, 1000)
