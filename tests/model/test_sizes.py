"""Parameters that no animal or robot has are told, and others are not."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(1, 1, functions=["energy", "momentum", "rollout"]))


STRANGE = {
    "grams": ({"torso_mass": 105.7}, r'torso_mass: value 105.7 kg: .* did you mean "105.7 g"\?'),
    "too heavy": (
        {"torso_mass": 20_000, "torso_inertia": [9e3] * 3},
        'value 20000 kg: beyond 10 t, which no animal or robot has: did you mean "20000 g"',
    ),
    "too light": (
        {"torso_mass": 1e-5, "torso_inertia": [1e-9] * 3},
        "torso_mass: value 1e-05 kg: below 0.1 g, .* are the units kg and m",
    ),
    "a tail of grams": (
        {"tail_mass": 5.0},
        r'tail_mass: value 5 kg: 47\.3 times the torso_mass of 0\.10572 kg, .* mean "5 g"\?',
    ),
    "millimetres": (
        {"tail_length": 194.66},
        'tail_length: value 194.66 m: beyond 100 m, .* did you mean "194.66 mm"',
    ),
    "too short": ({"tail_length": 1e-4}, "tail_length: value 0.0001 m: below 1 mm"),
    "a mount": ({"tail_mount": (0, -405, 0)}, "tail_mount: value 405 m: .* mean .405 mm"),
    "gravity": ({"gravity": 9800.0}, 'gravity: value 9800 m/s^2: .* mean "9800 mm/s2"'),
}


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnlikeBodies")
@pytest.mark.parametrize(("change", "words"), STRANGE.values(), ids=STRANGE)
def test_what_no_animal_has_is_told_to_who_gives_it(model, change, words):
    words = words.replace("^", r"\^")
    with pytest.warns(st.UnusualSize, match=words) as loading:
        st.load(model.folder, parameters=change)
    with pytest.warns(st.UnusualSize, match=words) as changing:
        model.with_parameters(**change)
    assert {w.filename for w in (*loading, *changing)} == {__file__}


@pytest.mark.parametrize(
    "change",
    [
        {"torso_mass": "0.15 g", "torso_inertia": [1e-9] * 3, "tail_mass": "10 mg"},  # a gecko
        {"torso_mass": "6000 kg", "torso_inertia": [5000, 3000, 5000.0]},
        {"tail_mass": 1.0},  # 9.5 times as heavy as its torso
        {"link_radius": "0.2 mm", "tail_length": "25 mm"},
        {"link_radius": 0, "gravity": 0, "tail_mount": [0, 0, 0]},
        {"torso_mass": 1.0},  # ten times as heavy, with the same inertia: a study of one parameter
        {"torso_inertia": [1e3, 1e3, 1e3]},  # a torso that cannot turn
    ],
)
def test_what_an_animal_or_a_study_has_is_not_told(model, change):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.with_parameters(**change)


def test_one_strange_run_of_many_is_told(model):
    q = np.tile([0, 0, 0.3, 1, 0, 0, 0, 0, 0.0], (3, 1))
    own = {"torso_mass": [0.1, 105.7, 0.1]}
    with pytest.warns(st.UnusualSize, match=r'torso_mass: value 105\.7 kg.* "105\.7 g"') as caught:
        st.simulate(model, q, np.zeros(8), parameters=own, t_span=1e-3, step=1e-3)
    assert [Path(w.filename).name for w in caught] == [Path(__file__).name]


def test_parameters_with_units_are_those_in_si(model):
    """Of one model and of many runs."""
    given = model.with_parameters(torso_mass="105.7 g", tail_mount="0, -40.5, 4.5 mm")
    assert given.parameters["torso_mass"] == 0.1057
    assert given.parameters["tail_mount"] == (0.0, -0.0405, 0.0045)
    runs = model.parameters_of_runs({"tail_mass": ["3 g", 0.004]}, 2)
    assert runs.values["tail_mass"].tolist() == [0.003, 0.004]


def test_a_wrong_unit_of_a_parameter_is_refused(model):
    with pytest.raises(st.ModelError) as caught:
        model.with_parameters(torso_mass="217 deg", tail_length="3 s", gravity="heavy")
    assert str(caught.value).splitlines() == [
        "parameters: gravity: value 'heavy': needs a finite number (m/s^2), 0 or above",
        "            torso_mass: value '217 deg': an angle where a mass is needed: give kg, g, mg "
        "or a plain number in kg",
        "            tail_length: value '3 s': a time where a length is needed: give m, cm, mm, um "
        "or a plain number in m",
    ]
