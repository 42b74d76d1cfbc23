"""The scenes of the checkout, and the shortest scene file that is right."""

from pathlib import Path

SCENES = Path(__file__).parents[2] / "scenes"
VALID = 'kind = "articulated"\nsegments = 2\nlinks = 3\n'
