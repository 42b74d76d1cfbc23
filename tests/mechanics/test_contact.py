"""Contact with the ground: points, velocities, forces, powers and accelerations against plain NumPy
and limiting cases.
"""

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.targets.c.loops import in_loops
from serpentail_codegen.targets.c.straight import straight_line
from tests.functions.test_trees import ARM, LEG, LIMB, WHEEL
from tests.references.body_set import Animal, Chain
from tests.references.contact import Contacts, attitude
from tests.references.parameters import random_states
from tests.support import own_tails, zoo
from tests.support.rows import row

LAWS = ["ground", "smooth", "paper"]  # all laws of friction on one tail
TAILS = ["ground_m2_n2", "ground_arcs", "tree_ground"]
TAILS += [pytest.param("ground_mixed", marks=pytest.mark.slow)]
PAIRS = (LIMB[0][:2], *LEG[1:]), (own_tails.ARC_BODIES[:1], (0.002, 0.05, 0.01), LEG[2])
SIDES = [Chain(*each, mirrored=left) for each in PAIRS for left in (False, True)]
TREE = {"segments": own_tails.LINK_BODIES[1:2], "mount_angles": own_tails.TILT}
TREE |= {"chains": (*SIDES, Chain((*ARM, WHEEL), PAIRS[1][1]))}
TREE = Animal(**own_tails.VALUES, **TREE)
UPRIGHT = np.array([0, 0, 0, 1.0, 0, 0, 0, 0, 0])


def untilted(name):
    """A model whose tail is mounted in torso axes, as that of the reference is."""
    model = zoo.model(name)
    return model.with_parameters(mount_angles=[0, 0, 0]) if name == "ground_mixed" else model


def reference_of(name):
    """The reference of a model."""
    return Contacts(untilted(name), TREE if name == "tree_ground" else None)


def near_ground(model, seed, count=20):
    """Random states with the torso about as high as the legs are long: some points touch."""
    rng = np.random.default_rng(seed)
    q, v, _, tau = random_states(model.segments, seed, count, "random")
    q, v, tau = q[:, : model.nq], v[:, : model.nv], tau[:, : model.nv - 6]
    feet = "feet" in model.contacts
    q[:, 2] = rng.uniform(-0.05, 0.15 if feet else 0.02, count)
    q[:, 7:] *= 0.5
    lowest, highest = [3, -1.5, 3, -1.5, *[-80] * 4], [4.2, 0, 4.2, 0, *[80] * 4]
    legs = rng.uniform(lowest, highest, (count, 8)) if feet else [None] * count
    points = sum(entry["count"] for entry in model.manifest["contacts"])
    return q, v, tau, rng.normal(0, 2e-3, (count, 2 * points)), legs


def each(model, seed=3, count=20):
    """The same, one by one."""
    return zip(*near_ground(model, seed, count), strict=True)


def test_legs_have_the_numbers_of_the_mechanism():
    """gamma = 210 deg: the sole is level; (y, z) of A, M and T from B in mm."""
    expected = {
        -15: [(-29.46, -14.96), (4.35, -24.02), (20.35, -24.02)],
        -75: [(-46.43, -31.93), (-37.37, -65.74), (-21.37, -65.74)],
    }
    for delta, points in expected.items():
        legs = np.radians([210, delta, 210, delta, 0, 0, 0, 0])
        found, _ = zoo.model("feet").contact_points(UPRIGHT, np.zeros(8), legs)
        for side in (0, 3):
            np.testing.assert_allclose(1e3 * found[side : side + 3, 1:], points, atol=0.006)
        np.testing.assert_allclose(found[:, 0], [0.0225] * 3 + [-0.0225] * 3)
        assert abs(found[1, 2] - found[2, 2]) < 1e-17


@pytest.mark.slow
def test_points_of_a_tail_on_a_tilted_mount_are_those_of_its_kinematics():
    model = zoo.model("ground_mixed")
    tail = slice(6, 6 + model.contacts["tail"])
    for q, v, _, _, legs in each(model, count=3):
        positions, velocities = model.contact_points(q, v, legs)
        np.testing.assert_allclose(positions[tail], model.tail_points(q)[1:], atol=1e-14)
        moving = (model.tail_point_jacobians(q) @ v).reshape(-1, 3)[1:]
        np.testing.assert_allclose(velocities[tail], moving, atol=1e-13 * np.abs(moving).max())


def test_the_torso_touches_by_its_lowest_point():
    """No point of the ellipsoid is lower, and it lies on the ellipsoid."""
    model, rng = zoo.model("ground"), np.random.default_rng(1)
    axes, sphere = np.array(model.parameters["torso_semi_axes"]), rng.normal(size=(20_000, 3))
    surface = axes * sphere / np.linalg.norm(sphere, axis=1)[:, None]
    for q in random_states(1, 5, 10, "random")[0]:
        lowest = model.contact_points(q, np.zeros(8), np.zeros(8))[0][-1]
        world = q[:3] + surface @ attitude(q[3:7]).T
        assert lowest[2] - 1e-15 <= world[:, 2].min() <= lowest[2] + 1e-3
        place = attitude(q[3:7]).T @ (lowest - q[:3])
        assert np.sum((place / axes) ** 2) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("name", [*LAWS, *TAILS])
def test_points_forces_powers_and_accelerations_are_the_references(name):
    """Eqs. 35 to 37, and the residual of H v_dot + C = [0; tau] + J^T f; a drive of the legs works
    against the ground's force on what it moves in the torso.
    """
    model = untilted(name)
    reference, touched, driven = reference_of(name), 0, 0.0
    for q, v, tau, bristles, legs in each(model, count=20 if "feet" in model.contacts else 12):
        positions, velocities = model.contact_points(q, v, legs)
        places, motion = reference.positions(q, legs).real, reference.velocities(q, v, legs)
        np.testing.assert_allclose(positions, places, atol=3e-15 * (1 + abs(q[:3]).max()))
        np.testing.assert_allclose(velocities, motion, atol=1e-13 * abs(velocities).max())

        v_dot, rates, forces = model.contact_dynamics(q, v, tau, bristles, legs)
        expected, by_law = reference.laws(q, v, bristles, legs)
        most = 1e-12 * (1 + abs(expected).max())
        np.testing.assert_allclose(forces, expected, rtol=1e-9, atol=most)
        np.testing.assert_allclose(rates, by_law, rtol=1e-9, atol=1e-9 * (1 + abs(by_law).max()))
        load = np.einsum("kai,ka->i", reference.jacobians(q, legs), expected)
        H, bias = model.mass_matrix(q), model.bias_force(q, v)
        residual, scale = H @ v_dot + bias - load, np.sqrt(np.diag(H))
        residual[6:] -= tau
        largest = ((np.abs(load) + np.abs(bias)) / scale).max()
        assert np.abs(residual / scale).max() < 1e-10 * largest

        given = [each for each in (q, v, tau, bristles, legs) if each is not None]
        *same, heights, powers = model.kernel("contact_rates")(*given)
        for found, value in zip(same, (v_dot, rates, forces), strict=True):
            np.testing.assert_allclose(found, value, rtol=1e-9, atol=1e-9 * np.abs(value).max())
        rising = np.stack([places[:, 2], motion[:, 2]], axis=1)
        np.testing.assert_allclose(np.reshape(heights, (-1, 2)), rising, rtol=1e-9, atol=1e-11)
        still = None if legs is None else np.r_[legs[:4], np.zeros(4)]
        drift = motion - reference.velocities(q, v, still)
        works = [np.sum(motion * expected), -np.sum(drift * expected)]
        np.testing.assert_allclose(powers, works, rtol=1e-8, atol=1e-9 * np.abs(works).max())
        touched, driven = touched + np.count_nonzero(expected[:, 2]), max(driven, abs(works[1]))
    assert touched > 20 and driven > ("feet" in model.contacts) - 1


@pytest.mark.parametrize("name", LAWS)
def test_operations_and_their_derivatives_are_those_of_the_functions(name):
    """By CasADi; slopes by central differences of the compiled function, and finite in the air."""
    model = zoo.model(name)
    f = model.casadi.contact_dynamics
    symbols = [casadi.MX.sym(name, f.size1_in(name)) for name in f.name_in()]
    slope = casadi.Function("slope", symbols, [casadi.jacobian(f(*symbols)[0], symbols[1])])
    units = 1e-5 * np.eye(model.nv)
    for state in each(model, count=6):
        q, v, *others = state
        for function, given in (
            ("contact_dynamics", state),
            ("contact_points", (q, v, others[-1])),
        ):
            expected = getattr(model, function)(*given)
            for one, other in zip(getattr(model.casadi, function)(*given), expected, strict=True):
                scalars, most = np.array(one).reshape(other.shape), 1e-9 * (1 + np.abs(other).max())
                np.testing.assert_allclose(scalars, other, atol=most)
        exact = np.array(slope(*state))
        ahead, behind = (
            model.contact_dynamics(q, v + side * units, *others)[0] for side in (1, -1)
        )
        most = 1e-5 * np.abs(exact).max()
        np.testing.assert_allclose(exact, (ahead - behind).T / 2e-5, rtol=1e-3, atol=most)
    assert np.isfinite(np.array(slope(q + np.eye(model.nq)[2], v, *others))).all()


def test_a_flight_pays_nothing_for_contact():
    """Functions of a flight scene have the same C in a scene with contacts."""
    for name in ("mass_matrix", "forward_dynamics"):
        flight, ground = (Tail(2, 2, contacts=contacts) for contacts in ((), ("feet",)))
        for printed in (straight_line, in_loops):
            texts = [printed(assemble(FUNCTIONS[name], t), "double", "x") for t in (flight, ground)]
            assert texts[0].lines == texts[1].lines, (name, printed)


def test_what_is_given_must_fit_the_contacts():
    ground, air = zoo.model("ground"), zoo.model("m1_n3")
    v, tau, legs = np.zeros(8), np.zeros(2), np.zeros(8)
    for words, call in {
        "feet.*legs": lambda: ground.contact_points(UPRIGHT, v),
        r"legs.*\(4,\).*\(8,\)": lambda: ground.contact_points(UPRIGHT, v, np.zeros(4)),
        r"bristles.*\(10, 2\).*\(20,\)": lambda: ground.contact_dynamics(
            UPRIGHT, v, tau, np.zeros((10, 2)), legs
        ),
    }.items():
        with row(words), pytest.raises(st.StateError, match=words):
            call()
    with pytest.raises(st.ModelError, match="contact_points"):
        air.contact_points(UPRIGHT, v)
    with pytest.raises(st.StateError, match=r"no feet.*contacts"):  # all on the ground have feet
        air.kernels.with_legs("energy", legs, UPRIGHT, v, out=None)
    for name, value in (("mu", -0.1), ("K_n", 0.0), ("D_f", 0.0), ("K_f", -1), ("L_m2t", -1)):
        with row(name), pytest.raises(st.ModelError, match=f"{name}.*{value}"):
            ground.with_parameters(**{name: value})
