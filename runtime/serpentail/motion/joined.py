"""Joins motions that follow each other to one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from ..basics.attitude import Array
from .given import TENSIONS
from .trajectory import ARRAYS, Trajectory

COUNTS = ("steps", "rejected", "evaluations", "factorisations", "unfelt", "seconds", "cpu_seconds")
BOOKS = ("work_J", "impulse_N_s")


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Return motions of one model, each beginning at the end of the one before, as one motion.

    A sample that two motions share is that of the earlier one. Counts, works and impulses are added
    up. The imbalance is the sum; its relative size is the largest of all parts.
    """
    arrays: dict[str, Any] = {
        name: _end_to_end([getattr(part, name) for part in parts]) for name in ARRAYS
    }
    contact = parts[0].contact
    if contact is not None:
        contacts = [part.contact.arrays for part in parts if part.contact]
        points: dict[str, Any] = {
            name: _end_to_end([each[name] for each in contacts]) for name in contact.arrays
        }
        contact = replace(contact, **points)
    info = _info([part.info for part in parts])
    if any(TENSIONS in part.info for part in parts):
        phases = [p.info.get(TENSIONS, [{"begin": float(p.t[0])}]) for p in parts]
        info[TENSIONS] = [*chain.from_iterable(phases)]
    return replace(parts[0], **arrays, info=info, contact=contact)


@dataclass(frozen=True, eq=False)
class JoinedAgain:
    """What makes each of some joined motions again, when it ended (s), and the sizes of q and v."""

    repeats: Sequence[Any]
    ends: Sequence[float]
    sizes: tuple[int, int]

    def coarser(self, coarse: int) -> Trajectory:
        """Return the motions made again, each from the end of the one before, as one."""
        parts: list[Trajectory] = []
        for again in self.repeats:
            parts.append(again.coarser(coarse, *parts[-1:]))
        return joined(parts)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return q (n, nq) and v (n, nv) at times (n,); where two motions meet, of the earlier."""
        whose = np.searchsorted(self.ends[:-1], times)
        q, v = (np.empty((len(times), size)) for size in self.sizes)
        for k in set(whose.tolist()):
            of_part = whose == k
            q[of_part], v[of_part] = self.repeats[k].at(times[of_part])
        return q, v


def _end_to_end(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Samples one after another, each once."""
    return np.concatenate([arrays[0], *(array[1:] for array in arrays[1:])])


def _info(parts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the info of the parts as that of one run."""
    info = dict(parts[-1])
    for name in COUNTS:
        if name in info:
            info[name] = sum(part.get(name, 0) for part in parts)
    controlled = [part["mpc"] for part in parts if "mpc" in part]
    if controlled:
        info["mpc"] = {  # counts, and a list of flags
            name: sum((each[name] for each in controlled[1:]), controlled[0][name])
            for name in controlled[0]
        }
    if all("events" in part for part in parts):
        info["events"] = [event for part in parts for event in part["events"]]
    info["warnings"] = list(dict.fromkeys(w for part in parts for w in part.get("warnings", [])))
    peaks = [item for part in parts for item in part.get("peaks", {}).items()]
    if peaks:  # sorted by force, so that the largest of each name is kept
        info["peaks"] = dict(sorted(peaks, key=lambda item: item[1][0]))
    if all("imbalance" in part for part in parts):
        for name in BOOKS:
            info[name] = {
                of: np.sum([part[name][of] for part in parts], axis=0).tolist() for of in info[name]
            }
        books = [part["imbalance"] for part in parts]
        info["imbalance"] = {
            "energy_J": sum(each["energy_J"] for each in books),
            "momentum_N_s": np.sum([each["momentum_N_s"] for each in books], axis=0).tolist(),
            "relative": max(each["relative"] for each in books),
        }
    return info
