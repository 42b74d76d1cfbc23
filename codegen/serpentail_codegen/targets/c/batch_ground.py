"""The C of steps on the ground: implicit steps of many states, a lane for each state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

from ...functions.catalogue import function_of
from ...functions.function import assemble
from ...functions.tail import Tail, struct_parameters
from ...ir.dataflow import on_arrays
from ...ir.program import Program, padded
from ...scene.scene import Scene
from ..templating import render
from .batch import STATES, LaneFunction, lane_function
from .form import PrintedFunction
from .records import layout, member_views, steps_record
from .views import callee_view, step_views

FUNCTIONS = {"dynamics": "contact_dynamics", "factor": "implicit_factor", "solve": "implicit_solve"}
ABSENT = ("damping", "gains")  # of implicit_factor: none acts in these steps
# rows of the workspace that arguments are in, and the number of rows before them there
ROWS = {
    "q": "q",
    "v": "v",
    "tau": "TAU(work)",
    "bristles": "STATE(work) + STATES * (NQ + NV)",
    "legs": "LEGS(work)",
    "v_dot": "RATES(work)",
    "bristle_rates": "RATES(work) + STATES * NV",
    "forces": "FORCES(work)",
    "weight": "WEIGHT(work)",
    "factors": "FACTORS(work)",
    "r_q": "right",
    "r_v": "right + STATES * NV",
    "r_u": "right + STATES * (NV + NV)",
    "k_q": "found",
    "k_v": "found + STATES * NV",
    "k_u": "found + STATES * (NV + NV)",
}


@dataclass(frozen=True)
class GroundSteps:
    """Implicit steps over lanes of states: their functions by role, and places in the workspace."""

    states: int
    parts: Mapping[str, LaneFunction]
    parameters: int
    rows: tuple[tuple[str, int], ...]  # name and number of rows of each block of the workspace

    @property
    def places(self) -> list[tuple[str, int]]:
        """Return the position of each block, and of the workspace of functions after them."""
        names = [name for name, _ in self.rows]
        ends = accumulate((self.states * count for _, count in self.rows), initial=0)
        *starts, end = ends
        return [*zip(names, starts, strict=True), ("INNER", padded(end))]

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.places[-1][1] + max(part.body.work for part in self.parts.values())


def ground_steps(
    scene: Scene, tail: Tail, printed: Sequence[PrintedFunction]
) -> GroundSteps | None:
    """Return the steps of a scene with contacts, rollout and implicit methods."""
    names = {f.function.name for f in printed}
    if not (scene.contacts and "implicit_factor" in names and "rollout" in scene.functions):
        return None
    parts = {role: _part(scene, tail, name) for role, name in FUNCTIONS.items()}
    count = 0 if scene.baked else sum(p.size for p in struct_parameters(scene))
    size, bristles = tail.nq + tail.nv + tail.bristles, tail.bristles
    rows = (
        ("OWN", count),
        ("STATE", size),
        ("BEFORE", size),
        ("TAU", tail.nt),
        ("POSED", tail.leg_numbers),
        ("LEGS", tail.leg_numbers),
        ("WEIGHT", tail.weights),
        ("RATES", tail.nv + bristles),
        ("FORCES", 3 * tail.points),
        ("FACTORS", tail.factors),
        ("RIGHT", 2 * tail.nv + bristles),
        ("FOUND", 2 * tail.nv + bristles),
    )
    return GroundSteps(STATES[scene.real], parts, count, rows)


def _part(scene: Scene, tail: Tail, name: str) -> LaneFunction:
    """Return a function over lanes."""
    single = _with_zeros(assemble(function_of(name, tail), tail))
    return lane_function(scene, single, f"{name}_of_runs")


def _with_zeros(program: Program) -> Program:
    """Return a program whose absent arguments are zeros."""
    arrays = {
        a.name: replace(a, role="constant", values=(0,) * a.length) if a.name in ABSENT else a
        for a in program.arrays
    }
    body = on_arrays(program.body, arrays)
    return replace(program, arrays=tuple(arrays.values()), body=body)


def ground_file(
    scene: Scene, tail: Tail, steps: GroundSteps | None, context: dict[str, Any]
) -> dict[str, str]:
    """Render the file of steps on the ground, if there is one."""
    if steps is None:
        return {}
    own = context | ground_context(scene, tail, steps)
    return {f"src/{scene.name}_ground.c": render("c", "batch/ground.c.jinja", own)}


def ground_context(scene: Scene, tail: Tail, steps: GroundSteps) -> dict[str, Any]:
    """Return the values that differ from those of the model's template."""
    parts = steps.parts
    views = {r: callee_view(part.program, part.body, scene.name) for r, part in parts.items()}
    helpers = set().union(*(part.body.helpers for part in parts.values()))
    calls = {
        role: {"name": view["name"], "arguments": _arguments(scene, parts[role].program)}
        for role, view in views.items()
    }
    return {
        "states": steps.states,
        "widest": steps.states,
        "record": member_views(steps_record(tail.bristles), scene.name),
        "way": "ground",
        "steps_type": "ground",
        "places": steps.places,
        "legs": tail.leg_numbers > 0,
        "bounded": tail.kind != "articulated",
        "parameter_count": steps.parameters,
        "lanes_functions": list(views.values()),
        "steps": step_views(list(parts.values()), scene.real, scene.name),
        "helpers": sorted(helpers | {"lanes", "all_lanes"}),
        **calls,
    }


def _arguments(scene: Scene, program: Program) -> str:
    """Print the arguments of a function: rows of the workspace."""
    places, place = {}, 0
    for parameter in struct_parameters(scene):
        places[parameter.name] = f"OWN(work) + STATES * {place}"
        place += parameter.size
    arrays = (*program.of_role("input"), *program.of_role("output"))
    return ", ".join(ROWS.get(a.name) or places[a.name] for a in arrays)


def ground_entry(tail: Tail, steps: GroundSteps | None) -> dict[str, Any]:
    """Return what a loader must know of steps on the ground: states, workspace, record."""
    if steps is None:
        return {}
    record = layout(steps_record(tail.bristles))
    return {"ground": {"states": steps.states, "work": steps.work, "record": record}}
