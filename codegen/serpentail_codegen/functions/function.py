"""A function together with its assembly: the code that builds its program for a tail."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

from serpentail_scene.signatures.arguments import GIVEN, GIVEN_TORQUES, Argument
from serpentail_scene.signatures.table import SIGNATURES

from ..ir.program import Array, Program
from .draft import Draft
from .tail import Tail, struct_parameters

Assembly = Callable[[Draft, dict[str, Array]], object]


# what arguments mean on a fixed base: they are those of the tail alone
FIXED_MEANINGS = {
    "q": "tail coordinates (rad)",
    "v": "rates of the tail coordinates (rad/s)",
    "v_dot": "accelerations of the tail coordinates (rad/s^2)",
    "force": "generalised forces on the tail coordinates (N m)",
    "linear": "linear momentum of the tail (kg m/s, world)",
    "angular": "angular momentum of the tail about its own centre of mass (kg m^2/s, world)",
    "position": "position of the tail's centre of mass (m, world)",
    "velocity": "velocity of the tail's centre of mass, J v (m/s, world)",
    "J": "Jacobian of the tail's centre of mass, world",
    "r_q": "right-hand side for q",
    "k_q": "solution for q",
}


@dataclass(frozen=True)
class Function:
    """A function of a model, or one that other functions call: name, arguments, and assembly."""

    name: str
    doc: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    assemble: Assembly

    def of(self, tail: Tail) -> "Function":
        """Return this function with those of its arguments that are not empty for this tail; what
        depends on q depends on prescribed joints, too.
        """
        meanings = FIXED_MEANINGS if tail.fixed else {}
        known = (GIVEN,) * any(a.name == "q" for a in self.inputs)
        torques = (GIVEN_TORQUES,) * (self.name == "inverse_dynamics")
        inputs, outputs = (
            tuple(
                replace(a, meaning=meanings.get(a.name, a.meaning))
                for a in arguments
                if a.length(tail)
            )
            for arguments in (self.inputs + known, self.outputs + torques)
        )
        return replace(self, inputs=inputs, outputs=outputs)


def signed(assemblies: Mapping[str, Assembly]) -> dict[str, Function]:
    """Join assemblies with the signatures of the same names."""
    functions = {}
    for name, assembly in assemblies.items():
        s = SIGNATURES[name]
        functions[name] = Function(name, s.doc, s.inputs, s.outputs, assembly)
    return functions


@cache
def assemble(function: Function, tail: Tail, dynamics: str = "composite") -> Program:
    """Assemble one function for given sizes.

    ``dynamics`` chooses another algorithm for long tails where vectors hold several numbers;
    functions that it does not apply to stay the same.
    """
    # only a free tail alone has other forms, without rotors, whose joints turn alike
    odd = tail.shape.ratios or "rotor" in tail.passive
    others = odd or tail.fixed or tail.polar or tail.branches
    if dynamics == "segments" and tail.widths:  # they know no air
        dynamics = "lanes"
    if others or (dynamics == "lanes" and tail.kind != "articulated"):
        dynamics = "composite"
    draft = Draft(function.name, function.doc, tail=tail, dynamics=dynamics)
    # parameters first, then arguments: the program keeps the order of its arrays
    draft.declare_parameters(struct_parameters(tail))
    arrays = {a.name: draft.array(a.name, a.length(tail), role="input") for a in function.inputs}
    arrays |= {a.name: draft.array(a.name, a.length(tail), role="output") for a in function.outputs}
    function.assemble(draft, arrays)
    return draft.finish()
