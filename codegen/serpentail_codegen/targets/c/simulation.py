"""What the templates of a simulation lay out: its workspace, its methods and its records."""

from itertools import accumulate
from typing import Any

from ...functions.tail import Tail
from ...scene.scene import Scene
from .records import DESCRIPTIONS, record_views
from .simulation_features import METHODS, SimulationFeatures
from .tableaux import RK4, ROS34PW2, TSIT5, transformed

SLOTS = 11  # states in the workspace: see simulation/workspace.c.jinja
# of simulation/workspace.c.jinja, undefined again where the file ends
MACROS = (
    *("NQ", "NV", "NT", "SIZE", "SLOT", "START", "END", "STAGES", "END_RATE", "TRIAL", "RIGHT"),
    *("TAU", "TABLE", "FORCES", "PRESSURES", "REACHED", "POINTS", "GROUPS", "FACTORS", "INNER"),
)


def simulation_context(
    scene: Scene, tail: Tail, has: SimulationFeatures, works: dict[str, int]
) -> dict[str, Any]:
    """Return what a simulation's templates lay out; ``works``: workspace of each function."""
    single = scene.real == "float"
    size, table = tail.nq + tail.nv + 2 * has.contacts, max(4 * tail.nt, 2 * tail.nv)
    states = SLOTS * size + tail.nt + table + 5 * has.contacts
    return {
        **{name: name + ("f" if single else "") for name in ("pow", "fabs", "ceil")},
        "eps": "FLT_EPSILON" if single else "DBL_EPSILON",
        "has": has,
        "ground_damping": scene.parameters.get("D_n"),  # Eq. 36, where it is folded in
        "group_starts": [0, *accumulate(count for _, count in has.groups)],
        "bristles": 2 * has.contacts,
        "bisections": 40,
        "methods": list(METHODS),
        "macros": MACROS,
        "slots": SLOTS,
        "table": table,
        "rollout_work": states + has.factors + max(works.values()),
        "descriptions": DESCRIPTIONS,
        "records": record_views(scene.name, has),
        "tsit5": TSIT5,
        "rk4": RK4,
        "ros34pw2": transformed(ROS34PW2),
    }
