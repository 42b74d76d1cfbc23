"""The table `body`: sizes by similarity and by published exponents, torsos of simple shapes."""

import numpy as np
import pytest

from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.units import dimensions

RAT = {"kind": "articulated", "segments": 1, "links": 3, "contacts": ["feet", "tail", "torso"]}
TAPER = {"taper": {"length": "0.2 m", "radii": ["4 mm", "1 mm"], "density": 1000.0}}


def parsed(body=None, **more):
    return parse_scene(RAT | more | ({} if body is None else {"body": body}), "rat")


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("kg m^2", (1, 2, 0)),
        ("N m", (1, 2, -2)),
        ("N m s", (1, 2, -1)),
        ("N/m^1.5", (1, -0.5, -2)),
        ("N m/rad", (1, 2, -2)),
        ("rad/s", (0, 0, -1)),
        ("m/s^2", (0, 1, -2)),
        ("kg/m^3", (1, -3, 0)),
        ("1", (0, 0, 0)),
        ("deg", (0, 0, 0)),
    ],
)
def test_dimensions(unit, powers):
    assert dimensions(unit) == powers


def test_a_scale_keeps_shape_and_froude_number():
    """Lengths go with the scale, masses with its cube, times with its root: numbers without a
    dimension stay.
    """
    a, b = parsed().parameters, parsed({"scale": 1.6}).parameters
    g = a["gravity"]
    assert b["gravity"] == g
    for one in (a, b):
        weight, length = (one["torso_mass"] + one["tail_mass"]) * g, one["tail_length"]
        numbers = [
            one["tail_mass"] / one["torso_mass"],
            np.array(one["torso_inertia"]) / (one["torso_mass"] * length**2),
            np.array(one["link_inertia"]) / (one["torso_mass"] * length**2),
            one["K_n"] * length**1.5 / weight,
            one["D_n"] / (length / g) ** 0.5,
            one["K_f"] * length / weight,
            one["D_f"] / (length / g) ** 0.5,
            one["L_k2a"] / length,
            one["mu"],
        ]
        wanted = numbers if one is a else wanted  # noqa: F821 - of the first
    for found, expected in zip(numbers, wanted, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-14)
    assert b["tail_length"] == pytest.approx(1.6 * a["tail_length"])
    assert b["torso_mass"] == pytest.approx(1.6**3 * a["torso_mass"])


def test_a_mass_scales_by_published_exponents():
    a, b = parsed().parameters, parsed({"mass": "2.5 kg"}).parameters
    ratio = 2.5 / (a["torso_mass"] + a["tail_mass"])
    assert b["torso_mass"] + b["tail_mass"] == pytest.approx(2.5)
    assert b["tail_length"] / a["tail_length"] == pytest.approx(ratio ** (1 / 3))
    assert b["L_a2m"] / a["L_a2m"] == pytest.approx(ratio**0.35)
    assert b["D_f"] / a["D_f"] == pytest.approx(ratio**0.15)
    assert b["torso_inertia"][0] / a["torso_inertia"][0] == pytest.approx(ratio ** (5 / 3))


def test_what_a_scene_names_is_scaled_too():
    named = {"parameters": {"torso_mass": 0.2, "link_inertia": [1e-7, 1e-8, 1e-7]}}
    found = parsed({"scale": 2.0}, **named).parameters
    assert found["torso_mass"] == pytest.approx(1.6) and found["link_inertia"][0] == 32e-7
    a, b = (parsed(body, **TAPER).parameters for body in (None, {"scale": 2.0}))
    np.testing.assert_allclose(b["link_masses"], 8 * np.array(a["link_masses"]), rtol=1e-14)
    stiff = {"tail_stiffness": 0.02, "tail_damping": 1e-4}
    b = parsed({"scale": 2.0}, parameters=stiff).parameters
    np.testing.assert_allclose(b["tail_stiffness"], 16 * 0.02)
    np.testing.assert_allclose(b["tail_damping"], 2**4.5 * 1e-4)


@pytest.mark.parametrize("shape", ["ellipsoid", "box"])
def test_a_torso_of_one_density_has_the_moments_of_its_points(shape):
    """Against the sums over many points inside."""
    lengths, density = np.array([0.03, 0.05, 0.02]), 1100.0
    name = {"ellipsoid": "semi_axes", "box": "sides"}[shape]
    table = {"shape": shape, name: lengths.tolist(), "density": "1.1 g/cm^3"}
    found = parsed({"torso": table}).parameters
    grid = (np.arange(120) + 0.5) / 60 - 1
    x, y, z = np.meshgrid(grid, grid, grid)
    half = lengths if shape == "ellipsoid" else lengths / 2
    inside = (x**2 + y**2 + z**2 <= 1) if shape == "ellipsoid" else np.ones(x.shape, bool)
    points = np.stack([x[inside], y[inside], z[inside]]) * half[:, None]
    mass = density * np.prod(2 * half) * inside.mean()
    squares = (points**2).mean(axis=1)
    assert found["torso_mass"] == pytest.approx(mass, rel=2e-3)
    expected = mass * (squares.sum() - squares)
    np.testing.assert_allclose(found["torso_inertia"], expected, rtol=5e-3)
    assert found["torso_semi_axes"] == pytest.approx(half)


@pytest.mark.parametrize(
    "body",
    [
        {"scale": 1.6},
        {"mass": 3.0},
        {"scale": 0.5, "torso": {"shape": "box", "sides": [0.1, 0.2, 0.1], "density": 1e3}},
    ],
    ids=str,
)
@pytest.mark.parametrize("more", [{}, TAPER], ids=["equal", "tapered"])
def test_a_scene_is_made_again_from_its_table(body, more):
    scene = parsed(body, **more)
    assert parse_scene(scene_to_dict(scene), "rat") == scene


def test_units_of_all_parameters_have_dimensions():
    for parameter in PARAMETERS:
        assert any(dimensions(parameter.unit)) == (parameter.unit not in ("1", "rad"))


WRONG = [
    (3, "body: value 3: needs a table"),
    ({"scale": 0}, "body.scale: value 0: needs a number from 0.001 to 1000"),
    ({"scale": -1.0}, "body.scale: value -1.0"),
    ({"scale": "big"}, "body.scale: value 'big'"),
    ({"scale": float("nan")}, "body.scale: value nan"),
    ({"scale": 1, "mass": 1}, "body.mass: value 1: given together with scale"),
    ({"scal": 1}, "body.scal: value 1: did you mean 'scale'?"),
    ({"mass": "3 m"}, "body.mass: value '3 m': a length where a mass is needed"),
    ({"torso": 3}, "body.torso: value 3: needs a table with shape"),
    ({"torso": {"shape": "cube"}}, "needs a table with shape ('ellipsoid' or 'box')"),
    ({"torso": {"shape": "box"}}, "body.torso.sides: no value: needs three lengths above 0"),
    ({"torso": {"shape": "box", "sides": [1, 2, 3]}}, "body.torso.density: no value"),
    ({"torso": {"shape": "box", "sides": [1, 2, 0], "density": 1}}, "needs three lengths above 0"),
    ({"torso": {"shape": "box", "sides": [1, 1, 1], "density": 1, "x": 1}}, "body.torso.x"),
]


@pytest.mark.parametrize(("body", "words"), WRONG, ids=lambda x: str(x)[:50])
def test_what_is_no_body_is_refused(body, words):
    with pytest.raises(SceneError) as caught:
        parsed(body)
    assert words in str(caught.value)


def test_a_torso_is_told_once():
    torso = {"shape": "box", "sides": [0.1, 0.1, 0.1], "density": 1000.0}
    with pytest.raises(SceneError, match=r"parameters.torso_mass: .* remove one of the two"):
        parsed({"torso": torso}, parameters={"torso_mass": 1.0})
