"""Random trees against Pinocchio, and prescribed arcs against a set of bodies in 60 digits."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from tests.functions.test_own_segments import accelerated
from tests.functions.test_trees import FORWARD, LIMBS
from tests.references.body_set import Animal, Chain, Hinge, Link
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
    near,
)
from tests.support import own_tails, zoo
from tests.support.bodies import FIN, OWN_LINKS
from tests.support.program_runs import FLOATS, interpreted
from tests.support.rows import row


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
