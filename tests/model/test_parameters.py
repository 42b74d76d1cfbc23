"""Parameters are those of a scene, or refused with what to do; what no animal has is told; how
wrong tapered tails of few arcs are, by sums over thin slices of the rod.
"""

import copy
import pickle
import warnings
from itertools import pairwise

import numpy as np
import pytest

import serpentail as st
from serpentail.model.even_arcs import excess, warn_of_even_arcs
from serpentail.model.parameters import RunParameters, link_inertia, resolve
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_scene.parameters import PARAMETERS
from tests.compiling.conftest import forbid_processes
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

TOTAL = 4  # links of "m2_n2"
INERTIA = (2.5e-07, 3.9e-09, 2.6e-07)
GIVEN = {"link_inertia": list(INERTIA), "gravity": 1.6, "tail_mount": [0.01, -0.05, 0.002]}
Q = [0, 0, 0, 1, 0.2, 0, 0, 0.3, -0.2]
STATE = Q, np.arange(8.0), [0.1, 0.2]


@pytest.fixture(scope="module")
def manifest():
    return zoo.model("m2_n2").manifest


def refusal(manifest, changes):
    with pytest.raises(st.ModelError) as caught:
        resolve(manifest, changes)
    return str(caught.value)


def test_scene_and_caller_agree_bit_for_bit(manifest):
    for changes in (None, {}):
        assert dict(resolve(manifest, changes)) == dict(resolve_parameters({}, TOTAL))
    names = ("tail_mass", "tail_length", "link_radius")
    for numbers in np.random.default_rng(5).uniform(0.001, 2, (200, 3)).tolist():
        changes = dict(zip(names, numbers, strict=True))
        assert dict(resolve(manifest, changes)) == dict(resolve_parameters(changes, TOTAL))
    elastic = zoo.model("elastic").manifest
    assert dict(resolve(elastic, None)) == dict(resolve_parameters(zoo.ELASTIC, TOTAL, segments=2))
    baked, model = zoo.model("baked"), zoo.model("m1_n3")
    assert dict(resolve(baked.manifest, {})) == dict(resolve_parameters({}, 3))
    found, expected = (each.forward_dynamics(*STATE) for each in (baked, model))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    for twin in (baked.with_parameters(), copy.deepcopy(baked), pickle.loads(pickle.dumps(baked))):
        assert twin.parameters == model.parameters
    for attempt in (lambda p: baked.with_parameters(**p), lambda p: st.load(baked.folder, p)):
        with pytest.raises(st.ModelError, match="baked = false"):
            attempt({"gravity": 1.6})


def test_link_inertia_and_what_it_follows_from_replace_each_other(manifest):
    given = st.load(folder_of(zoo.scene("bare", parameters=GIVEN)))  # as the zoo has none
    before = resolve(manifest, None)
    for name in ("tail_mass", "tail_length", "link_radius"):
        after = resolve(manifest, {name: 0.1})
        assert after["link_inertia"] == link_inertia(after, TOTAL) != before["link_inertia"]
    values = resolve(manifest, {"link_inertia": INERTIA, "tail_mass": 0.1})
    assert values["link_inertia"] == INERTIA and "link_radius" not in values
    assert resolve(given.manifest, {"tail_mass": 0.1})["link_inertia"] == INERTIA
    values = resolve(given.manifest, {"link_radius": 0.01})
    assert values["link_inertia"] == link_inertia(values, 1)
    late = zoo.model("bare").with_parameters(**GIVEN)
    found, expected = (each.forward_dynamics(*STATE) for each in (late, given))
    assert late.parameters == given.parameters and np.array_equal(found, expected)


def test_numbers_in_any_row_of_any_type_and_with_units(manifest):
    three = [1, 2, 2.5]
    for value in (three, tuple(three), np.array(three), np.float32(three)):
        assert resolve(manifest, {"torso_inertia": value})["torso_inertia"] == (1.0, 2.0, 2.5)
    for value in (2, 2.0, np.float32(2), np.int8(2), np.array(2.0)):
        mass = resolve(manifest, {"tail_mass": value})["tail_mass"]
        assert mass == 2.0 and type(mass) is float
    model = zoo.model("m1_n1")  # with units, of one model and of many runs
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


def test_wrong_value_is_named_with_its_unit_or_the_rule_that_it_breaks(manifest):
    units = {p.name: f"({p.unit})" for p in PARAMETERS}
    rows = [(name, value, units[name]) for name, values in WRONG.items() for value in values]
    for name, value, words in (
        *rows,
        ("torso_inertia", "1 g cm2", "here is 1 number$"),
        ("torso_inertia", [1e-5, 1e-5, 9e-5], "here 9e-05 is above 2e-05$"),
        ("torso_inertia", [1e-5, 1e-5, 0], "sum of the other two$"),
        ("tail_mount", [1, 2], "here are 2 numbers$"),
        ("tail_mount", [1, 2, np.nan], "3 finite numbers (m)$"),
        ("tail_mount", [[1, 2]], "3 finite numbers (m)$"),
        ("torso_mass", "217 deg", "an angle where a mass"),
        ("tail_length", "3 s", "a time where a length"),
    ):
        with row(name, value):
            message = refusal(manifest, {name: value})
            assert message.startswith(f"parameters: {name}: value ") and words in f"{message}$"
    for strange in ("colour", 3):
        message = refusal(manifest, {strange: 1})
        assert f"{strange}: no such parameter; there are " in message and "torso_mass" in message
    wrong = {"tail_mas": 1, "torso_mass": -1, "gravity": "9.8"}  # all at once
    lines = refusal(manifest, wrong | {"link_radius": 0.1, "link_inertia": INERTIA}).splitlines()
    for line, name in zip(lines, [*wrong, "link_radius and link_inertia"], strict=True):
        assert f"{name}: " in line
    assert "did you mean 'tail_mass'?" in lines[0]
    for changes, words in (
        ({"tail_length": 1e200}, "no finite link_inertia"),
        ({"tail_mass": 1e200, "gravity": 1e200}, "no finite weight"),
        (3, "parameters: value 3"),
    ):
        assert words in refusal(manifest, changes)


def test_changes_add_up_without_a_compiler_and_the_first_model_keeps_its_own(monkeypatch):
    """Mass and inertia twice as large make H twice as large, bit for bit."""
    forbid_processes(monkeypatch)
    model = zoo.model("m1_n1")
    before, expected = dict(model.parameters), model.mass_matrix(Q)
    double = {name: 2 * np.array(before[name]) for name in ("torso_mass", "tail_mass")}
    double["torso_inertia"] = 2 * np.array(before["torso_inertia"])
    for heavy in (st.load(model.folder, double), model.with_parameters(**double)):
        assert np.array_equal(heavy.mass_matrix(Q), 2 * expected)
        assert heavy.parameters["link_inertia"] == tuple(2 * np.array(before["link_inertia"]))
    light = model.with_parameters(tail_mass=0.001).with_parameters(link_radius=0.01)
    assert light.parameters == model.with_parameters(tail_mass=0.001, link_radius=0.01).parameters
    given = light.with_parameters(link_inertia=INERTIA).with_parameters(tail_mass=0.002)
    assert given.parameters["link_inertia"] == INERTIA and "link_radius" not in given.parameters
    assert given.with_parameters(link_radius=0.01, tail_mass=0.001).parameters == light.parameters
    assert (light.mass_matrix(Q) != expected).any()
    assert dict(model.parameters) == before and np.array_equal(model.mass_matrix(Q), expected)
    with pytest.raises(TypeError):  # nor can they be changed in place
        model.parameters["tail_mass"] = 1.0
    for vector in (model.parameter_vector, model.with_parameters(gravity=0).parameter_vector):
        with pytest.raises(ValueError, match="read-only"):
            vector[0] = 1.0


def test_values_of_the_passive_tail_are_one_for_all_or_one_for_each_or_refused(manifest):
    elastic = zoo.model("elastic").manifest
    values = resolve(elastic, {"tail_stiffness": "20 mN m/rad", "tail_rest": [0, "30 deg", 0, 1]})
    assert values["tail_stiffness"] == (0.02,) * 4
    assert values["tail_rest"] == pytest.approx((0, np.pi / 6, 0, 1))
    assert values["tail_stop_upper"] == (0.6, 0.5, 0.4, 0.55)
    expected = np.outer([0.02, 0.03, 0.04], np.ones(4))
    for stiffness in ([0.02, 0.03, 0.04], expected):
        runs = RunParameters.checked(elastic, values, {"tail_stiffness": stiffness}, 3)
        assert (runs.changes["tail_stiffness"] == expected).all()
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
    assert len(refusal(manifest, {"9" * 5000: 1})) < 700
    lower = np.array([[0, 0, 0, 0], [0, 3, 0, 0]])
    with pytest.raises(st.ModelError, match=r"tail_stop_upper 0\.5 of tail coordinate 1"):
        RunParameters.checked(elastic, resolve(elastic, None), {"tail_stop_lower": lower}, 2)


def test_totals_and_bends_follow_from_the_links():
    model = zoo.model("own_links")
    reference = st.Reference.of_bends(model, [0.0, 0.1], [[0.3, 0.4, 0.6]] * 2)
    np.testing.assert_allclose(reference.curve.at(0.05)[0], [0.1, 0, 0.2, 0, 0.3, 0])
    assert model.links == (3, 2, 2) and list(model.joints_each) == [3, 2, 2]
    ratios = zoo.model("ratios")
    np.testing.assert_allclose(ratios.state(bend=[0.8, 0.4]).q[7:], [0.5, 0, 0.5, 0])
    with pytest.raises(st.ModelError, match="segment 2 sum to 0"):
        ratios.with_parameters(joint_ratios=[1, 1, 1, -1])
    masses, length = model.parameters["link_masses"], model.parameters["tail_length"]
    assert (model.parameters["tail_mass"], length) == pytest.approx((0.0026, 0.135))
    lighter = model.with_parameters(link_masses=0.5 * np.array(masses))
    assert lighter.parameters["tail_mass"] == pytest.approx(0.0013)
    moments = np.reshape(model.parameters["link_inertias"], (7, 3))
    assert model.with_parameters(link_inertias=moments).parameters == model.parameters
    for name, value, words in (
        ("link_inertias", moments[:6], "21 finite numbers, 3 of each piece"),
        ("tail_mass", 0.1, r"tail_mass: no such .* sum of link_masses"),
        ("link_lengths", [0.0] * 7, "above 0"),
    ):
        with pytest.raises(st.ModelError, match=words):
            model.with_parameters(**{name: value})
    of_runs = np.outer([1.0, 1.5], masses)
    vectors = model.parameters_of_runs({"link_masses": of_runs}, 2).vectors
    alone = [model.with_parameters(link_masses=own).parameter_vector for own in of_runs]
    np.testing.assert_array_equal(vectors, alone)
    # a single link has arrays too; its scene is the point, and nothing is compiled
    tables = [{"links": 1, "length": 0.1, "mass": 0.01}]
    scene = parse_scene({"kind": "articulated", "segments": tables, "functions": ["energy"]}, "one")
    model = st.load(folder_of(scene), compiled=False)
    assert model.parameters["link_masses"] == (0.01,)
    assert model.with_parameters(link_masses=[0.02]).parameters["tail_mass"] == 0.02


STRANGE = (
    ({"torso_mass": 105.7}, 'torso_mass: value 105.7 kg: .*"105.7 g"'),
    ({"torso_mass": 20_000, "torso_inertia": [9e3] * 3}, 'value 20000 kg: .*10 t.*"20000 g"'),
    ({"torso_mass": 1e-5, "torso_inertia": [1e-9] * 3}, "torso_mass: value 1e-05 kg: .*0.1 g"),
    ({"tail_mass": 5.0}, r'tail_mass: value 5 kg: 47\.3 times .*0\.10572 kg.*"5 g"'),
    ({"tail_length": 194.66}, 'tail_length: value 194.66 m: .*100 m.*"194.66 mm"'),
    ({"tail_length": 1e-4}, "tail_length: value 0.0001 m: .*1 mm"),
    ({"tail_mount": (0, -405, 0)}, "tail_mount: value 405 m: .*405 mm"),
    ({"gravity": 9800.0}, r'gravity: value 9800 m/s\^2: .*"9800 mm/s2"'),
)
USUAL = (
    {"torso_mass": "0.15 g", "torso_inertia": [1e-9] * 3, "tail_mass": "10 mg"},  # a gecko
    {"torso_mass": "6000 kg", "torso_inertia": [5000, 3000, 5000.0]},
    {"tail_mass": 1.0},  # 9.5 times as heavy as its torso
    {"link_radius": "0.2 mm", "tail_length": "25 mm"},
    {"link_radius": 0, "gravity": 0, "tail_mount": [0, 0, 0]},
    {"torso_mass": 1.0},  # ten times as heavy, with the same inertia: a study of one parameter
    {"torso_inertia": [1e3, 1e3, 1e3]},  # a torso that cannot turn
)


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnlikeBodies")
def test_what_no_animal_has_is_told_to_who_gives_it_and_the_rest_is_not():
    model = zoo.model("bare")
    for change, words in STRANGE:
        with row(change):
            with pytest.warns(st.UnusualSize, match=words) as loading:
                st.load(model.folder, parameters=change)
            with pytest.warns(st.UnusualSize, match=words) as changing:
                model.with_parameters(**change)
            assert {w.filename for w in (*loading, *changing)} == {__file__}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for change in USUAL:
            with row(change):
                model.with_parameters(**change)
    settings = {"parameters": {"torso_mass": [0.1, 105.7, 0.1]}, "t_span": 1e-3, "step": 1e-3}
    with pytest.warns(st.UnusualSize, match=r'torso_mass: value 105\.7 kg.* "105\.7 g"') as caught:
        st.simulate(zoo.model("m1_n1"), np.tile(Q, (3, 1)), np.zeros(8), **settings)
    assert [w.filename for w in caught] == [__file__]


CONE = {"length": "200 mm", "radii": "4, 1 mm", "density": "1 g/cm^3"}
ARC, LINKS = {"kind": "continuum"}, {"kind": "articulated", "links": 3}


def thin(ends, count=200_000):
    """Places (m) and masses (kg) of thin slices of the cone between two places."""
    edges = np.linspace(*ends, count + 1)
    places = (edges[1:] + edges[:-1]) / 2
    return places, 1000 * np.pi * np.interp(places, [0, 0.2], [0.004, 0.001]) ** 2 * np.diff(edges)


def test_the_excess_is_that_of_evenly_spread_slices():
    for kind, segments, arcs in (
        *(("continuum", count, np.linspace(0, 0.2, count + 1)) for count in (1, 2, 3, 8)),
        *(("mixed", [LINKS, ARC], [0.1, 0.2]), ("mixed", [ARC, LINKS], [0, 0.1])),
    ):
        scene = parse_scene({"kind": kind, "segments": segments, "taper": CONE}, "x")
        places, masses = thin((0, 0.2))
        true, even = masses @ places**2, masses @ places**2
        for ends in pairwise(arcs):
            places, masses = thin(ends)
            even += masses.mean() * (places**2).sum() - masses @ places**2
        with row(kind, segments):
            found = excess({"scene": scene_to_dict(scene)}, scene.parameters)
            # links are wider than a rod without thickness
            assert found == pytest.approx(
                even / true - 1, rel=1e-6 if kind == "continuum" else 2e-3
            )


def test_a_build_tells_the_number_and_enough_arcs_are_silent():
    with pytest.warns(st.UnusualSize, match=r"taper: .* 23 % too large, .* 2 %"):
        st.build(tail="continuum", segments=2, taper=CONE, functions=["energy"], compiled=False)
    scene = parse_scene({"kind": "continuum", "segments": 8, "taper": CONE}, "x")
    warn_of_even_arcs({"scene": scene_to_dict(scene)}, scene.parameters, 1)
