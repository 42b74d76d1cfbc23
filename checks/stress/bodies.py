"""Errors of long tails, and for parameters that are far from those of an animal."""

import numpy as np

from checks.stress.figure import Figure
from checks.stress.subjects import changed, compared, errors, state, subject
from serpentail.basics.plausible_values import disparity

LONG = ((1, 1), (8, 4), (20, 1), (20, 4), (1, 512), (6, None))
EXTREME = ((1, 1), (1, 3), (3, 4), (1, None), (3, None))
MICROGRAM = 1e-9  # kg
CHANGES: dict[str, dict] = {
    "torso of 1 kg": {"torso_mass": 1.0},
    "torso of 1 mg": {"torso_mass": 1e-6, "torso_inertia": (1e-12, 1e-12, 1e-12)},
    "torso of 1 t": {"torso_mass": 1e3, "torso_inertia": (1e2, 2e2, 2e2)},
    "tail of 1 t": {"tail_mass": 1e3},
    "tail of 1 um": {"tail_length": 1e-6},
    "tail of 1 km": {"tail_length": 1e3},
    "no gravity": {"gravity": 0.0},
    "mount 1 km away": {"tail_mount": (1e3, -1e3, 1e3)},
}
OF_LINKS = {
    "zero link inertia": {"link_inertia": (0.0, 0.0, 0.0)},
    "zero link radius": {"link_radius": 0.0},
    "link inertia about one axis": {"link_inertia": (0.0, 1e-9, 0.0)},
}


def changes(segments: int, links: int | None) -> dict[str, dict]:
    """Return extreme parameters by name."""
    light = {"tail_mass": segments * (links or 1) * MICROGRAM}
    found = {"links of 1 ug": light, "torso of 1 kg, links of 1 ug": light | {"torso_mass": 1.0}}
    return found | CHANGES | (OF_LINKS if links else {})


def long_tails() -> list[Figure]:
    """Return errors by size: bends of up to 1 rad a segment, and folds of up to 3 rad."""
    rng, found = np.random.default_rng(5), []
    for size in LONG:
        of = subject(*size)
        for reach in (1.0, 3.0):
            bends = rng.uniform(-reach, reach, of.model.nv - 6) / (of.model.links or 1)
            cases = [errors(of, *state(of, rng, bends))]
            found += compared(of, f"bends up to {reach:g} rad", cases)
    return found


def extremes() -> list[Figure]:
    """Return the errors for extreme parameters, of a bent and a straight tail."""
    rng, found = np.random.default_rng(6), []
    for size in EXTREME:
        of = subject(*size)
        for name, change in changes(*size).items():
            other, nt = changed(of, **change), of.model.nv - 6
            poses = rng.uniform(-1, 1, nt), np.zeros(nt)
            cases = [errors(other, *state(other, rng, bends)) for bends in poses]
            # torso and tail that are unlike lose digits by so much
            unlike = max(1.0, disparity(other.model.parameters))
            found += compared(of, name, cases, unlike)
    return found
