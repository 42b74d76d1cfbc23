"""Settings that FATROP does not list are found by a child process, and their absence, too."""

import subprocess
import sys
from pathlib import Path

import pytest

from serpentail.optimal import fatrop, fatrop_settings
from serpentail.optimal.library import kernel
from tests.support.rows import row

pytest.importorskip("casadi")
NAMES = tuple(fatrop.CALLED.values())
LISTED, FAKE = ("tolerance", "mu_init"), "no_such_setting"


@pytest.fixture
def notes(tmp_path, monkeypatch):
    """The folder of answers, of an empty cache."""
    kernel()  # of the usual cache
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    return tmp_path / "solvers"


def has(setting: str) -> bool:
    """Ask as a new process would, which remembers nothing."""
    return fatrop_settings.has_setting.__wrapped__(fatrop.library(), setting, NAMES)


def test_settings_that_fatrop_has_are_told_from_those_that_it_lacks(notes, monkeypatch):
    library = fatrop.library()
    named = fatrop.PIVOT.encode() in Path(library._name).read_bytes()
    expected = {**dict.fromkeys(LISTED, True), fatrop.PIVOT: named, FAKE: False}
    assert all(library.fatrop_ocp_c_option_type(name.encode()) == 0 for name in LISTED)
    for name, answer in expected.items():
        with row(name):
            assert has(name) is answer
    assert len(list(notes.iterdir())) == len(expected)
    # another process finds the answers
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("asked again"))
    for name, answer in expected.items():
        with row(name):
            assert has(name) is answer


def test_without_a_child_nothing_is_set_and_it_is_asked_again(notes, tmp_path, monkeypatch):
    silent = tmp_path / "silent"
    silent.write_text("#!/bin/sh\nexit 0\n")
    silent.chmod(0o700)
    changes = {
        "no program": (sys, "executable", ""),
        "missing program": (sys, "executable", str(tmp_path / "missing")),
        "another program": (sys, "executable", str(silent)),
        "an application": (sys, "frozen", True),
        "no answer": (fatrop_settings, "PATIENCE_S", 0.0),
        "an error of its own": (fatrop_settings, "CHILD", tmp_path / "missing.py"),
    }
    for name, change in changes.items():
        with row(name), monkeypatch.context() as changed:
            changed.setattr(*change, raising=False)
            assert has(LISTED[0]) is False
            assert not notes.exists()
    assert has(LISTED[0]) is True


def test_a_cache_that_cannot_be_written_only_costs_time(notes, tmp_path, monkeypatch):
    place = tmp_path / "file"
    place.touch()
    monkeypatch.setenv("SERPENTAIL_CACHE", str(place))
    for name, answer in {LISTED[0]: True, FAKE: False}.items():
        with row(name):
            assert has(name) is answer


def test_a_setting_is_passed_only_to_a_fatrop_that_has_it(monkeypatch):
    for answer in (True, False):
        monkeypatch.setattr(fatrop, "has_setting", lambda *_, answer=answer: answer)
        given = {option.name.decode(): option.value for option in fatrop.options_of({}, "far")}
        with row(answer):
            assert given.get(fatrop.PIVOT) == (fatrop.LEAST_PIVOT if answer else None)
