"""Models of several chains: against sets of bodies in 60 digits, and against Pinocchio."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_scene.parameters import PASSIVE
from tests.functions.test_own_segments import accelerated
from tests.references.body_set import Animal, Chain, Hinge, Link
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
    near,
)
from tests.references.passive import PassiveTail
from tests.support import own_tails, zoo
from tests.support.bodies import FIN, OWN_LINKS
from tests.support.program_runs import FLOATS, interpreted
from tests.support.rows import row

FORWARD = 5e-15  # of v_dot, times the condition number of H
LEG = own_tails.LINK_BODIES[1:2], (0.01, 0.02, -0.003), (0.4, -0.2, 1.3)
# the same moments as of the ellipsoids that the scene describes
THIRD = (Link(5e-4, 0.02, 0.01, tuple(1e-4 * np.array([1.0841e-4, 1.682e-5, 1.0841e-4]))),) * 2
TREE = Animal(
    segments=own_tails.LINK_BODIES[:2],
    mount_angles=own_tails.TILT,
    **own_tails.VALUES,
    chains=(
        Chain(*LEG),
        Chain(*LEG, mirrored=True),
        Chain(own_tails.ARC_BODIES[:1], (0.002, 0.05, 0.01)),
        Chain((THIRD,), (-0.004, 0.01, 0.02)),
    ),
)
SHANK = Hinge(0, 1e-3, (0, -0.008, 0), (5e-8, 4e-9, 5e-8), (0, -0.02, 0))
THIGH = Hinge(0, 2e-3, (0, -0.015, 0), (9.64e-8, 1.28e-8, 9.64e-8), (0, -0.03, 0))
LIFT = (1.5e-3, (0.002, -0.008, -0.004), (6e-8, 4e-8, 5e-8), (0.005, -0.02, 0.003))
ARM = (Hinge(2, rotor=2e-7), Hinge(0, *LIFT, rotor=3e-7))
WHEEL = Hinge(1, 3e-3, inertia=(4e-8, 7e-8, 4e-8))
LIMB = ((Hinge(1), THIGH, SHANK), *LEG[1:])
LIMBS = Animal(
    segments=own_tails.LINK_BODIES[1:2],
    mount_angles=own_tails.TILT,
    **own_tails.VALUES,
    chains=(Chain(*LIMB), Chain(*LIMB, mirrored=True), Chain((*ARM, WHEEL), (0.002, 0.05, 0.01))),
)
# the passive chains of models: their first coordinate, how many, the names of their parameters
PASSIVE_CHAINS = {
    "tree": ((4, 2, "leg"), (6, 2, "leg"), (10, 2, "third")),
    "limbs": ((2, 3, "leg"), (5, 3, "leg")),
}


def passive(model, q, v):
    """Generalised forces of springs, damping and stops of a model of the zoo, chain by chain."""
    force = np.zeros(model.nv)
    for first, count, owner in PASSIVE_CHAINS[model.name]:
        names = {f"{owner}_{p.name.removeprefix('tail_')}": p.name for p in PASSIVE}
        own = {names[n]: x for n, x in model.parameters.items() if n in names}
        angles, rates = q[7 + first :][:count], v[6 + first :][:count]
        force[6 + first :][:count] = PassiveTail(own, count).force(angles, rates)
    return force


@pytest.mark.slow  # 60 digits
@pytest.mark.parametrize(("name", "bodies"), [("tree", TREE), ("limbs", LIMBS)])
def test_a_tree_is_its_set_of_bodies(name, bodies):
    model = zoo.model(name)
    for q, v, v_dot, tau in own_tails.states(model.nq, 1):
        H, force, bias = own_tails.dynamics(bodies, q, v, v_dot)
        own = passive(model, q, v)
        assert mass_matrix_error(model.mass_matrix(q), H) < 1e-13
        assert force_error(model.inverse_dynamics(q, v, v_dot), force + own, H) < 1e-13
        assert force_error(model.bias_force(q, v), bias + own, H) < 1e-13
        second = model.layout.chains[1].v.start
        assert (model.mass_matrix(q)[6:second, second:] == 0).all()  # chains do not couple

        expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - bias - own)
        most = FORWARD * equilibrated_condition(H)
        assert block_error(model.forward_dynamics(q, v, tau), expected) < most
        graph = model.casadi.forward_dynamics(q, v, tau).full().ravel()
        assert block_error(graph, expected) < most
        np.testing.assert_allclose(model.energy(q, v)[0], bodies.energy(q, v)[0], rtol=1e-14)
        for found, momentum in zip(model.momentum(q, v), bodies.momentum(q, v), strict=True):
            assert np.abs(found - momentum).max() < 1e-13 * np.abs(momentum).max()
        assert np.abs(model.tail_points(q) - bodies.tail_points(q)).max() < 1e-15

        # in the air: torso and acceleration by the momentum of the bodies; M' by that of H
        x, h = np.concatenate([q[3:], v[6:]]), np.array(bodies.momentum(q, v)[1], float)
        y, J = model.airborne_rates_derivatives(x, tau, h)
        nt, most = model.layout.nt, 1e-13 * equilibrated_condition(H)
        assert np.abs(y[-3:] - v[3:6]).max() < most * np.abs(v).max()
        assert block_error(y[4 + nt : -3], expected[6:]) < most
        left = H[6:, 6:] - H[6:, :6] @ np.linalg.solve(H[:6, :6], H[:6, 6:])
        assert np.abs(J[4 + nt : -3, -nt:] @ left - np.eye(nt)).max() < most


@pytest.mark.parametrize("name", ["tree", "limbs"])
def test_loads_do_their_work(name):
    """J^T f of a force at each point, by the points' velocities along v_dot of a load alone."""
    model, step = zoo.model(name), 1e-6
    q, v, _, tau = next(own_tails.states(model.nq, 1))
    q[3:7] /= np.linalg.norm(q[3:7])
    rng = np.random.default_rng(4)
    f_ext = rng.normal(size=len(model.external_force()))
    change = model.forward_dynamics(q, v, tau, f_ext) - model.forward_dynamics(q, v, tau)
    force, way = model.mass_matrix(q) @ change, rng.normal(size=model.nv)
    ahead, behind = (model.tail_points(model.integrate(q, way, h)) for h in (step, -step))
    power = f_ext[:3] @ way[:3] + f_ext[3:6] @ way[3:6]
    power += np.sum(f_ext[6:].reshape(-1, 3) * (ahead - behind)) / (2 * step)
    assert way @ force == pytest.approx(power, rel=1e-8)


# ---- random trees -------------------------------------------------------------------------------


def random_chain(rng):
    """The table of a chain, and its segments as sets of links."""
    tables, segments = [], []
    for _ in range(rng.integers(1, 4)):
        n = int(rng.integers(1, 4))
        masses, lengths = 10 ** rng.uniform(-3.5, -2, n), rng.uniform(0.01, 0.05, n)
        centers = lengths * rng.uniform(0.3, 0.7, n)
        r = rng.uniform(0.3, 1, (n, 3))
        moments = (r.sum(axis=1, keepdims=True) - r) * 1e-4 * masses[:, None]
        tables.append(
            {
                "links": n,
                "link_masses": masses.tolist(),
                "link_lengths": lengths.tolist(),
                "link_centers": centers.tolist(),
                "link_inertias": moments.tolist(),
            }
        )
        rows = zip(masses, lengths, centers, moments, strict=True)
        segments.append([Link(*row[:3], tuple(row[3])) for row in rows])
    mount, angles = rng.normal(size=3) * 0.05, rng.uniform(-2, 2, 3)
    table = {"kind": "articulated", "segments": tables}
    place = {"mount": mount.tolist(), "mount_angles": angles.tolist()}
    return table | place, (tuple(segments), tuple(mount), tuple(angles))


def random_limb(rng):
    """The table of a limb of one to five hinges, some without bodies, and the same as hinges."""
    joints, hinges, count, bare, axis = [], [], int(rng.integers(1, 6)), False, 0
    anywhere = bool(rng.integers(2))
    for k in range(count):
        axis = (axis + int(rng.integers(1, 3))) % 3 if bare else int(rng.integers(3))
        joint = {"name": f"j{k}", "axis": "xyz"[axis]}
        bare = k < count - 1 and rng.integers(3) == 0
        if bare:
            joints.append(joint)
            hinges.append(Hinge(axis))
            continue
        mass, length = 10 ** rng.uniform(-3.5, -2), rng.uniform(0.01, 0.05)
        r = rng.uniform(0.3, 1, 3)
        moments = ((r.sum() - r) * 1e-4 * mass).tolist()
        tip = (rng.normal(size=3) * 0.03 if anywhere else np.array([0, -length, 0])).tolist()
        center = (rng.normal(size=3) * 0.02 * [anywhere, 1, anywhere]).tolist()
        joint |= {"mass": mass, "center": center, "inertia": moments}
        joint |= {"tip": tip} if anywhere else {"length": length}
        joints.append(joint)
        hinges.append(Hinge(axis, mass, tuple(center), tuple(moments), tuple(tip)))
    mount, angles = rng.normal(size=3) * 0.05, rng.uniform(-2, 2, 3)
    table = {"kind": "limb", "joints": joints, "mount": mount.tolist()}
    return table | {"mount_angles": angles.tolist()}, (tuple(hinges), tuple(mount), tuple(angles))


def random_tree(seed, prescribed):
    """A scene of a tail and one to four more chains or pairs, and the same as a set of bodies."""
    rng, drives = np.random.default_rng(seed), np.random.default_rng(seed)
    tail, (segments, mount, angles) = random_chain(rng)
    placed = zoo.TORSO | {"tail_mount": tail.pop("mount"), "mount_angles": tail.pop("mount_angles")}
    chains, bodies = {}, []
    for k in range(rng.integers(1, 5)):
        table, of_chain = (random_chain, random_limb)[rng.integers(2)](rng)
        pair = bool(rng.integers(2))
        chains[f"c{k}"] = table | {"pair": pair}
        if prescribed and (not k or drives.integers(2)):
            chains[f"c{k}"]["drive"] = "prescribed"
        bodies += [Chain(*of_chain)] + [Chain(*of_chain, mirrored=True)] * pair
    scene = parse_scene(tail | {"chain": chains, "parameters": placed}, "random")
    values = own_tails.VALUES | {"tail_mount": mount, "mount_angles": angles}
    return scene, Animal(segments=segments, chains=tuple(bodies), **values)


def check_against(reference, scene, dynamics):
    """H, H v_dot + C, v_dot, torques of drives, energy, momentum and points, by programs, are those
    of a reference whose coordinates are all free; ``dynamics(q, v, v_dot)`` are its H and force.
    """
    tail = tail_of(scene)
    moved = [c.prescribed for c in tail.chains for _ in range(c.width * c.segments)]
    q, v, v_dot, tau = next(own_tails.states(7 + len(moved), 1))
    free, tau = ~np.array([False] * 6 + moved), tau[~np.array(moved)]
    H, force = dynamics(q, v, v_dot)[:2]
    expected = {"energy": reference.energy(q, v), "momentum": reference.momentum(q, v)}
    expected["tail_points"] = reference.tail_points(q)
    given = {"given": np.concatenate([q[1:][~free], v[~free], v_dot[~free]])} if any(moved) else {}
    force, q = np.concatenate([force[free], force[~free]]), np.concatenate([q[:1], q[1:][free]])
    H, v, v_dot = H[free][:, free], v[free], v_dot[free]

    def result(name, **arguments):
        program = assemble(function_of(name, tail), tail)
        values = {a.name: scene.parameters[a.name] for a in program.of_role("parameters")}
        inputs = {n: [x] if isinstance(x, float) else list(x) for n, x in values.items()}
        known = {"q": q, "v": v} | arguments | given
        names = {a.name for a in program.of_role("input")}
        inputs |= {n: list(map(float, x)) for n, x in known.items() if n in names}
        return np.concatenate(list(interpreted(program, inputs, FLOATS).values()))

    for name, numbers in expected.items():
        with row(name):
            near(result(name), np.ravel(numbers), 1e-13)
    assert mass_matrix_error(result("mass_matrix").reshape(H.shape), H) < 1e-13
    found, n = result("inverse_dynamics", v_dot=v_dot), tail.nv
    assert force_error(found[:n], force[:n], H) < 1e-13
    assert np.abs(found - force).max() < 1e-12 * np.abs(force).max()
    expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - force[:n] + H @ v_dot)
    error = block_error(result("forward_dynamics", tau=tau), expected)
    assert error < 2e-12 + FORWARD * equilibrated_condition(H)  # Pinocchio rounds, too


def check_against_pinocchio(seed, prescribed=False):
    """The programs of a random tree are those of a tree of hinges."""
    scene, animal = random_tree(seed, prescribed)
    from tests.references.pinocchio_tree import PinocchioTree

    tree = PinocchioTree(animal)
    check_against(tree, scene, lambda q, *v: (tree.mass_matrix(q), tree.inverse_dynamics(q, *v)))


@pytest.mark.parametrize("prescribed", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_random_trees_are_those_of_pinocchio(seed, prescribed):
    pytest.importorskip("pinocchio")
    check_against_pinocchio(seed, prescribed)


@pytest.mark.slow
def test_200_random_trees_are_those_of_pinocchio():
    pytest.importorskip("pinocchio")
    for seed in range(3, 203):
        with row(seed):
            check_against_pinocchio(seed, seed % 2 > 0)


def test_prescribed_arcs_are_sets_of_bodies():
    """A mirrored pair of arcs that follow a motion, in 60 digits."""
    fin, place = FIN | {"drive": "prescribed"}, (tuple(FIN["mount"]), tuple(FIN["mount_angles"]))
    keys = zoo.ZOO["own_links"] | {"segments": OWN_LINKS[1:2], "chain": {"fin": fin}}
    fins = [Chain(own_tails.ARC_BODIES[:1], *place, mirrored=side) for side in (False, True)]
    animal = replace(LIMBS, chains=tuple(fins))
    check_against(animal, parse_scene(keys, "fins"), partial(own_tails.dynamics, animal))
