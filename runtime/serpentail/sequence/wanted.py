"""What a leap shall keep and reach, and how far a motion is from that."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import acos, degrees
from typing import Any

from ..basics.checks import number, one_of, refusal
from ..basics.errors import SimulationError
from ..motion.landing import MIN_SHARE, MIN_UPRIGHT

UNITS = {"push": "", "landing": "", "spin": "kg m^2/s", "tilt": "rad", "leg_rate": "rad/s"}
NAMES = {"limits": (*UNITS, "torque"), "goal": ("rise", "standing")}
BEST = ("rise", "softness", "spin")  # what may be made as large, or as small, as it can be
PAID = 10.0  # weight, in the cost, of a share beyond MARGIN; what is to be best has about 1
EVEN = 0.1  # of the mean square of all shares, if nothing is to be best
ENOUGH = 0.1  # cost of what keeps all margins and is not best
MARGIN = 0.9  # share of a limit that a search keeps
NEARLY = 0.99  # the same of a rise: less than its goal by a hair more
HIGHER = 1.1  # times its goal, to which a rise is kept unless it is to be best
MISS = 0.1  # rad, of a flight's goal, which a plan mends
UPRIGHT = degrees(acos(MIN_UPRIGHT))  # deg, of a torso that stands


@dataclass(frozen=True)
class Wanted:
    """Limits (body weights, kg m^2/s, rad, rad/s; the least rise, m), whether to stand, what is
    best. A *share* is a measure over its limit: 1 is the limit, also of a rise.
    """

    limits: Mapping[str, float]
    standing: bool
    best: str | None

    def shares(self, measures: Mapping[str, float]) -> dict[str, float]:
        """Return the shares of those measures that have a limit."""
        found = {name: measures[name] / x for name, x in self.limits.items() if name in measures}
        return found | ({"rise": 2 - found["rise"]} if "rise" in found else {})

    def cost(self, measures: Mapping[str, float]) -> float:
        """Return what a search makes small: shares beyond the margin, then what is to be best, by
        default the mean square of all shares.
        """
        shares = self.shares(measures)
        if self.standing and "lean" in measures:
            shares["lean"] = measures["lean"] / UPRIGHT
            shares["carried"] = 2 - measures["carried"] / MIN_SHARE
        if "miss" in measures:
            shares["miss"] = measures["miss"] / MISS
        if "rise" in shares and self.best != "rise":  # higher than needed, it lands harder
            shares["too high"] = (2 - shares["rise"]) / HIGHER
        margins = dict.fromkeys(shares, MARGIN) | {"rise": NEARLY, "too high": 1.0}
        cost = PAID * sum(max(0.0, share - margins[name]) for name, share in shares.items())
        if self.best is None:
            return cost + EVEN * sum(share**2 for share in shares.values()) / max(len(shares), 1)
        worse = {
            "rise": -measures.get("rise", 0.0),
            "spin": 1e3 * measures.get("spin", 0.0),
            "softness": 0.02 * max(measures.get(name, 0.0) for name in ("push", "landing")),
        }
        return cost + worse[self.best]


def wanted_of(limits: Any, goal: Any, best: Any) -> Wanted:
    """Return checked limits and goals; SimulationError names what is wrong."""
    checked = {}
    for where, given in (("limits", limits), ("goal", goal)):
        if not isinstance(given, Mapping):
            raise refusal(where, given, "a mapping, such as {'push': 25}", SimulationError)
        for name, value in given.items():
            one_of(f"{where}: name", name, NAMES[where], SimulationError)
            if name in ("standing", "torque") or (name == "rise" and value is None):
                continue
            least = {"least": 1.0} if name in ("push", "landing") else {"above": 0.0}
            unit = UNITS.get(name, "m")
            checked[name] = number(f"{where}.{name}", value, SimulationError, unit=unit, **least)
    standing = goal.get("standing", True)
    if not isinstance(standing, bool):
        raise refusal("goal.standing", standing, "True or False", SimulationError)
    if best is not None:
        one_of("best", best, BEST, SimulationError)
    return Wanted(checked, standing, best)
