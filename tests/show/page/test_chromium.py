"""The page in a real browser, also in a notebook: it needs nothing else, seeks, obeys, saves."""

import csv
import dataclasses
import time
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

import serpentail as st
from tests.motion.conftest import simulated
from tests.support.page import need

pytest.importorskip("selenium")
from selenium.webdriver import ActionChains
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from tests.support import chromium
from tests.support.chromium import opened, requests

pytestmark = pytest.mark.slow  # Chromium is no part of a newcomer's installation
PHONE = (375, 740)
SETTLED = 0.1  # s, for what is drawn when a frame comes


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Pages of the kick, and of two runs over each other."""
    folder, kick = tmp_path_factory.mktemp("pages"), simulated("kick")
    slow = kick.resample(kick.t[:600:3])
    return {
        "kick": kick.view(folder / "kick & more.html"),
        "two": st.view([kick, slow], folder / "two.html", names=["whole", "begin"]),
    }


def text(driver, name):
    return driver.execute_script(f"return document.getElementById('{name}').textContent")


def seek(driver, t):
    driver.execute_script(f"serpentail.seek({t})")


def picture(driver):
    """What the stage shows, as a drawn image."""
    time.sleep(SETTLED)
    return driver.find_element("id", "view").screenshot_as_png


def pixels(png):
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"), int)


def press(driver, *keys, on="body"):
    driver.find_element("css selector", on).send_keys(*keys)


def value(driver):
    return float(driver.execute_script("return document.getElementById('time').value"))


def test_it_needs_nothing_else_and_complains_of_nothing(browser, pages):
    for page in pages.values():
        shades = set()
        for size, scheme in (((1280, 800), "light"), ((1280, 800), "dark"), (PHONE, "dark")):
            driver = opened(browser, page, size, scheme)
            seek(driver, 0.5)
            shades.add(picture(driver))
            assert requests(driver) == [page.as_uri()] and driver.get_log("browser") == []
            wide = "const e = document.documentElement; return e.scrollWidth - e.clientWidth"
            assert driver.execute_script(wide) <= 0
        assert len(shades) == 3
    script = "fetch('data:,x').then(() => arguments[0]('got it'), () => arguments[0]('refused'))"
    assert driver.execute_async_script(script) == "refused"


def test_seeking_changes_picture_and_numbers(browser, pages):
    driver = opened(browser, pages["kick"])
    seen = []
    for t in (0.1, 0.5, 0.8):
        seek(driver, t)
        seen.append((picture(driver), text(driver, "plots"), text(driver, "clock")))
    assert all(len(set(each)) == 3 for each in zip(*seen, strict=True))
    assert seen[1][2] == "0.5000 s"
    for t, end in ((-1, 0.0), (99, 1.2)):
        seek(driver, t)
        assert value(driver) == end
    plot = driver.find_element("css selector", ".u-over")
    quarter = plot.size["width"] // 4
    ActionChains(driver).move_to_element_with_offset(plot, quarter, 5).click().perform()
    assert 0.8 < value(driver) < 1.0


def test_runs_switch_on_and_off(browser, pages):
    driver = opened(browser, pages["two"])
    seek(driver, 0.7)
    both, words = picture(driver), "return document.querySelectorAll('figcaption [hidden]').length"
    boxes = driver.find_elements("css selector", "#runs input")
    boxes[1].click()
    assert picture(driver) != both and driver.execute_script(words) > 0
    press(driver, "2")
    assert boxes[1].is_selected() and driver.execute_script(words) == 0
    assert picture(driver) == both
    press(driver, "1", "2")
    assert not any(box.is_selected() for box in boxes)

    # where runs are in one place, the first is seen
    press(driver, "1", "2")
    seek(driver, 0.0)
    drawn = [picture(driver)]
    press(driver, "2")
    drawn.append(picture(driver))
    other = np.abs(pixels(drawn[0]) - pixels(drawn[1])).max(axis=2) > 40
    assert other.mean() < 0.005  # the path of the other's centre of mass
    unnamed = """
      const named = (each) => each.getAttribute("aria-label") || each.closest("label")
        || each.textContent.trim();
      const controls = document.querySelectorAll("button, select, input, canvas[tabindex]");
      return [...controls].filter((each) => each.tabIndex < 0 || !named(each))
        .map((each) => each.outerHTML);"""
    assert driver.execute_script(unnamed) == []
    assert "whole: tail: " in text(driver, "warnings")


def test_runs_stand_side_by_side_by_a_key(browser, pages):
    """The second run, which is hidden by the first, is then seen in its own colour."""
    driver = opened(browser, pages["two"])
    shown = []
    for _ in range(3):
        shown.append(pixels(picture(driver)))
        press(driver, "s")
    over, beside = (np.mean(p[..., 0] - p[..., 2] > 60) for p in shown[:2])
    assert beside > 5 * over and (shown[0] == shown[2]).all()
    driver = opened(browser, pages["kick"])
    assert not driver.find_element("id", "apart").is_displayed()
    seek(driver, 0.42)
    for key in "mt":  # torques, path of the tail's tip
        before = pixels(picture(driver))
        press(driver, key)
        assert 1e-4 < (pixels(picture(driver)) != before).mean() < 0.05, key


def test_keys(browser, pages, kick):
    driver = opened(browser, pages["kick"])
    first = kick.events[0]["time"]
    for keys, expected in (
        ([Keys.ARROW_RIGHT], 0.001),
        ([Keys.SHIFT, Keys.ARROW_RIGHT, Keys.NULL], 0.011),
        ([Keys.ARROW_LEFT], 0.010),
        (["n"], first),
        ([Keys.END], 1.2),
        ([Keys.HOME], 0.0),
        (["n", "n", "p"], first),
    ):
        press(driver, *keys)
        assert value(driver) == pytest.approx(expected, abs=1e-6), keys
    assert "take off" in text(driver, "clock")

    # on the slider the same, not the browser's own step
    press(driver, Keys.HOME, Keys.ARROW_RIGHT, on="#time")
    assert value(driver) == pytest.approx(0.001, abs=1e-6)

    # space plays and pauses
    press(driver, Keys.HOME, " ")
    assert text(driver, "play") == "Pause"
    WebDriverWait(driver, 60).until(value)  # some time has passed
    press(driver, " ")
    assert text(driver, "play") == "Play"
    held = value(driver)
    time.sleep(SETTLED)
    assert value(driver) == held
    driver.execute_script("document.getElementById('play').focus()")
    press(driver, " ", on="#play")  # the focused button's own key, once
    assert text(driver, "play") == "Pause"


def test_other_motions_open(browser, tmp_path, flight):
    for motion, end in ((flight, "Pause"), (flight.resample([0.0]), "Play")):
        driver = opened(browser, motion.view(tmp_path / "run.html"))
        seek(driver, 0.1)
        press(driver, " ", "n", "f", "r", "+", "-")
        assert driver.get_log("browser") == []
        assert text(driver, "play") == end


def test_without_webgl_all_but_the_animal_is_there(pages):
    need(chromium.need_chromium)
    with chromium.chromium("--disable-3d-apis") as driver:
        opened(driver, pages["kick"])
        assert "this browser has no WebGL" in text(driver, "notes")
        before = text(driver, "plots")
        press(driver, Keys.END)
        assert value(driver) == pytest.approx(1.2) and text(driver, "plots") != before


def test_warnings_open_by_a_click_licences_are_there_and_damage_is_told(
    browser, pages, kick, tmp_path
):
    driver = opened(browser, pages["kick"], (1280, 800))
    box = driver.find_element("id", "warnings")
    assert box.text == "5 warnings"
    assert driver.find_element("css selector", ".u-over").rect["y"] < 800 - 100
    box.find_element("css selector", "summary").click()
    assert all(each in box.text for each in kick.warnings)
    said = text(driver, "panel")
    assert said.count("MIT License") == 2 and "three.js authors" in said and "Leon Sorokin" in said

    whole, cut = pages["kick"].read_text(), tmp_path / "cut.html"
    cut.write_text(whole.replace('"rows": 1201', '"rows": 1202'))
    driver.get(cut.as_uri())
    error = WebDriverWait(driver, 60).until(lambda d: d.execute_script("return serpentail.error"))
    assert "damaged" in error and "could not be opened" in text(driver, "notes")
    assert not driver.execute_script("return serpentail.ready")


SPY = """
  window.labels = new Map();
  const write = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...more) {
    if (!window.labels.has(this.canvas)) window.labels.set(this.canvas, new Set());
    if (!/s$/.test(text)) window.labels.get(this.canvas).add(text);
    return write.call(this, text, ...more);
  };
"""


def test_the_axes_of_a_motion_at_rest_do_not_show_rounding(browser, tmp_path, kick):
    """Its height varies by the rounding of a float: labels differ, over 1 mm or more."""
    q, v = np.repeat(kick.q[:1], len(kick.t), axis=0), np.zeros_like(kick.v)
    q[:, 2] = 0.109 + 1e-8 * np.sin(20 * kick.t)
    rest = dataclasses.replace(kick, q=q, v=v)
    driver = opened(browser, rest.view(tmp_path / "rest.html"), script=SPY)
    time.sleep(SETTLED)
    drawn = driver.execute_script("return [...labels.values()].map((each) => [...each])")
    height, tilt = (sorted(map(float, each)) for each in drawn[:2])
    assert len(height) > 1 and 0.4e-3 < np.ptp(height) < 3e-3 and height[0] < 0.109 < height[-1]
    assert len(tilt) > 1 and 0.04 < np.ptp(tilt) < 0.3


def test_an_output_of_a_notebook_runs_and_fetches_nothing(browser, kick, tmp_path):
    """A page with two outputs, as a notebook has them."""
    notebook, output = tmp_path / "notebook.html", kick._repr_html_()
    whole = f'<!doctype html><meta charset="utf-8"><body><p>A motion</p>{output}{output}</body>'
    notebook.write_text(whole, encoding="utf-8")
    browser.get_log("performance")
    done = "return window.serpentail && (serpentail.ready || serpentail.error)"
    browser.get(notebook.as_uri())
    for frame in browser.find_elements("css selector", "iframe"):
        browser.switch_to.frame(frame)
        WebDriverWait(browser, 60).until(lambda driver: driver.execute_script(done))
        assert browser.execute_script("return serpentail.error") is None
        seek(browser, 0.6)
        assert value(browser) == pytest.approx(0.6, abs=0.003)
        assert browser.execute_script("return origin") == "null"
        browser.switch_to.default_content()
    assert browser.get_log("browser") == []
    assert set(requests(browser)) <= {notebook.as_uri(), "about:srcdoc"}


def test_what_is_shown_is_saved_and_a_film_is_behind_it(browser, tmp_path, kick, flight):
    """No name becomes a formula of a spreadsheet; what is no film is refused by its name."""
    page = st.view([kick, flight], tmp_path / "page.html", names=["</script>", '=1+1,"a"'])
    driver, wait = opened(browser, page), WebDriverWait(browser, 60).until
    behavior = {"behavior": "allow", "downloadPath": str(tmp_path)}
    driver.execute_cdp_cmd("Page.setDownloadBehavior", behavior)
    press(driver, "1", *"++++++++")  # the second run, fast
    seek(driver, 0.1)

    def saved(kind):
        driver.find_element("css selector", f"#save [value={kind}]").click()
        return wait(lambda _: list(tmp_path.glob(f"*.{kind}")))[0]

    rows = list(csv.DictReader(saved("csv").read_text().splitlines()))
    assert {each["run"] for each in rows} == {'\'=1+1,"a"'}
    yaw = np.degrees(flight.tail[:, 3])
    for key, expected in (("t (s)", flight.t), ("bends of the tail's segments: yaw 2 (deg)", yaw)):
        np.testing.assert_allclose([float(row[key]) for row in rows], expected, 1e-6, 1e-9)
    shown = pixels(picture(driver))
    assert np.abs(shown - pixels(saved("png").read_bytes())).mean() < 1
    film, wrong = saved("webm"), tmp_path / "<b>none"
    assert b"V_VP" in film.read_bytes() and text(driver, "play") == "Play"
    wrong.write_text("no film")
    chosen = driver.find_element("css selector", "#backdrop input")
    chosen.send_keys(str(wrong))
    wait(lambda _: "<b>none: this browser" in text(driver, "backdrop"))
    chosen.send_keys(str(film))
    at = "const v = document.getElementById('film'); return v.hidden ? -1 : v.currentTime"
    wait(lambda _: driver.execute_script(at) >= 0)
    driver.execute_script("document.querySelector('#backdrop [type=number]').value = 0.05")
    seek(driver, 0.1)
    wait(lambda _: driver.execute_script(at) == pytest.approx(0.15, abs=1e-3))
    assert {each[:5] for each in requests(driver)} <= {"file:", "blob:"}
    assert driver.get_log("browser") == []
