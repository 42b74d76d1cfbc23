"""Limits in which models of several chains are models of one tail; what mirror images and
conservation say; how far a gecko swings its tail to roll over.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.weight import weight_of
from serpentail_codegen.scene.parse import parse_scene
from tests.functions.test_trees import FORWARD
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
)
from tests.support import own_tails, zoo
from tests.support.models import folder_of
from tests.support.rows import row

FEW = ["mass_matrix", "bias_force", "forward_dynamics"]
RUNS = ["forward_dynamics", "energy", "momentum", "tail_points", "rollout"]
ALONE = {"kind": "articulated", "segments": 1, "links": 3, "parameters": zoo.TORSO | zoo.MOUNTED}


def built(name="limit", **changes):
    """A model of a tail and the given chains."""
    tables = {"functions": FEW, "targets": ["c"]} | ALONE | changes
    return st.load(folder_of(parse_scene(tables, name)))


def test_legs_and_limbs_without_mass_change_nothing():
    link = {"links": 1, "length": 0.03, "mass": 1e-11, "link_inertia": [1e-16, 1e-17, 1e-16]}
    bone = {"length": "3 cm", "mass": 1e-14, "inertia": [1e-20, 1e-21, 1e-20]}
    joints = [bone | {"name": "hip"}, bone | {"name": "knee", "center": "0, -8, 0 mm"}]
    place = {key: zoo.CHAINS["leg"][key] for key in ("pair", "mount", "mount_angles")}
    for kind, most in (
        ({"kind": "articulated", "segments": [link]}, 1e-6),
        ({"kind": "limb", "joints": joints}, 1e-9),
    ):
        with row(kind):
            tree, alone = built(chain={"leg": place | kind}), built()
            q, v, _, tau = next(own_tails.states(tree.nq, 1))
            tau[2:] = 0
            v_dot = alone.forward_dynamics(q[:9], v[:8], tau[:2])
            assert block_error(tree.forward_dynamics(q, v, tau)[:8], v_dot) < most


def test_it_does_not_matter_which_chain_is_the_tail():
    """The same animal with the chains exchanged: the same H, C and v_dot with exchanged rows."""
    second = {"kind": "continuum", "segments": 1, "mass": "2 g", "length": "90 mm"}
    placed = {"mount": [0.0, 0.05, 0.01], "mount_angles": [0.2, 0.1, 3.0]}
    first = {"kind": "articulated", "segments": 1, "links": 3, "mass": "3 g", "length": "0.2 m"}
    first |= {"mount": zoo.MOUNTED["tail_mount"], "mount_angles": zoo.MOUNTED["mount_angles"]}
    one = built(
        chain={"second": second | placed},
        parameters=ALONE["parameters"] | {"tail_mass": 3e-3, "tail_length": 0.2},
    )
    of_tail = {"tail_mass": 2e-3, "tail_length": 0.09, "tail_mount": placed["mount"]}
    parameters = zoo.TORSO | of_tail | {"mount_angles": placed["mount_angles"]}
    keys = {"kind": "continuum", "segments": 1, "samples": 5, "parameters": parameters}
    tables = {"functions": FEW, "targets": ["c"]} | keys | {"chain": {"first": first}}
    other = st.load(folder_of(parse_scene(tables, "other")))
    q, v, _, tau = next(own_tails.states(one.nq, 1))
    swap = np.r_[0:6, 8:10, 6:8]
    q2, v2, tau2 = q[np.r_[0:7, 9:11, 7:9]], v[swap], tau[[2, 3, 0, 1]]
    H = one.mass_matrix(q)
    assert mass_matrix_error(other.mass_matrix(q2), H[np.ix_(swap, swap)]) < 1e-14
    assert force_error(other.bias_force(q2, v2), one.bias_force(q, v)[swap], H) < 1e-13
    most = FORWARD * equilibrated_condition(H)
    expected = one.forward_dynamics(q, v, tau)[swap]
    assert block_error(other.forward_dynamics(q2, v2, tau2), expected) < most


@pytest.mark.slow  # it compiles a model
def test_legs_with_mass_push_with_less_than_20_body_weights():
    """Torques bounded by half of a jerboa's; work, impulses and the motion agree."""
    run = (rat := st.scenario("rat_kick")).simulate()
    assert 10 < run.info["peaks"]["all"][0] / weight_of(rat.model.parameters) < 20
    assert run.info["imbalance"]["relative"] < 1e-4
    assert {each["group"] for each in run.events} == {*rat.model.contacts}
    alone = st.build("rat_kick", chain={}, contacts=[], functions=["mount_wrench"])
    for k in np.flatnonzero(run.contact.of("tail").total == 0)[::20]:
        q, v, bristles = run.q[k], run.v[k], run.contact.bristles[k].ravel()
        v_dot = rat.model.contact_dynamics(q, v, run.tau[k], bristles)[0]
        expected = alone.mount_wrench(*(x[:-6] for x in (q, v, v_dot)))  # of the two legs
        for found, part in zip(run.mount_wrench, expected, strict=True):
            with row(k):
                np.testing.assert_allclose(found[k], part, atol=1e-9 * abs(part).max())


def test_a_reaction_wheel_turns_the_body_back():
    """By J / (J + I) of its own turn, if all lies on its axis; its rotor only resists the motor."""
    J, rotor, moments = 7e-8, 2e-7, [4e-8, 7e-8, 4e-8]
    spin = {"name": "spin", "axis": "y", "tip": [0, 0, 0], "mass": 3e-3, "inertia": moments}
    wheel = {"kind": "limb", "mount": [0, 0.01, 0], "joints": [spin | {"rotor": rotor}]}
    along = zoo.TORSO | {"tail_mount": [0, -0.04, 0]}
    model = built("wheel", chain={"wheel": wheel}, parameters=along)
    H, (_, Iy, _) = model.mass_matrix(model.neutral().q), along["torso_inertia"]
    of_tail = 3 * model.parameters["link_inertia"][1]
    assert H[4, 8] / H[4, 4] == pytest.approx(J / (J + Iy + of_tail), rel=1e-12)
    assert H[8, 8] == pytest.approx(J + rotor, rel=1e-12)


def test_a_single_hinge_has_spring_damping_and_stops():
    """It moves as without them under their torque, and its run keeps its books."""
    spin = {"name": "spin", "length": 0.02, "mass": 1e-3, "inertia": [3e-8, 1e-9, 3e-8]}
    passive = {"stiffness": 1e-4, "damping": 1e-6, "stops": [-1.0, 0.3], "stop_stiffness": 1e-2}
    leg = {"kind": "limb", "mount": [0, 0.01, -0.02], "joints": [spin]}
    tables = leg, leg | {"joints": [spin | passive]}
    bare, own = (built("spin", functions=RUNS, chain={"leg": each}) for each in tables)
    start = own.state(height=1, bend=[0.1, -0.2, 0.2], spin=[3, 2, 1], bend_rate=[1, 2, 3])
    found, tau = own.forward_dynamics(start.q, start.v, [0, 0, 0]), [0, 0, -2.3e-5]
    np.testing.assert_allclose(found, bare.forward_dynamics(start.q, start.v, tau), rtol=1e-12)
    run = st.simulate(own.with_parameters(leg_damping=2e-6), start, 0.1, rtol=1e-10)
    assert run.info["imbalance"]["relative"] < 1e-8 and run.info["work_J"]["damping"] < -1e-7


def test_a_wheel_may_spin_in_the_body():
    """The robot's tails begin in the body and its wheel is there: no reason to warn; many at once
    are what each is alone.
    """
    robot = st.build("robot_two_tails", targets=["c"])
    v = np.zeros((3, robot.nv))
    v[:, robot.layout["wheel"].v] = [[0], [40], [80]]
    q = np.tile(robot.state(height=1.0).q, (3, 1))
    runs = st.simulate(robot, q, v, 0.2, output_step=0.05)
    alone = st.simulate(robot, q[2], v[2], 0.2, output_step=0.05)
    assert not alone.warnings
    assert alone["wheel_spin"][-1] > 15
    assert (runs.q[2] == alone.q).all()


# ---- the gecko -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def gecko():
    """The packaged gecko with legs of mass."""
    return st.build("gecko_legs", functions=["+implicit"], targets=["c"])


def test_pairs_at_equal_angles_neither_yaw_nor_roll(gecko):
    """Of the gecko, whose tail turns upward alone, and of a rat with three joints in each leg."""
    rat = st.build("rat_legs", targets=["c"])
    moves = ((0.3, -0.5, 0.2), (2, -7, 3), (1e-3, 3e-3, -1e-3))
    for model, pairs, tail in ((gecko, ("hind", "fore"), (0.4, 3.0)), (rat, ("hind",), (0, 0))):
        q, v, tau = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.layout.nt)
        q[3], q[7], v[6] = 1, *tail
        legs = [[model.layout[f"{pair}_{side}"] for side in ("right", "left")] for pair in pairs]
        for leg in (each for pair in legs for each in pair):
            for x, own, values in zip((q, v, tau), (leg.q, leg.v, leg.tau), moves, strict=True):
                x[own] = values[: x[own].size]
        v_dot = model.forward_dynamics(q, v, tau)
        with row(model.name):
            assert np.abs(v_dot[[0, 4, 5]]).max() < 1e-12 * np.abs(v_dot).max()
            for right, left in legs:
                np.testing.assert_allclose(v_dot[left.v], v_dot[right.v], rtol=1e-11)


@pytest.mark.parametrize("method", ["tsit5", "dp8", "rk4", "ros34pw2", "implicit_euler"])
def test_a_flight_keeps_momentum_and_energy(gecko, method):
    q, v = gecko.state(height=1.0).q, 3 * np.random.default_rng(2).normal(size=gecko.nv)
    fixed = {"rk4": {"step": 1e-4}, "implicit_euler": {"step": 2e-6}}
    settings = fixed.get(method, {"rtol": 1e-8})
    motion = st.simulate(gecko, q, v, t_span=0.05, method=method, **settings)
    (_, before), (_, after) = (gecko.momentum(motion.q[k], motion.v[k]) for k in (0, -1))
    most = 1e-3 if method == "implicit_euler" else 1e-6
    assert np.abs(after - before).max() < most * np.abs(before).max()
    energy = motion.kinetic + motion.potential
    assert abs(energy[-1] - energy[0]) < most * motion.kinetic[0]


def test_rolling_over_takes_a_gecko_more_tail_because_it_has_legs():
    """The roll by momentum of a straight tail at right angles that circles about the body's axis,
    with B and the root on the axis: Siddall's gecko needs 345 degrees for 180, without legs 217.
    """
    tail = {"links": 1, "functions": ["mass_matrix"], "targets": ["c"]}  # which does not curl
    for chains, expected, error in ({}, 345, 4), ({"chain": {}}, 217, 2):
        model = st.build("gecko_legs", **tail, **chains)
        q = np.zeros(model.nq)
        q[3], q[7] = 1, np.pi / 2  # beta_1 then turns the tail about the body's axis
        H = model.mass_matrix(q)
        with row(expected):
            assert 180 * abs(H[4, 4] / H[4, 7]) == pytest.approx(expected, abs=error)
