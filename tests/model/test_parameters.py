"""Parameters: what a caller gives reaches the model as it would from a scene, or is refused with
what to do.
"""

import re
import subprocess

import numpy as np
import pytest

import serpentail as st
from serpentail.model.parameters import RunParameters, ellipsoid, flat, flat_names, resolve
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.shape import EQUAL
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

TOTAL = 4  # links of "m2_n2"
INERTIA = (2.5e-07, 3.9e-09, 2.6e-07)
GIVEN = {"link_inertia": list(INERTIA), "gravity": 1.6, "tail_mount": [0.01, -0.05, 0.002]}
Q = [0, 0, 0, 1, 0.2, 0, 0, 0.3, -0.2]


@pytest.fixture(scope="module")
def manifest():
    return zoo.model("m2_n2").manifest


@pytest.fixture(scope="module")
def given():
    """The zoo's "bare" with parameters in its scene, which no model of the zoo has."""
    return st.load(folder_of(zoo.scene("bare", parameters=GIVEN)))


def refusal(manifest, changes):
    """The message that refuses changes."""
    with pytest.raises(st.ModelError) as caught:
        resolve(manifest, changes)
    return str(caught.value)


def test_defaults_are_the_scenes(manifest):
    for changes in (None, {}):
        assert dict(resolve(manifest, changes)) == dict(resolve_parameters({}, TOTAL))


def test_scene_and_caller_agree_bit_for_bit(manifest):
    names = ("tail_mass", "tail_length", "link_radius")
    for numbers in np.random.default_rng(5).uniform(0.001, 2, (200, 3)).tolist():
        changes = dict(zip(names, numbers, strict=True))
        assert dict(resolve(manifest, changes)) == dict(resolve_parameters(changes, TOTAL))


def test_link_inertia_and_what_it_follows_from_replace_each_other(manifest, given):
    before = resolve(manifest, None)
    for name in ("tail_mass", "tail_length", "link_radius"):
        after = resolve(manifest, {name: 0.1})
        assert after["link_inertia"] == ellipsoid(after, TOTAL) != before["link_inertia"]
    values = resolve(manifest, {"link_inertia": INERTIA, "tail_mass": 0.1})
    assert values["link_inertia"] == INERTIA and "link_radius" not in values
    assert resolve(given.manifest, {"tail_mass": 0.1})["link_inertia"] == INERTIA
    values = resolve(given.manifest, {"link_radius": 0.01})
    assert values["link_inertia"] == ellipsoid(values, 1)


def test_flat_is_the_struct(manifest):
    values = resolve(manifest, {"tail_mount": (1, 2, 3)})
    of_equal = [p for p in PARAMETERS if EQUAL.numbers_of(p.tail) and not p.needs]
    own = [p.name for p in of_equal if p.name != "link_radius"]
    assert flat(manifest, values) == np.hstack([values[name] for name in own]).tolist()
    assert flat(manifest, values)[5:8] == [1.0, 2.0, 3.0]
    assert flat_names(manifest)[4:6] == ("torso_inertia[2]", "tail_mount[0]")


def test_numbers_in_any_row_and_of_any_type(manifest):
    three = [1, 2, 2.5]
    for value in (three, tuple(three), np.array(three), np.float32(three)):
        assert resolve(manifest, {"torso_inertia": value})["torso_inertia"] == (1.0, 2.0, 2.5)
    for value in (2, 2.0, np.float32(2), np.int8(2), np.array(2.0)):
        mass = resolve(manifest, {"tail_mass": value})["tail_mass"]
        assert mass == 2.0 and type(mass) is float


def test_parameters_with_units_are_those_in_si():
    """Of one model and of many runs."""
    model = zoo.model("m1_n1")
    given = model.with_parameters(torso_mass="105.7 g", tail_mount="0, -40.5, 4.5 mm")
    assert given.parameters["torso_mass"] == 0.1057
    assert given.parameters["tail_mount"] == (0.0, -0.0405, 0.0045)
    runs = model.parameters_of_runs({"tail_mass": ["3 g", 0.004]}, 2)
    assert runs.values["tail_mass"].tolist() == [0.003, 0.004]


WRONG = {
    "tail_mass": [0, -1, np.nan, np.inf, "3", True, None, 1j, [1.0], np.array([1.0]), 10**400],
    "torso_inertia": ["123", {1, 2, 3}, [1, 2], [1, 1, "1"], [[1, 1, 1]], 1.0, [1, 2, 3.1]],
    "tail_mount": [[0, 0, np.nan], [[1], [1, 2]]],
    "gravity": [-9.8],
    "link_inertia": [[1, -1, 1], np.ma.masked_array(INERTIA, [False, True, False])],
}


def test_wrong_value_is_named_with_its_unit(manifest):
    units = {p.name: p.unit for p in PARAMETERS}
    for name, values in WRONG.items():
        for value in values:
            with row(name, value):
                message = refusal(manifest, {name: value})
                assert message.startswith(f"parameters: {name}: value ")
                assert f"({units[name]})" in message


def test_what_failed_of_several_rules_is_told(manifest):
    for name, value, told in (
        ("torso_inertia", "1 g cm2", "here is 1 number$"),
        ("torso_inertia", [1e-5, 1e-5, 9e-5], "here 9e-05 is above 2e-05$"),
        ("torso_inertia", [1e-5, 1e-5, 0], "sum of the other two$"),
        ("tail_mount", [1, 2], "here are 2 numbers$"),
        ("tail_mount", [1, 2, np.nan], r"3 finite numbers \(m\)$"),
        ("torso_mass", "217 deg", "an angle where a mass"),
        ("tail_length", "3 s", "a time where a length"),
    ):
        with row(name, value):
            message = refusal(manifest, {name: value})
            assert re.match(f"parameters: {name}: value .*{told}", message), message


def test_unknown_names_and_all_problems_come_at_once(manifest):
    for strange in ("colour", 3):
        message = refusal(manifest, {strange: 1})
        assert f"{strange}: no such parameter; there are " in message and "torso_mass" in message
    wrong = {"tail_mas": 1, "torso_mass": -1, "gravity": "9.8"}
    lines = refusal(manifest, wrong | {"link_radius": 0.1, "link_inertia": INERTIA}).splitlines()
    for line, name in zip(lines, [*wrong, "link_radius and link_inertia"], strict=True):
        assert f"{name}: " in line
    assert "did you mean 'tail_mass'?" in lines[0]


def test_values_without_a_finite_inertia_or_weight_are_refused(manifest):
    assert "no finite link_inertia" in refusal(manifest, {"tail_length": 1e200})
    assert "no finite weight" in refusal(manifest, {"tail_mass": 1e200, "gravity": 1e200})
    assert "parameters: value 3" in refusal(manifest, 3)


# Models


def test_parameters_change_without_a_compiler(monkeypatch):
    """Mass and inertia twice as large make H twice as large, bit for bit."""
    model = zoo.model("m1_n1")

    def refuse(*_args, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    double = {name: 2 * model.parameters[name] for name in ("torso_mass", "tail_mass")}
    double["torso_inertia"] = 2 * np.array(model.parameters["torso_inertia"])
    for heavy in (st.load(model.folder, double), model.with_parameters(**double)):
        assert np.array_equal(heavy.mass_matrix(Q), 2 * model.mass_matrix(Q))
        inertia = 2 * np.array(model.parameters["link_inertia"])
        assert heavy.parameters["link_inertia"] == tuple(inertia)


def test_parameters_given_late_are_those_of_a_scene(given):
    late = zoo.model("bare").with_parameters(**GIVEN)
    v, tau = np.arange(8.0), [0.1, 0.2]
    found, expected = (each.forward_dynamics(Q, v, tau) for each in (late, given))
    assert late.parameters == given.parameters and np.array_equal(found, expected)


def test_changes_add_up_and_the_first_model_keeps_its_own():
    model = zoo.model("m1_n1")
    before, expected = dict(model.parameters), model.mass_matrix(Q)
    light = model.with_parameters(tail_mass=0.001).with_parameters(link_radius=0.01)
    assert light.parameters == model.with_parameters(tail_mass=0.001, link_radius=0.01).parameters
    given = light.with_parameters(link_inertia=INERTIA).with_parameters(tail_mass=0.002)
    assert given.parameters["link_inertia"] == INERTIA and "link_radius" not in given.parameters
    assert given.with_parameters(link_radius=0.01, tail_mass=0.001).parameters == light.parameters
    assert (light.mass_matrix(Q) != expected).any()
    assert dict(model.parameters) == before and np.array_equal(model.mass_matrix(Q), expected)


def test_baked_model_has_the_same_values_and_refuses_others():
    baked, model, v = zoo.model("baked"), zoo.model("m1_n3"), np.arange(8.0)
    found, expected = (each.forward_dynamics(Q, v, [0.1, 0.2]) for each in (baked, model))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert baked.with_parameters().parameters == model.parameters
    assert dict(resolve(baked.manifest, {})) == dict(resolve_parameters({}, 3))
    for attempt in (lambda p: baked.with_parameters(**p), lambda p: st.load(baked.folder, p)):
        with pytest.raises(st.ModelError, match="baked = false"):
            attempt({"gravity": 1.6})


def test_values_cannot_be_changed_in_place(manifest):
    with pytest.raises(TypeError):
        resolve(manifest, None)["tail_mass"] = 1.0
    model = zoo.model("m1_n1")
    for vector in (model.parameter_vector, model.with_parameters(gravity=0).parameter_vector):
        with pytest.raises(ValueError, match="read-only"):
            vector[0] = 1.0


# The passive tail


def test_one_number_stands_for_all_tail_coordinates():
    elastic = zoo.model("elastic").manifest
    values = resolve(elastic, {"tail_stiffness": "20 mN m/rad", "tail_rest": [0, "30 deg", 0, 1]})
    assert values["tail_stiffness"] == (0.02,) * 4
    assert values["tail_rest"] == pytest.approx((0, np.pi / 6, 0, 1))
    assert values["tail_stop_upper"] == (0.6, 0.5, 0.4, 0.55)
    assert dict(resolve(elastic, None)) == dict(resolve_parameters(zoo.ELASTIC, TOTAL, segments=2))
    for stiffness in ([0.02, 0.03, 0.04], np.outer([0.02, 0.03, 0.04], np.ones(4))):
        runs = RunParameters.checked(elastic, values, {"tail_stiffness": stiffness}, 3)
        expected = np.outer([0.02, 0.03, 0.04], np.ones(4))
        assert (runs.changes["tail_stiffness"] == expected).all()


def test_values_of_the_passive_tail_that_cannot_be(manifest):
    elastic = zoo.model("elastic").manifest
    for changes, says in (
        ({"tail_stiffness": -1e-9}, "tail_stiffness: value -1e-09"),
        ({"tail_stiffness": [1, 1, 1]}, "4 finite numbers, or one for all"),
        ({"tail_stiffness": float("nan")}, "tail_stiffness: value nan"),
        ({"tail_stop_stiffness": 0}, "above 0"),
        ({"tail_stop_lower": 0.5}, "tail_stop_lower 0.5 is not below tail_stop_upper 0.5 of"),
        ({"tail_stop_lower": 0.45}, "tail_stop_upper 0.4 of tail coordinate 2"),
        ({"tail_rest": "3 N m"}, "a torque where an angle is needed"),
    ):
        with row(changes):
            assert says in refusal(elastic, changes)
    assert "tail_damping: no such parameter" in refusal(manifest, {"tail_damping": 1e-3})
    lower = np.array([[0, 0, 0, 0], [0, 3, 0, 0]])
    with pytest.raises(st.ModelError, match=r"tail_stop_upper 0\.5 of tail coordinate 1"):
        RunParameters.checked(elastic, resolve(elastic, None), {"tail_stop_lower": lower}, 2)


# Links that have values of their own


def test_totals_and_bends_follow_from_the_links():
    model = zoo.model("own_links")
    reference = st.Reference.of_bends(model, [0.0, 0.1], [[0.3, 0.4, 0.6]] * 2)
    np.testing.assert_allclose(reference.curve.at(0.05)[0], [0.1, 0, 0.2, 0, 0.3, 0])
    assert model.links == (3, 2, 2) and list(model.joints_each) == [3, 2, 2]
    assert "3, 2, 2 links" in repr(model)
    assert model.parameters["tail_mass"] == pytest.approx(0.0026)
    assert model.parameters["tail_length"] == pytest.approx(0.135)
    lighter = model.with_parameters(link_masses=0.5 * np.array(model.parameters["link_masses"]))
    assert lighter.parameters["tail_mass"] == pytest.approx(0.0013)


def test_moments_may_be_given_link_by_link():
    model = zoo.model("own_links")
    moments = np.reshape(model.parameters["link_inertias"], (7, 3))
    assert model.with_parameters(link_inertias=moments).parameters == model.parameters
    for name, value, words in (
        ("link_inertias", moments[:6], "21 finite numbers, 3 of each piece"),
        ("tail_mass", 0.1, r"tail_mass: no such .* sum of link_masses"),
        ("link_lengths", [0.0] * 7, "above 0"),
    ):
        with pytest.raises(st.ModelError, match=words):
            model.with_parameters(**{name: value})


def test_runs_have_links_of_their_own():
    model = zoo.model("own_links")
    masses = np.outer([1.0, 1.5], model.parameters["link_masses"])
    q = np.array([0, 0, 1.0, 1, 0, 0, 0, 0.2, 0.1, -0.3, 0.2, 0.4, 0.1])
    v = np.array([0, 0, 0, 1.0, 0, 0, 3.0, 0, 0, 2.0, 0, -1.0])
    keys = {"t_span": (0, 0.01), "method": "rk4", "step": 1e-3}
    both = np.tile(q, (2, 1)), np.tile(v, (2, 1))
    runs = st.simulate(model, *both, parameters={"link_masses": masses}, **keys)
    for k, run in enumerate(runs):
        alone = st.simulate(model.with_parameters(link_masses=masses[k]), q, v, **keys)
        np.testing.assert_allclose(run.q[-1], alone.q[-1], rtol=0, atol=1e-14)
    assert np.abs(runs[0].q[-1] - runs[1].q[-1]).max() > 1e-4


def test_a_single_link_has_arrays_too():
    """Its scene is the point; nothing is compiled."""
    tables = [{"links": 1, "length": 0.1, "mass": 0.01}]
    scene = parse_scene({"kind": "articulated", "segments": tables, "functions": ["energy"]}, "one")
    model = st.load(folder_of(scene), compiled=False)
    assert model.parameters["link_masses"] == (0.01,)
    assert model.with_parameters(link_masses=[0.02]).parameters["tail_mass"] == 0.02
