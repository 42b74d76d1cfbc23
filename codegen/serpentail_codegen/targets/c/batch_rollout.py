"""The C of flights: a scene's forward dynamics go in, the text of the file that simulates many
states comes out.
"""

from dataclasses import dataclass

from ...functions.function import assemble
from ...functions.tail import Tail
from ...ir.program import Program, padded
from ...passes.batch import batched, unrolled_step, with_own_parameters
from ...scene.scene import Scene
from ..templating import render
from .batch import STATES, straight
from .form import Emitted, baked_values
from .loops import in_loops
from .routine import CFunction
from .simulation import fields, typed
from .views import callee_view, step_views

RECORD = fields(
    ("parameters", "const real *", "[count][PARAMETERS]"),
    ("q", "const real *", "[count][NQ] start"),
    ("v", "const real *", "[count][NV] start"),
    ("q_out", "real *", "[count][samples][NQ], the start first"),
    ("v_out", "real *", "[count][samples][NV]"),
    ("count", "size_t", "flights, at most STATES"),
    ("samples", "long", "of each"),
    ("damping", "const real *", "[NT] N m s"),
    ("lengths", "const real *", "[steps] (s)"),
    (
        "torques",
        "const real *",
        "[steps][3][NT] (N m) at beginning, middle and end of each step; NULL: none",
    ),
    ("due", "const int *", "[steps] whether a sample follows"),
    ("steps", "long", ""),
    ("pause", "long", "steps of one call"),
    ("work", "real *", "holds the flights between calls"),
    ("step", "long", "steps done"),
    ("done", "long", "samples written"),
)


@dataclass(frozen=True)
class Flights:
    """Forward dynamics over rows of states and of their parameters: its program, and the C of
    that.
    """

    states: int
    program: Program
    body: CFunction
    parameters: int
    size: int
    nt: int

    @property
    def state(self) -> int:
        """Where the states lie in the workspace: behind the parameters."""
        return self.states * self.parameters

    @property
    def inner(self) -> int:
        """Where the workspace of forward dynamics begins."""
        return padded(self.state + self.states * (4 * self.size + self.nt))

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.inner + self.body.work


def flights(scene: Scene, tail: Tail, emitted: list[Emitted]) -> Flights | None:
    """Return the flights of a scene that has a rollout and touches nothing."""
    if "rollout" not in scene.functions or scene.contacts:
        return None
    (single,) = (e for e in emitted if e.function.name == "forward_dynamics")
    fixed, states, single = baked_values(scene), STATES[scene.real], assemble(single.function, tail)
    single = unrolled_step(single, fixed) if straight(scene, single) else single
    own = single if scene.baked else with_own_parameters(single, "forward_dynamics_of_flights")
    rows = batched(own, states)
    count = 0 if scene.baked else sum(a.length for a in single.of_role("parameters"))
    return Flights(
        states,
        rows,
        in_loops(rows, scene.real, scene.name, fixed),
        count,
        tail.nq + tail.nv,
        tail.nt,
    )


def flights_file(scene: Scene, found: Flights | None, context: dict) -> dict[str, str]:
    """Render the file of flights, if there are any."""
    own = {} if found is None else context | _own(scene, found)
    return {f"src/{scene.name}_flights.c": render("c", "batch/rollout.c.jinja", own)} if own else {}


def _own(scene: Scene, found: Flights) -> dict:
    """Return what the template lays out."""
    rows = {"q": "q", "v": "v", "tau": "tau"}
    names, place = [], 0
    for a in found.program.of_role("input"):
        names.append(rows.get(a.name, f"own + STATES * {place}"))
        place += 0 if a.name in rows else a.length
    return {
        "states": found.states,
        "widest": found.states,
        "rows": callee_view(found.program, found.body, scene.name),
        "arguments": ", ".join(names),
        "record": [
            {"type": typed(f.type, scene.name), "name": f.name, "meaning": f.meaning}
            for f in RECORD
        ],
        "parameter_count": found.parameters,
        "state": found.state,
        "inner": found.inner,
        "steps": step_views([found], scene.real, scene.name),
        "helpers": sorted(found.body.helpers | {"lanes", "everywhere"}),
    }


def flights_entry(found: Flights | None) -> dict:
    """Return what a loader must know of flights: how many side by side, their workspace, the
    members of the record.
    """
    members = [[f.name, f.kind] for f in RECORD]
    return (
        {"flights": {"states": found.states, "work": found.work, "record": members}}
        if found
        else {}
    )
