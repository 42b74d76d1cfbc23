"""Options of the test run, how it compiles its models, and what it could not test."""

import gc
import os
import re
import signal
from importlib.util import find_spec

import pytest

from serpentail.model.fast_call import extension
from tests.support.models import choose_compiler

# of extras that `make test` does not install
LIBRARIES = (
    *("fmpy", "hatchling", "imageio_ffmpeg", "jax", "mujoco", "pinocchio", "selenium"),
    *("sphinx", "torch", "viser", "ziglang"),
)
LACKS = re.compile(r"could not import '(\w+)")


def pytest_addoption(parser):
    """Add the options that accept new golden models, and that compile models in less time."""
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite generated/golden_* from the generator"
    )
    parser.addoption(
        "--quick", action="store_true", help="compile models without optimisation, unless CC is set"
    )


def pytest_configure(config):
    """Choose the compiler of all processes, and let Ctrl-C reach them also in the background."""
    choose_compiler(config.getoption("--quick"))
    gc.set_threshold(20_000, 20, 50)  # fewer searches for cycles: a tenth of a run's time
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for `make test &` in a script
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if os.environ.get("CI") and missing():
        raise pytest.UsageError(f"in CI every test runs, but {', '.join(missing())} is missing")


def pytest_sessionstart(session):
    """Compile what makes calls, before a test tries what happens where that cannot be had."""
    extension()


def pytest_collection_finish(session):
    """Leave what was imported out of the searches for cycles."""
    gc.freeze()


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of a test's own, which is empty."""
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def missing():
    """Return the libraries of extras that are not installed."""
    return [name for name in LIBRARIES if find_spec(name) is None]


@pytest.hookimpl(tryfirst=True)
def pytest_terminal_summary(terminalreporter):
    """Tell in one line which libraries were not there, instead of one for each of their tests."""
    skipped = terminalreporter.stats.get("skipped", [])
    lacking = [report for report in skipped if LACKS.search(str(report.longrepr))]
    if lacking:
        names = sorted({LACKS.search(str(report.longrepr))[1] for report in lacking})
        terminalreporter.stats["skipped"] = [r for r in skipped if r not in lacking]
        terminalreporter.write_line(
            f"not tested: {len(lacking)} tests, files and folders that need {', '.join(names)}; "
            "`make setup` installs them"
        )
