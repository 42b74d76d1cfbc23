"""The table `body`: sizes by similarity and by published exponents, torsos of simple shapes."""

import numpy as np
import pytest

from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from tests.support.rows import row

RAT = {"kind": "articulated", "segments": 1, "links": 3, "contacts": ["feet", "tail", "torso"]}
TAPER = {"taper": {"length": "0.2 m", "radii": ["4 mm", "1 mm"], "density": 1000.0}}
BOX = {"shape": "box", "sides": [0.1, 0.2, 0.1], "density": 1e3}


def parsed(body=None, **more):
    return parse_scene(RAT | more | ({} if body is None else {"body": body}), "rat")


def numbers(found):
    """Numbers without a dimension of an animal on the ground."""
    g, length = found["gravity"], found["tail_length"]
    weight = (found["torso_mass"] + found["tail_mass"]) * g
    yield found["tail_mass"] / found["torso_mass"]
    for name in ("torso_inertia", "link_inertia"):
        yield from np.array(found[name]) / (found["torso_mass"] * length**2)
    yield found["K_n"] * length**1.5 / weight
    yield found["K_f"] * length / weight
    yield from (found[name] / (length / g) ** 0.5 for name in ("D_n", "D_f"))
    yield from (found["L_k2a"] / length, found["mu"], found["hip"][0] / length)


def test_a_scale_keeps_shape_and_froude_number():
    """Lengths go with the scale, masses with its cube, times with its root: numbers without a
    dimension stay.
    """
    a, b = parsed().parameters, parsed({"scale": 1.6}).parameters
    assert b["gravity"] == a["gravity"]
    np.testing.assert_allclose([*numbers(b)], [*numbers(a)], rtol=1e-14)
    assert b["tail_length"] == pytest.approx(1.6 * a["tail_length"])
    assert b["torso_mass"] == pytest.approx(1.6**3 * a["torso_mass"])
    scene = parsed({"scale": 4.0})
    assert scene.size == (64.0, 4.0, 2.0) and scene.unscaled == a


def test_a_mass_scales_by_published_exponents():
    a, b = parsed().parameters, parsed({"mass": "2.5 kg"}).parameters
    ratio = 2.5 / (a["torso_mass"] + a["tail_mass"])
    assert b["torso_mass"] + b["tail_mass"] == pytest.approx(2.5) and b["gravity"] == a["gravity"]
    assert b["tail_length"] / a["tail_length"] == pytest.approx(ratio ** (1 / 3))
    assert b["L_a2m"] / a["L_a2m"] == pytest.approx(ratio**0.35)
    assert b["D_f"] / a["D_f"] == pytest.approx(ratio**0.15)
    assert b["torso_inertia"][0] / a["torso_inertia"][0] == pytest.approx(ratio ** (5 / 3))
    c = parsed({"mass": 2.5}, **TAPER).parameters
    assert c["torso_mass"] + sum(c["link_masses"]) == pytest.approx(2.5)


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


def test_a_torso_of_one_density_has_the_moments_of_its_points():
    """Against the sums over many points inside."""
    lengths, density = np.array([0.03, 0.05, 0.02]), 1100.0
    grid = (np.arange(60) + 0.5) / 30 - 1
    x, y, z = np.meshgrid(grid, grid, grid)
    shapes = {"ellipsoid": ("semi_axes", lengths, x**2 + y**2 + z**2 <= 1)}
    shapes |= {"box": ("sides", lengths / 2, np.ones(x.shape, bool))}
    for shape, (name, half, inside) in shapes.items():
        table = {"shape": shape, name: lengths.tolist(), "density": "1.1 g/cm^3"}
        found = parsed({"torso": table}).parameters
        points = np.stack([x[inside], y[inside], z[inside]]) * half[:, None]
        mass = density * np.prod(2 * half) * inside.mean()
        squares = (points**2).mean(axis=1)
        with row(shape):
            assert found["torso_mass"] == pytest.approx(mass, rel=2e-3)
            expected = mass * (squares.sum() - squares)
            np.testing.assert_allclose(found["torso_inertia"], expected, rtol=5e-3)
            assert found["torso_semi_axes"] == pytest.approx(half)
    free = parsed({"torso": BOX}, contacts=["feet"]).parameters
    assert "torso_semi_axes" not in free and free["torso_mass"] == pytest.approx(2.0)


def test_a_scene_is_made_again_from_its_table():
    for body in ({"scale": 1.6}, {"mass": 3.0}, {"scale": 0.5, "torso": BOX}, {"scale": 1}):
        for more in ({}, TAPER):
            with row(body, more):
                scene = parsed(body, **more)
                assert parse_scene(scene_to_dict(scene), "rat") == scene


def test_what_is_no_body_is_refused(refuse_rows):
    one = {"shape": "box", "sides": [1, 1, 1]}
    rows = [
        (3, "", "scale"),
        ({"scale": 0}, ".scale", "0.001 to 1000"),
        ({"scale": 0.00099}, ".scale", "0.001 to 1000"),
        ({"scale": 1000.1}, ".scale", "0.001 to 1000"),
        ({"scale": "big"}, ".scale", ""),
        ({"scale": float("nan")}, ".scale", ""),
        ({"scale": 1, "mass": 1}, ".mass", "scale"),
        ({"scal": 1}, ".scal", "'scale'"),
        ({"mass": "3 m"}, ".mass", "kg"),
        ({"mass": 0}, ".mass", "1e-09"),
        ({"torso": 3}, ".torso", "'box'"),
        ({"torso": {"shape": "cube"}}, ".torso", "'ellipsoid'"),
        ({"torso": one}, ".torso.density", "kg/m^3"),
        ({"torso": one | {"sides": [1, 2, 0], "density": 1}}, ".torso.sides", "three"),
        ({"torso": one | {"sides": [1, 2], "density": 1}}, ".torso.sides", "three"),
        ({"torso": one | {"sides": "1 kg", "density": 1}}, ".torso.sides", "mm"),
        ({"torso": {"shape": "box", "density": 1}}, ".torso.sides", "three"),
        ({"torso": one | {"density": 1, "x": 1}}, ".torso.x", "sides"),
        ({"torso": one | {"density": 1.1e5}}, ".torso.density", "100000"),
        ({"torso": one | {"density": 9e-4}}, ".torso.density", "0.001"),
    ]
    refuse_rows((RAT | {"body": body}, f"body{field}", words) for body, field, words in rows)
    twice = RAT | {"body": {"torso": BOX}, "parameters": {"torso_mass": 1.0}}
    refuse_rows([(twice, "parameters.torso_mass", "body.torso")])
    for body in ({"scale": 0.001}, {"scale": 1000}, {"mass": 1e-9}):
        assert parsed(body).unscaled
    for density in (1e-3, 1e5):
        assert parsed({"torso": one | {"density": density}}).parameters["torso_mass"] == density
