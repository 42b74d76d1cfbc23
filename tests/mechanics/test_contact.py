"""Contact with the ground: points, velocities, forces and accelerations against plain NumPy and
limiting cases.
"""

from functools import cache
from itertools import product

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail.verification.report import laws
from serpentail_codegen.scene.parse import parse_scene
from tests.c.target.emitted import C99, compiled
from tests.references.contact import Contacts, attitude
from tests.references.parameters import random_states
from tests.support.models import folder_of, model_folder

ALL = ("feet", "tail", "torso")
FRICTION = ("cone", "box", "smooth", "paper")
# segments of a mixed tail
MIXED = (
    {"kind": "articulated", "links": 2, "length": 0.08, "mass": 0.0015},
    {"kind": "continuum", "length": 0.06, "mass": 0.001},
    {"kind": "articulated", "links": 3, "link_lengths": [0.03, 0.02, 0.02], "mass": 0.0008},
)
CASES = {
    "straight": (1, 3, {"emission": "straight"}),
    "loops": (2, 2, {"emission": "loops"}),
    "continuum": (2, None, {"samples": 3}),
    "continuum_loops": (1, None, {"emission": "loops"}),
    "baked": (1, 2, {"baked": True}),
    "mixed": (3, None, {"kind": "mixed", "samples": 3}),
}
NAMES = ["mass_matrix", "bias_force", "forward_dynamics", "contact_points", "contact_dynamics"]


@cache
def touching(segments=1, links=3, contacts=ALL, functions=tuple(NAMES), **options):
    """A model that can touch the ground."""
    options = {"contacts": list(contacts), "functions": list(functions), "name": "rat"} | options
    if options.get("kind") == "mixed":
        return st.load(folder_of(parse_scene(options | {"segments": MIXED[:segments]}, "rat")))
    return st.load(model_folder(segments, links, **options))


@pytest.fixture(params=CASES)
def model(request):
    """A model of each kind and emission."""
    segments, links, options = CASES[request.param]
    return touching(segments, links, **options)


def near_ground(model, seed, count=20):
    """Random states with the torso about as high as the legs are long: some points touch, some do
    not.
    """
    rng = np.random.default_rng(seed)
    q, v, _, tau = random_states(model.segments, seed, count, "random")
    q[:, 2] = rng.uniform(-0.05, 0.15, count)
    q[:, 7:] *= 0.5
    legs = rng.uniform(
        [3, -1.5, 3, -1.5, -80, -80, -80, -80], [4.2, 0, 4.2, 0, 80, 80, 80, 80], (count, 8)
    )
    points = sum(entry["count"] for entry in model.manifest["contacts"])
    return q, v, tau, rng.normal(0, 2e-3, (count, 2 * points)), legs


def each(model, seed=3, count=20):
    """The same, one by one."""
    return zip(*near_ground(model, seed, count), strict=True)


def test_legs_have_the_numbers_of_the_mechanism():
    """gamma = 210 deg: the sole is level; (y, z) of A, M and T from B in mm."""
    model = touching(1, 1, contacts=("feet",))
    expected = {
        -15: [(-29.46, -14.96), (4.35, -24.02), (20.35, -24.02)],
        -75: [(-46.43, -31.93), (-37.37, -65.74), (-21.37, -65.74)],
    }
    for delta, points in expected.items():
        legs = np.radians([210, delta, 210, delta, 0, 0, 0, 0])
        found, _ = model.contact_points([0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), legs)
        for side in (0, 3):
            np.testing.assert_allclose(1e3 * found[side : side + 3, 1:], points, atol=0.006)
        np.testing.assert_allclose(found[:, 0], [0.0225] * 3 + [-0.0225] * 3)
        assert abs(found[1, 2] - found[2, 2]) < 1e-17


def test_points_and_velocities_are_the_references(model):
    reference = Contacts(model)
    for q, v, _, _, legs in each(model):
        positions, velocities = model.contact_points(q, v, legs)
        np.testing.assert_allclose(
            positions, reference.positions(q, legs).real, atol=3e-15 * (1 + abs(q[:3]).max())
        )
        scale = abs(velocities).max()
        np.testing.assert_allclose(velocities, reference.velocities(q, v, legs), atol=1e-13 * scale)


def test_the_torso_touches_by_its_lowest_point():
    """No point of the ellipsoid is lower, and it lies on the ellipsoid."""
    model = touching(1, 1, contacts=("torso",))
    axes, rng = np.array(model.parameters["torso_semi_axes"]), np.random.default_rng(1)
    sphere = rng.normal(size=(20_000, 3))
    surface = axes * sphere / np.linalg.norm(sphere, axis=1)[:, None]
    for q in random_states(1, 5, 10, "random")[0]:
        (lowest,), _ = model.contact_points(q, np.zeros(8))
        world = q[:3] + surface @ attitude(q[3:7]).T
        assert world[:, 2].min() >= lowest[2] - 1e-15
        assert world[:, 2].min() <= lowest[2] + 1e-3
        place = attitude(q[3:7]).T @ (lowest - q[:3])
        assert np.sum((place / axes) ** 2) == pytest.approx(1, rel=1e-12)


def models_of_contact():
    """All cases and laws of friction; all laws of one case are quick."""
    for case, friction in product(CASES, FRICTION):
        quick = case == "straight" or friction == "cone"
        yield pytest.param(case, friction, marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize(("case", "friction"), list(models_of_contact()))
def test_forces_and_accelerations_are_the_references(case, friction):
    """Eqs. 35 to 37, and the residual of H v_dot + C = [0; tau] + J^T f."""
    segments, links, options = CASES[case]
    model = touching(segments, links, friction=friction, **options)
    reference, touched = Contacts(model), 0
    for q, v, tau, bristles, legs in each(model):
        v_dot, rates, forces = model.contact_dynamics(q, v, tau, bristles, legs)
        expected, expected_rates = reference.laws(q, v, bristles, legs)
        np.testing.assert_allclose(
            forces, expected, rtol=1e-9, atol=1e-12 * (1 + abs(expected).max())
        )
        np.testing.assert_allclose(
            rates, expected_rates, rtol=1e-9, atol=1e-9 * (1 + abs(expected_rates).max())
        )
        load = np.einsum("kai,ka->i", reference.jacobians(q, legs), expected)
        residual = model.mass_matrix(q) @ v_dot + model.bias_force(q, v) - load
        residual[6:] -= tau
        scale = (np.abs(load) + np.abs(model.bias_force(q, v))) / np.sqrt(
            np.diag(model.mass_matrix(q))
        )
        assert np.abs(residual / np.sqrt(np.diag(model.mass_matrix(q)))).max() < 1e-10 * scale.max()
        touched += np.count_nonzero(expected[:, 2])
    assert touched > 20


# The other targets.


@pytest.mark.parametrize("friction", FRICTION)
def test_operations_are_those_of_the_functions(friction):
    model = touching(2, 2, friction=friction)
    for q, v, tau, bristles, legs in each(model, count=5):
        found = model.casadi.contact_dynamics(q, v, tau, bristles, legs)
        for one, other in zip(
            found, model.contact_dynamics(q, v, tau, bristles, legs), strict=True
        ):
            scalars = np.array(one).reshape(other.shape)
            np.testing.assert_allclose(scalars, other, atol=1e-9 * (1 + np.abs(other).max()))
        found = model.casadi.contact_points(q, v, legs)
        for one, other in zip(found, model.contact_points(q, v, legs), strict=True):
            np.testing.assert_allclose(np.array(one), other, atol=1e-12)


@pytest.mark.parametrize("friction", FRICTION)
def test_derivatives_are_numbers_in_the_air_and_right_on_the_ground(friction):
    """CasADi's derivatives of the operations against central differences of the compiled
    function.
    """
    model = touching(1, 2, friction=friction)
    q, v, tau, bristles, legs = (rows[:6] for rows in near_ground(model, 3, 6))
    f = model.casadi.contact_dynamics
    symbols = [casadi.MX.sym(name, f.size1_in(name)) for name in f.name_in()]
    slope = casadi.Function("slope", symbols, [casadi.jacobian(f(*symbols)[0], symbols[1])])
    for k in range(6):
        exact = np.array(slope(q[k], v[k], tau[k], bristles[k], legs[k]))
        units = 1e-5 * np.eye(model.nv)
        ends = [
            model.contact_dynamics(q[k], v[k] + side * units, tau[k], bristles[k], legs[k])[0]
            for side in (1, -1)
        ]
        np.testing.assert_allclose(
            exact, (ends[0] - ends[1]).T / 2e-5, rtol=1e-3, atol=1e-5 * np.abs(exact).max()
        )
    high = q[0] + np.eye(model.nq)[2]
    assert np.isfinite(np.array(slope(high, v[0], tau[0], bristles[0], legs[0]))).all()


def test_flight_is_contact_dynamics_high_up():
    model = touching()
    q, v, tau, bristles, legs = (rows[0] for rows in near_ground(model, 3, 1))
    q[2] = 10.0
    v_dot, rates, forces = model.contact_dynamics(q, v, tau, bristles, legs)
    np.testing.assert_allclose(v_dot, model.forward_dynamics(q, v, tau), rtol=1e-12)
    np.testing.assert_allclose(rates, -bristles / model.parameters["D_f"], rtol=1e-12)
    assert not forces.any()


@pytest.mark.parametrize("emission", ["straight", "loops"])
def test_a_flight_pays_nothing_for_contact(emission):
    """Functions of a flight scene have the same C in a scene with contacts."""
    names = ["mass_matrix", "forward_dynamics"]
    texts = []
    for options in ({}, {"contacts": ["feet"]}):
        folder = model_folder(2, 2, name="rat", functions=names, emission=emission, **options)
        text = (folder / "src" / "rat.c").read_text()
        texts.append(
            text[text.index("#if defined(__GNUC__)") : text.index("void rat_default")]
            + text[text.index("}\n") :]
        )
        assert ("K_n" in (folder / "include" / "rat.h").read_text()) == bool(options)
    assert texts[0] == texts[1]


def test_verification_judges_what_else_a_model_with_contacts_has():
    checks = laws(touching(2, 2))
    assert [c for c in checks if not c.passed] == []
    assert sum(not c.omitted for c in checks) == 14


# Misuse.


def test_legs_are_given_where_there_are_feet():
    with pytest.raises(st.StateError, match="rat has feet: give legs, 4 angles"):
        touching().contact_points(np.eye(9)[3], np.zeros(8))
    with pytest.raises(st.StateError, match="rat has no feet, but legs were given"):
        touching(1, 1, contacts=("torso",)).contact_points(np.eye(9)[3], np.zeros(8), np.zeros(8))
    with pytest.raises(st.StateError, match=r"legs has shape \(4,\), not \(8,\)"):
        touching().contact_points(np.eye(9)[3], np.zeros(8), np.zeros(4))
    with pytest.raises(st.StateError, match=r"bristles has shape \(10, 2\), not \(20,\)"):
        touching().contact_dynamics(
            np.eye(9)[3], np.zeros(8), np.zeros(2), np.zeros((10, 2)), np.zeros(8)
        )


@pytest.mark.parametrize(
    ("name", "value"), [("mu", -0.1), ("K_n", 0.0), ("D_f", 0.0), ("K_f", -1), ("L_m2t", -1)]
)
def test_unphysical_parameters_are_refused(name, value):
    with pytest.raises(st.ModelError, match=f"{name}: value"):
        touching().with_parameters(**{name: value})


def test_parameters_reach_the_compiled_function():
    model = touching(1, 1, contacts=("feet",)).with_parameters(mu=0.0, hip=(0.1, 0.2, 0.3))
    legs = np.radians([210, -15, 210, -15, 0, 0, 0, 0])
    q, v = np.array([0, 0, -0.27, 1, 0, 0, 0, 0, 0.0]), np.array([1.0, 1, 0, 0, 0, 0, 0, 0])
    _, _, forces = model.contact_dynamics(q, v, np.zeros(2), np.zeros(12), legs)
    assert forces[:, 2].max() > 0 and not forces[:, :2].any()
    assert model.contact_points(q, v, legs)[0][:, 0].tolist() == [0.1] * 3 + [-0.1] * 3


@pytest.mark.parametrize(
    "options", [{"emission": "straight"}, {"emission": "loops"}, {"real": "float"}, {"baked": True}]
)
@pytest.mark.parametrize("size", [(2, 2), (2, None)])
def test_compiles_without_a_warning(tmp_path, size, options):
    functions = ["contact_points", "contact_dynamics", "pfl", "implicit"]
    folder = model_folder(*size, name="rat", contacts=list(ALL), functions=functions, **options)
    for source in ("src/rat.c", "src/rat_host.c", "example/main.c"):
        compiled(tmp_path, folder / source, *C99, "-fsyntax-only")


def test_optimiser_finds_nothing_to_warn_about(tmp_path):
    functions = ["contact_points", "contact_dynamics", "pfl", "implicit"]
    folder = model_folder(
        2, 2, name="rat", contacts=list(ALL), functions=functions, emission="loops"
    )
    compiled(tmp_path, folder / "src" / "rat.c", *C99, "-O2")


def test_single_precision_is_single_precision():
    model, exact = touching(1, 2, real="float"), touching(1, 2)
    for q, v, *others in each(model, count=5):
        state = q, 0.1 * v, *others
        for one, other in zip(
            model.contact_dynamics(*state), exact.contact_dynamics(*state), strict=True
        ):
            np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-4 * (1 + np.abs(other).max()))


def test_the_manifest_names_the_points():
    entry = touching(2, 3).manifest["contacts"]
    assert entry == [
        {"group": "feet", "count": 6},
        {"group": "tail", "count": 6},
        {"group": "torso", "count": 1},
    ]
    assert "RAT_CONTACTS = 13 " in (touching(2, 3).folder / "include" / "rat.h").read_text()
    assert touching(1, 3, contacts=(), functions=("mass_matrix",)).contacts == {}
