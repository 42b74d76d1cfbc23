"""The scenes of the checkout, and the shortest valid scene file."""

from pathlib import Path

SCENES = Path(__file__).parents[2] / "scenes"
VALID = 'kind = "articulated"\nsegments = 2\nlinks = 3\n'
