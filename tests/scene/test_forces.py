"""Gravity in any direction, slopes and motors in scenes: what follows, and what is refused."""

from math import pi

import pytest

from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from tests.scene.test_parameters import given, parsed, wrong
from tests.support.scenes import VALID


def test_a_slope_turns_gravity(read):
    """The ground rises towards an axis: gravity pulls the other way, and no scale changes it."""
    slope = 'slope = { angle = "30 deg", toward = "y" }\n'
    found = read(slope + VALID).parameters
    assert "gravity" not in found
    assert found["gravity_vector"] == pytest.approx((0, -4.9, -9.8 * 3**0.5 / 2), rel=1e-15)
    for angle, toward, expected in (
        (90, "-x", (2, 0, 0)),
        (180, "x", (0, 0, 2)),
        (0, "y", (0, 0, -2)),
    ):
        given_slope = {"angle": f"{angle} deg", "toward": toward}
        scene = parsed({"scale": 2}, slope=given_slope, parameters={"gravity": 2})
        assert scene.parameters["gravity_vector"] == pytest.approx(expected, abs=1e-15)
        assert parse_scene(scene_to_dict(scene), "rat") == scene


def test_gravity_that_cannot_be_is_refused(refuse_rows):
    vector, slope = "gravity_vector = [0, 1, -9]", 'slope = { angle = 0.1, toward = "y" }\n'
    rows = [(given(vector, "gravity = 9.8"), "parameters.gravity", "gravity_vector")]
    rows += [wrong("gravity_vector", value, "m/s^2") for value in ("9.8", "[0, 9]", "[0, nan, 1]")]
    rows += [("weightless = true\n" + given(vector), "parameters.gravity_vector", "weightless")]
    rows += [(slope + given(vector), "parameters.gravity_vector", "slope")]
    rows += [("slope = 0.1\n" + VALID, "slope", "angle")]
    for angle, toward, field in (
        *((a, '"y"', "angle") for a in ("-0.1", "3.2", '"190 deg"', '"3 m"', "nan")),
        *(("0.1", t, "toward") for t in ('"z"', "1", "[]")),
    ):
        text = f"slope = {{ angle = {angle}, toward = {toward} }}\n"
        rows += [(text + VALID, f"slope.{field}", "rad" if field == "angle" else "x")]
    rows += [('slope = { toward = "y" }\n' + VALID, "slope.angle", "rad")]
    rows += [('slope = { angle = 1, toward = "y", up = 1 }\n' + VALID, "slope.up", "angle")]
    refuse_rows(rows)


def test_motors_that_cannot_be_are_refused(read, refuse_rows):
    motor = "motor_torque = 0.02", 'motor_speed = "600 rpm"'
    found = read(given(*motor)).parameters
    assert found["motor_torque"] == (0.02,) * 4 and found["motor_speed"] == (20 * pi,) * 4
    rows = [(given(motor[0]), "parameters.motor_speed", "motor_torque")]
    rows += [(given(motor[1]), "parameters.motor_torque", "motor_speed")]
    rows += [(given(motor[0], "motor_speed = 0"), "parameters.motor_speed", "above 0")]
    rows += [wrong("motor_power", value, "W") for value in ("0", "-1", '"1 N m"', "[1, 2]")]
    polar = {"kind": "continuum", "segments": 1, "coordinates": "polar"}
    rows += [(polar | {"parameters": {"motor_power": 1}}, "parameters.motor_power", "motors")]
    refuse_rows(rows)
