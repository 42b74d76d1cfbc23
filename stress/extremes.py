"""Errors and refusals for parameters that are far from those of an animal."""

import numpy as np

from serpentail.basics.plausible_values import disparity
from stress.figures import Figure
from stress.subjects import changed, errors, judged, state, subject

MICROGRAM = 1e-9  # kg
CASES = {
    "links of 1 ug": lambda links: {"tail_mass": links * MICROGRAM},
    "torso of 1 kg, links of 1 ug": lambda links: {
        "torso_mass": 1.0,
        "tail_mass": links * MICROGRAM,
    },
    "torso of 1 kg": lambda links: {"torso_mass": 1.0},
    "torso of 1 mg": lambda links: {"torso_mass": 1e-6, "torso_inertia": (1e-12, 1e-12, 1e-12)},
    "torso of 1 t": lambda links: {"torso_mass": 1e3, "torso_inertia": (1e2, 2e2, 2e2)},
    "tail of 1 t": lambda links: {"tail_mass": 1e3},
    "tail of 1 um": lambda links: {"tail_length": 1e-6},
    "tail of 1 km": lambda links: {"tail_length": 1e3},
    "no gravity": lambda links: {"gravity": 0.0},
    "mount 1 km away": lambda links: {"tail_mount": (1e3, -1e3, 1e3)},
}
LINKS = {
    "zero link inertia": {"link_inertia": (0.0, 0.0, 0.0)},
    "zero link radius": {"link_radius": 0.0},
    "link inertia about one axis": {"link_inertia": (0.0, 1e-9, 0.0)},
}


def cases(size: tuple[int, int | None]) -> dict[str, dict]:
    """Return changes of the parameters by name."""
    pieces = size[0] * (size[1] or 1)
    return {name: made(pieces) for name, made in CASES.items()} | (LINKS if size[1] else {})


def measured() -> list[Figure]:
    """Return the errors of each case, for a bent and a straight tail."""
    rng, found = np.random.default_rng(6), []
    for size in ((1, 1), (1, 3), (3, 4), (1, None), (3, None)):
        of = subject(*size)
        for name, change in cases(size).items():
            other = changed(of, **change)
            bends = [rng.uniform(-1, 1, of.model.nv - 6), np.zeros(of.model.nv - 6)]
            unlike = max(1.0, disparity(other.model.parameters))
            found += judged(
                of, name, [errors(other, *state(other, rng, bend)) for bend in bends], unlike
            )
    return found
