"""One folder that is generated again and again, as different models of the same name."""

import json
from pathlib import Path

import numpy as np

from serpentail_codegen.targets.write import write_folder
from tests.support.models import model_folder

FUNCTIONS = ["mass_matrix", "forward_dynamics", "energy", "momentum", "rollout"]
Q = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2]


def texts(segments: int, links: int, **options) -> tuple[dict[str, str], dict]:
    """Return what the generator would write of a model called tail: texts and manifest."""
    folder = model_folder(segments, links, name="tail", **options)
    manifest = json.loads((folder / "manifest.json").read_text())
    return {name: (folder / name).read_text() for name in manifest["files"]}, manifest


def put(folder: Path, made: tuple[dict[str, str], dict]) -> Path:
    """Write such a model to a folder, as the generator does."""
    write_folder(folder, *made)
    return folder


def model_of(links: int, **options) -> tuple[dict[str, str], dict]:
    """Return the texts and the manifest of one segment."""
    return texts(1, links, functions=FUNCTIONS, **options)


def agree(model) -> None:
    """Check that CasADi and C are of one model."""
    np.testing.assert_allclose(model.casadi.mass_matrix(Q), model.mass_matrix(Q), rtol=1e-12)
