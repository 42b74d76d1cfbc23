"""Joints that follow a schedule: legs without mass, flights, landings, refusals."""

import re

import numpy as np
import pytest

import serpentail as st
from serpentail.model.weight import total_mass, weight_of
from tests.functions.test_tree_limits import RUNS, built
from tests.references.metrics import block_error
from tests.support import zoo
from tests.support.bodies import FIN
from tests.support.rows import row
from tests.support.scenes import SCENES


def test_prescribed_legs_without_mass_are_those_of_the_paper():
    """Points, forces and v_dot of a kick, its motion, and what the drives do; a heel that never
    turns is where the paper's A is.
    """
    paper, names = zoo.model("ground"), ("L_h2d", "L_d2k", "L_k2a", "L_a2m", "L_m2t")
    h2d, d2k, k2a, a2m, m2t = (float(paper.parameters[name]) for name in names)
    bones = {"hip": h2d + k2a, "knee": d2k, "heel": a2m, "ankle": m2t}
    light = {"mass": 0, "radius": 0}
    joints = [light | {"name": name, "length": length} for name, length in bones.items()]
    leg = {"kind": "limb", "pair": True, "drive": "prescribed", "joints": joints}
    leg |= {"mount": list(paper.parameters["hip"])}
    keys = {"contacts": ["tail", "hind", "torso"], "parameters": {}}
    keys |= {"functions": [*RUNS, "contact_points", "contact_dynamics", "implicit"]}
    limbs = built("kicker", chain={"hind": leg}, **keys)

    def bent(gamma, delta):
        sole = gamma - paper.parameters["delta_m"]
        return [gamma - np.pi, delta - gamma, 0, sole - delta + np.pi]

    kick = {"at": 0.01, "duration": 0.03}
    legs = st.Legs.moves(3.67, -0.26, [kick | {"delta": -1.2, "shape": "quintic"}])
    given = st.Prescribed.moves({"hind": bent(3.67, -0.26)}, [kick | {"hind": bent(3.67, -1.2)}])
    start = paper.state(height=0.055, spin=[0.3, -0.2, 0.1], velocity=[0.1, 0.2, -0.3])
    settings = {"rtol": 1e-7, "output_step": 2e-3, "t_span": 0.06}
    run = st.simulate(paper, start, legs=legs, **settings)
    other = st.simulate(limbs, start, prescribed=given, **settings)
    # where the points of feet, tail and torso are among those of the limbs
    feet = np.r_[3 + 1 + np.arange(3), 3 + 5 + np.arange(3)]
    places = np.r_[feet, 0:3, 11]
    bristles = np.zeros((len(run.t), 12, 2))
    bristles[:, places] = run.contact.bristles
    state = run.q, run.v, run.tau
    numbers = bristles.reshape(len(run.t), -1), *other.given
    own = np.concatenate(legs.curve.at(run.t)[:2], axis=1)
    v_dot, _, forces = limbs.contact_dynamics(*state, *numbers)
    expected = paper.contact_dynamics(*state, run.contact.bristles.reshape(len(run.t), -1), own)
    assert block_error(v_dot, expected[0]) < 1e-12
    assert np.abs(forces[:, places] - expected[2]).max() < 1e-12 * np.abs(expected[2]).max()
    points = limbs.contact_points(*state[:2], *other.given)[0][:, feet]
    joints = paper.leg_points(run.q, own[:, :4])[:, :, 3:].reshape(len(run.t), 6, 3)
    assert np.abs(points - joints).max() < 1e-15

    assert run.contact.total.max() > 5 * weight_of(paper.parameters)
    np.testing.assert_allclose(other.q[-1], run.q[-1], atol=1e-5)
    work = [each.info["work_J"][name] for each, name in ((run, "legs"), (other, "prescribed"))]
    assert work[1] == pytest.approx(work[0], rel=1e-4)
    assert other.info["imbalance"]["relative"] < 1e-5


SCHEDULE = """
[simulate]
duration = 0.2
start = { height = 1, bend = [0.1, -0.2], bend_rate = [1, 2], spin = [0.5, -1, 2] }
[simulate.prescribed]
hind = [0.3, -0.5, 0.2]
moves = [{ at = 0.05, duration = "80 ms", hind = [-0.6, 0.9, 0] }]
"""


def test_a_flight_with_prescribed_legs_keeps_its_books(tmp_path):
    """Energy, momentum, the velocity of the COM; wrong schedules, and what does not follow yet."""
    limb = 'kind = "limb"\ndrive = "prescribed"'
    text = (SCENES / "rat_legs.toml").read_text().replace('kind = "limb"', limb)
    (tmp_path / "rat.toml").write_text(text + SCHEDULE)
    scene = st.scenario(tmp_path / "rat.toml")
    rat, legs, run = scene.model, scene.settings["prescribed"], scene.simulate(rtol=1e-10)
    start, move = rat.state(height=1), {"at": 0, "duration": 1, "hind": [1, 2, 3]}
    assert run.info["imbalance"]["relative"] < 1e-8
    assert max(abs(each) for each in run.info["work_J"].values()) > 1e-5
    assert np.ptp(run.angular_momentum, axis=0).max() < 1e-7 * np.abs(run.angular_momentum).max()
    momentum = total_mass(rat.parameters) * rat.center_of_mass(run.q, run.v, *run.given)[1]
    np.testing.assert_allclose(momentum, run.linear_momentum, atol=1e-14)
    assert "has prescribed joints" in run.view(tmp_path / "page.html", live=True).read_text()
    read = st.Trajectory.load(run.save(tmp_path / "run"))
    assert (read.given[0] == run.given[0]).all() and read.names == run.names
    table, moves = {"hind": [0, 0, 0]}, st.Prescribed.moves
    short = moves(table, [move | {"at": 0.1, "duration": 0.01}])  # which no step misses
    assert abs(st.simulate(rat, start, 0.2, prescribed=short).info["imbalance"]["energy_J"]) < 1e-6
    both = np.array([start.q] * 2), np.array([start.v] * 2), 0.1
    wrong = {
        "blend": lambda: st.Prescribed([0, 1], {"hind": np.eye(3)[:2]}, "linear"),
        "moves[0].rate": lambda: moves(table, [move | {"rate": 3}]),
        "moves[1].at": lambda: moves(table, [move, move]),
        "fore": lambda: st.simulate(rat, start, prescribed=moves(table | {"fore": [0]})),
        "hind_right": lambda: st.simulate(rat, start, prescribed=moves({"hind": [0]})),
        "prescribed: value None": lambda: st.simulate(rat, start),
        "q0": lambda: st.simulate(rat, *both, prescribed=legs),
        "plan": lambda: st.plan(rat, start=start, duration=0.1),
        "step": lambda: rat.step(start.q, start.v, [0, 0], 1e-3),
        "export": lambda: st.export(rat, "mjcf", tmp_path / "rat.xml"),
        "Pfl": lambda: st.simulate(rat, start, prescribed=legs, controller=st.Pfl(rat, run)),
    }
    for field, call in wrong.items():
        with row(field), pytest.raises(st.SerpentailError, match=re.escape(field)):
            call()


def test_prescribed_arcs_land_and_keep_their_books():
    """A mirrored pair that pushes off by bending: the ground acts on its drives, too."""
    keys = {"parameters": {}, "contacts": ["fin", "torso"], "functions": [*RUNS, "implicit"]}
    fins = built("fins", chain={"fin": FIN | {"drive": "prescribed"}}, **keys)
    move = {"at": 0.01, "duration": 0.05, "fin": [1.5, 0.9]}
    start, moves = fins.state(height=0.015), st.Prescribed.moves({"fin": [0, 0]}, [move])
    run = st.simulate(fins, start, 0.08, prescribed=moves, rtol=1e-7)
    assert run.contact.of("fin_left").total.max() > weight_of(fins.parameters)
    assert run.info["imbalance"]["relative"] < 1e-6 and run.info["work_J"]["prescribed"] > 0.02
