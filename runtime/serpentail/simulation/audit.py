"""Whether a run's books balance: energy against work, momentum against impulses.

Work and impulses are added up inside the integrator, by the same weights as the state, so what does
not balance is an error of the integration.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..brief import brief
from ..model.model import Model
from ..model.parameters import total_mass

# An imbalance over what was moved is reported from so many times a method's relative tolerance on,
# from so many roundings on, and where steps are fixed from this part on: docs/contact.md has what
# runs come to.
TOLERANCES = 100.0
ROUNDINGS = 1e5
FIXED_STEPS = 0.05
DIFFERENCE = 100.0  # roundings of kinetic energies that may be left of their difference
TINY = np.finfo(float).tiny  # where nothing moves, and nothing weighs
BALANCED = ("kinetic", "potential", "linear_momentum")  # what an audit needs of both ends
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Audit:
    """The books of runs; arrays have the leading axis of the runs, or none.

    work (J) of torques, damping, the ground on what touches it, and the drives of the legs;
    impulses (..., 3) in N s, world, of the ground on each group of points; energy (J) and momentum
    (..., 3) in N s: what changed without these and gravity; relative: the larger of both over what
    was moved, in flights the energy about the centre of mass.
    """

    work: Arrays
    impulses: Arrays
    energy: np.ndarray
    momentum: np.ndarray
    relative: np.ndarray
    __repr__ = brief

    def of(self, k: int) -> "Audit":
        """Return the books of run k."""
        work = {name: each[k] for name, each in self.work.items()}
        impulses = {name: each[k] for name, each in self.impulses.items()}
        return Audit(work, impulses, self.energy[k], self.momentum[k], self.relative[k])

    def info(self) -> dict[str, Any]:
        """What a trajectory's info says of a single run."""
        return {
            "work_J": {name: float(work) for name, work in self.work.items()},
            "impulse_N_s": {name: each.tolist() for name, each in self.impulses.items()},
            "imbalance": {
                "energy_J": float(self.energy),
                "momentum_N_s": self.momentum.tolist(),
                "relative": float(self.relative),
            },
        }


def audited(
    model: Model, values: Mapping[str, Any], ledger: np.ndarray, span: Any, ends: Arrays
) -> Audit:
    """Return the audit of runs with these parameters and ledgers (..., entries), of a span (s).

    ends, at the start and at the end: kinetic, potential and the part of it that the tail stores
    (..., 2), linear_momentum (..., 2, 3).
    """
    work, impulses = named(model, ledger)
    kinetic, potential, momentum = (
        ends[name] for name in ("kinetic", "potential", "linear_momentum")
    )
    weight = np.asarray(total_mass(values)) * values["gravity"]
    energy = np.diff(kinetic + potential)[..., 0] - sum(work.values())
    pull = np.zeros((*energy.shape, 3))
    pull[..., 2] = -weight * span
    moved = momentum[..., 1, :] - momentum[..., 0, :] - pull - sum(impulses.values())
    moved = 0 * moved if model.fixed else moved  # its base gives a tail any momentum

    # over what was moved, an animal at rest by its weight
    stored = ends["stored"]
    worked = sum(np.abs(each) for each in work.values())
    energies = kinetic.max(axis=-1) + weight * values["tail_length"] + stored.max(axis=-1) + worked
    share = np.abs(energy) / np.fmax(energies, TINY)
    if not model.fixed:
        flies = ~np.any([np.any(each != 0, axis=-1) for each in impulses.values()], axis=0)
        share = np.where(flies, _within(values, kinetic, momentum, stored, work), share)
    momenta = np.linalg.norm(momentum, axis=-1).max(axis=-1) + weight * span
    momenta = momenta + sum(np.linalg.norm(each, axis=-1) for each in impulses.values())
    relative = np.maximum(share, np.linalg.norm(moved, axis=-1) / np.fmax(momenta, TINY))
    return Audit(work, impulses, energy, moved, relative)


def _within(
    values: Mapping[str, Any],
    kinetic: np.ndarray,
    momentum: np.ndarray,
    stored: np.ndarray,
    work: Arrays,
) -> np.ndarray:
    """Return the imbalance of a flight's energy about its centre of mass, over that energy.

    The energy of the fall, which the momentum audits, would hide it.
    """
    fall = np.sum(momentum**2, axis=-1) / (2 * np.asarray(total_mass(values))[..., None])
    inner = np.fmax(kinetic - fall, 0.0)
    change = np.abs(np.diff(inner + stored)[..., 0] - sum(work.values()))
    # roundings of the difference, and a torso that turns at 1 rad/s: less is next to nothing
    change = np.fmax(change - DIFFERENCE * np.finfo(kinetic.dtype).eps * kinetic.max(axis=-1), 0.0)
    least = 0.5 * np.min(np.asarray(values["torso_inertia"])[..., :3], axis=-1)
    moved = inner.max(axis=-1) + stored.max(axis=-1) + sum(np.abs(each) for each in work.values())
    return change / np.fmax(moved + least, TINY)


def named(model: Model, ledger: np.ndarray) -> tuple[Arrays, Arrays]:
    """Return works (...,) and impulses (..., 3) of a ledger by their names."""
    works, impulses, first = {}, {}, 0
    for name, size in model.manifest["simulation"]["ledger"]:
        if size == 1:
            works[name] = ledger[..., first].astype(float)
        else:
            impulses[name] = ledger[..., first : first + size].astype(float)
        first += size
    return works, impulses


def warnings_of(audit: Audit, info: Mapping[str, Any], eps: float) -> list[str]:
    """Say what does not balance, and which touches were not felt; audit and info of one run."""
    found = []
    allowed, remedy = FIXED_STEPS, "take a shorter step"
    if "rtol" in info:
        allowed = max(TOLERANCES * max(info["rtol"], info["atol"]), ROUNDINGS * eps)
        remedy = "take a smaller rtol"
    if not audit.relative <= allowed:
        found.append(
            f"{100 * audit.relative:.2g} % of what was moved is not accounted for (energy "
            f"{audit.energy:.2g} J, momentum {np.linalg.norm(audit.momentum):.2g} N s; expected "
            f"below {100 * allowed:.2g} %): {remedy}"
        )
    if info.get("unfelt"):
        found.append(
            f"{info['unfelt']} touches were shorter than a step and may not have been felt: take a "
            "shorter step, or an adaptive method"
        )
    return found
