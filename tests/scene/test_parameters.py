"""Parameters of a scene: defaults, what follows from others, and values that are refused."""

import math

import pytest

from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import GROUPS
from serpentail_codegen.scene.shape import EQUAL
from tests.support.scenes import VALID


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
    given = {p.name: p.default for p in PARAMETERS if p.default is not None}
    assert resolve_parameters(given, 6, contacts=GROUPS) == resolve_parameters(
        {}, 6, contacts=GROUPS
    )
    assert all(p.unit and p.meaning and p.size in (1, 3) for p in PARAMETERS)


def test_link_inertia_is_that_of_a_uniform_ellipsoid():
    """Moments of mass by midpoint quadrature over the ellipsoid's discs along y."""
    given = {"tail_mass": 0.03, "tail_length": 0.5, "link_radius": 0.02}
    m, half, r, discs = 0.03 / 5, 0.5 / 5 / 2, 0.02, 2000
    y = [half * (2 * (k + 0.5) / discs - 1) for k in range(discs)]
    weight = [1 - (s / half) ** 2 for s in y]
    along = sum(w * r**2 * w / 2 for w in weight) * m / sum(weight)
    across = (
        sum(w * (r**2 * w / 4 + s**2) for w, s in zip(weight, y, strict=True)) * m / sum(weight)
    )
    expected = pytest.approx((across, along, across), rel=1e-6)
    assert resolve_parameters(given, 5)["link_inertia"] == expected


def test_given_link_inertia_replaces_the_radius(read):
    parameters = read(VALID + "[parameters]\nlink_inertia = [1e-8, 0, 1e-8]\n").parameters
    assert parameters["link_inertia"] == (1e-8, 0.0, 1e-8)
    assert "link_radius" not in parameters
    of_equal = {p.name for p in PARAMETERS if not p.needs and EQUAL.numbers_of(p.tail)}
    assert set(parameters) == of_equal - {"link_radius"}


def test_zeros_are_allowed_and_lose_their_sign(read):
    parameters = read(
        VALID + "[parameters]\nlink_radius = 0\ngravity = -0.0\ntail_mount = [0, -0.0, 0]"
    ).parameters
    assert parameters["link_inertia"][1] == 0
    assert [math.copysign(1, x) for x in (parameters["gravity"], *parameters["tail_mount"])] == [
        1
    ] * 4


@pytest.mark.parametrize(
    "moments", [[1, 1, 1], [1, 2, 3], [1e-5, 2e-5, 3e-5], [0.2, 0.7, 0.9], [3e-9, 1e-9, 2e-9]]
)
def test_torso_inertia_may_be_that_of_a_flat_body(moments):
    assert resolve_parameters({"torso_inertia": moments}, 1)["torso_inertia"] == tuple(moments)


def test_numbers_become_floats(read):
    parameters = read(VALID + "[parameters]\ngravity = 10\ntail_mount = [0, -1, 0]\n").parameters
    assert [type(x) for x in (parameters["gravity"], *parameters["tail_mount"])] == [float] * 4


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
@pytest.mark.parametrize(
    "bad", ["true", '"3"', "nan", "inf", "-inf", "{}", "[]", "12:30:00", "9" * 400]
)
def test_parameters_are_finite_numbers(refuse, parameter, bad):
    value = bad if parameter.size == 1 else f"[1.0, {bad}, 1.0]"
    problems = refuse(VALID + f"[parameters]\n{parameter.name} = {value}")
    assert set(problems) == {f"parameters.{parameter.name}"}
    assert parameter.unit in problems[f"parameters.{parameter.name}"].remedy


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_parameters_have_their_size(refuse, parameter):
    right, field = ("1", "[1, 1, 1]")[parameter.size > 1], f"parameters.{parameter.name}"
    for value in {"1", "[]", "[1]", "[1, 1]", "[1, 1, 1]", "[1, 1, 1, 1]", "[[1, 1, 1]]"} - {right}:
        assert set(refuse(VALID + f"[parameters]\n{parameter.name} = {value}")) == {field}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(
            (name, value)
            for name in ("torso_mass", "tail_mass", "tail_length")
            for value in ("0", "-1e-3")
        ),
        *((name, "-1e-3") for name in ("gravity", "link_radius")),
        *(
            ("torso_inertia", value)
            for value in ("[1, 1, 2.01]", "[3, 1, 1]", "[0, 1, 1]", "[1, -1, 1]")
        ),
        ("link_inertia", "[1, -1e-30, 1]"),
    ],
)
def test_parameters_are_physical(refuse, name, value):
    assert set(refuse(VALID + f"[parameters]\n{name} = {value}")) == {f"parameters.{name}"}


def test_link_inertia_and_link_radius_exclude_each_other(refuse):
    problems = refuse(VALID + "[parameters]\nlink_inertia = [1, 1, 1]\nlink_radius = 0.003")
    assert "remove one" in problems["parameters.link_inertia"].remedy


def test_a_computed_inertia_has_to_be_finite(refuse):
    assert set(refuse(VALID + "[parameters]\ntail_length = 1e200")) == {"parameters.link_inertia"}


@pytest.mark.parametrize("value", ["3", "[]", '"gravity"', "[{}]"])
def test_parameters_are_a_table(refuse, value):
    assert set(refuse(f"parameters = {value}\n" + VALID)) == {"parameters"}


@pytest.mark.parametrize("mass", [1e-50, 1e300])
def test_single_precision_holds_its_parameters(mass):
    with pytest.raises(SceneError, match="beyond single precision"):
        scene_for("articulated", 1, 1, real="float", parameters={"torso_mass": mass})
