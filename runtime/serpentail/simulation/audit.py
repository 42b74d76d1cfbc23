"""Checks whether energy and momentum of a run balance with work and impulses.

Work and impulses are added up inside the integrator, by the same weights as the state, so what does
not balance is an error of the integration.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..basics.short_repr import brief
from ..model.model import Model
from ..model.weight import fall, total_mass, weight_of

# An imbalance relative to what was moved is reported if it exceeds the smaller of the first two,
# with steps of a fixed length the second, and the third. docs/contact.md has measured ones.
TOLERANCES = 100.0  # times a method's relative tolerance
MOST = 0.01  # runs with more are millimetres off, or centimetres
ROUNDINGS = 1e5  # rounding errors
DIFFERENCE = 100.0  # rounding errors of kinetic energies that their difference may contain
TINY = np.finfo(float).tiny  # for bodies that neither move nor weigh anything
BALANCED = ("kinetic", "potential", "linear_momentum")  # values at both ends that an audit needs
WORDS = {  # of warnings; a page that computes tells them, too
    "unbalanced": "{share:.2g} % of what was moved is not accounted for (energy {energy:.2g} J, "
    "momentum {momentum:.2g} N s; expected below {allowed:.2g} %): take a {remedy}",
    "unfelt": "{count} touches were shorter than a step and may have been missed: take a shorter "
    "step, or an adaptive method",
    "near": "{group}: point {point} passed {height:.2g} mm above the ground at t = {time:.4g} s "
    "with an error of {error:.2g} mm: a smaller rtol decides whether it touches",
}
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Audit:
    """Work, impulses, and what they do not explain; arrays have the runs' axis, or none.

    work (J): of torques, damping, the ground on the points, the drives of the legs, loads, the air.
    impulses (..., 3), N s, world: of the ground on each group of points, of loads, the air. energy
    (J) and momentum (..., 3), N s: changes that these and gravity do not explain. relative: the
    larger of both relative to what was moved; in free flights, the energy is that about the centre
    of mass. Where the ends and the net work are small besides the imbalance, what was moved is the
    largest energy of all samples.
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


class Between(NamedTuple):
    """The largest imbalance that is not looked into, and what a function of runs' marks returns.

    It returns energies and momenta at all samples, at least of the runs that are marked.
    """

    allowed: float
    samples: Callable[[np.ndarray], Arrays]


def audited(
    model: Model,
    values: Mapping[str, Any],
    ledger: np.ndarray,
    span: Any,
    ends: Arrays,
    between: Between,
) -> Audit:
    """Return the audit of runs with these parameters and ledgers (..., entries), of a span (s).

    ends, at the start and at the end: kinetic, potential and the part of it that the tail stores
    (..., 2), linear_momentum (..., 2, 3). between: the same at all samples, where it is needed.
    """
    work, impulses = named(model, ledger)
    kinetic, potential, momentum = (ends[name] for name in BALANCED)
    weight = weight_of(values)
    energy = np.diff(kinetic + potential)[..., 0] - sum(work.values())
    pull = fall(values) * (np.asarray(total_mass(values)) * span)[..., None]
    moved = momentum[..., 1, :] - momentum[..., 0, :] - pull - sum(impulses.values())
    moved = 0 * moved if model.fixed else moved  # its base gives a tail any momentum

    worked = sum(np.abs(each) for each in work.values())
    flies = ~np.any([np.any(each != 0, axis=-1) for each in impulses.values()], axis=0)

    def share(seen: Arrays) -> np.ndarray:
        all_of_it = np.abs(energy) / np.fmax(_most_energy(values, seen, weight) + worked, TINY)
        if model.fixed:
            return all_of_it
        lost = _lost_within(values, ends, work)
        within = lost / np.fmax(_most_energy_within(values, seen) + worked, TINY)
        return np.where(flies, within, all_of_it)

    found = share(ends)
    doubtful = found > between.allowed
    if np.any(doubtful):  # from rest to rest, both ends hold nothing
        found = np.where(doubtful, share(between.samples(doubtful)), found)
    momenta = np.linalg.norm(momentum, axis=-1).max(axis=-1) + weight * span
    momenta = momenta + sum(np.linalg.norm(each, axis=-1) for each in impulses.values())
    relative = np.maximum(found, np.linalg.norm(moved, axis=-1) / np.fmax(momenta, TINY))
    return Audit(work, impulses, energy, moved, relative)


def _most_energy(values: Mapping[str, Any], seen: Arrays, weight: np.ndarray) -> np.ndarray:
    """Return the most energy of runs, with what lifts the animal by its tail's length."""
    return _most(seen["kinetic"]) + weight * values["tail_length"] + _most(seen["stored"])


def _most_energy_within(values: Mapping[str, Any], seen: Arrays) -> np.ndarray:
    """Return the most energy of flights about their centre of mass.

    The energy of the fall is larger and would hide an imbalance; the balance of momentum checks the
    fall. Less energy than that of a torso that turns at 1 rad/s counts as that.
    """
    least = 0.5 * np.min(np.asarray(values["torso_inertia"])[..., :3], axis=-1)
    return _most(_inner(values, seen)) + _most(seen["stored"]) + least


def _lost_within(values: Mapping[str, Any], ends: Arrays, work: Arrays) -> np.ndarray:
    """Return the change of that energy without the work; rounding errors do not count."""
    kinetic = ends["kinetic"]
    change = np.diff(_inner(values, ends) + ends["stored"])[..., 0] - sum(work.values())
    rounding = DIFFERENCE * np.finfo(kinetic.dtype).eps * kinetic.max(axis=-1)
    return np.fmax(np.abs(change) - rounding, 0.0)


def _inner(values: Mapping[str, Any], seen: Arrays) -> np.ndarray:
    """Return the kinetic energy about the centre of mass."""
    mass = np.asarray(total_mass(values))[..., None]
    return np.fmax(seen["kinetic"] - np.sum(seen["linear_momentum"] ** 2, axis=-1) / (2 * mass), 0)


def _most(energy: np.ndarray) -> np.ndarray:
    """Return the largest value of each run; samples after its end are nan."""
    return np.fmax.reduce(energy, axis=-1)


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


def allowance(info: Mapping[str, Any], eps: float) -> float:
    """Return the largest relative imbalance that the method of a run explains."""
    tolerance = max(info["rtol"], info["atol"]) if "rtol" in info else np.inf
    return max(min(TOLERANCES * tolerance, MOST), ROUNDINGS * eps)


def warnings_of(audit: Audit, info: Mapping[str, Any], eps: float) -> list[str]:
    """Return warnings about imbalance and missed touches, from the audit and info of one run."""
    found = []
    allowed = allowance(info, eps)
    if not audit.relative <= allowed:
        words = {
            "share": 100 * audit.relative,
            "energy": audit.energy,
            "momentum": np.linalg.norm(audit.momentum),
            "allowed": 100 * allowed,
            "remedy": remedy(info),
        }
        found.append(WORDS["unbalanced"].format(**words))
    if info.get("unfelt"):
        found.append(WORDS["unfelt"].format(count=info["unfelt"]))
    if near := info.get("near"):
        lengths = {name: 1e3 * near[name] for name in ("height", "error")}
        found.append(WORDS["near"].format(**near | lengths))
    return found


def remedy(info: Mapping[str, Any]) -> str:
    """Return what makes a method more exact."""
    return "smaller rtol" if "rtol" in info else "shorter step"
