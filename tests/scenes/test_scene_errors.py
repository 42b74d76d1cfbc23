"""What is wrong in a scene file, or in changes of it, is named with its remedy."""

from pathlib import Path

import pytest

import serpentail as st
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of

# Errors.

WRONG = [
    ({"duration": "duration = -1.0"}, "", "simulate.duration: value -1.0: needs a number above 0"),
    ({"duration": ""}, "", "simulate.duration: no value: needs seconds"),
    ({"duration": "duration = nan"}, "", "simulate.duration: value nan"),
    (
        {"duration": "duratoin = 1.0"},
        "",
        "simulate: key: value 'duratoin': did you mean 'duration'?",
    ),
    ({"height": "height = -0.05"}, "", r"q0: point \d+ \((tail|feet)\) is .* mm deep at the start"),
    ({"height": "height = nan"}, "", "simulate.start.height: value nan: needs a finite number"),
    ({"height": "heigth = 0.1"}, "", "simulate.start: key: value 'heigth': did you mean 'height'?"),
    (
        {"height": "velocity = [1, 2]"},
        "",
        "simulate.start.velocity: value .*: needs three numbers",
    ),
    (
        {"height": "height = 0.1\nvelocity = [0, 0, 1]\nsettle = {}"},
        "",
        "has no velocity and no rate",
    ),
    (
        {"height": "height = 0.1\nsettle = { rounds = 0 }"},
        "",
        "rounds: value 0: needs a whole number from 1",
    ),
    (
        {"height": "height = 0.1\nbends = [0.1, 0.2]"},
        "",
        r"bends has shape \(1, 2\): give \(times, 1\)",
    ),
    ({"gamma": ""}, "", "simulate.legs: value .*: needs gamma, delta"),
    (
        {"delta": "delta = -0.26\nmoves = [{ at = 0.1, delta = -1.0 }]"},
        "",
        "needs at, gamma or delta, and one of rate",
    ),
    (
        {"delta": "delta = -0.26\nmoves = [{ at = 0.1, delta = -1.0, rate = -1 }]"},
        "",
        r"moves\[0\].rate: value -1",
    ),
    (
        {"delta": "delta = -0.26\nmoves = [{ at = 0.1, delta = -0.26, rate = 1 }]"},
        "",
        "and another angle than before",
    ),
    (
        {"delta": "delta = -0.26\nmoves = [{ at = 0.1, dleta = 1, rate = 1 }]"},
        "",
        "did you mean 'delta'?",
    ),
    (
        {
            "delta": (
                "delta = 0.0\nmoves = [{at = 0.1, delta = 1.0, duration = 0.2}, "
                "{at = 0.2, delta = 0.0, rate = 9}]"
            )
        },
        "",
        r"legs.moves\[1\].at: value 0.2: the move before it ends at 0.3 s",
    ),
    (
        {"delta": "delta = [0.0, 1.0]\ntimes = [1.0, 0.0]"},
        "",
        "Legs: times: value .*: needs increasing times",
    ),
    ({}, '[simulate.controller]\nkind = "pfl"\n', "tracks a reference: add a table"),
    ({}, '[simulate.controller]\nkind = "pdf"\n', "did you mean 'pfl'?"),
    (
        {},
        '[simulate.controller]\nkind = "damping"\ndamping = -1.0\n',
        "damping: value -1.0: needs one or .* numbers from 0",
    ),
    (
        {},
        '[simulate.controller]\nkind = "damping"\nkp = 1.0\n',
        "key: value 'kp': needs 'kind' or 'damping'",
    ),
    (
        {},
        '[[simulate.controller]]\nkind = "none"\n',
        r"simulate.controller\[0\]: .* needs a table with begin",
    ),
    (
        {},
        "[simulate.reference]\ntimes = [0.0, 0.0]\nbends = [[0.1], [0.2]]\n",
        "Reference: times: value .*: needs increasing times",
    ),
    ({}, "[simulate.reference]\ntimes = [0.0]\n", "needs times and bends, or a file"),
    ({}, '[simulate.reference]\nfile = "none.npz"\n', "no trajectory file"),
]


@pytest.mark.parametrize(("replaced", "added", "words"), WRONG, ids=[words for *_, words in WRONG])
def test_what_is_wrong_is_named(scene, replaced, added, words):
    with pytest.raises(st.SimulationError, match=words):
        st.scenario(scene(added, **replaced)).simulate()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mu": -0.5}, "mu: value -0.5: needs a finite number .*, 0 or above"),
        ({"Kn": 0.5}, "Kn: no such parameter; did you mean 'K_n'?"),
        ({"nu": 0.5}, "nu: no such parameter; there are gravity, "),
        ({"contacts": ["feet"]}, "contacts: no such parameter"),
        ({"parameters.mu": 1}, "change 'parameters.mu': unknown; needs a parameter"),
        (
            {"duraton": 1, "strat.pitch": 1},
            "'duraton': unknown; did you mean 'duration'(?s:.*)'start'",
        ),
        ({"legs.moves.0.rate": 1}, "change 'legs.moves.0.rate': 'moves' is not in "),
        ({"duration.x": 1}, "change 'duration.x': 'x' is not in 0.02"),
        ({"method": "euler"}, "method: value 'euler': needs 'auto' or 'rk4'"),
        ({"step": 1e-3, "rtol": 1e-3}, "has no setting 'rtol'"),
    ],
)
def test_wrong_changes_are_named(scene, changes, words):
    with pytest.raises(st.SerpentailError, match=words):
        st.scenario(scene(), changes=changes).simulate()


def test_a_folder_of_another_scene_is_refused(scene):
    folder = folder_of(load_scene(scene()))
    with pytest.raises(st.ModelError, match=r"has contacts = .*: generate it again, or leave"):
        st.scenario(scene(contacts='contacts = ["feet"]'), folder)
    assert st.scenario(scene(contacts='contacts = ["tail", "feet"]'), folder).model.contacts == {
        "feet": 6,
        "tail": 2,
    }


def test_scene_without_a_motion(scene):
    path = Path(scene())
    path.write_text(path.read_text().split("[simulate]")[0])
    with pytest.raises(st.SimulationError, match=r"has no table \[simulate\]; add one"):
        st.scenario(path)
    with pytest.raises(st.SimulationError, match="or try `serpentail plan`"):
        st.scenario("righting_m1_n3")
    with pytest.raises(st.SimulationError, match="cannot be read"):
        st.scenario("nowhere.toml")
