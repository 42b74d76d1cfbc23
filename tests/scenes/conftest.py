"""A simple scene, to which tests add and of which they replace text."""

import re
from pathlib import Path

import pytest

SIMPLE = """kind = "articulated"
segments = 1
links = 2
contacts = ["feet", "tail"]
functions = [
  "energy", "momentum", "rollout", "implicit", "pfl", "tail_points",
  "contact_points", "leg_points", "contact_dynamics",
]
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
    text = SIMPLE.replace('kind = "art', 'name = "simple"\nkind = "art')
    Path("simple.toml").write_text(text)

    def write(added="", **replaced):
        own = text
        for old, new in replaced.items():
            own = re.sub(rf"^{old} = .*$", new, own, flags=re.MULTILINE)
        Path("simple.toml").write_text(own + added)
        return "simple.toml"

    return write
