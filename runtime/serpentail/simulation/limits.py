"""What a run may take: refused before it begins are steps without end, and more than memory has."""

import math
import os

from ..basics.errors import SimulationError
from ..model.model import Model

MOST_STEPS = 1e9  # of one run: hours
COPIES = 3  # of every sample: written by the C, stored in a trajectory, and derived


def refuse_endless(name: str, step: float, span: float, most_steps: float = MOST_STEPS) -> None:
    """SimulationError if steps of at most this length (s) are too many for a span (s)."""
    if span > most_steps * step:
        raise SimulationError(
            f"{name} {step:.3g}: needs {span / step:.2g} steps, more than {most_steps:g}: give "
            f"{span / most_steps:.2g} s or more"
        )


def refuse_overfull(model: Model, runs: int, samples: int) -> None:
    """SimulationError if the samples of runs need more memory than this machine has."""
    width = model.nq + model.nv + model.layout.nt + 10 * sum(model.contacts.values())
    need, have = 8.0 * COPIES * width * samples * runs, memory()
    if need > have:
        whose = f" of each of {runs} runs" if runs > 1 else ""
        raise SimulationError(
            f"output_step: {samples} samples{whose} need {need / 1e9:.3g} GB, this machine has "
            f"{have / 1e9:.3g} GB: give a longer output_step, or fewer runs at once"
        )


def memory() -> float:
    """Return the memory (bytes) of this machine; infinite if unknown."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return math.inf
