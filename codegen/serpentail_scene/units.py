"""Numbers with units as users write them, such as "105.7 g": exact up to the last rounding."""

import math
import re
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

ONE, KILO = Fraction(1), Fraction(1000)
POUND, INCH = Fraction("0.45359237"), Fraction("0.0254")
CENTI, MILLI, MICRO = (Fraction(1, n) for n in (100, 1000, 10**6))
DEGREE = Fraction(math.pi) / 180  # of the double pi, so that 30 deg are math.pi / 6
# The unit of a field, powers without "^" -> what it measures, and what else may be written there:
# how much of the field's unit each unit is.
MEASURES: dict[str, tuple[str, dict[str, Fraction]]] = {
    "kg/m3": ("a density", {"kg/m3": ONE, "g/cm3": KILO}),
    "kg": ("a mass", {"kg": ONE, "g": MILLI, "mg": MICRO, "lb": POUND, "oz": POUND / 16}),
    "m": ("a length", {"m": ONE, "cm": CENTI, "mm": MILLI, "um": MICRO, "in": INCH}),
    "s": ("a time", {"s": ONE, "ms": MILLI, "us": MICRO}),
    "rad": ("an angle", {"rad": ONE, "deg": DEGREE}),
    "deg": ("an angle", {"deg": ONE, "rad": 1 / DEGREE}),
    "m/s": ("a speed", {"m/s": ONE, "cm/s": CENTI, "mm/s": MILLI, "km/h": KILO / 3600}),
    "rad/s": ("a rate of turning", {"rad/s": ONE, "deg/s": DEGREE, "rpm": 6 * DEGREE}),
    "m/s2": ("an acceleration", {"m/s2": ONE, "cm/s2": CENTI, "mm/s2": MILLI}),
    "kg m2": (
        "a moment of inertia",
        {
            **{"kg m2": ONE, "kg cm2": CENTI**2, "kg mm2": MICRO},
            **{"g cm2": MILLI * CENTI**2, "g mm2": MILLI * MICRO},
        },
    ),
    "N": ("a force", {"N": ONE, "mN": MILLI, "kN": KILO}),
    "N m": ("a torque", {"N m": ONE, "N cm": CENTI, "mN m": MILLI, "N mm": MILLI}),
    "W": ("a power", {"W": ONE, "mW": MILLI}),
    "N m/s": ("a torque per time", {"N m/s": ONE, "mN m/s": MILLI, "N mm/s": MILLI}),
    "N m s": (
        "a damping of joints",
        {"N m s": ONE, "mN m s": MILLI, "N m s/rad": ONE, "mN m s/rad": MILLI},
    ),
    "N m/rad": (
        "a stiffness of joints",
        {
            **{"N m/rad": ONE, "N cm/rad": CENTI, "mN m/rad": MILLI, "N mm/rad": MILLI},
            "N m/deg": 1 / DEGREE,
        },
    ),
    "N/m": ("a stiffness", {"N/m": ONE, "kN/m": KILO, "N/mm": KILO}),
    "N/m1.5": ("a stiffness of contact", {"N/m1.5": ONE, "kN/m1.5": KILO}),
    "m2": ("an area", {"m2": ONE, "cm2": CENTI**2, "mm2": MICRO}),
    "m5": ("a drag of turning", {"m5": ONE, "cm5": CENTI**5, "mm5": MILLI**5}),
    "1/s": ("a gain per time or a rate", {"1/s": ONE, "Hz": ONE, "kHz": KILO}),
    "1/s2": ("a gain per time squared", {"1/s2": ONE}),
}
# angles have none
BASE = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "W": (1, 2, -3)}
DEEPEST = 4  # arrays in arrays that are looked into
NUMBER = r"[+-]?(?:[0-9]{1,40}(?:\.[0-9]{0,40})?|\.[0-9]{1,40})(?:[eE][+-]?[0-9]{1,3})?"
TEXT = re.compile(rf"\s*({NUMBER}(?:\s*,\s*{NUMBER})*)(?:\s*([^\W\d_].*)|\s+(1/.*))", re.DOTALL)
SPELLINGS = {"^": "", "Nm": "N m", "*": " ", "·": " ", "²": "2", "µ": "u", "μ": "u"}


def in_unit(value: Any, unit: str | Sequence[str], depth: int = DEEPEST) -> Any:
    """Return a value with each text such as "105.7 g", in arrays too, as a number in the unit.

    unit: of every number, or one of each entry of an array, the last one of the rest.  Of a text
    with commas, "31.5, 49.5, 27 mm", all numbers have the unit at its end.  What is no number and
    no such text is returned as it is.  ValueError says which unit is needed.
    """
    if type(value) in (list, tuple) and depth:
        units = [unit] if isinstance(unit, str) else unit
        each = [units[min(k, len(units) - 1)] for k in range(len(value))]
        return type(value)(in_unit(x, u, depth - 1) for x, u in zip(value, each, strict=True))
    if not isinstance(value, str) or not isinstance(unit, str) or plain(unit) not in MEASURES:
        return value
    found = TEXT.fullmatch(value) if len(value) < 1000 else None
    if not found:
        return value
    factor = _factor(plain(found[2] or found[3]), unit)
    numbers = [_float(text, factor, unit) for text in found[1].split(",")]
    return numbers if len(numbers) > 1 else numbers[0]


@lru_cache(256)
def plain(unit: str) -> str:
    """Return a unit as MEASURES spells it, such as "kg m2" for "kg m^2"."""
    for old, new in SPELLINGS.items():
        unit = unit.replace(old, new)
    return re.sub(r"\s*/\s*", "/", " ".join(unit.split()))


@lru_cache(256)
def dimensions(unit: str) -> tuple[float, float, float]:
    """Return the powers of kg, m and s in a unit, such as (1, 2, -2) of "N m"."""
    powers = [0.0, 0.0, 0.0]
    above, *below = plain(unit).split("/")
    for part, sign in ((above, 1), *((each, -1) for each in below)):
        for factor in part.split():
            name, power = re.fullmatch(r"([A-Za-z]*)([0-9.]*)", factor).groups()  # type: ignore[union-attr]
            for k, each in enumerate(BASE.get(name, (0, 0, 0))):
                powers[k] += sign * each * float(power or 1)
    return powers[0], powers[1], powers[2]


def words_of(unit: str | Sequence[str]) -> str:
    """Return what a message says of a unit after a number."""
    return ", without a unit" if unit == "1" else f", in {unit}"


def choices(unit: str) -> str:
    """Return what may be written in a field of a unit."""
    return f"{', '.join(MEASURES[plain(unit)][1])} or a plain number in {unit}"


def pattern(unit: str, others: str = "{0}") -> str:
    """Return the regular expression of a number and others, with one of the units of a field.

    others: how many, as regular expressions say it.
    """
    names = [name.replace(".", "[.]") for name in MEASURES[plain(unit)][1]]
    spelled = "|".join(re.sub("([ms])([123])", r"\1\^?\2", name) for name in names)
    gap = r"\s+" if spelled.startswith("1") else r"\s*"
    return rf"^\s*{NUMBER}(?:\s*,\s*{NUMBER}){others}{gap}(?:{spelled})\s*$"


def _factor(written: str, unit: str) -> Fraction:
    """Return how much of a field's unit the written one is."""
    needed, known = MEASURES[plain(unit)]
    if written in known:
        return known[written]
    others = [what for what, units in MEASURES.values() if written in units]
    wrong = f"{others[0]} where {needed} is needed" if others else f"unknown unit {written[:20]!r}"
    raise ValueError(f"{wrong}: give {choices(unit)}")


def _float(text: str, factor: Fraction, unit: str) -> float:
    """Return the double nearest to the number that the text says; + 0.0 turns -0.0 into 0.0."""
    try:
        return float(Fraction(text.strip()) * factor) + 0.0
    except OverflowError:
        raise ValueError(f"too large for a number in {unit}") from None
