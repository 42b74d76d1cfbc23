"""The C of batches: functions that a host evaluates for many states, a lane for each state."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from serpentail_scene.signatures.table import AIRBORNE

from ...functions.function import Function, assemble
from ...functions.tail import Tail
from ...ir.cost import applied, branches, executed
from ...ir.program import Program
from ...passes.batch import batched, unrolled_step, with_own_parameters
from ...passes.narrow_directions import directions_in_turn, has_directions
from ...passes.unrolled_ldl import unrolled_ldl
from ...scene.scene import Scene
from ..templating import render
from .form import UNROLLED_ROWS, PrintedFunction, baked_values, in_form, long
from .loops import in_loops
from .routine import CFunction
from .views import ArgumentView, callee_view, quaternion_in, step_views

STATES = {"double": 8, "float": 16}  # side by side: lanes of the widest vector
# nodes of one line; beyond, loops are hardly slower, or a compiler takes more than some seconds
STRAIGHT_UP_TO = 20000
SLOPES_UP_TO = 11000
MOST_APPLIED = 28000  # nodes: longer lines stay too long even without their zeros
# by source file: each file is compiled when it is first needed
PARTS = {
    "batch": ("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics"),
    "batch_derivatives": (
        "inverse_dynamics_derivatives",
        "forward_dynamics_derivatives",
        "inverse_dynamics_vjp",
        "forward_dynamics_jvp",
        "forward_dynamics_vjp",
        "inverse_dynamics_hessian",
    ),
    "batch_airborne": AIRBORNE,
    "batch_contact": ("contact_points", "leg_points", "contact_dynamics"),
}
BATCHED = {name: part for part, names in PARTS.items() for name in names}


@dataclass(frozen=True)
class LaneFunction:
    """A function over lanes of states, and maybe of their own parameters: its program, its C."""

    program: Program
    body: CFunction


@dataclass(frozen=True)
class Batch:
    """One function of a model over lanes of states."""

    function: Function
    lanes: LaneFunction

    @property
    def arguments_work(self) -> int:
        """Reals of workspace for its arguments."""
        program = self.lanes.program
        arguments = (*program.of_role("input"), *program.of_role("output"))
        return sum(a.length * a.row for a in arguments)

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.arguments_work + self.lanes.body.work


def batches(scene: Scene, tail: Tail, printed: Sequence[PrintedFunction]) -> list[Batch]:
    """Return the functions that a host evaluates for many states."""
    return [_batch(scene, tail, f.function) for f in printed if f.function.name in BATCHED]


def _batch(scene: Scene, tail: Tail, function: Function) -> Batch:
    fixed, single = baked_values(scene), of_one_state(scene, tail, function)
    if has_directions(assemble(function, tail)):
        single = _of_directions(scene, single, fixed)
    elif straight(scene, single):
        single = unrolled_step(single, fixed)
    return Batch(function, _in_lanes(scene, single))


def _in_lanes(scene: Scene, single: Program) -> LaneFunction:
    lanes = batched(single, STATES[scene.real])
    return LaneFunction(lanes, in_loops(lanes, scene.real, scene.name, baked_values(scene)))


def of_one_state(scene: Scene, tail: Tail, function: Function) -> Program:
    """Return what lanes of states run: a program whose own lanes are in loops.

    It goes by segments if the scene asks for that, or if that takes fewer operations: with states
    as lanes, no lane of a sweep over segments is free of charge.
    """
    forms = []
    if scene.emission == "segments" or (scene.emission == "auto" and long(tail)):
        form, swept = in_form("segments", function, tail)
        forms = [_in_turn(swept)] if form == "segments" else []
    if not forms or scene.emission == "auto":
        forms.append(_in_turn(assemble(function, tail)))
    return min(forms, key=executed) if len(forms) > 1 else forms[0]


def _in_turn(program: Program) -> Program:
    if not has_directions(program):
        return program
    return directions_in_turn(unrolled_ldl(program, UNROLLED_ROWS))


def _of_directions(scene: Scene, turns: Program, fixed: dict[str, list]) -> Program:
    """Return a program whose directions are in loops, or one straight line if that is short.

    It is never a long straight line: a compiler would work on it for minutes.
    """
    if scene.emission in ("auto", "straight") and applied(turns) <= MOST_APPLIED:
        line = unrolled_step(turns, fixed)
        if executed(line) <= SLOPES_UP_TO:
            return line
    return turns


def straight(scene: Scene, program: Program) -> bool:
    """Tell if a batch has no loops: it has no sweeps in lanes that would be faster."""
    if scene.emission == "auto":
        return applied(program) <= STRAIGHT_UP_TO and not branches(program)
    return scene.emission == "straight"


def lane_function(scene: Scene, single: Program, name: str) -> LaneFunction:
    """Return a program of one state over lanes; name: of the program with its own parameters."""
    if straight(scene, single):
        single = unrolled_step(single, baked_values(scene))
    return _in_lanes(scene, single if scene.baked else with_own_parameters(single, name))


class BatchView:
    """A batch as the template sees it: arguments, the function of their lanes, workspace."""

    def __init__(self, batch: Batch, tail: Tail, prefix: str):
        function = batch.function
        self.name = function.name
        self.lanes_function = callee_view(batch.lanes.program, batch.lanes.body, prefix)
        self.inputs = [ArgumentView(a, tail) for a in function.inputs]
        self.outputs = [ArgumentView(a, tail) for a in function.outputs]
        free = not tail.fixed
        self.quaternion = quaternion_in(function.inputs[0].name, " * STATES") if free else ""
        self.names = ", ".join(a.name for a in self.inputs + self.outputs)
        self.arguments_work = batch.arguments_work


def batch_files(
    scene: Scene, tail: Tail, batches: Sequence[Batch], context: dict[str, Any]
) -> dict[str, str]:
    """Render the files of the batches that the scene has."""
    files = {}
    for part in PARTS:
        here = [batch for batch in batches if BATCHED[batch.function.name] == part]
        if here:
            views = [BatchView(batch, tail, scene.name) for batch in here]
            own = context | lanes_context(scene, [batch.lanes for batch in here])
            own |= {"functions": views}
            files[f"src/{scene.name}_{part}.c"] = render("c", "batch/batch.c.jinja", own)
    return files


def lanes_context(scene: Scene, parts: Sequence[LaneFunction]) -> dict[str, Any]:
    """Return what the template of a file needs for its functions over lanes."""
    helpers = set().union(*(part.body.helpers for part in parts))
    return {
        "states": STATES[scene.real],
        "widest": STATES[scene.real],
        "steps": step_views(parts, scene.real, scene.name),
        "helpers": sorted(helpers | {"lanes", "all_lanes"}),
    }


def batch_entry(scene: Scene, batches: Sequence[Batch]) -> dict[str, Any]:
    """Return what a loader must know of batches: states side by side, workspace, sources."""
    names = [b.function.name for b in batches]
    return {
        "states": STATES[scene.real],
        "work": {b.function.name: b.work for b in batches},
        "parts": {name: BATCHED[name] for name in names},
    }
