"""The models that tests share: each has all functions, and is generated and compiled once.

A test asks for one by name: ``zoo.model("m1_n3")``.  It takes another size only where the size is
its point.  ``python -m tests.support.zoo`` makes all of them, side by side, with ``--quick`` those
of quick tests; a run of few tests makes those that it asks for.
"""

import argparse
import gc
import os
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.scene import Scene
from serpentail_scene.signatures.table import AIRBORNE, NEEDS, VALUES
from tests.support import models
from tests.support.bodies import CHAINS, LIMBS, MIXED, OWN_ARCS, OWN_LINKS, TOUCHING

GROUND = {"contacts": ["feet", "tail", "torso"]}
FLYING = [*(name for name in VALUES if name not in NEEDS), "rollout"]
FEW = ["mass_matrix", "forward_dynamics", "energy", "contact_dynamics"]
FEW += ["pfl", "rollout", "implicit"]
# derivatives of flight are those of the same tail without contact
LANDING = [*FLYING, "contact_points", "leg_points", "contact_dynamics", "pfl", "implicit"]
STANDING = ["mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics", "energy"]
STANDING += ["momentum", "contact_points", "contact_dynamics", "rollout", "implicit"]
PUSHED = ["mass_matrix", "forward_dynamics", "forward_dynamics_external", "energy", "momentum"]
PUSHED += ["rollout", "loads"]
TAPED = [*STANDING, "gradients"]
TAPED_AIR = ["rollout", "energy", "momentum", "gradients"]
# what differs from coordinate to coordinate shows an exchange of two of them
ELASTIC = {
    "tail_stiffness": [0.004, 0.006, 0.005, 0.003],
    "tail_rest": [0.15, -0.1, 0.2, 0.05],
    "tail_damping": [2e-4, 3e-4, 1e-4, 4e-4],
    "tail_stop_lower": [-0.5, -0.4, -0.6, -0.45],
    "tail_stop_upper": [0.6, 0.5, 0.4, 0.55],
    "tail_stop_stiffness": [0.05, 0.04, 0.06, 0.03],
}
MOTORS = {"motor_torque": "3 mN m", "motor_speed": [14, 10], "motor_power": "4 mW"}
MOTORS |= {"tail_rotor": "20, 30 g cm2"}
# faster than e, and across a wind; widths by the number of links and arcs
AIR = {
    "air_density": 1.2,
    "wind": [1.0, 2.0, -0.5],
    "tail_drag": [1.1, 0.05],
    "torso_drag": "11, 6, 13 cm2",
    "torso_drag_turning": [3e-8, 1e-8, 2e-8],
    "torso_air_damping": [1e-6, 2e-6, 3e-6],
}
TAIL_IN_AIR = {n: AIR[n] for n in ("air_density", "wind", "tail_drag")}
WIDTHS = [6, 10, 20, 8, 4, 7, 9, 12]  # mm
RING = {"ring": {"count": 3, "radius": 0.004, "tension": 5}}
TAPERING = {
    "left": {"offset": "4, 1 mm", "end_offset": "2, 1 mm", "root": "5 mm", "tension": "4 N"},
    "up": {"offset": "-1, 4 mm", "root": "3 mm", "tension": 5, "guides": 0.7, "to": 2},
    "low": {"offset": "0, -4 mm", "end_offset": "1, -2 mm", "root": 0, "tension": 3, "to": 1},
}
TORSO = {"torso_mass": 0.11, "torso_inertia": [7e-5, 4e-5, 7.5e-5]}
MOUNTED = {"tail_mount": [0.002, -0.04, 0], "mount_angles": [0.3, -0.6, 0.9]}


def _links(segments: int, links: int, **keys: Any) -> dict[str, Any]:
    """Return the scene of a tail of equal links."""
    return {"kind": "articulated", "segments": segments, "links": links, **keys}


def _arcs(segments: int, **keys: Any) -> dict[str, Any]:
    """Return the scene of a tail of equal arcs."""
    return {"kind": "continuum", "segments": segments, **keys}


def widths(pieces: int) -> dict[str, str]:
    """Return widths of a tail of so many links and arcs."""
    return {"tail_widths": f"{', '.join(map(str, WIDTHS[: pieces + 1]))} mm"}


def _own(kind: str, segments: list, **keys: Any) -> dict[str, Any]:
    """Return the scene of a tail whose segments differ, on a tilted mount."""
    samples = {} if kind == "articulated" else {"samples": 3}
    return {"kind": kind, "segments": segments, "parameters": TORSO | MOUNTED, **samples, **keys}


ZOO: dict[str, dict[str, Any]] = {
    # tails of links, in the form that the generator chooses
    "m1_n1": _links(1, 1),
    "m1_n3": _links(1, 3),
    "m2_n2": _links(2, 2),
    "m3_n4": _links(3, 4),
    # every form of one tail
    "straight": _links(2, 2, emission="straight"),
    "loops": _links(2, 2, emission="loops"),
    "lanes": _links(2, 2, emission="lanes"),
    "segments": _links(2, 2, emission="segments"),
    # whose joints turn by unequal shares
    "ratios": _links(2, 2, parameters={"joint_ratios": [1.0, 0.6, -0.5, 1.3]}),
    # tails of arcs
    "arcs1": _arcs(1),
    "arcs2": _arcs(2),
    "arcs3": _arcs(3),
    "arcs2_loops": _arcs(2, emission="loops"),
    "polar": _arcs(1, coordinates="polar", functions=FLYING),  # it has no others
    # segments that differ, on a tilted mount
    "own_links": _own("articulated", OWN_LINKS),
    "own_arcs": _own("continuum", OWN_ARCS),
    "mixed": _own("mixed", MIXED),
    # springs, damping and stops
    "elastic": _links(2, 2, parameters=ELASTIC),
    "damped_stops": _links(2, 2, parameters=ELASTIC | {"tail_stop_damping": [2e-3, 0, 1e-3, 3e-3]}),
    "elastic_arcs": _arcs(2, parameters=ELASTIC),
    "elastic_ground": _links(2, 2, parameters=ELASTIC, functions=LANDING, **GROUND),
    # motors that a run meets the limits of
    "motors": _links(1, 3, parameters=MOTORS),
    # in air
    "air": _links(2, 2, parameters=AIR | widths(4)),
    "air_mixed": _own("mixed", MIXED, parameters=TORSO | MOUNTED | AIR | widths(7)),
    "air_fixed": _links(2, 2, base="fixed", parameters=TAIL_IN_AIR),
    "air_arc": _arcs(1, functions=["air_force"], parameters=AIR | widths(1)),
    "air_ground": _links(1, 3, parameters=AIR, functions=["air_force", *LANDING], **GROUND),
    # pulled by tendons, whose guides are alike, or of links of their own and to some segments
    "tendons": _links(2, 2, tendon=RING),
    "tendons_own": _own("articulated", OWN_LINKS, tendon=TAPERING),
    "tendons_arcs": _arcs(2, tendon=RING),
    # on the ground
    "ground_m1_n1": _links(1, 1, **GROUND),
    "ground": _links(1, 3, **GROUND),
    "ground_m2_n2": _links(2, 2, functions=LANDING, **GROUND),
    "ground_arcs": _arcs(2, functions=LANDING, **GROUND),
    "ground_mixed": _own("mixed", MIXED, functions=LANDING, **GROUND),
    "feet": _links(1, 3, functions=LANDING, contacts=["feet"]),
    "feet_tail": _links(1, 3, functions=LANDING, contacts=["feet", "tail"]),
    "smooth": _links(1, 3, friction="smooth", functions=LANDING, **GROUND),
    "paper": _links(1, 3, friction="paper", functions=LANDING, **GROUND),
    # a torso that never moves
    "fixed": _links(2, 2, base="fixed"),
    "fixed_arcs": _arcs(2, base="fixed"),
    "fixed_mixed": _own("mixed", MIXED, base="fixed", parameters=MOUNTED),
    # several chains
    "tree": _own("articulated", OWN_LINKS[:2], chain=CHAINS),
    "limbs": _own("articulated", OWN_LINKS[1:2], chain=LIMBS),
    "tree_ground": _own(
        "articulated", OWN_LINKS[1:2], functions=[*STANDING, "pfl", "tail_points"], **TOUCHING
    ),
    # with forces from outside, which other models get when they are asked for them
    "pushed": _links(1, 3, functions=[*PUSHED, "pfl"]),
    "pushed_fixed": _links(1, 2, base="fixed", functions=[*PUSHED[:2], *PUSHED[3:]]),
    "pushed_limbs": _own("mixed", MIXED[:2], functions=PUSHED, chain=LIMBS),
    "pushed_ground": _links(
        1,
        3,
        contacts=["feet"],
        functions=[*PUSHED, "contact_points", "contact_dynamics", "implicit"],
    ),
    # other gravity
    "slope": _links(1, 3, slope={"angle": "25 deg", "toward": "-x"}, contacts=["torso"]),
    # other numbers
    "weightless": _links(1, 3, weightless=True),
    "single": _links(2, 2, real="float"),
    "single_ground": _links(1, 3, real="float", functions=[*LANDING, *AIRBORNE], **GROUND),
    "baked": _links(1, 3, baked=True),
    # the same bits everywhere; the second is small, for many compilers, emulators and watchers
    "reproducible": _links(1, 3, profile="reproducible", **GROUND),
    "small": _links(1, 1, real="float", profile="reproducible", emission="loops", functions=FEW)
    | GROUND,
    # whose runs have gradients, which other models get when they are asked for them
    "taped": _links(1, 3, contacts=["feet"], functions=TAPED),
    "taped_m2_n2": _links(2, 2, functions=TAPED, **GROUND, parameters={"tail_damping": 1e-3}),
    "taped_air": _links(1, 1, functions=TAPED_AIR, parameters=AIR | widths(1)),
    # it lacks all that a test wants to miss
    "bare": _links(1, 1, functions=["forward_dynamics"]),
}
# which slow tests alone ask for
SLOW = {"straight", "lanes", "arcs3", "own_arcs", "air_mixed", "air_ground"}
SLOW |= {"ground_mixed", "fixed_arcs"}


def scene(name: str, **changes: Any) -> Scene:
    """Return the scene of a model by its name, with some keys changed."""
    return parse_scene({"functions": "all"} | ZOO[name] | changes, name)


def folder(name: str) -> Path:
    """Return the generated folder of a model by its name."""
    return models.folder_of(scene(name))


@cache
def model(name: str) -> st.Model:
    """Return a compiled model by its name; tests share it."""
    return own(name)


def own(name: str) -> st.Model:
    """Return a model that no other test has: it has no lanes yet, and no run waits for it."""
    return st.load(folder(name))


def make(names: list[str], jobs: int) -> None:
    """Generate and compile models, side by side."""
    context = get_context("fork")
    # a search for cycles takes a sixth of a generation, and finds none
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=gc.disable) as pool:
        for _ in pool.map(_made, names):
            pass


def _made(name: str) -> None:
    model(name)


def main() -> None:
    """Make all models."""
    parser = argparse.ArgumentParser(description=__doc__)
    told = "those of quick tests, without optimisation unless CC is set"
    parser.add_argument("--quick", action="store_true", help=told)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="models at the same time")
    options = parser.parse_args()
    models.choose_compiler(options.quick)
    begun = time.monotonic()
    names = [name for name in ZOO if not options.quick or name not in SLOW]
    make(names, options.jobs)
    print(f"{len(names)} models for tests: {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
