"""The C of batch rollouts: many flights by rk4 or tsit5, a lane for each."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...functions.function import assemble
from ...functions.tail import Tail
from ...ir.program import Program, padded
from ...scene.scene import Scene
from ..templating import render
from .batch import STATES, lane_function
from .form import PrintedFunction
from .records import ROLLOUTS, layout, member_views, steps_record
from .routine import CFunction
from .simulation import own_damping
from .views import callee_view, step_views

SLOTS = 10  # states in the workspace: see batch/rollout.c.jinja
LEDGER = 2  # numbers that a flight sums up, stored behind its state


@dataclass(frozen=True)
class BatchRollout:
    """Forward dynamics over lanes of states and of their parameters: its program, and its C."""

    states: int
    program: Program
    body: CFunction
    parameters: int
    size: int
    nt: int

    @property
    def given(self) -> int:
        """Return the position of torques in the workspace: behind the parameters."""
        return self.states * self.parameters

    @property
    def state(self) -> int:
        """Return the position of the states: behind given torques, damping and total torques."""
        return self.given + 3 * self.states * self.nt

    @property
    def inner(self) -> int:
        """Return the position of the workspace of forward dynamics."""
        return padded(self.state + SLOTS * self.states * self.size)

    @property
    def work(self) -> int:
        """Reals of workspace in all."""
        return self.inner + self.body.work


def batch_rollout(
    scene: Scene, tail: Tail, printed: Sequence[PrintedFunction]
) -> BatchRollout | None:
    """Return the batch rollout of a scene with rollout and a free torso, but without contacts."""
    if "rollout" not in scene.functions or scene.contacts or tail.fixed:
        return None
    (dynamics,) = (f.function for f in printed if f.function.name == "forward_dynamics")

    # one state, with parameters of its own; then a lane for each state
    single = assemble(dynamics, tail)
    count = 0 if scene.baked else sum(a.length for a in single.of_role("parameters"))
    lanes = lane_function(scene, single, "forward_dynamics_of_flights")
    size = tail.nq + tail.nv + LEDGER
    return BatchRollout(STATES[scene.real], lanes.program, lanes.body, count, size, tail.nt)


def batch_rollout_file(
    scene: Scene, rollout: BatchRollout | None, context: dict[str, Any]
) -> dict[str, str]:
    """Render the file of a batch rollout, if there is one."""
    if rollout is None:
        return {}
    differing = context | rollout_context(scene, rollout)
    return {f"src/{scene.name}_flights.c": render("c", "batch/rollout.c.jinja", differing)}


def rollout_context(scene: Scene, rollout: BatchRollout) -> dict[str, Any]:
    """Return the values that differ from those of the model's template."""
    # states and torques have their own names; parameters are at the start of the workspace
    arguments, place, places = [], 0, {}
    for array in rollout.program.of_role("input"):
        if array.name in ("q", "v", "tau"):
            arguments.append(array.name)
        else:
            arguments.append(f"own + STATES * {place}")
            places[array.name] = place
            place += array.length

    return {
        "states": rollout.states,
        "widest": rollout.states,
        "lanes_function": callee_view(rollout.program, rollout.body, scene.name),
        "arguments": ", ".join(arguments),
        "runs": f"{scene.name}_side_by_side",  # what explicit methods advance, and lengths of steps
        "lengths": "const real *",
        "method": "run->method",
        "steps_record": member_views(steps_record(0), scene.name),
        "way": "steps",
        "steps_type": "flights",
        "legs": False,
        "bounded": False,
        "damped_in_lanes": damped_in_lanes(scene, places),
        "parameter_count": rollout.parameters,
        "given": rollout.given,
        "state": rollout.state,
        "rollouts_record": member_views(ROLLOUTS, scene.name),
        "inner": rollout.inner,
        "steps": step_views([rollout], scene.real, scene.name),
        "helpers": sorted(rollout.body.helpers | {"lanes", "all_lanes"}),
    }


def damped_in_lanes(scene: Scene, places: dict[str, int]) -> str:
    """Print the tail's own damping of coordinate k, where parameters lie in these places."""
    if scene.baked:
        return f"WIDE({own_damping(scene)}[k])"
    return f"LOAD(own + ({places.get('tail_damping')} + k) * STATES + c)"


def batch_rollout_entry(rollout: BatchRollout | None) -> dict[str, Any]:
    """Return what a loader must know of a batch rollout: states, workspace, record."""
    if rollout is None:
        return {}
    records = {"record": layout(steps_record(0)), "rollouts": layout(ROLLOUTS)}
    return {"flights": {"states": rollout.states, "work": rollout.work} | records}
