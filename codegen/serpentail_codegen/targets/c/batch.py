"""The C of batches: emitted functions of a scene go in, the text of the file that evaluates many
states comes out.
"""

from dataclasses import dataclass

from ...functions.function import Function, assemble
from ...functions.tail import Tail
from ...ir.cost import applied, branches
from ...ir.program import Program
from ...passes.batch import batched, unrolled_step
from ...scene.scene import Scene
from ..templating import render
from .form import Emitted, baked_values
from .loops import in_loops
from .routine import CFunction
from .views import ArgumentView, callee_view, step_views

STATES = {"double": 8, "float": 16}  # side by side: lanes of the widest vector
STRAIGHT_UP_TO = (
    10000  # nodes: beyond, loops are hardly slower, and compile in a quarter of the time
)
BATCHED = ("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics")


@dataclass(frozen=True)
class Batch:
    """One function over rows of states: its program, and the C of that."""

    function: Function
    states: int
    program: Program
    body: CFunction

    @property
    def own(self) -> int:
        """Reals of workspace for the rows of its arguments."""
        arguments = (*self.program.of_role("input"), *self.program.of_role("output"))
        return self.states * sum(a.length for a in arguments)

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.own + self.body.work


def batches(scene: Scene, tail: Tail, emitted: list[Emitted]) -> list[Batch]:
    """Return the functions that a host evaluates for many states."""
    return [_batch(scene, tail, e.function) for e in emitted if e.function.name in BATCHED]


def _batch(scene: Scene, tail: Tail, function: Function) -> Batch:
    fixed, single, states = baked_values(scene), assemble(function, tail), STATES[scene.real]
    single = unrolled_step(single, fixed) if straight(scene, single) else single
    rows = batched(single, states)
    return Batch(function, states, rows, in_loops(rows, scene.real, scene.name, fixed))


def straight(scene: Scene, program: Program) -> bool:
    """Return whether a batch has no loops; there are no sweeps in lanes here that would overtake
    straight lines.
    """
    if scene.emission == "auto":
        return applied(program) <= STRAIGHT_UP_TO and not branches(program)
    return scene.emission == "straight"


class BatchView:
    """A batch as the template sees it: its arguments, the function of their rows, their
    workspace.
    """

    def __init__(self, batch: Batch, tail: Tail, prefix: str):
        function = batch.function
        self.name, self.rows = function.name, callee_view(batch.program, batch.body, prefix)
        self.inputs = [ArgumentView(a, tail) for a in function.inputs]
        self.outputs = [ArgumentView(a, tail) for a in function.outputs]
        self.names = ", ".join(a.name for a in self.inputs + self.outputs)
        self.own = batch.own


def batch_file(scene: Scene, tail: Tail, found: list[Batch], context: dict) -> dict[str, str]:
    """Render the file of batches, if there are any."""
    own = {
        "states": STATES[scene.real],
        "widest": STATES[scene.real],
        "functions": [BatchView(b, tail, scene.name) for b in found],
        "steps": step_views(found, scene.real, scene.name),
        "helpers": sorted(set().union(*(b.body.helpers for b in found)) | {"lanes", "everywhere"}),
    }
    return (
        {f"src/{scene.name}_batch.c": render("c", "batch/batch.c.jinja", context | own)}
        if found
        else {}
    )


def batch_entry(scene: Scene, found: list[Batch]) -> dict:
    """Return what a loader must know of the batches: how many states side by side, and each one's
    workspace.
    """
    return {"states": STATES[scene.real], "work": {b.function.name: b.work for b in found}}
