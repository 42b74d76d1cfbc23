"""Parameters of a scene, of its passive tail and of its body, which is scaled by similarity or by
published exponents or has a torso of a simple shape: defaults, what follows, what is refused.
"""

import math
from math import pi

import numpy as np
import pytest

from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.variant import EQUAL
from serpentail_scene.keys import GROUPS
from serpentail_scene.parameters import PARAMETERS, PASSIVE, PASSIVE_NAMES
from tests.support.rows import row
from tests.support.scenes import VALID

BAD = ["true", '"3"', "nan", "inf", "-inf", "{}", "[]", "12:30:00", "9" * 400]
# of each part of a passive tail enough to be there
NEEDED = {
    "spring": "tail_stiffness = 0.01\n",
    "damping": "tail_damping = 1e-4\n",
    "stops": "tail_stop_lower = -1\ntail_stop_upper = 1\ntail_stop_stiffness = 0.1\n",
    "stop damping": "tail_stop_damping = 1e-3\ntail_stop_lower = -1\ntail_stop_upper = 1\n"
    "tail_stop_stiffness = 0.1\n",
    "motor": "motor_torque = 0.02\nmotor_speed = 80\n",
    "power": "motor_power = 1\n",
    "rotor": "tail_rotor = 1e-6\n",
}


def given(*lines):
    """A scene of two segments with some lines of parameters."""
    return VALID + "\n".join(["[parameters]", *lines]) + "\n"


def wrong(name, value, unit):
    """A row of a table of refusals: a value of a parameter, whose unit is told."""
    return given(f"{name} = {value}"), f"parameters.{name}", unit


def test_defaults_are_table_1_in_si_units(read):
    assert dict(read(VALID).parameters) == {
        "gravity": 9.8,
        "torso_mass": pytest.approx(105.72e-3, rel=1e-15),
        "torso_inertia": pytest.approx((672.2e-7, 363.9e-7, 727.9e-7), rel=1e-15),
        "tail_mount": pytest.approx((0.0, -40.5e-3, 4.5e-3), rel=1e-15),
        "tail_mass": pytest.approx(3.51e-3, rel=1e-15),
        "tail_length": pytest.approx(194.66e-3, rel=1e-15),
        "link_radius": pytest.approx(2.9e-3, rel=1e-15),
        "link_inertia": pytest.approx((3.17716e-08, 1.96794e-09, 3.17716e-08), rel=1e-5),
    }


def test_defaults_that_are_named_change_nothing():
    named = {p.name: p.default for p in PARAMETERS if p.default is not None}
    found = resolve_parameters(named, 6, contacts=GROUPS)
    assert found == resolve_parameters({}, 6, contacts=GROUPS)


def test_link_inertia_is_that_of_a_uniform_ellipsoid():
    """Moments of mass by midpoint quadrature over the ellipsoid's discs along y."""
    named = {"tail_mass": 0.03, "tail_length": 0.5, "link_radius": 0.02}
    m, half, r, discs = 0.03 / 5, 0.5 / 5 / 2, 0.02, 2000
    y = [half * (2 * (k + 0.5) / discs - 1) for k in range(discs)]
    weight = [1 - (s / half) ** 2 for s in y]
    along = sum(w * r**2 * w / 2 for w in weight) * m / sum(weight)
    spread = sum(w * (r**2 * w / 4 + s**2) for w, s in zip(weight, y, strict=True))
    across = spread * m / sum(weight)
    expected = pytest.approx((across, along, across), rel=1e-6)
    assert resolve_parameters(named, 5)["link_inertia"] == expected


def test_numbers_that_are_taken(read):
    """An inertia instead of a radius, zeros without a sign, whole numbers, flat bodies."""
    found = read(given("link_inertia = [1e-8, 0, 1e-8]")).parameters
    assert found["link_inertia"] == (1e-8, 0.0, 1e-8)
    of_equal = {p.name for p in PARAMETERS if not p.needs and EQUAL.numbers_of(p.tail)}
    assert set(found) == of_equal - {"link_radius"}
    found = read(given("link_radius = 0", "gravity = -0.0", "tail_mount = [0, -0.0, 1]")).parameters
    numbers = (found["gravity"], *found["tail_mount"])
    assert found["link_inertia"][1] == 0 and numbers == (0, 0, 0, 1)
    assert all(type(x) is float and math.copysign(1, x) == 1 for x in numbers)
    flat = [1, 1, 1], [1, 2, 3], [1e-5, 2e-5, 3e-5], [0.2, 0.7, 0.9], [3e-9, 1e-9, 2e-9]
    for moments in flat:
        found = resolve_parameters({"torso_inertia": moments}, 1)
        assert found["torso_inertia"] == tuple(moments)


def test_parameters_are_finite_numbers_of_their_size(refuse_rows):
    """All wrong values of a number and of an array, and one of each for all parameters."""
    sizes = ["[]", "[1, 1]", "[1, 1, 1, 1]", "[[1, 1, 1]]"]
    refuse_rows(wrong("torso_mass", bad, "kg") for bad in (*BAD, "[1]", "[1, 1, 1]", *sizes))
    refuse_rows(wrong("tail_mount", f"[1.0, {bad}, 1.0]", "m") for bad in BAD)
    refuse_rows(wrong("tail_mount", bad, "m") for bad in ("1", "[1]", *sizes))
    for p in PARAMETERS:
        bad = "nan" if p.size == 1 else "[1, nan, 1]"
        refuse_rows(wrong(p.name, each, p.unit.strip("1")) for each in (bad, "[1, 1]"))
    above_0 = ("torso_mass", "tail_mass", "tail_length")
    not_negative = ("gravity", "link_radius", *(f"L_{leg}" for leg in ("h2d", "m2t")))
    rows = [(name, value) for name in above_0 for value in ("0", "-1e-3")]
    rows += [(name, "-1e-3") for name in not_negative]
    torso = ("[1, 1, 2.01]", "[3, 1, 1]", "[0, 1, 1]", "[1, 2, 3.00001]")
    rows += [("torso_inertia", value) for value in torso]
    rows += [("link_inertia", "[1, -1e-30, 1]")]
    refuse_rows(wrong(*entry, "") for entry in rows)
    feet = 'contacts = ["feet"]\n'
    ground = {"K_n": ("0", "above 0"), "D_f": ("0.0", "above 0"), "K_f": ("0", "above 0")}
    ground |= {"mu": ("-0.1", "0 or above"), "D_n": ("-1", "0 or above"), "hip": ("[0, 1]", "3")}
    rows = [(feet + given(f"{n} = {v}"), f"parameters.{n}", say) for n, (v, say) in ground.items()]
    twice = given("link_inertia = [1, 1, 1]", "link_radius = 0.003")
    rows += [(twice, "parameters.link_inertia", "link_radius")]
    rows += [(given("tail_length = 1e200"), "parameters.link_inertia", "")]
    tables = ("3", "[]", '"gravity"', "[{}]")
    refuse_rows([*rows, *((f"parameters = {x}\n" + VALID, "parameters", "") for x in tables)])


def test_single_precision_holds_its_parameters(refuse, read):
    one = {"kind": "articulated", "segments": 1, "links": 1, "real": "float"}
    least, most = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
    for value in (1e-50, 1e300, least * (1 - 1e-15), most * (1 + 1e-15)):
        for parameters in ({"gravity": value}, {"tail_mount": [0, value, -1]}):
            with row(parameters):
                (name,) = parameters
                assert set(refuse(one | {"parameters": parameters})) == {f"parameters.{name}"}
                assert read(one | {"real": "double", "parameters": parameters})
    for value in (0.0, least, most):
        assert read(one | {"parameters": {"gravity": value}}).parameters["gravity"] == value


# Springs, damping and stops.


def test_a_parameter_brings_its_part_of_a_passive_tail_alone(read):
    for part, lines in ({"": ""} | NEEDED).items():
        with row(part):
            scene = read(given(lines))
            parts = ("stops", part) if part == "stop damping" else (part,) * bool(part)
            assert scene.passive == parts == tail_of(scene).passive
            own = {p.name for p in PASSIVE if p.needs in parts}
            assert set(scene.parameters) & set(PASSIVE_NAMES) == own


def test_one_number_stands_for_all_coordinates_and_each_may_have_its_own(read):
    found = read(given('tail_stiffness = "20 mN m/rad"', NEEDED["stops"])).parameters
    assert found["tail_stiffness"] == (0.02,) * 4 and found["tail_rest"] == (0.0,) * 4
    assert found["tail_stop_width"] == (0.1,) * 4 and found["tail_stop_lower"] == (-1.0,) * 4
    stiffness = 'tail_stiffness = [0.02, "30 mN m/rad", 0, 0.01]'
    found = read(given(stiffness, 'tail_rest = "0, 30, 0, -90 deg"')).parameters
    assert found["tail_stiffness"] == (0.02, 0.03, 0.0, 0.01)
    assert found["tail_rest"] == pytest.approx((0, pi / 6, 0, -pi / 2), rel=1e-15)


def test_passive_values_that_cannot_be_are_refused(refuse_rows):
    values = ("nan", "true", '"3"', "[]", "[1, 2, 3]", "[1, 2, 3, 4, 5]", "{}")
    rows = [("tail_damping", value) for value in (*values, "-1e-9", '"3 N m/rad"')]
    rows += [("tail_stiffness", value) for value in ("-1e-9", "[1, 1, -1, 1]", '"3 N m"')]
    rows += [(f"tail_stop_{n}", value) for n in ("stiffness", "width") for value in ("0", "-1")]
    rows += [(p.name, "[1, nan, 2, 3]") for p in PASSIVE]
    for name, value in rows:
        parameter = next(p for p in PASSIVE if p.name == name)
        kept = [x for x in NEEDED[parameter.needs].splitlines() if not x.startswith(f"{name} ")]
        text = given(f"{name} = {value}", *kept)
        refuse_rows([(text, f"parameters.{name}", parameter.unit)])
    refuse_rows([wrong("tail_stiffness", "[1, 1]", "array of 4")])


def test_what_a_passive_tail_lacks_or_excludes_is_told(refuse, refuse_rows):
    refuse_rows([(given("tail_rest = 0.1"), "parameters.tail_stiffness", "tail_rest")])
    names = ["tail_stop_upper", "tail_stop_stiffness"]
    for given_one, lacks in (("lower", names), ("damping", [*names, "tail_stop_lower"])):
        problems = refuse(given(f"tail_stop_{given_one} = 0.1"))
        assert set(problems) == {f"parameters.{name}" for name in lacks}
    stops = "tail_stop_lower = [-1, 1, 0.5, -1]", "tail_stop_upper = [1, 1, 0.4, 1]"
    problems = refuse(given(*stops, "tail_stop_stiffness = 0.1"))
    assert set(problems) == {f"parameters.tail_stop_lower[{k}]" for k in (1, 2)}
    assert "tail_stop_upper[2] = 0.4" in problems["parameters.tail_stop_lower[2]"].remedy
    polar = {"kind": "continuum", "segments": 1, "coordinates": "polar"}
    damped = polar | {"parameters": {"tail_damping": 1e-3}}
    refuse_rows([(damped, "parameters.tail_damping", "")])


# The table `body`

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
    # what a scene names is scaled, too
    named = {"parameters": {"torso_mass": 0.2, "link_inertia": [1e-7, 1e-8, 1e-7]}}
    found = parsed({"scale": 2.0}, **named).parameters
    assert found["torso_mass"] == pytest.approx(1.6) and found["link_inertia"][0] == 32e-7
    a, b = (parsed(body, **TAPER).parameters for body in (None, {"scale": 2.0}))
    np.testing.assert_allclose(b["link_masses"], 8 * np.array(a["link_masses"]), rtol=1e-14)
    stiff = {"tail_stiffness": 0.02, "tail_damping": 1e-4}
    b = parsed({"scale": 2.0}, parameters=stiff).parameters
    np.testing.assert_allclose(b["tail_stiffness"], 16 * 0.02)
    np.testing.assert_allclose(b["tail_damping"], 2**4.5 * 1e-4)


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


def test_what_is_no_body_is_refused(refuse_rows):
    one = {"shape": "box", "sides": [1, 1, 1]}
    rows = [
        (3, "", "scale"),
        ({"scale": 0.00099}, ".scale", "0.001 to 1000"),
        ({"scale": 1000.1}, ".scale", "0.001 to 1000"),
        ({"scale": float("nan")}, ".scale", ""),
        ({"scale": 1, "mass": 1}, ".mass", "scale"),
        ({"scal": 1}, ".scal", "'scale'"),
        ({"mass": "3 m"}, ".mass", "kg"),
        ({"mass": 0}, ".mass", "1e-09"),
        ({"torso": 3}, ".torso", "'box'"),
        ({"torso": {"shape": "cube"}}, ".torso", "'ellipsoid'"),
        ({"torso": one}, ".torso.density", "kg/m^3"),
        ({"torso": one | {"sides": [1, 2, 0], "density": 1}}, ".torso.sides", "3 finite"),
        ({"torso": one | {"sides": [1, 2], "density": 1}}, ".torso.sides", "3 finite"),
        ({"torso": one | {"sides": "1 kg", "density": 1}}, ".torso.sides", "mm"),
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
