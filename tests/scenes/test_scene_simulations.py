"""Scenes with a table [simulate]: the paper's motions come out of them, and what is wrong in one is
named.
"""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.pictures.skeleton import leg_joints
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of

SCENES = Path(__file__).parents[2] / "scenes"
SIMPLE = """kind = "articulated"
segments = 1
links = 2
contacts = ["feet", "tail"]
functions = [
  "energy", "momentum", "rollout", "implicit", "pfl", "tail_points",
  "contact_points", "contact_dynamics",
]
[simulate]
duration = 0.02
[simulate.start]
height = 0.1
[simulate.legs]
gamma = 3.67
delta = -0.26
"""


@cache
def made(name):
    """The generated folder of a scene of the repository."""
    return folder_of(load_scene(SCENES / f"{name}.toml"))


def told(name, **changes):
    scene = st.scenario(SCENES / f"{name}.toml", made(name), changes)
    motion = scene.simulate()
    return scene, motion, scene.summary(motion)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """Return a function from text that is added to, or put for other text of, a simple scene to its
    file's path.
    """
    monkeypatch.chdir(tmp_path)
    text = SIMPLE.replace('kind = "art', 'name = "simple"\nkind = "art')
    Path("generated").mkdir()
    Path("simple.toml").write_text(text)
    Path("generated/simple").symlink_to(folder_of(load_scene("simple.toml")))

    def write(added="", **replaced):
        own = text
        for old, new in replaced.items():
            own = re.sub(rf"^{old} = .*$", new, own, flags=re.MULTILINE)
        Path("simple.toml").write_text(own + added)
        return "simple.toml"

    return write


# The paper's motions; figures of docs/contact.md.


def test_kick_is_the_papers():
    _, motion, summary = told("kick")
    expected = {"take_off_s": (0.404, 1e-3), "com_rise_m": (0.619, 1e-3), "apex_m": (0.632, 2e-3)}
    expected |= {"recontact_s": (1.095, 2e-3), "peak_foot_force_N": (400, 40)}
    for name, (value, tolerance) in expected.items():
        assert summary[name] == pytest.approx(value, abs=tolerance), name
    at = int(np.argmin(np.abs(motion.t - 0.5)))
    pitch = st.pitch_roll_yaw(motion.q, unwrap=True)[:, 0]
    assert pitch[at] == pytest.approx(3.80, abs=0.01) and motion.v[at, 3] == pytest.approx(
        26.2, abs=0.1
    )
    assert pitch[np.argmin(np.abs(motion.t - 1.08))] == pytest.approx(18.7, abs=0.05)
    assert summary["pitch_at_end_rad"] == pitch[-1] and summary["method"] == "ros34pw2"


def test_kick_starts_at_rest():
    scene, motion, _ = told("kick")
    before = motion.t < 0.4
    assert (
        np.abs(motion.q[before] - scene.q0).max() < 1e-3 and np.abs(motion.v[before]).max() < 1e-2
    )
    assert np.degrees(st.pitch_roll_yaw(scene.q0)[0]) == pytest.approx(12.8, abs=0.2)
    loads = motion.contact.forces[0, :3, 2]
    assert loads[:2].min() > 5 * loads[2] > 0  # on A and M


def test_less_friction_is_a_parameter():
    assert told("kick", mu=0.2)[2]["apex_m"] != pytest.approx(told("kick")[2]["apex_m"], abs=1e-4)
    changed = told("kick", **{"legs.moves.0.rate": 60.0, "duration": 0.6})
    assert changed[1].t[-1] == 0.6 and changed[2]["take_off_s"] > told("kick")[2]["take_off_s"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tail_support_jump", "tail_support_jump_continuum"])
def test_tail_support_jump_stands_again(name):
    summary = told(name)[2]
    assert summary["apex_m"] == pytest.approx(0.647, abs=3e-3)
    assert summary["standing_end"] is True and summary["upright_end"] > 0.9
    passive = told(name, controller={"kind": "damping", "damping": 1e-3})[2]
    assert passive["standing_end"] is False and passive["upright_end"] < 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["self_recovery", "self_recovery_continuum"])
def test_self_recovery_stands(name):
    scene, _, summary = told(name)
    assert scene.q0[2] == pytest.approx(0.0167, abs=2e-4)
    assert st.rotation_matrix(scene.q0[3:7])[2, 2] < -0.99
    assert summary["standing_end"] is True and summary["upright_end"] == pytest.approx(
        0.976, abs=2e-3
    )
    assert told(name, controller={"kind": "damping", "damping": 1e-3})[2]["upright_end"] < 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tail_support_jump", "self_recovery", "self_recovery_continuum"])
def test_without_tail_contact_none_stands(tmp_path, name):
    text = (SCENES / f"{name}.toml").read_text()
    source = tmp_path / f"{name}_without.toml"
    source.write_text(text.replace('"feet", "tail"', '"feet"'))
    scene = st.scenario(source, folder_of(load_scene(source)))
    summary = scene.summary(scene.simulate())
    assert summary["standing_end"] is False and summary["upright_end"] < 0


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_scene_is_sound(path):
    assert load_scene(path).name == path.stem


# Starts, schedules and controllers of tables.


def test_bends_are_shared_among_links(scene):
    path = scene("[simulate.reference]\ntimes = [0.01, 0.02]\nbends = [[0.4], [[0.6]]]\n")
    with pytest.raises(st.SimulationError, match="bends"):
        st.scenario(path)
    given = "[simulate.reference]\ntimes = [0.01, 0.02]\nbends = [[[0.4, -0.2]], [[0.6, 0.0]]]\n"
    given += '[simulate.controller]\nkind = "pfl"\nkp = 1e4\nkd = 200.0\n'
    found = st.scenario(scene(given))
    np.testing.assert_allclose(found.q0[7:], [0.2, -0.1])
    # The quintic's terms, 10, 15 and 6 times a rise of 0.1 rad, cancel at its end. Powers, products
    # and sums round each at most 14 times by 2^-53 of itself: 14 * 3.1 * 2^-53 = 5e-15 rad is left.
    np.testing.assert_allclose(found.controller.curve.at(0.03)[0], [0.3, 0], rtol=0, atol=5e-15)
    assert (found.controller.kp, found.controller.kd) == (1e4, 200)
    assert found.simulate().t[-1] == 0.02


def test_pose_is_yaw_pitch_roll(scene):
    found = st.scenario(scene(), changes={"start.pitch": 0.3, "start.roll": -0.2, "start.yaw": 2.0})
    np.testing.assert_allclose(st.pitch_roll_yaw(found.q0), [0.3, -0.2, 2.0], atol=1e-14)
    np.testing.assert_array_equal(found.q0[:3], [0, 0, 0.1])


def test_controllers_follow_one_another(scene):
    path = scene(
        '[[simulate.controller]]\nbegin = 0.0\nkind = "none"\n'
        '[[simulate.controller]]\nbegin = 0.01\nkind = "torques"\ntimes = [0.0, 1.0]\n'
        "torques = [[1e-4, 0.0], [1e-4, 0.0]]\n"
    )
    motion = st.scenario(path).simulate()
    apart = np.abs(motion.t - 0.01) > 1e-9
    np.testing.assert_allclose(motion.tau[apart, 0], np.where(motion.t < 0.01, 0, 1e-4)[apart])


def test_a_settled_start_is_at_rest(scene):
    found = st.scenario(scene(height="height = 0.05\nsettle = { rounds = 8, duration = 0.25 }"))
    assert found.settings["bristles0"].shape == (8, 2) and not found.v0.any()
    motion = found.simulate()
    assert np.abs(motion.q[-1] - found.q0).max() < 1e-3


def test_a_saved_motion_is_a_reference(scene, tmp_path):
    flight = st.scenario(scene()).simulate()
    flight.save(tmp_path / "flight.npz")
    found = st.scenario(
        scene('[simulate.reference]\nfile = "flight.npz"\n[simulate.controller]\nkind = "pfl"\n')
    )
    np.testing.assert_allclose(
        found.controller.curve.at(0.01)[0], flight.resample([0.01]).tail[0], atol=1e-9
    )


def test_moves_follow_each_other():
    moves = [
        {"at": 0.4, "delta": -1.3, "rate": 70.0},
        {"at": 0.6, "delta": -0.5, "gamma": 3.0, "duration": 0.1},
    ]
    curve = st.Legs.moves(3.6, -0.2, moves).curve
    values, rates, _ = curve.at([0.0, 0.4, 0.5, 0.65, 1.0])
    np.testing.assert_allclose(values[:, 0], [3.6, 3.6, 3.6, 3.3, 3.0])
    np.testing.assert_allclose(values[:, 1], [-0.2, -0.2, -1.3, -0.9, -0.5])
    np.testing.assert_allclose(rates[:, 1], [0, -70, 0, 8, 0], atol=1e-12)
    np.testing.assert_array_equal(values[:, :2], values[:, 2:])
    assert len(curve.times) == 4


# Errors.

WRONG = [
    ({"duration": "duration = -1.0"}, "", "simulate.duration -1.0: give a number above 0"),
    ({"duration": ""}, "", "simulate.duration: no value: needs seconds"),
    ({"duration": "duration = nan"}, "", "simulate.duration nan"),
    (
        {"duration": "duratoin = 1.0"},
        "",
        "simulate: key: value 'duratoin': did you mean 'duration'?",
    ),
    ({"height": "height = -0.05"}, "", r"q0: point \d+ \((tail|feet)\) is .* mm deep at the start"),
    ({"height": "height = nan"}, "", "simulate.start.height nan: give a finite number"),
    ({"height": "heigth = 0.1"}, "", "simulate.start: key: value 'heigth': did you mean 'height'?"),
    (
        {"height": "velocity = [1, 2]"},
        "",
        "simulate.start.velocity: value .*: needs three finite numbers",
    ),
    (
        {"height": "height = 0.1\nvelocity = [0, 0, 1]\nsettle = {}"},
        "",
        "has no velocity and no rate",
    ),
    (
        {"height": "height = 0.1\nsettle = { rounds = 0 }"},
        "",
        "rounds 0: give a whole number from 1",
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
        r"moves\[0\].rate -1",
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
    ({"delta": "delta = [0.0, 1.0]\ntimes = [1.0, 0.0]"}, "", "Legs: times must increase"),
    ({}, '[simulate.controller]\nkind = "pfl"\n', "tracks a reference: add a table"),
    ({}, '[simulate.controller]\nkind = "pdf"\n', "did you mean 'pfl'?"),
    (
        {},
        '[simulate.controller]\nkind = "damping"\ndamping = -1.0\n',
        "damping -1.0: give finite numbers, 0 or above",
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
        "Reference: times must increase",
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
        ({"parameters.mu": 1}, "change 'parameters.mu': unknown"),
        ({"legs.moves.0.rate": 1}, "change 'legs.moves.0.rate': 'moves' is not in "),
        ({"duration.x": 1}, "change 'duration.x': 'x' is not in 0.02"),
        ({"method": "euler"}, "method 'euler': choose one of"),
        ({"step": 1e-3, "rtol": 1e-3}, "has no setting 'rtol'"),
    ],
)
def test_wrong_changes_are_named(scene, changes, words):
    with pytest.raises(st.SerpentailError, match=words):
        st.scenario(scene(), changes=changes).simulate()


def test_a_folder_of_another_scene_is_refused(scene):
    with pytest.raises(
        st.ModelError, match=r"has contacts = .*: generate it again, `make model SCENE=simple.toml`"
    ):
        st.scenario(scene(contacts='contacts = ["feet"]'))
    assert st.scenario(scene(contacts='contacts = ["tail", "feet"]')).model.contacts == {
        "feet": 6,
        "tail": 2,
    }


def test_scene_without_a_motion(scene):
    path = Path(scene())
    path.write_text(path.read_text().split("[simulate]")[0])
    with pytest.raises(st.SimulationError, match=r"has no table \[simulate\]; add one"):
        st.scenario(path)
    with pytest.raises(st.SimulationError, match="cannot be read"):
        st.scenario("nowhere.toml")


# The command line.


def test_simulate_prints_one_json_object(scene, capsys):
    arguments = [
        "simulate",
        scene(),
        "--set",
        "mu=0.5",
        "--set",
        "duration=0.01",
        "--save",
        "a.npz",
        "--json",
        "-",
    ]
    assert cli.main(arguments) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert out.count("\n") == 1 and not err
    names = (
        "take_off_s apex_m com_rise_m recontact_s pitch_at_end_rad upright_end peak_foot_force_N "
        "steps cpu_s"
    )
    assert set(names.split()) | {"real_time_factor", "method"} <= set(summary)
    saved = st.Trajectory.load("a.npz")
    assert saved.t[-1] == 0.01 and saved.info["parameters"]["mu"] == 0.5


def test_simulate_prints_a_table_and_draws(scene, capsys):
    assert cli.main(["simulate", scene(), "--film", "a.png"]) == 0
    assert re.search(r"^upright_end +1\.0", capsys.readouterr().out, re.MULTILINE)
    assert Path("a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("mu=-1", "mu: value -1"),
        ("mu", "--set mu: needs NAME=VALUE"),
        ("duration=0", "give a number above 0"),
    ],
)
def test_wrong_sets_are_status_2(scene, capsys, given, words):
    assert cli.main(["simulate", scene(), "--set", given, "--json", "-"]) == 2
    out, err = capsys.readouterr()
    assert not out and words in err


def test_a_missing_model_is_generated_first(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("simple.toml").write_text(SIMPLE.replace('kind = "art', 'name = "simple"\nkind = "art'))
    assert cli.main(["simulate", "simple.toml", "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["model"] == "simple" and "generated/simple: " in err


def test_a_scene_that_cannot_be_generated_is_status_2(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("wrong.toml").write_text(SIMPLE.replace("links = 2", "links = 0"))
    assert cli.main(["simulate", "wrong.toml"]) == 2
    assert "could not be generated: " in capsys.readouterr().err


def test_a_flight_is_a_scene_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    functions = '["energy", "momentum", "rollout", "tail_points"]'
    text = (
        "kind = 'articulated'\nsegments = 1\nlinks = 1\nfunctions = "
        f"{functions}\n[simulate]\nduration = 0.1\n"
    )
    Path("tumble.toml").write_text(
        text + "start = { height = 1.0, velocity = [0, 0, 2], rate = [9, 0, 0] }\n"
    )
    assert cli.main(["simulate", "tumble.toml", "--json", "-", "--film", "tumble.png"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["method"] == "tsit5" and summary["take_off_s"] is summary["standing_end"] is None
    assert summary["com_rise_m"] == pytest.approx(2 * 0.1 - 4.9 * 0.01, abs=0.01)
    Path("still.toml").write_text(text + "start = { settle = {} }\n")
    assert cli.main(["simulate", "still.toml"]) == 2 and "cannot settle" in capsys.readouterr().err


# Drawings.


def test_drawn_feet_are_where_the_model_has_them(scene):
    found = st.scenario(scene(), changes={"start.pitch": 0.3, "start.roll": -0.2, "start.yaw": 2.0})
    motion = found.simulate()
    joints = leg_joints(found.model, motion, found.legs.curve.at(motion.t)[0])
    feet = motion.contact.of("feet").points.reshape(-1, 2, 3, 3)
    np.testing.assert_allclose(joints[:, :, 3:], feet, atol=1e-15)
