"""What no scene can mean is one clear line, and no endless work."""

import time

import numpy as np
import pytest

import serpentail as st
from serpentail.scenes.overrides import changed, parsed
from serpentail.scenes.plan import plan_arguments
from serpentail.simulation import limits
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of, model_folder

START = {"q": [0, 0, 0.3, 1, 0, 0, 0, 0, 0], "v": [0] * 8}
TASK = {"start": START, "duration": 0.3}


def one_line(caught):
    """The line that an error says."""
    text = str(caught.value)
    assert "\n" not in text and len(text) < 700
    return text


@pytest.mark.parametrize(
    ("replaced", "added", "words"),
    [
        (
            {"segments": "segments = 1\nparameters = true"},
            "",
            "parameters: value true: needs",
        ),
        ({"delta": "delta = -0.26\nmoves = 1"}, "", "legs.moves: value 1: needs an array of tab"),
        ({"delta": 'delta = -0.26\nmoves = "at"'}, "", "legs.moves: value 'at': needs an array"),
        ({"name": 'name = "../simple"'}, "", "name: value '../simple': needs a text of up to 63"),
        ({"name": "name = 3"}, "", "name: value 3: needs a text of up to 63 of a-z, 0-9 and _"),
        ({"name": f"name = {'a' * 240!r}"}, "", "name: value 'aaa"),
        (
            {"contacts": f"contacts = [0x{'f' * 5000}]"},
            "",
            "contacts: value of type int, too long",
        ),
        ({"duration": "duration = 1" + "0" * 400}, "", "simulate.duration: value 1000"),
        ({"duration": f"duration = 0x{'f' * 5000}"}, "", "simulate.duration: value of type int"),
        ({"duration": "duration = 1.0\nstep = 1e-12"}, "", "step 1e-12: needs 1e+12 steps, more"),
        (
            {"duration": "duration = 1.0\nmost_step = 1e-9"},
            "",
            "needs 1e+09 steps, more than 1e+06",
        ),
        ({"duration": "duration = 1.0\noutput_step = 1e-9"}, "", "more than 10000000 samples"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "",
)
def test_what_no_scene_can_mean_is_one_line_at_once(scene, replaced, added, words):
    st.build(scene())
    path, begun = scene(added, **replaced), time.perf_counter()
    with pytest.raises(st.SerpentailError) as caught:
        st.scenario(path).simulate()
    assert words in one_line(caught) and time.perf_counter() - begun < 5


def test_no_name_leads_to_another_folder(scene, tmp_path):
    """What "../elsewhere/t" would mean is there, and is not taken."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "t").symlink_to(folder_of(load_scene(scene())))
    path = scene(name='name = "../elsewhere/t"')
    with pytest.raises(st.ModelError, match="needs a text of up to 63"):
        st.scenario(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("duration=1\nmethod=2", "--set duration=1 method=2: needs NAME=VALUE, on one line"),
        ("legs.moves.²=5", "change 'legs.moves.²': '²' is not in [1]"),
        ("legs.moves.99999999999999999999=5", "is not in [1]: name a key, or a place from 0"),
        ("a." * 3000 + "a=5", "3001 names: needs at most 8"),
        ("=5", "needs NAME=VALUE"),
    ],
)
def test_changes_that_name_nothing_are_one_line(text, words):
    with pytest.raises(st.SimulationError) as caught:
        changed({"legs": {"moves": [1]}}, parsed([text]))
    assert words in one_line(caught)


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 5000, "{" + "a." * 3000 + "a=1}", "kick"])
def test_values_that_are_no_toml_are_words(value):
    assert parsed([f"x={value}"]) == {"x": value}


def rat():
    functions = ["mass_matrix", "inverse_dynamics", "energy", "momentum", "rollout"]
    return st.load(model_folder(1, 1, functions=functions))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"start": START | {"q": [0, [1, 2], 3]}}, "start[0]: value [0, [1, 2], 3]: needs 9 num"),
        ({"start": START | {"v": "free"}}, "start[1]: value 'free': needs 8 numbers"),
        ({"damping": 10**300}, "damping: value 1000"),
        ({"damping": 10**400}, "damping: value 1000"),
        ({"smoothing": 1e300}, "smoothing: value 1e+300: needs a number from 0 to 1e+100"),
        ({"bounds": {"torque": 1e308}}, "bounds.torque: value 1e+308: needs one or 2"),
        ({"goal": {"tail": [10**400, 0]}}, "goal.tail: value (1000"),
        ({"rule": ["radau"]}, "rule: value ['radau']: needs 'trapezoidal' or"),
        ({"solver": ["ipopt"]}, "solver: value ['ipopt']: "),
        ({"intervals": 10**9}, "intervals: value 1000000000: needs a whole number from 1 to 10000"),
        ({"seed": -1}, "seed: value -1: needs a whole number from 0"),
        ({"track": "yes"}, "track: value 'yes': needs True or False"),
    ],
    ids=lambda value: "".join(value) if isinstance(value, dict) else "",
)
def test_what_no_plan_can_be_is_one_line(change, words):
    with pytest.raises(st.PlanningError) as caught:
        st.plan(rat(), **plan_arguments(TASK | change))
    assert words in one_line(caught)


@pytest.mark.parametrize(
    "change",
    [
        {"solver": "../../tmp/solver"},
        {"solver": "sqpmethod", "options": {"jit": True}},
        {"options": {"jit": True, "compiler": "shell"}},
        {"options": {"ipopt.output_file": "somewhere"}},
        {"options": {"ipopt.option_file_name": "somewhere"}},
        {"options": {"ipopt.hsllib": "library.so"}},
        {"options": {"ipopt.max_iter": {"jit": True}}},
        {"options": 3},
    ],
)
def test_a_scene_cannot_make_a_solver_write_files_or_run_code(change):
    with pytest.raises(st.PlanningError, match=r"to serpentail\.plan"):
        plan_arguments(TASK | change)


def test_a_scene_can_set_numbers_of_the_solver():
    options = {"ipopt.max_iter": 100, "ipopt.mu_strategy": "adaptive", "ipopt.tol": 1e-6}
    assert plan_arguments(TASK | {"options": options})["options"] == options


def test_samples_that_no_memory_holds_are_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr(limits, "memory", lambda: 1e6)
    model = rat()
    q = np.tile(START["q"], (100, 1))
    st.simulate(model, q[0], START["v"], t_span=0.01)
    with pytest.raises(st.SimulationError, match=r"201 samples of each of 100 runs need .* GB, th"):
        st.simulate(model, q, START["v"], t_span=0.01)
    assert limits.memory() == 1e6
    monkeypatch.undo()
    assert 1e8 < limits.memory() < 1e15
