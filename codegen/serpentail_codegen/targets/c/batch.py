"""The C of batches: functions that a host evaluates for many states, a lane for each state."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...functions.function import Function, assemble
from ...functions.tail import Tail
from ...ir.cost import applied, branches
from ...ir.program import Program
from ...passes.batch import batched, unrolled_step
from ...scene.scene import Scene
from ..templating import render
from .form import PrintedFunction, baked_values
from .loops import in_loops
from .routine import CFunction
from .views import ArgumentView, callee_view, step_views

STATES = {"double": 8, "float": 16}  # side by side: lanes of the widest vector
# nodes: beyond, loops are hardly slower, and compile in a quarter of the time
STRAIGHT_UP_TO = 10000
BATCHED = ("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics")


@dataclass(frozen=True)
class Batch:
    """One function over lanes of states: its program, and the C of that."""

    function: Function
    states: int
    program: Program
    body: CFunction

    @property
    def arguments_work(self) -> int:
        """Reals of workspace for its arguments."""
        arguments = (*self.program.of_role("input"), *self.program.of_role("output"))
        return self.states * sum(a.length for a in arguments)

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.arguments_work + self.body.work


def batches(scene: Scene, tail: Tail, printed: Sequence[PrintedFunction]) -> list[Batch]:
    """Return the functions that a host evaluates for many states."""
    return [_batch(scene, tail, f.function) for f in printed if f.function.name in BATCHED]


def _batch(scene: Scene, tail: Tail, function: Function) -> Batch:
    fixed, single, states = baked_values(scene), assemble(function, tail), STATES[scene.real]
    single = unrolled_step(single, fixed) if straight(scene, single) else single
    lanes = batched(single, states)
    return Batch(function, states, lanes, in_loops(lanes, scene.real, scene.name, fixed))


def straight(scene: Scene, program: Program) -> bool:
    """Tell if a batch has no loops: it has no sweeps in lanes that would be faster than these."""
    if scene.emission == "auto":
        return applied(program) <= STRAIGHT_UP_TO and not branches(program)
    return scene.emission == "straight"


class BatchView:
    """A batch as the template sees it: arguments, the function of their lanes, workspace."""

    def __init__(self, batch: Batch, tail: Tail, prefix: str):
        function = batch.function
        self.name, self.lanes_function = (
            function.name,
            callee_view(batch.program, batch.body, prefix),
        )
        self.inputs = [ArgumentView(a, tail) for a in function.inputs]
        self.outputs = [ArgumentView(a, tail) for a in function.outputs]
        self.names = ", ".join(a.name for a in self.inputs + self.outputs)
        self.arguments_work = batch.arguments_work


def batch_file(
    scene: Scene, tail: Tail, batches: Sequence[Batch], context: dict[str, Any]
) -> dict[str, str]:
    """Render the file of batches, if there are any."""
    if not batches:
        return {}
    helpers = set().union(*(batch.body.helpers for batch in batches))
    differing = {
        "states": STATES[scene.real],
        "widest": STATES[scene.real],
        "functions": [BatchView(batch, tail, scene.name) for batch in batches],
        "steps": step_views(batches, scene.real, scene.name),
        "helpers": sorted(helpers | {"lanes", "all_lanes"}),
    }
    return {f"src/{scene.name}_batch.c": render("c", "batch/batch.c.jinja", context | differing)}


def batch_entry(scene: Scene, batches: Sequence[Batch]) -> dict[str, Any]:
    """Return what a loader must know of batches: their states side by side, their workspace."""
    return {"states": STATES[scene.real], "work": {b.function.name: b.work for b in batches}}
