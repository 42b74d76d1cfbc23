"""Parameters that no animal or robot has are told, and others are not."""

import warnings

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo

from ..support.rows import row

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


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnlikeBodies")
def test_what_no_animal_has_is_told_to_who_gives_it():
    model = zoo.model("bare")
    for change, words in STRANGE:
        with row(change):
            with pytest.warns(st.UnusualSize, match=words) as loading:
                st.load(model.folder, parameters=change)
            with pytest.warns(st.UnusualSize, match=words) as changing:
                model.with_parameters(**change)
            assert {w.filename for w in (*loading, *changing)} == {__file__}


def test_what_an_animal_or_a_study_has_is_not_told():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for change in USUAL:
            with row(change):
                zoo.model("bare").with_parameters(**change)


def test_one_strange_run_of_many_is_told():
    q = np.tile([0, 0, 0.3, 1, 0, 0, 0, 0, 0.0], (3, 1))
    own = {"torso_mass": [0.1, 105.7, 0.1]}
    with pytest.warns(st.UnusualSize, match=r'torso_mass: value 105\.7 kg.* "105\.7 g"') as caught:
        settings = {"parameters": own, "t_span": 1e-3, "step": 1e-3}
        st.simulate(zoo.model("m1_n1"), q, np.zeros(8), **settings)
    assert [w.filename for w in caught] == [__file__]
