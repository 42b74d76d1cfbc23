"""What only a continuum has, and what only scenes with contacts have."""

import math

import pytest

from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.signatures.table import ALL, DEFAULT, DEFAULT_ON_GROUND, NEEDS
from tests.support.scenes import VALID

CONTINUUM = 'kind = "continuum"\nsegments = 3\n'


def test_a_continuum_has_no_links(refuse):
    problems = refuse(CONTINUUM + "links = 4\n[parameters]\nlink_radius = 0.003\n")
    assert set(problems) == {"links", "parameters.link_radius"}
    assert all("remove it" in problem.remedy for problem in problems.values())


@pytest.mark.parametrize("value", ["0", "-1.0", "nan", "inf", "101", "true", '"2"'])
def test_bend_range_is_an_angle(refuse, value):
    assert set(refuse(CONTINUUM + f"bend_range = {value}\n")) == {"bend_range"}


def test_a_continuum_scene(tmp_path):
    scene = scene_for("continuum", 3, samples=7)
    assert (scene.name, scene.segments, scene.samples, scene.coordinates) == (
        "continuum_m3",
        3,
        7,
        "bend",
    )
    assert "link_inertia" not in scene.parameters
    assert parse_scene(scene_to_dict(scene), "other") == scene


def test_bend_range_and_samples_are_a_continuums_alone(refuse):
    assert set(refuse(VALID + "samples = 3\n")) == {"samples"}


STANCE = VALID + 'contacts = ["torso", "feet"]\n'


def test_contacts_bring_their_parameters_and_functions(read):
    scene = read(STANCE)
    assert scene.contacts == ("feet", "torso") and scene.friction == "cone"
    assert scene.functions == tuple(name for name in ALL if name in DEFAULT + DEFAULT_ON_GROUND)
    assert dict(scene.parameters).keys() - dict(read(VALID).parameters) == {
        p.name for p in PARAMETERS if p.needs
    }
    assert scene.parameters["L_a2m"] == 0.035 and scene.parameters["delta_m"] == pytest.approx(
        math.radians(30)
    )
    assert parse_scene(scene_to_dict(scene), "other") == scene
    tail = read(VALID + 'contacts = ["tail"]\nfriction = "box"\n')
    assert "mu" in tail.parameters and "hip" not in tail.parameters and tail.friction == "box"


def test_a_flight_says_nothing_of_contacts(read):
    scene = read(VALID)
    assert scene.contacts == () and not {"contacts", "friction"} & set(scene_to_dict(scene))
    assert not set(NEEDS) & set(read(VALID + 'functions = "all"\n').functions)


def test_legs_have_joints_where_there_are_feet(read):
    tail = VALID + 'contacts = ["tail", "torso"]\n'
    for scene in (tail, tail + 'functions = "all"\n'):
        assert {"contact_points", "leg_points"} & set(read(scene).functions) == {"contact_points"}
    for scene in (STANCE, STANCE + 'functions = "all"\n'):
        assert {"contact_points", "leg_points"} <= set(read(scene).functions)


@pytest.mark.parametrize("value", ['["foot"]', '["feet", "feet"]', '"feet"', "true", "[3]", "[[]]"])
def test_contacts_are_different_groups(refuse, value):
    assert refuse(VALID + f"contacts = {value}\n")["contacts"].remedy.startswith(
        "needs an array of different names"
    )


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        (VALID + 'friction = "box"\n', "friction", 'add contacts = ["feet"]'),
        (VALID + 'functions = ["contact_points"]\n', "functions", 'add contacts = ["feet"]'),
        (VALID + 'functions = ["leg_points"]\n', "functions", 'add contacts = ["feet"]'),
        (
            VALID + 'contacts = ["tail"]\nfunctions = ["leg_points"]\n',
            "functions",
            'needs feet: add "feet" to `contacts`',
        ),
        (VALID + "[parameters]\nmu = 0.5\n", "parameters.mu", 'add "feet" to `contacts`'),
        (
            VALID + 'contacts = ["tail"]\n[parameters]\nL_m2t = 0.5\n',
            "parameters.L_m2t",
            'add "feet" to `contacts`',
        ),
        (
            STANCE + 'friction = "coulomb"\n',
            "friction",
            'needs "cone" or "box" or "smooth" or "paper"',
        ),
        (
            STANCE + "[parameters]\nmu = -0.1\n",
            "parameters.mu",
            "a finite number, 0 or above, in 1 (default: 1.0)",
        ),
        (STANCE + "[parameters]\nK_n = 0\n", "parameters.K_n", "above 0, in N/m^1.5"),
        (STANCE + "[parameters]\nD_f = 0.0\n", "parameters.D_f", "above 0, in s"),
        (STANCE + "[parameters]\nhip = [0, 1]\n", "parameters.hip", "an array of 3 finite numbers"),
        (CONTINUUM + 'coordinates = "polar"\ncontacts = ["tail"]\n', "contacts", 'use "bend"'),
    ],
)
def test_contact_keys_that_do_not_fit(refuse, text, field, words):
    problems = refuse(text)
    assert set(problems) == {field} and words in problems[field].remedy
