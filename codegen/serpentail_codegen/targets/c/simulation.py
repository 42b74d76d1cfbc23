"""The values for the templates of a simulation: its workspace, its methods and its records."""

from dataclasses import dataclass
from itertools import accumulate
from typing import Any, cast

from serpentail_scene.keys import LIMBS
from serpentail_scene.parameters import name_in

from ...functions.tail import Tail
from ...scene.scene import Scene
from .records import DESCRIPTIONS, record_views
from .simulation_features import METHODS, SimulationFeatures
from .tableaux import DP8, RK4, ROS34PW2, TSIT5

LOOKS = 24  # parts of parts of a step in which contacts are looked for: up to 2^-23 of it
# heights (m): how exactly the sides of the ground are told apart; depths from which a point counts
# as having entered it; from which on a step must not overlook that
RESOLUTION = {"double": (1e-7, 1e-6, 2e-6), "float": (2e-6, 1e-5, 2e-5)}
TURNED_AT = {  # where along a tail its turn grows, and by what
    "articulated": "at each joint by the segment's rates",
    "continuum": "at each sample by its part of the bend",
    "mixed": "at each joint by the segment's rates, at each sample by its part of the bend",
    **dict.fromkeys(LIMBS, "at each joint"),
}
# ros34pw2's error in flight at one tolerance, over that of tsit5: measured, docs/simulation.md
AIR = 5.0
# s: how long ros34pw2 takes an error of a rate to last in contact; measured: with it, short steps
# after a touch and long ones add equally to the error at the end
LASTING = 1e-3
# states in the workspace, see simulation/workspace.c.jinja: with contacts; without, dp8 has stages
SLOTS = {True: 11, False: 2 + len(DP8.nodes) + 2}
# of simulation/workspace.c.jinja, undefined again where the file ends
MACROS = (
    *("NQ", "NV", "NT", "SIZE", "SLOT", "START", "END", "STAGES", "END_RATE", "TRIAL", "RIGHT"),
    *("TAU", "TABLE", "FORCES", "HEIGHTS", "REACHED", "LOOKS", "BENDS", "OFF", "POINTS", "GROUPS"),
    *("FACTORS", "INNER", "CORE", "LEDGER", "BYTES"),
    *("STATES", "LANES", "lanes", "WIDE", "LOAD", "STORE"),  # of simulation/simulation.c.jinja
)


def own_damping(scene: Scene, tail: Tail) -> str:
    """Print the position of the tail's own damping in a run, of a tree that of all parameters;
    empty if there is none.
    """
    if "damping" not in tail.passive:
        return ""
    if tail.branches:
        return "run->parameters"
    return f"{scene.name}_tail_damping" if scene.baked else "run->parameters->tail_damping"


def motors(scene: Scene) -> list[tuple[str, str, tuple[float, ...]]]:
    """Return what limits the torques of a run's controllers: a name in C, the parameter, values."""
    names = [(n, f"motor_{n}") for n in ("torque", "speed", "power")]
    found = [(n, parameter) for n, parameter in names if parameter in scene.parameters]
    return [(n, p, cast("tuple[float, ...]", scene.parameters[p])) for n, p in found]


def damped_chains(tail: Tail) -> list[tuple[str, int, int]]:
    """Return the damping of coordinate k of each chain of a tree, and its coordinates from which to
    which.
    """
    found = [
        (name_in(c.owner, "tail_damping"), c.coordinates_before, c.coordinates_before + c.nt)
        for c in tail.branches
        if "damping" in c.passive
    ]
    return [(f"{name}[k - {a}]" if b - a > 1 else name, a, b) for name, a, b in found]


def simulation_context(
    scene: Scene, tail: Tail, has: SimulationFeatures, works: dict[str, int]
) -> dict[str, Any]:
    """Return the values for a simulation's templates; ``works``: workspace of each function."""
    single = scene.real == "float"
    ledger = sum(size for _, size in has.ledger)
    table = max(4 * tail.nt, 2 * tail.nv, tail.nt + 3 * tail.tendons)
    size = tail.nq + tail.nv + 2 * has.contacts + ledger
    slots = SLOTS[has.contacts > 0]
    states = slots * size + tail.nt + table + (12 + 2 * LOOKS) * has.contacts + 4
    inner, backward = max(works.values()), (9 * size + 2 * tail.causes) * has.gradients
    resolution, level, felt = RESOLUTION[scene.real]
    return {
        **{name: name + ("f" if single else "") for name in ("pow", "fabs", "ceil")},
        **({"pow": f"{scene.name}_power"} if scene.profile == "reproducible" else {}),
        "eps": "FLT_EPSILON" if single else "DBL_EPSILON",
        "has": has,
        "values": scene.parameters,  # where they are folded in
        # of an index that counts the tail's numbers of q, of v
        "before_q": "" if tail.fixed else "7 + ",
        "before_v": "" if tail.fixed else "6 + ",
        "chains": {chain.group: reach(scene, chain) for chain in tail.chains},
        "ledger": ledger,
        "damped": own_damping(scene, tail),
        "damped_chains": damped_chains(tail),
        "stopped": ["lower", "upper", "width", "damping"] * ("stop damping" in tail.passive),
        "motors": motors(scene),
        "driven": tail.nt,
        "looks": LOOKS,
        "resolution": resolution,
        "level": level,
        "felt": felt,
        "group_starts": [0, *accumulate(count for _, count in has.groups)],
        "bristles": 2 * has.contacts,
        "bisections": 41,
        "methods": METHODS,
        "method": f"{scene.name}_method(run)" if "switching" in has.methods else "run->method",
        "air": AIR,
        "lasting": LASTING,
        "runs": f"{scene.name}_run",  # what explicit methods advance, and the length of its steps
        "lengths": "real ",
        "turns": 1 if tail.kind == "continuum" else tail.links,  # of a tip, for a coordinate
        "macros": MACROS,
        "slots": slots,
        "table": table,
        "inner": inner,
        "most_explicit": 0.6,
        "rollout_work": states + has.factors + inner + backward,
        "descriptions": DESCRIPTIONS,
        "records": record_views(scene.name, has),
        "tsit5": TSIT5,
        "rk4": RK4,
        "dp8": DP8,
        "ros34pw2": ROS34PW2,
    }


@dataclass(frozen=True)
class Lengths:
    """Lengths of links or arcs that have their own: the C array, their parameter, its values."""

    name: str
    parameter: str
    values: tuple[float, ...]


def own_lengths(scene: Scene, owner: str = "") -> list[Lengths]:
    """Return the lengths of a chain's links, arcs or bodies that have their own; a mixed tail has
    both.
    """
    found = []
    for parameter in ("link_lengths", "arc_lengths", "link_tips"):
        if parameter in scene.parameters:
            value = scene.parameters[parameter]
            name = parameter if scene.kind == "mixed" else "lengths"
            values = value if isinstance(value, tuple) else (value,)
            found.append(Lengths(name, name_in(owner, parameter), values))
    return found


@dataclass(frozen=True)
class Reach:
    """How a chain's points may move: where its turn grows; ``part`` of a segment's turn at each
    piece; parameters of mount, length and lengths; how many bodies are before each stretch.
    """

    tail: Tail
    lengths: list[Lengths]

    @property
    def turned_at(self) -> str:
        """Where the turn grows, and by what."""
        return TURNED_AT[self.tail.kind]

    @property
    def part(self) -> float:
        """Part of a segment's turn at each piece."""
        return 1.0 if self.tail.kind == "articulated" else 1 / self.tail.links

    def named(self, parameter: str) -> str:
        """Return the name of one of its parameters."""
        return name_in(self.tail.owner, parameter)

    def hulls(self, prefix: str, rate: str, acceleration: str, first: int, i: str) -> str:
        """Print what bounds rate and acceleration of coordinate ``first + i`` over a step."""
        k = self.tail.coordinates_before + first
        if self.tail.prescribed:
            return f"{rate} = rates[{k} + {i}], {acceleration} = accelerations[{k} + {i}]"
        return f"{prefix}_hulls(run, h, {k + 7} + {i}, &{rate}, &{acceleration})"

    @property
    def bodies(self) -> list[int]:
        """Number of bodies before each stretch of a limb."""
        counts = [0 if s.kind.endswith("bare") else s.stop - s.first for s in self.tail.stretches]
        return list(accumulate(counts, initial=0))


def reach(scene: Scene, chain: Tail) -> Reach:
    """Return how the points of a chain may move."""
    return Reach(chain, own_lengths(scene.parts[chain.owner], chain.owner))
