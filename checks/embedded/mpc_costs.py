"""What a tick of a predictive controller costs on boards, for one plan of (1, 3)."""

from pathlib import Path

import numpy as np

import serpentail as st
from checks.embedded.mpc_image import ticks
from examples.righting import FUNCTIONS as RIGHTING
from examples.righting import TORQUE, tumbling
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

DURATION, STEP = 0.4, 0.017  # s: of the plan; longest Runge-Kutta step
NODE = ("airborne_rates", "airborne_rates_derivatives", "airborne_rates_hessian")
START = 903  # seed
PLANNED = (*NODE, *RIGHTING.split(","))  # what a plan needs
CASES = (("m7", "double", 480), ("m7", "float", 480), ("m4", "float", 168))  # MHz of a usual chip
HEAD = ("board", "type", "code, bytes", "memory, bytes", "stack, bytes")
HEAD += ("instructions, measured", "at most", "ticks a second")


def tick_costs(parent: Path) -> list[tuple]:
    """Return rows: board, type of numbers, bytes, instructions of the longest tick measured and the
    most of any tick, and the ticks a second at one instruction a cycle.
    """
    folders = {real: _made(parent, real) for real in ("double", "float")}
    models = {real: st.load(folder) for real, folder in folders.items()}
    model = models["double"]
    plan = st.plan(
        model,
        start=tumbling(model, START),
        duration=DURATION,
        goal=st.Goal(torso_rate=None),
        bounds=st.Bounds(angle=np.pi / 3, torque=TORQUE),
    )
    rows = []
    for board, real, clock in CASES:
        mpc = st.Mpc(models[real], plan, step=STEP)
        found = ticks(folders[real], mpc, board, parent / f"{board}_{real}", "fast")
        name = {"m7": "Cortex-M7", "m4": "Cortex-M4F"}[board]
        sizes = found.code, found.memory, found.stack
        rate = int(clock * 1_000_000 / found.most)
        counts = found.instructions, found.most, f"{rate} at {clock} MHz"
        rows.append((name, f"`{real}`", *sizes, *counts))
    return rows


def _made(parent: Path, real: str) -> Path:
    scene = scene_for("articulated", 1, 3, functions=[*PLANNED], real=real)
    generate(scene, parent / real)
    return parent / real / scene.name
