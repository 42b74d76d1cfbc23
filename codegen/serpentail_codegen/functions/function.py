"""The functions a scene can ask for: a tail's sizes go in, the loop nest of each function comes
out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import prod

from ..ir.program import Array, Program
from ..scene.parameters import Parameter
from ..scene.resolve import parameters_of
from ..scene.scene import Scene
from .draft import Draft
from .tail import Tail


@dataclass(frozen=True)
class Argument:
    """One array argument of a function: its shape from the tail's sizes, and what it means."""

    name: str
    shape: Callable[[Tail], tuple[int, ...]]
    meaning: str

    def length(self, tail: Tail) -> int:
        """Number of scalars."""
        return prod(self.shape(tail))


@dataclass(frozen=True)
class Function:
    """A function that a scene can ask for: name, arguments, and how to assemble it."""

    name: str
    doc: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    assemble: Callable[[Draft, dict[str, Array]], None]

    def of(self, tail: Tail) -> "Function":
        """Return this function with the arguments that a tail has: those of a length."""
        inputs, outputs = (
            tuple(a for a in some if a.length(tail)) for some in (self.inputs, self.outputs)
        )
        return replace(self, inputs=inputs, outputs=outputs)


def struct_parameters(model: Tail | Scene) -> tuple[Parameter, ...]:
    """Return the parameters that the functions of a model read: the fields of its struct."""
    return tuple(p for p in parameters_of(model.kind, model.contacts) if p.name != "link_radius")


@cache
def assemble(function: Function, tail: Tail, dynamics: str = "composite") -> Program:
    """Assemble one function for given sizes; other ``dynamics`` where vectors hold several numbers
    and tails are long.

    What they do not apply to is the same in all.
    """
    dynamics = dynamics if tail.kind == "articulated" else "composite"
    draft = Draft(function.name, function.doc, tail=tail, dynamics=dynamics)
    for parameter in struct_parameters(tail):
        draft.known[parameter.name] = draft.array(
            parameter.name, parameter.size, role="parameters"
        )[0]
    arrays = {a.name: draft.array(a.name, a.length(tail), role="input") for a in function.inputs}
    arrays |= {a.name: draft.array(a.name, a.length(tail), role="output") for a in function.outputs}
    draft.known |= {a.name: arrays[a.name][0] for a in function.inputs}
    if "q" in arrays:
        draft.known |= {"p": arrays["q"].part(0, 3), "quaternion": arrays["q"].part(3, 4)}
    if "v" in arrays:
        draft.known |= {"p_dot": arrays["v"].part(0, 3), "omega": arrays["v"].part(3, 3)}
    function.assemble(draft, arrays)
    return draft.finish()
