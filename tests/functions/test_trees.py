"""Models of several chains: against sets of bodies in 60 digits and against Pinocchio; limits in
which they are models of one tail, and what mirror images and conservation say.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.catalogue import function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from tests.functions.test_own_segments import accelerated
from tests.references.body_set import Animal, Chain, Link
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
)
from tests.support import own_tails, zoo
from tests.support.models import folder_of
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


def passive(model, q, v):
    """Generalised forces of springs, damping and stops of the zoo's tree by their definitions."""
    p, force = model.parameters, np.zeros(model.nv)
    angles, rates = q[7:], v[6:]
    for side in (slice(4, 6), slice(6, 8)):
        elastic = np.array(p["leg_stiffness"]) * (angles[side] - np.array(p["leg_rest"]))
        force[6:][side] = elastic + np.array(p["leg_damping"]) * rates[side]
    last = slice(10, 12)
    force[6:][last] = np.array(p["third_damping"]) * rates[last]
    for way, end in ((-1, "lower"), (1, "upper")):
        depth = way * (angles[last] - np.array(p[f"third_stop_{end}"]))
        width = np.array(p["third_stop_width"])
        s, beyond = np.clip(depth / width, 0, 1), np.maximum(depth / width - 1, 0)
        stiffness = np.array(p["third_stop_stiffness"])
        force[6:][last] += way * stiffness * width * (s**3 - s**4 / 2 + beyond)
    return force


@pytest.mark.slow  # 60 digits
def test_a_tree_is_its_set_of_bodies():
    model = zoo.model("tree")
    for q, v, v_dot, tau in own_tails.states(model.nq, 1):
        H, force, bias = own_tails.dynamics(TREE, q, v, v_dot)
        own = passive(model, q, v)
        assert mass_matrix_error(model.mass_matrix(q), H) < 1e-13
        assert force_error(model.inverse_dynamics(q, v, v_dot), force + own, H) < 1e-13
        assert force_error(model.bias_force(q, v), bias + own, H) < 1e-13
        assert (np.abs(model.mass_matrix(q)[6:10, 10:]) == 0).all()  # chains do not couple

        expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - bias - own)
        most = FORWARD * equilibrated_condition(H)
        assert block_error(model.forward_dynamics(q, v, tau), expected) < most
        graph = model.casadi.forward_dynamics(q, v, tau).full().ravel()
        assert block_error(graph, expected) < most
        np.testing.assert_allclose(model.energy(q, v)[0], TREE.energy(q, v)[0], rtol=1e-14)
        for found, momentum in zip(model.momentum(q, v), TREE.momentum(q, v), strict=True):
            assert np.abs(found - momentum).max() < 1e-13 * np.abs(momentum).max()
        assert np.abs(model.tail_points(q) - TREE.tail_points(q)).max() < 1e-15


def test_loads_do_their_work():
    """J^T f of a force at each point, by the points' velocities along v_dot of a load alone."""
    model, step = zoo.model("tree"), 1e-6
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


def test_derivatives_are_those_of_the_functions():
    """Along one direction by differences; products with Jacobians to rounding."""
    model, step, rng = zoo.model("tree"), 1e-6, np.random.default_rng(5)
    q, v, v_dot, tau = next(own_tails.states(model.nq, 1))
    q[3:7] /= np.linalg.norm(q[3:7])
    dq, dv, weights = rng.normal(size=(3, model.nv))
    dtau = 1e-4 * rng.normal(size=model.nv - 6)

    def change(f):
        low, high = (
            np.concatenate(
                [np.ravel(x) for x in f(model.integrate(q, dq, h), v + h * dv, h * dtau)]
            )
            for h in (-step, step)
        )
        return (high - low) / (2 * step)

    forward = model.forward_dynamics_derivatives(q, v, tau)
    along = sum(J @ d for J, d in zip(forward, (dq, dv, dtau), strict=True))
    inverse = (*model.inverse_dynamics_derivatives(q, v, v_dot), model.mass_matrix(q))
    potential = model.energy_derivatives(q, v)
    by_q, by_v, turn_q, turn_v = model.momentum_derivatives(q, v)
    cases = {
        "forward": (lambda q, v, t: [model.forward_dynamics(q, v, tau + t)], along),
        "inverse": (
            lambda q, v, _: [model.inverse_dynamics(q, v, v_dot)],
            inverse[0] @ dq + inverse[1] @ dv,
        ),
        "energy": (
            lambda q, v, _: model.energy(q, v),
            np.array([potential[0] @ dq + potential[1] @ dv, potential[2] @ dq]),
        ),
        "momentum": (
            lambda q, v, _: model.momentum(q, v),
            np.concatenate([by_q @ dq + by_v @ dv, turn_q @ dq + turn_v @ dv]),
        ),
    }
    for name, (f, found) in cases.items():
        with row(name):
            expected = change(f)
            assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()

    jvp = model.forward_dynamics_jvp(q, v, tau, dq, dv, dtau)
    assert block_error(jvp, along) < 1e-12
    both = zip(model.forward_dynamics_vjp(q, v, tau, weights), forward, strict=True)
    others = zip(model.inverse_dynamics_vjp(q, v, v_dot, weights), inverse, strict=True)
    for found, J in (*both, *others):
        assert np.abs(found - weights @ J).max() < 1e-12 * np.abs(weights @ J).max()


def test_torques_of_pfl_give_the_accelerations():
    model = zoo.model("tree")
    q, v, v_dot, _ = next(own_tails.states(model.nq, 1))
    torques = model.pfl(q, v, v_dot[6:])
    found = model.forward_dynamics(q, v, torques)[6:]
    assert np.abs(found - v_dot[6:]).max() < 1e-9 * np.abs(v_dot).max()


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


def random_tree(seed):
    """A scene of a tail and one to four more chains or pairs, and the same as a set of bodies."""
    rng = np.random.default_rng(seed)
    tail, (segments, mount, angles) = random_chain(rng)
    placed = zoo.TORSO | {"tail_mount": tail.pop("mount"), "mount_angles": tail.pop("mount_angles")}
    chains, bodies = {}, []
    for k in range(rng.integers(1, 5)):
        table, of_chain = random_chain(rng)
        pair = bool(rng.integers(2))
        chains[f"c{k}"] = table | {"pair": pair}
        bodies += [Chain(*of_chain)] + [Chain(*of_chain, mirrored=True)] * pair
    scene = parse_scene(tail | {"chain": chains, "parameters": placed}, "random")
    values = own_tails.VALUES | {"tail_mount": mount, "mount_angles": angles}
    return scene, Animal(segments=segments, chains=tuple(bodies), **values)


def check_against_pinocchio(seed):
    """H, H v_dot + C and v_dot of programs over floats against those of a tree of hinges."""
    scene, animal = random_tree(seed)
    from tests.references.pinocchio_tree import PinocchioTree

    tree, tail = PinocchioTree(animal), tail_of(scene)
    q, v, v_dot, tau = next(own_tails.states(tail.nq, 1))
    H, force = tree.mass_matrix(q), tree.inverse_dynamics(q, v, v_dot)
    bias = tree.inverse_dynamics(q, v, 0 * v)

    def result(name, **arguments):
        program = assemble(function_of(name, tail), tail)
        values = {a.name: scene.parameters[a.name] for a in program.of_role("parameters")}
        given = {n: [x] if isinstance(x, float) else list(x) for n, x in values.items()}
        given |= {n: list(map(float, x)) for n, x in arguments.items()}
        (found,) = interpreted(program, given, FLOATS).values()
        return np.array(found)

    assert mass_matrix_error(result("mass_matrix", q=q).reshape(H.shape), H) < 1e-13
    assert force_error(result("inverse_dynamics", q=q, v=v, v_dot=v_dot), force, H) < 1e-13
    expected = accelerated(H, np.concatenate([np.zeros(6), tau]) - bias)
    error = block_error(result("forward_dynamics", q=q, v=v, tau=tau), expected)
    assert error < FORWARD * equilibrated_condition(H)


@pytest.mark.parametrize("seed", range(3))
def test_random_trees_are_those_of_pinocchio(seed):
    pytest.importorskip("pinocchio")
    check_against_pinocchio(seed)


@pytest.mark.slow
def test_many_random_trees_are_those_of_pinocchio():
    pytest.importorskip("pinocchio")
    for seed in range(3, 20):
        with row(seed):
            check_against_pinocchio(seed)


# ---- limits --------------------------------------------------------------------------------------

FEW = ["mass_matrix", "bias_force", "forward_dynamics"]
ALONE = {"kind": "articulated", "segments": 1, "links": 3, "parameters": zoo.TORSO | zoo.MOUNTED}


def built(name="limit", **changes):
    """A model of a tail and the given chains."""
    tables = {"functions": FEW, "targets": ["c"]} | ALONE | changes
    return st.load(folder_of(parse_scene(tables, name)))


def test_legs_without_mass_change_nothing():
    link = {"links": 1, "length": 0.03, "mass": 1e-11, "link_inertia": [1e-16, 1e-17, 1e-16]}
    leg = zoo.CHAINS["leg"] | {"segments": [link]}
    leg = {key: x for key, x in leg.items() if key not in ("stiffness", "damping")}
    tree, alone = built(chain={"leg": leg}), built()
    q, v, _, tau = next(own_tails.states(tree.nq, 1))
    tau[2:] = 0
    v_dot = alone.forward_dynamics(q[:9], v[:8], tau[:2])
    assert block_error(tree.forward_dynamics(q, v, tau)[:8], v_dot) < 1e-6


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


# ---- the gecko -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def gecko():
    """The packaged gecko with legs of mass."""
    return st.build("gecko_legs", functions=["+mass_matrix", "+implicit"])


def test_a_pair_at_equal_angles_neither_yaws_nor_rolls(gecko):
    q, v, tau = np.zeros(gecko.nq), np.zeros(gecko.nv), np.zeros(gecko.layout.nt)
    q[3], q[7], v[6] = 1, 0.4, 3.0  # the tail turns upward alone
    for pair in ("hind", "fore"):
        for side in ("right", "left"):
            chain = gecko.layout[f"{pair}_{side}"]
            q[chain.q], v[chain.v], tau[chain.tau] = (0.3, -0.5), (2.0, -7.0), (1e-6, 3e-6)
    v_dot = gecko.forward_dynamics(q, v, tau)
    assert np.abs(v_dot[[0, 4, 5]]).max() < 1e-12 * np.abs(v_dot).max()
    for pair in ("hind", "fore"):
        right, left = (v_dot[gecko.layout[f"{pair}_{side}"].v] for side in ("right", "left"))
        np.testing.assert_allclose(left, right, rtol=1e-11)


@pytest.mark.parametrize("method", ["tsit5", "dp8", "rk4", "ros34pw2", "implicit_euler"])
def test_a_flight_keeps_momentum_and_energy(gecko, method):
    v = 3 * np.random.default_rng(2).normal(size=gecko.nv)
    q = gecko.state(height=1.0).q
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
