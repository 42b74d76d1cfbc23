"""A simple scene of the model "feet_tail", to which tests add and of which they replace text."""

import re
from pathlib import Path

import pytest

import serpentail as st
from tests.support import zoo

SIMPLE = """kind = "articulated"
segments = 1
links = 3
contacts = ["feet", "tail"]
[simulate]
duration = 0.02
[simulate.start]
height = 0.1
[simulate.legs]
gamma = 3.67
delta = -0.26
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """Return a function that writes the simple scene, with text added or replaced, and its path."""
    monkeypatch.chdir(tmp_path)
    text = 'name = "simple"\n' + SIMPLE

    def write(added="", **replaced):
        own = text
        for old, new in replaced.items():
            own = re.sub(rf"^{old} = .*$", lambda _, new=new: new, own, flags=re.MULTILINE)
        Path("simple.toml").write_text(own + added)
        return "simple.toml"

    return write


@pytest.fixture
def scenario(scene):
    """Return a function that reads the simple scene, with text added or replaced, and changes."""

    def read(added="", changes=None, **replaced):
        return st.scenario(scene(added, **replaced), zoo.folder("feet_tail"), changes)

    return read
