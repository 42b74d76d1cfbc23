"""The C that advances many runs, a lane for each: flights, and implicit steps on the ground."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

from ...functions.catalogue import function_of
from ...functions.tail import Tail, struct_parameters
from ...ir.dataflow import on_arrays
from ...ir.program import Program, padded
from ...scene.scene import Scene
from ..templating import render
from .batch import STATES, LaneFunction, lane_function, lanes_context, of_one_state
from .form import PrintedFunction
from .records import ROLLOUTS, layout, member_views, steps_record
from .views import callee_view

FUNCTIONS = {"dynamics": "contact_dynamics", "factor": "implicit_factor", "solve": "implicit_solve"}
ABSENT = ("damping", "gains")  # of implicit_factor: none acts in these steps
SLOTS = 10  # states in the workspace of flights: see batch/rollout.c.jinja
# rows of the workspace that arguments are in
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
class BatchRollout:
    """Steps over lanes of states: their functions by role, and places in the workspace."""

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


def batch_rollout(
    scene: Scene, tail: Tail, printed: Sequence[PrintedFunction]
) -> BatchRollout | None:
    """Return what advances runs in lanes, of a scene with rollout and a free torso.

    With contacts it needs implicit methods. Models in air, with prescribed joints or with damped
    stops have none, and trees with damping: theirs is not one array.
    """
    names = {f.function.name for f in printed}
    if "rollout" not in scene.functions or tail.fixed or tail.widths or tail.given:
        return None
    if "stop damping" in tail.passive:
        return None
    if tail.branches and "damping" in tail.passive:
        return None
    if scene.contacts and "implicit_factor" not in names:
        return None
    count = 0 if scene.baked else sum(p.size for p in struct_parameters(scene))
    if not scene.contacts:
        size = tail.nq + tail.nv + 2  # with the works of torques and of damping
        dynamics = of_one_state(scene, tail, function_of("forward_dynamics", tail))
        parts = {"dynamics": lane_function(scene, dynamics, "forward_dynamics_of_flights")}
        torques = [(name, tail.nt) for name in ("GIVEN", "DAMPING", "TAU")]
        rows = (("OWN", count), *torques, ("STATE", SLOTS * size))
        return BatchRollout(STATES[scene.real], parts, count, rows)
    parts = {role: _part(scene, tail, name) for role, name in FUNCTIONS.items()}
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
    return BatchRollout(STATES[scene.real], parts, count, rows)


def _part(scene: Scene, tail: Tail, name: str) -> LaneFunction:
    """Return a function over lanes."""
    single = _with_zeros(of_one_state(scene, tail, function_of(name, tail)))
    return lane_function(scene, single, f"{name}_of_runs")


def _with_zeros(program: Program) -> Program:
    """Return a program whose absent arguments are zeros."""
    arrays = {
        a.name: replace(a, role="constant", values=(0,) * a.length) if a.name in ABSENT else a
        for a in program.arrays
    }
    body = on_arrays(program.body, arrays)
    return replace(program, arrays=tuple(arrays.values()), body=body)


def batch_rollout_file(
    scene: Scene, tail: Tail, runs: BatchRollout | None, context: dict[str, Any]
) -> dict[str, str]:
    """Render the file of runs in lanes, if there is one."""
    if runs is None:
        return {}
    name, template, values = "flights", "rollout", _flights_context
    if scene.contacts:
        name, template, values = "ground", "ground", _ground_context
    parts = list(runs.parts.values())
    own = (
        context
        | lanes_context(scene, parts)
        | {
            "places": runs.places,
            "parameter_count": runs.parameters,
            "bodies": [callee_view(p.program, p.body, scene.name) for p in parts],
            "steps_record": member_views(steps_record(tail.bristles), scene.name),
            "steps_type": name,
            "legs": tail.leg_numbers > 0,
            "bounded": scene.contacts and tail.kind != "articulated",
        }
    )
    own |= values(scene, runs)
    return {f"src/{scene.name}_{name}.c": render("c", f"batch/{template}.c.jinja", own)}


def _flights_context(scene: Scene, runs: BatchRollout) -> dict[str, Any]:
    """Return the values of flights alone."""
    # states and torques have their own names; parameters are at the start of the workspace
    arguments, place, places = [], 0, {}
    for array in runs.parts["dynamics"].program.of_role("input"):
        if array.name in ("q", "v", "tau"):
            arguments.append(array.name)
        else:
            arguments.append(f"own + STATES * {place}")
            places[array.name] = place
            place += array.length
    damping = f"LOAD(own + ({places.get('tail_damping')} + k) * STATES + c)"
    return {
        "way": "steps",
        "arguments": ", ".join(arguments),
        "damped_in_lanes": f"WIDE({scene.name}_tail_damping[k])" if scene.baked else damping,
        "runs": f"{scene.name}_side_by_side",  # what explicit methods advance, and lengths of steps
        "lengths": "const real *",
        "method": "run->method",
        "rollouts_record": member_views(ROLLOUTS, scene.name),
    }


def _ground_context(scene: Scene, runs: BatchRollout) -> dict[str, Any]:
    """Return the values of steps on the ground alone: the calls of their functions."""
    calls = {}
    for role, part in runs.parts.items():
        name = callee_view(part.program, part.body, scene.name)["name"]
        calls[role] = {"name": name, "arguments": _arguments(scene, part.program)}
    return {"way": "ground", **calls}


def _arguments(scene: Scene, program: Program) -> str:
    """Print the arguments of a function: rows of the workspace."""
    places, place = {}, 0
    for parameter in struct_parameters(scene):
        places[parameter.name] = f"OWN(work) + STATES * {place}"
        place += parameter.size
    arrays = (*program.of_role("input"), *program.of_role("output"))
    return ", ".join(ROWS.get(a.name) or places[a.name] for a in arrays)


def batch_rollout_entry(tail: Tail, runs: BatchRollout | None) -> dict[str, Any]:
    """Return what a loader must know of runs in lanes: states, workspace, records."""
    if runs is None:
        return {}
    entry: dict[str, Any] = {"states": runs.states, "work": runs.work}
    entry["record"] = layout(steps_record(tail.bristles))
    if tail.bristles:
        return {"ground": entry}
    return {"flights": entry | {"rollouts": layout(ROLLOUTS)}}
