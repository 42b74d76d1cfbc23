"""Options of the test run, and how it compiles its models."""

import os
import signal

import pytest

from tests.support.models import QUICK, choose_compiler


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
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for `make test &` in a script
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def users_compiler(monkeypatch):
    """Compile models as for a user, even if other tests compile faster."""
    if os.environ.get("CC") == QUICK:
        monkeypatch.delenv("CC")
