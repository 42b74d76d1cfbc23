"""Numbers with units mean, to the last bit, what the same numbers in SI units mean."""

import math
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

import serpentail.units
import serpentail_codegen.scene.units
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.scene.units import MEASURES, in_unit, pattern, plain
from tests.support.scenes import VALID

# (written, unit of the field, power of ten between the two)
SHIFTS = [
    *(("kg", "kg", 0), ("g", "kg", -3), ("mg", "kg", -6)),
    *(("m", "m", 0), ("cm", "m", -2), ("mm", "m", -3), ("um", "m", -6), ("µm", "m", -6)),
    *(("s", "s", 0), ("ms", "s", -3), ("us", "s", -6)),
    *(("cm/s", "m/s", -2), ("mm/s", "m/s", -3), ("cm/s^2", "m/s^2", -2), ("mm/s2", "m/s^2", -3)),
    *(("kg mm^2", "kg m^2", -6), ("g cm2", "kg m^2", -7), ("g*mm²", "kg m^2", -9)),
    *(("mN m", "N m", -3), ("N mm", "N m", -3), ("N m s/rad", "N m s", 0), ("mN m s", "N m s", -3)),
    *(("mN m/s", "N m/s", -3), ("kN/m", "N/m", 3), ("N/mm", "N/m", 3), ("kN/m^1.5", "N/m^1.5", 3)),
    *(("1/s", "1/s", 0), ("1/s2", "1/s^2", 0), ("deg", "deg", 0)),
]
numbers = some.decimals(-(10**9), 10**9, places=9) | some.floats(
    -1e200, 1e200, allow_subnormal=False
).map(repr)


@pytest.mark.parametrize(("written", "unit", "shift"), SHIFTS)
@settings(max_examples=50, deadline=None, derandomize=True)
@given(number=numbers)
def test_a_decimal_shift_rounds_once(written, unit, shift, number):
    """Python reads "1.5e-3" as the nearest double: the exponent is shifted in the text itself."""
    sign, digits, exponent = Decimal(str(number)).as_tuple()
    moved = f"{'-' if sign else ''}{''.join(map(str, digits))}e{exponent + shift}"
    assert in_unit(f"{number} {written}", unit) == float(moved)


@pytest.mark.parametrize(("written", "unit"), [("deg", "rad"), ("deg/s", "rad/s"), ("rad", "deg")])
@settings(max_examples=100, deadline=None, derandomize=True)
@given(number=some.decimals(-4000, 4000, places=6))
def test_an_angle_in_degrees_is_that_of_the_double_pi_rounded_once(written, unit, number):
    with mp.workdps(60):
        factor = mpf(math.pi) / 180 if unit.startswith("rad") else 180 / mpf(math.pi)
        nearest = float(mpf(str(number)) * factor)
        exact = mpf(str(number)) * (mp.pi / 180 if unit.startswith("rad") else 180 / mp.pi)
    found = in_unit(f"{number} {written}", unit)
    assert found == nearest and abs(found - exact) <= math.ulp(found)


@pytest.mark.parametrize("n", [n for n in range(1, 181) if 180 % n == 0])
def test_a_part_of_half_a_turn_is_that_part_of_pi(n):
    assert in_unit(f"{180 // n} deg", "rad") == math.pi / n


def test_a_speed_of_a_car_is_the_nearest_double_too():
    assert in_unit("100 km/h", "m/s") == float(Fraction(100_000, 3600))


def test_the_two_packages_have_the_same_file():
    texts = {
        Path(m.__file__).read_bytes() for m in (serpentail.units, serpentail_codegen.scene.units)
    }
    assert len(texts) == 1


def test_every_parameter_can_have_a_unit_but_a_pure_number():
    assert {p.name for p in PARAMETERS if plain(p.unit) not in MEASURES} == {"mu"}


def test_arrays_have_units_of_their_own_or_one_for_all():
    assert in_unit(["31.5 mm", 0.0495, "2.7 cm"], "m") == [0.0315, 0.0495, 0.027]
    assert in_unit("31.5, 49.5, 27 mm", "m") == [0.0315, 0.0495, 0.027]
    assert in_unit([["90 deg"], ["free", 1]], "rad") == [[pytest.approx(1.570796)], ["free", 1]]
    assert in_unit(("1 mm", "1 deg", "2 deg"), ("m", "deg")) == (0.001, 1.0, 2.0)


@pytest.mark.parametrize(
    "text", ["", "2", "1, 2", "heavy", "nan kg", "1_0 g", "1,, 2 mm", "kg", "- 1 g"]
)
def test_what_is_no_number_is_left_to_the_fields_own_rule(text):
    assert in_unit(text, "kg") == text


@pytest.mark.parametrize(
    ("field", "text", "remedy"),
    [
        (
            "torso_mass",
            "217 deg",
            "an angle where a mass is needed: give kg, g, mg or a plain number in kg",
        ),
        ("torso_mass", "2 lb", "unknown unit 'lb': give kg, g, mg or a plain number in kg"),
        ("torso_mass", "2", "needs a finite number above 0, in kg (default: 0.10572)"),
        ("torso_mass", "1e999 g", "too large for a number in kg"),
        ("delta_m", "3 mm", "a length where an angle is needed: give rad, deg or a plain numb"),
        ("K_n", "3 N/m", "a stiffness where a stiffness of contact is needed: give N/m1.5, kN/m1"),
        ("mu", "1 m", "needs a finite number, 0 or above, in 1 (default: 1.0)"),
        ("torso_mass", "-1 g", "needs a finite number above 0, in kg (default: 0.10572)"),
    ],
)
def test_a_wrong_unit_is_refused_with_those_that_fit(refuse, field, text, remedy):
    scene = f'contacts = ["feet"]\n{VALID}[parameters]\n{field} = "{text}"\n'
    (problem,) = refuse(scene).values()
    assert (problem.field, problem.value) == (f"parameters.{field}", text)
    assert problem.remedy.startswith(remedy)


def test_a_bend_range_is_an_angle(refuse):
    assert scene_for("continuum", 1, bend_range="180 deg").bend_range == float(mp.pi)
    for wrong in ("1 m", "9999 deg"):
        text = f'kind = "continuum"\nsegments = 1\nbend_range = "{wrong}"\n'
        assert 'such as "360 deg"' in refuse(text)["bend_range"].remedy


def test_the_pattern_of_a_unit_is_what_its_texts_match():
    for unit, (_, known) in MEASURES.items():
        for name in known:
            assert re.match(pattern(unit), f"-1.5e-3 {name}")
            assert re.match(pattern(unit, "*"), f" .5, 2 {name} ")
            assert not re.match(pattern(unit), f"1, 2 {name}") and not re.match(pattern(unit), "1")
            in_unit([f"-1.5e-3 {name}", f" .5, 2 {name} "], unit)


def test_models_of_numbers_with_units_are_the_same_to_the_byte(tmp_path):
    """The hash of their content, the manifests and all files."""
    given = [
        {"torso_mass": 0.1057, "tail_mount": [0.0, -0.0405, 0.0045], "torso_inertia": [7e-5] * 3},
        {
            "torso_mass": "105.7 g",
            "tail_mount": [0, "-40.5 mm", "0.45 cm"],
            "torso_inertia": "700, 700, 700 g cm^2",
        },
    ]
    folders = []
    for k, parameters in enumerate(given):
        scene = scene_for("articulated", 1, 1, functions=["energy"], parameters=parameters)
        generate(scene, tmp_path / str(k))
        folder = tmp_path / str(k) / scene.name
        folders.append({p.relative_to(folder): p.read_bytes() for p in folder.rglob("*.*")})
    assert folders[0] == folders[1] and len(folders[0]) > 5
