"""Numbers with units mean, to the last bit, what the same numbers in SI units mean."""

import math
import re
from decimal import Decimal
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

from serpentail_scene.parameters import PARAMETERS
from serpentail_scene.units import MEASURES, dimensions, in_unit, pattern, plain
from tests.support.rows import row
from tests.support.scenes import VALID

# (written, unit of the field, power of ten between the two)
SHIFTS = [
    *(("kg", "kg", 0), ("g", "kg", -3), ("mg", "kg", -6)),
    *(("kg/m^3", "kg/m^3", 0), ("g/cm^3", "kg/m^3", 3), ("N/m^1.5", "N/m^1.5", 0)),
    *(("m", "m", 0), ("cm", "m", -2), ("mm", "m", -3), ("um", "m", -6), ("µm", "m", -6)),
    *(("s", "s", 0), ("ms", "s", -3), ("us", "s", -6), ("m/s", "m/s", 0), ("m/s^2", "m/s^2", 0)),
    *(("cm/s", "m/s", -2), ("mm/s", "m/s", -3), ("cm/s^2", "m/s^2", -2), ("mm/s2", "m/s^2", -3)),
    *(("kg mm^2", "kg m^2", -6), ("g cm2", "kg m^2", -7), ("g*mm²", "kg m^2", -9)),
    *(("kg m^2", "kg m^2", 0), ("N m", "N m", 0), ("N m/s", "N m/s", 0), ("N/m", "N/m", 0)),
    *(("mN m", "N m", -3), ("N mm", "N m", -3), ("N m s/rad", "N m s", 0), ("mN m s", "N m s", -3)),
    *(("N m s", "N m s", 0), ("mN m s/rad", "N m s", -3), ("N m/rad", "N m/rad", 0)),
    *(("mN m/rad", "N m/rad", -3), ("N mm/rad", "N m/rad", -3), ("N mm/s", "N m/s", -3)),
    *(("mN m/s", "N m/s", -3), ("kN/m", "N/m", 3), ("N/mm", "N/m", 3), ("kN/m^1.5", "N/m^1.5", 3)),
    *(("1/s", "1/s", 0), ("1/s2", "1/s^2", 0), ("deg", "deg", 0), ("rad", "rad", 0)),
    *(("rad/s", "rad/s", 0), ("kg cm2", "kg m^2", -4), ("N cm", "N m", -2)),
    *(("W", "W", 0), ("N", "N", 0), ("mN", "N", -3), ("kN", "N", 3), ("mW", "W", -3)),
    *(("m2", "m^2", 0), ("cm2", "m^2", -4), ("mm2", "m^2", -6)),
    *(("m5", "m^5", 0), ("cm5", "m^5", -10), ("mm5", "m^5", -15)),
    *(("N cm/rad", "N m/rad", -2), ("mNm", "N m", -3), ("Hz", "1/s", 0), ("kHz", "1/s", 3)),
]
ODD = [  # a unit, that of the field, a number of them, and what they are
    *(("lb", "kg", 1, 0.45359237), ("oz", "kg", 16, 0.45359237), ("in", "m", 1, 0.0254)),
    ("rpm", "rad/s", 60, 2 * math.pi),
]
ANGLES = [("deg", "rad", 1), ("deg/s", "rad/s", 1), ("rad", "deg", -1), ("N m/deg", "N m/rad", -1)]
NUMBERS = some.decimals(-(10**9), 10**9, places=9) | some.floats(
    -1e200, 1e200, allow_subnormal=False
).map(repr)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(number=NUMBERS)
def test_a_decimal_shift_rounds_once(number):
    """Python reads "1.5e-3" as the nearest double: the exponent is shifted in the text itself."""
    sign, digits, exponent = Decimal(str(number)).as_tuple()
    whole = f"{'-' if sign else ''}{''.join(map(str, digits))}"
    for written, unit, shift in SHIFTS:
        with row(written, unit):
            assert in_unit(f"{number} {written}", unit) == float(f"{whole}e{exponent + shift}")


@settings(max_examples=100, deadline=None, derandomize=True)
@given(number=some.decimals(-4000, 4000, places=6))
def test_an_angle_in_degrees_is_that_of_the_double_pi_rounded_once(number):
    for written, unit, power in ANGLES:
        with row(written, unit), mp.workdps(60):
            nearest = float(mpf(str(number)) * (mpf(math.pi) / 180) ** power)
            exact = mpf(str(number)) * (mp.pi / 180) ** power
            found = in_unit(f"{number} {written}", unit)
            assert found == nearest and abs(found - exact) <= math.ulp(found)


def test_parts_of_a_turn_and_the_speed_of_a_car_are_the_nearest_doubles():
    for n in [n for n in range(1, 181) if 180 % n == 0]:
        assert in_unit(f"{180 // n} deg", "rad") == math.pi / n
    assert in_unit("100 km/h", "m/s") == float(Fraction(100_000, 3600))


def test_every_unit_is_tested():
    tested = {(plain(w), plain(u)) for w, u, _ in (*SHIFTS, *ANGLES)} | {("km/h", "m/s")}
    tested |= {(name, unit) for name, unit, *_ in ODD}
    known = {(w, u) for u, (_, units) in MEASURES.items() for w in units}
    assert known == tested
    assert {p.name for p in PARAMETERS if plain(p.unit) not in MEASURES} == {
        *("mu", "tendon_guides", "joint_ratios")
    }


def test_units_have_dimensions():
    rows = {"kg m^2": (1, 2, 0), "N m": (1, 2, -2), "N m s": (1, 2, -1), "m/s^2": (0, 1, -2)}
    rows |= {"N/m^1.5": (1, -0.5, -2), "N m/rad": (1, 2, -2), "rad/s": (0, 0, -1)}
    rows |= {"kg/m^3": (1, -3, 0), "1": (0, 0, 0), "deg": (0, 0, 0), "s": (0, 0, 1)}
    assert {unit: dimensions(unit) for unit in rows} == rows
    for parameter in PARAMETERS:
        assert any(dimensions(parameter.unit)) == (parameter.unit not in ("1", "rad"))


def test_arrays_have_units_of_their_own_or_one_for_all():
    assert in_unit(["31.5 mm", 0.0495, "2.7 cm"], "m") == [0.0315, 0.0495, 0.027]
    assert in_unit("31.5, 49.5, 27 mm", "m") == [0.0315, 0.0495, 0.027]
    assert in_unit([["90 deg"], ["free", 1]], "rad") == [[math.pi / 2], ["free", 1]]
    assert in_unit(("1 mm", "1 deg", "2 deg"), ("m", "deg")) == (0.001, 1.0, 2.0)
    assert in_unit([[[["1 g", ["1 g"]]]]], "kg") == [[[[0.001, ["1 g"]]]]]  # at most 4 deep
    assert math.copysign(1, in_unit("-0 g", "kg")) == 1
    # what is no number is left to the field's own rule
    texts = ["", "2", "1, 2", "heavy", "nan kg", "1_0 g", "1,, 2 mm", "kg", "- 1 g", "1 g" * 400]
    for value in (*texts, 1, None, True, {}):
        assert in_unit(value, "kg") == value
    assert in_unit("1 m", "1") == "1 m"


def test_a_wrong_unit_is_refused_with_those_that_fit(refuse_rows):
    rows = [
        ("torso_mass", "217 deg", "an angle"),
        ("torso_mass", "217 deg", "a mass"),
        ("torso_mass", "2 st", "'st'"),
        ("torso_mass", "2 st", "kg, g, mg, lb, oz"),
        ("torso_mass", "2", "0.10572"),
        ("torso_mass", "1e999 g", "kg"),
        ("torso_mass", "-1 g", "above 0, in kg"),
        ("delta_m", "3 mm", "rad, deg"),
        ("K_n", "3 N/m", "N/m1.5, kN/m1.5"),
        ("mu", "1 m", "without a unit"),
    ]
    for field, text, words in rows:
        scene = f'contacts = ["feet"]\n{VALID}[parameters]\n{field} = "{text}"\n'
        refuse_rows([(scene, f"parameters.{field}", words)])


def test_the_pattern_of_a_unit_is_what_its_texts_match():
    for unit, (_, known) in MEASURES.items():
        for name in known:
            with row(unit, name):
                assert re.match(pattern(unit), f"-1.5e-3 {name}")
                assert re.match(pattern(unit, "*"), f" .5, 2 {name} ")
                assert not re.match(pattern(unit), f"1, 2 {name}")
                assert not re.match(pattern(unit), "1")
                in_unit([f"-1.5e-3 {name}", f" .5, 2 {name} "], unit)


def test_units_without_a_decimal_shift_are_those_of_their_definitions():
    for written, unit, count, expected in ODD:
        with row(written):
            assert in_unit(f"{count} {written}", unit) == expected
