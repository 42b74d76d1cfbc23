"""A real Chromium that opens pages, and records the requested addresses."""

import json
import shutil
from contextlib import contextmanager
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

from checks.embedded.boards import ToolchainMissing
from tests.support.page import need_page

OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
)


def need_chromium() -> None:
    """ToolchainMissing without the page, or Chromium and its driver."""
    need_page()
    for program in ("chromium", "chromedriver"):
        if shutil.which(program) is None:
            remedy = "Debian: apt-get install --no-install-recommends chromium chromium-driver"
            raise ToolchainMissing(f"{program} is not on PATH; {remedy}")


@contextmanager
def chromium(*more):
    """Yield a headless Chromium that draws in software, and records console messages and requests.

    more: options.
    """
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for option in (*OPTIONS, *more):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, Service(shutil.which("chromedriver")))
    try:
        yield driver
    finally:
        driver.quit()


def opened(driver, page: Path, size=(1280, 800), scheme="light", script=""):
    """Return the browser with a loaded page, in a window of a size, in light or dark.

    script: runs before those of the page.
    """
    for log in ("browser", "performance"):
        driver.get_log(log)
    width, height = size
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    added = driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
    driver.get(page.as_uri())
    driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
    done = "return window.serpentail && (serpentail.ready || serpentail.error)"
    WebDriverWait(driver, 60).until(lambda browser: browser.execute_script(done))
    assert driver.execute_script("return serpentail.error") is None
    return driver


def requests(driver) -> list[str]:
    """Return addresses that were requested since the last call."""
    entries = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    sent = [e["params"] for e in entries if e["method"] == "Network.requestWillBeSent"]
    return [each["request"]["url"] for each in sent]
