"""A page that computes: equal to Python's runs of the same numbers, in a real browser."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.cli import cli
from serpentail.motion.derived import AGAIN
from tests.support import zoo
from tests.support.page import data_of
from tests.support.rows import row
from tests.support.scenes import SCENES

pytest.importorskip("ziglang")
pytest.importorskip("selenium")
from selenium.webdriver import ActionChains

from tests.support.chromium import opened, requests

pytestmark = pytest.mark.slow
LEGS = st.Legs.fixed(3.7, -0.3)
NUMBERS = """return [...document.querySelectorAll("#numbers tr")].map((row) =>
  [...row.children].map((cell) => cell.textContent))"""
WARNINGS = "return [...document.querySelectorAll('#warnings p')].map((each) => each.textContent)"
SAMPLES = "return [...serpentail.samples().q]"


def flown(name, law=None, span=0.3, **words):
    model = zoo.model(name)
    # gains make steps that rounding decides to repeat: their errors must be small
    more = {"rtol": 1e-12} if model.fixed else {}
    more |= {"legs": LEGS} if "feet" in model.contacts else {}
    state = model.state(**words) if words else (np.array([0, 0, 1, 1, 0, 0, 0, 0.2, 0.9]), [0] * 8)
    return st.simulate(model, state, span, controller=law, **more)


def tracking(model, kp=900, kd=60):
    reference = st.Reference([0.0, 0.1], [[0.0] * model.nu, [0.3] * model.nu])
    return st.Pfl(model, reference, kp=kp, kd=kd)


# a motion, and what is changed
TUMBLE = {"height": 1.0, "pitch": 2.5, "spin": [3, 1, 2], "bend": [[1.0, 0.3]]}
TABLE = st.TorqueTable([0.0, 0.1, 0.3], [[0.0, 0.0], [4e-4, -2e-4], [0.0, 0.0]])
CURLED = {"height": 1.0, "spin": [3, 1, 2], "bend": 0.2}
OTHERS = {"third_mass": 2e-3, "third_link_radius": 4e-3, "third_length": 0.05}
OTHERS |= {"bend third_alpha_1": 80.0, "bend leg_left_beta_1": -30.0, "third_damping": 1e-4}
HEAVY = {"height": 0.07, "mu": 0.3, "bend arm_lift": 20.0, "leg_link_masses": 0.05}
BODY = {"tail_mass": 0.005, "tail_length": 0.25, "link_radius": 0.004, "gravity": 3.7}
TURNED = {"pitch": 100.0, "yaw": -20.0, "spin x": 5.0, "bend 1 yaw": 20.0}
FALL = {"height": 0.3, "pitch": 0.4, "bend": [[0.4, 0.1]]}
CASES = {
    "flight": (lambda: flown("m1_n3", st.Damping(1e-4), **TUMBLE), BODY | TURNED),
    "stops": (lambda: flown("elastic", height=1, bend=0.5), {"bend 2 pitch": 150.0, "spin z": 9.0}),
    "arc": (lambda: flown("arcs1", TABLE, **TUMBLE), {"torso_mass": 0.2, "roll": 30.0}),
    "tree": (lambda: flown("tree", st.Damping(1e-4), **CURLED), OTHERS | {"pitch": 100.0}),
    "stand": (lambda: flown("tree_ground", st.Damping(1e-3), 0.1, height=0.08), HEAVY),
    "polar": (lambda: flown("polar"), {"gravity": 1.0, "spin y": 4.0}),
    "fixed": (
        lambda: flown("fixed", tracking(zoo.model("fixed")), bend=0.2),
        {"kp": 400.0, "kd": 50.0, "tail_mass": 0.01},
    ),
    "fall": (lambda: flown("reproducible", st.Damping(1e-3), 0.6, **FALL), {}),
    "slip": (
        lambda: flown("reproducible", st.Damping(1e-3), 0.6, **FALL),
        {"mu": 0.2, "height": 0.25, "D_n": 0.3, "damping": 5e-4, "torso_mass": 0.12},
    ),
}


def again(motion, values, faster=0):
    """The run of the same start, model, controller and settings with other values, by Python."""
    made, start = vars(motion)[AGAIN], {}
    left = {name: [x] if name.endswith("_masses") else x for name, x in values.items()}
    q, v, model = made.start.q0[0].copy(), made.start.v0[0].copy(), motion.model
    angles = None if model.fixed else np.degrees(st.pitch_roll_yaw(q[None], unwrap=True)[0])
    for k, name in enumerate(("pitch", "roll", "yaw")):
        if name in left:
            angles[k] = left.pop(name)
            euler = Rotation.from_euler("ZXY", angles[[2, 0, 1]], degrees=True)
            q[3:7] = euler.as_quat()[[3, 0, 1, 2]]
    q[2:3] = left.pop("height", q[2])
    for k, name in enumerate(("spin x", "spin y", "spin z")):
        if name in left:
            v[3 + k] = left.pop(name)
    alone = len(model.layout.chains) == 1
    for k, joints in enumerate(np.repeat(model.joints_each, model.layout.widths)):
        place = len(q) - model.nu + k
        which = f"{k // 2 + 1} {('pitch', 'yaw')[k % 2]}" if alone else model.names.tail[k]
        name = f"bend {which}"
        q[place] = np.radians(left.pop(name)) / joints if name in left else q[place]
    gains = {name: left.pop(name) for name in ("damping", "kp", "kd") if name in left}
    law, model = made.controller, model.with_parameters(**left)
    if gains:
        law = tracking(model, **gains) if "kp" in gains else st.Damping(**gains)
    if made.ground.legs is not None:
        start["legs"] = made.ground.legs
    settings = {name: made.method.settings[name] for name in ("rtol", "atol")}
    settings |= {"method": made.method.name, "controller": law}
    return st.simulate(model, (q, v + faster), made.start.end, **settings, **start)


@pytest.mark.parametrize("name", CASES)
def test_a_run_is_computed_again_as_python_does(browser, tmp_path, name):
    make, values = CASES[name]
    motion = make()
    driver = opened(browser, motion.view(tmp_path / "live.html", live=True))
    assert driver.execute_script("return serpentail.change(arguments[0])", values) == ""
    expected = again(motion, values)
    found = np.reshape(driver.execute_script(SAMPLES), expected.q.shape)
    assert np.abs(found - expected.q).max() <= (0 if name in ("fall", "slip") else 1e-9)
    assert driver.execute_script(WARNINGS) == expected.warnings
    rows = data_of(expected.view(tmp_path / "other.html"))["runs"][0]["numbers"]
    numbers = driver.execute_script(NUMBERS)
    assert [label for label, _ in numbers] == [label for label, _ in rows]
    for (label, word), (_, other) in zip(numbers, rows, strict=True):
        with row(label):
            for a, b in zip(word.split(), other.split(), strict=True):
                same = a == b or float(a) == pytest.approx(float(b), rel=2e-4, abs=1e-11)
                assert same, (a, b)
    assert browser.get_log("browser") == [] and len(requests(browser)) == 1


def test_a_wrong_value_is_refused_in_the_words_of_python(browser, tmp_path):
    motion = flown("reproducible", None, 0.1, **FALL)
    model = motion.model
    page = motion.view(tmp_path / "live.html", live=True)
    assert page.stat().st_size < 2e6
    driver = opened(browser, page)
    before = driver.execute_script(NUMBERS)
    for value, wrong in (
        ({"torso_mass": -1}, lambda: model.with_parameters(torso_mass=-1)),
        ({"mu": -0.5}, lambda: model.with_parameters(mu=-0.5)),
        ({"tail_length": 0}, lambda: model.with_parameters(tail_length=0)),
        ({"spin y": None}, lambda: model.state(spin=[0, np.nan, 0])),
        ({"height": -0.2}, lambda: again(motion, {"height": -0.2})),
    ):
        with row(value), pytest.raises(st.SerpentailError) as error:
            wrong()
        script = (
            "const [v] = arguments; for (const k in v) v[k] ??= NaN; return serpentail.change(v)"
        )
        assert driver.execute_script(script, value) == str(error.value)
        assert driver.execute_script(NUMBERS) == before
    assert driver.find_element("css selector", "#knobs p").is_displayed()


def test_a_push_changes_the_start_as_python_says(browser, tmp_path):
    """A drag from the torso pushes, too; a refused push changes nothing; a button takes it back."""
    push = {"point": [0.01, 0.04, -0.02], "impulse": [0.02, -0.01, 0.03]}
    script = "return serpentail.change(arguments[0]) + serpentail.push(arguments[1])"
    for name, values in (("flight", TURNED), ("slip", {})):
        motion = CASES[name][0]()
        driver = opened(browser, motion.view(tmp_path / "live.html", live=True))
        assert driver.execute_script(script, values, push) == ""
        q = again(motion, values).q[0]
        own = Rotation.from_quat(q[[4, 5, 6, 3]]).inv().apply(push["impulse"])
        force = np.r_[push["impulse"], np.cross(push["point"], own), 0, 0]
        expected = again(motion, values, np.linalg.solve(motion.model.mass_matrix(q), force)).q
        found = np.reshape(driver.execute_script(SAMPLES), expected.shape)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9, err_msg=name)
    with pytest.raises(st.StateError) as error:
        again(motion, {}, np.nan)
    wrong = push | {"impulse": [0, 0, "NaN"]}
    assert driver.execute_script(script, {}, wrong) == str(error.value)
    driver.execute_script("document.getElementById('push').click()")
    view = driver.find_element("id", "view")
    ActionChains(driver).drag_and_drop_by_offset(view, 60, -30).perform()
    assert "pushed at the start" in driver.find_element("id", "notes").text
    driver.find_element("css selector", "#knobs button").click()
    assert driver.execute_script(SAMPLES) == motion.q.ravel().tolist()


def test_a_slider_moves_the_run_and_a_button_brings_it_back(browser, tmp_path):
    driver = opened(browser, CASES["flight"][0]().view(tmp_path / "live.html", live=True))
    before, text = driver.execute_script(NUMBERS), "return document.body.innerText"
    figures = driver.execute_script(text)
    drag = """const [done] = arguments, slider = document.querySelector(".knob input");
      const begun = performance.now();
      for (let i = 0; i < 30; i++) {
        slider.value = 0.5 + 0.01 * i;
        slider.dispatchEvent(new Event("input", { bubbles: true }));
        serpentail.change({ height: 0.5 + 0.01 * i });
      }
      const took = performance.now() - begun;
      requestAnimationFrame(() => requestAnimationFrame(() => done(took)));"""
    assert driver.execute_async_script(drag) < 1000  # ms: 30 times a second
    changed = dict(driver.execute_script(NUMBERS))
    assert float(changed["highest torso (m)"]) == pytest.approx(0.79, abs=1e-4)
    assert driver.execute_script(text) != figures and "turned" in driver.page_source
    driver.find_element("css selector", "#knobs button").click()
    assert driver.execute_script(NUMBERS) == before


def test_without_webassembly_or_recorder_the_page_says_so_and_replays(browser, tmp_path):
    page = CASES["arc"][0]().view(tmp_path / "live.html", live=True)
    driver = opened(
        browser, page, script="delete globalThis.WebAssembly; delete globalThis.MediaRecorder"
    )
    assert "cannot compute the run again" in driver.find_element("id", "notes").text
    assert not driver.find_element("id", "knobs").is_displayed()
    driver.find_element("css selector", "#save [value=webm]").click()
    assert "cannot record WebM" in driver.find_element("id", "notes").text
    driver.execute_script("serpentail.seek(0.2)")
    assert "0.2" in driver.find_element("id", "clock").text


def test_what_cannot_be_computed_is_replayed_with_the_reason(tmp_path):
    flight = flown("m1_n3", lambda t, q, v: [0.0, 0.0], **TUMBLE)
    many = st.simulate(zoo.model("m1_n3"), flight.q[0], flight.v[0], output_step=1e-4)
    parts = [st.Phase(name, 0.01) for name in ("first", "second")]
    state = flight.q[0], flight.v[0]
    joined = (
        st.Sequence(zoo.model("ground"), parts, gamma=3.7, delta=-0.3).simulate(*state).trajectory
    )
    for motion, words in (
        (flight, "its controller is a function"),
        (dataclasses.replace(flight), "only one run"),
        (joined, "only one run"),
        (flown("single", height=1), 'real = "double"'),
        (flown("baked", height=1), "baked = false"),
        (many, "longer output_step"),
    ):
        data = data_of(motion.view(tmp_path / "live.html", live=True))
        assert "live" not in data and any(words in note for note in data["notes"])


def test_the_command_makes_such_a_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    kick = str(SCENES / "kick.toml")
    assert cli.main(["simulate", kick, "--live"]) == 2 and "--view" in capsys.readouterr().err
    few = ["--set", "duration=0.1"]
    assert cli.main(["simulate", kick, "--live", "--view", "kick.html", *few]) == 0
    data = data_of(tmp_path / "kick.html")
    assert {each["group"] for each in data["live"]["knobs"]} == {"start", "body", "controller"}
    assert len(data["live"]["times"]) == data["runs"][0]["rows"] == 101
