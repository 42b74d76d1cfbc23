"""Table 1, and Figs. 14 and 15: the tail on the ground (Sect. 4.4)."""

from pathlib import Path

import numpy as np

import serpentail as st
from examples.paper import published
from examples.studies.contact import scene_file
from serpentail.simulation.controllers.pfl import KD, KP

JUMP, CONTINUUM = "tail_support_jump", "tail_support_jump_continuum"
RECOVERIES = {"articulated": "self_recovery", "continuum": "self_recovery_continuum"}
SI = {"mm": 1e-3, "g": 1e-3, "g cm^2": 1e-7, "deg": np.pi / 180}  # other units are of SI


def support(folder: Path) -> dict:
    """Fig. 14: the jump, with the tail through the ground, and with two kinds of tails on it."""
    scenes = {"without": scene_file(JUMP, folder, "tail"), "articulated": JUMP}
    told = simulated(scenes | {"continuum": CONTINUUM}, folder / "fig14.html")
    lands = {
        name: of["standing_end"] and of["landing_group"] == "feet" for name, of in told.items()
    }
    return {"fig14": lands | {"without": not lands["without"]}}


def recovery(folder: Path) -> dict:
    """Fig. 15: from lying to standing."""
    told = simulated(RECOVERIES, folder / "fig15.html")
    return {"fig15": {name: of["standing_end"] for name, of in told.items()}}


def simulated(scenes: dict, page: Path) -> dict[str, dict]:
    """Simulate scenes, show them on a page and in filmstrips; return their summaries."""
    found = {name: st.scenario(scene) for name, scene in scenes.items()}
    motions = {name: scene.simulate() for name, scene in found.items()}
    st.view(list(motions.values()), page, names=list(motions))
    for name, motion in motions.items():
        motion.filmstrip(page.with_name(f"{page.stem}_{name}.png"))
    return {name: dict(found[name].summary(motion)) for name, motion in motions.items()}


def table_1(folder: Path) -> dict:
    """Table 1: the parameters of a model, as built; the folder stays empty."""
    found = {"K_d": KD, "K_p": KP, "K_dmp": st.Damping().damping}
    for name, value in st.build("kick").parameters.items():
        parts = zip("xyz", value, strict=True) if np.ndim(value) else [("", value)]
        found |= {f"{name}_{axis}".rstrip("_"): part for axis, part in parts}
    rows = published.read()["table1"].rows
    return {"table1": {row.name: found[row.name] / SI.get(row.unit, 1) for row in rows}}
