"""What a reader does with the page in a real browser: saves it, and sees more in it."""

import csv
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

import serpentail as st

pytest.importorskip("selenium")
from selenium.webdriver.support.ui import WebDriverWait

from tests.support.chromium import opened, picture, press, requests, seek, text

pytestmark = pytest.mark.slow
TRAIL = (0xA8, 0x56, 0x1C)  # colour of the path of the tip
HOSTILE = ['=1+1,"a"', "</script>"]
CHOOSE = """const menu = document.getElementById("save"); menu.value = arguments[0];
  document.getElementById("speed").value = "5";
  menu.dispatchEvent(new Event("change"))"""


def saved(driver, folder, kind):
    """The bytes of what the page saves, when they are all written."""
    behavior = {"behavior": "allow", "downloadPath": str(folder)}
    driver.execute_cdp_cmd("Page.setDownloadBehavior", behavior)
    driver.execute_script(CHOOSE, kind)
    (path,) = WebDriverWait(driver, 60).until(lambda _: list(folder.glob(f"*.{kind}")))
    return path.read_bytes()


def test_paths_of_the_tip_and_torques_are_seen_by_a_key(browser, tmp_path, flight):
    driver = opened(browser, flight.view(tmp_path / "page.html"))
    seek(driver, 0.1)
    counts = []
    for key in "mmtt":
        shown = np.asarray(Image.open(BytesIO(picture(driver))).convert("RGB"), int)
        violet = (shown[..., 2] > shown[..., 1] + 60).sum()  # blue more than green
        counts.append((violet, (np.abs(shown - TRAIL).max(axis=2) < 40).sum()))
        press(driver, key)
    assert counts[1][0] > 20 > counts[0][0] == counts[2][0]
    assert counts[3][1] > counts[2][1] + 50


def test_what_is_shown_is_saved(browser, tmp_path, kick, flight):
    """The table has the samples of the runs that are switched on; no name becomes a formula."""
    page = st.view([kick, flight], tmp_path / "page.html", names=HOSTILE)
    driver = opened(browser, page)
    press(driver, "1")
    seek(driver, 0.1)
    rows = list(csv.DictReader(saved(driver, tmp_path, "csv").decode().splitlines()))
    assert {each["run"] for each in rows} == {HOSTILE[1]} and len(rows) == 41
    number = [{key: float(x) for key, x in row.items() if x and key != "run"} for row in rows]
    for key, expected in (
        *(
            ("t (s)", flight.t),
            ("torso qx (1)", flight.q[:, 4]),
            ("energy: total (J)", flight.energy),
        ),
        ("bends of the tail's segments: yaw 2 (deg)", np.degrees(flight.tail[:, 3])),
    ):
        found = [row[key] for row in number]
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9, err_msg=key)
    shown = Image.open(BytesIO(picture(driver))).convert("RGB")
    kept = Image.open(BytesIO(saved(driver, tmp_path, "png"))).convert("RGB")
    assert shown.size == kept.size
    assert np.abs(np.asarray(shown, int) - np.asarray(kept, int)).mean() < 1
    video = saved(driver, tmp_path, "webm")
    assert video[:4] == b"\x1aE\xdf\xa3" and b"V_VP" in video
    assert text(driver, "play") == "Play" and driver.get_log("browser") == []
    # a film is seen behind the model at the time that is shown; what is none is refused by its name
    (tmp_path / "<b>no film").write_text("no film")
    chosen = driver.find_element("css selector", "#backdrop input")
    chosen.send_keys(str(tmp_path / "<b>no film"))
    wait = WebDriverWait(driver, 60).until
    assert wait(lambda _: "<b>no film: this browser" in text(driver, "backdrop"))
    chosen.send_keys(str(next(tmp_path.glob("*.webm"))))
    at = "const v = document.getElementById('film'); return v.hidden ? -1 : v.currentTime"
    wait(lambda _: driver.execute_script(at) >= 0)
    field = driver.find_elements("css selector", "#backdrop [type=number]")[0]
    driver.execute_script("arguments[0].value = 0.05", field)
    seek(driver, 0.1)
    assert wait(lambda _: driver.execute_script(at) == pytest.approx(0.15, abs=1e-3))
    assert {each[:5] for each in requests(driver)} <= {"file:", "blob:"}
