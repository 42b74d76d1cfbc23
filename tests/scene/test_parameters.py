"""Parameters of a scene, and of its passive tail: defaults, what follows, what is refused."""

import json
import math
from math import pi

import numpy as np
import pytest

from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.passive import PASSIVE, PASSIVE_NAMES
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import GROUPS
from serpentail_codegen.scene.shape import EQUAL
from tests.support.rows import row
from tests.support.scenes import VALID

BAD = ["true", '"3"', "nan", "inf", "-inf", "{}", "[]", "12:30:00", "9" * 400]
# of each part of a passive tail enough to be there
NEEDED = {
    "spring": "tail_stiffness = 0.01\n",
    "damping": "tail_damping = 1e-4\n",
    "stops": "tail_stop_lower = -1\ntail_stop_upper = 1\ntail_stop_stiffness = 0.1\n",
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


def test_the_parameter_table_keeps_its_own_rules():
    named = {p.name: p.default for p in PARAMETERS if p.default is not None}
    found = resolve_parameters(named, 6, contacts=GROUPS)
    assert found == resolve_parameters({}, 6, contacts=GROUPS)
    assert all(p.unit and p.meaning and p.size in (1, 3) for p in PARAMETERS)


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
    every = [(p, "nan" if p.size == 1 else "[1, nan, 1]") for p in PARAMETERS]
    every += [(p, "[1, 1]") for p in PARAMETERS]
    refuse_rows(wrong(p.name, bad, p.unit) for p, bad in every)


def test_parameters_are_physical(refuse, refuse_rows):
    above_0 = ("torso_mass", "tail_mass", "tail_length")
    not_negative = ("gravity", "link_radius", *(f"L_{leg}" for leg in ("h2d", "m2t")))
    rows = [(name, value) for name in above_0 for value in ("0", "-1e-3")]
    rows += [(name, "-1e-3") for name in not_negative]
    torso = ("[1, 1, 2.01]", "[3, 1, 1]", "[0, 1, 1]", "[1, -1, 1]", "[1, 2, 3.00001]")
    rows += [("torso_inertia", value) for value in torso]
    rows += [("link_inertia", "[1, -1e-30, 1]")]
    refuse_rows(wrong(*entry, "") for entry in rows)
    feet = 'contacts = ["feet"]\n'
    ground = {"K_n": ("0", "above 0"), "D_f": ("0.0", "above 0"), "K_f": ("0", "above 0")}
    ground |= {"mu": ("-0.1", "0 or above"), "D_n": ("-1", "0 or above"), "hip": ("[0, 1]", "3")}
    for name, (value, words) in ground.items():
        refuse_rows([(feet + given(f"{name} = {value}"), f"parameters.{name}", words)])
    twice = given("link_inertia = [1, 1, 1]", "link_radius = 0.003")
    assert "link_radius" in refuse(twice)["parameters.link_inertia"].remedy
    assert set(refuse(given("tail_length = 1e200"))) == {"parameters.link_inertia"}
    for value in ("3", "[]", '"gravity"', "[{}]"):
        assert set(refuse(f"parameters = {value}\n" + VALID)) == {"parameters"}


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
    scene = read(VALID)
    assert scene.passive == () == tail_of(scene).passive
    assert not set(scene.parameters) & set(PASSIVE_NAMES)
    for part, lines in NEEDED.items():
        with row(part):
            scene = read(given(lines))
            assert scene.passive == (part,) == tail_of(scene).passive
            own = {p.name for p in PASSIVE if p.needs == part}
            assert set(scene.parameters) & set(PASSIVE_NAMES) == own
            assert parse_scene(json.loads(json.dumps(scene_to_dict(scene))), "other") == scene


def test_one_number_stands_for_all_coordinates_and_each_may_have_its_own(read):
    found = read(given('tail_stiffness = "20 mN m/rad"', NEEDED["stops"])).parameters
    assert found["tail_stiffness"] == (0.02,) * 4 and found["tail_rest"] == (0.0,) * 4
    assert found["tail_stop_width"] == (0.1,) * 4 and found["tail_stop_lower"] == (-1.0,) * 4
    stiffness = 'tail_stiffness = [0.02, "30 mN m/rad", 0, 0.01]'
    found = read(given(stiffness, 'tail_rest = "0, 30, 0, -90 deg"')).parameters
    assert found["tail_stiffness"] == (0.02, 0.03, 0.0, 0.01)
    assert found["tail_rest"] == pytest.approx((0, pi / 6, 0, -pi / 2), rel=1e-15)


def test_passive_values_that_cannot_be_are_refused(refuse_rows):
    values = ("nan", "inf", "true", '"3"', "[]", "[1, 2, 3]", "[1, 2, 3, 4, 5]", "{}")
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


def test_what_a_passive_tail_lacks_or_excludes_is_told(refuse):
    problems = refuse(given("tail_rest = 0.1"))
    assert set(problems) == {"parameters.tail_stiffness"}
    assert "tail_rest" in problems["parameters.tail_stiffness"].remedy
    problems = refuse(given("tail_stop_lower = -1"))
    names = ("tail_stop_upper", "tail_stop_stiffness")
    assert set(problems) == {f"parameters.{name}" for name in names}
    stops = "tail_stop_lower = [-1, 1, 0.5, -1]", "tail_stop_upper = [1, 1, 0.4, 1]"
    problems = refuse(given(*stops, "tail_stop_stiffness = 0.1"))
    assert set(problems) == {f"parameters.tail_stop_lower[{k}]" for k in (1, 2)}
    assert "tail_stop_upper[2] = 0.4" in problems["parameters.tail_stop_lower[2]"].remedy
    polar = {"kind": "continuum", "segments": 1, "coordinates": "polar"}
    problems = refuse(polar | {"parameters": {"tail_damping": 1e-3}})
    assert set(problems) == {"parameters.tail_damping"}
