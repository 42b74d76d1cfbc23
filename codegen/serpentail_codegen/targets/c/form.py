"""Chooses the form of each C function: straight lines, loops, or sweeps by lanes or segments."""

from dataclasses import dataclass

from ...functions.function import Function, assemble
from ...functions.tail import Tail, struct_parameters
from ...ir.cost import applied, branches
from ...ir.program import Program
from ...passes.narrow_directions import directions_in_turn, has_directions, places_lanes
from ...passes.structural_zeros import without_still
from ...passes.unrolled_ldl import unrolled_ldl
from ...scene.scene import Scene
from .loops import in_loops
from .routine import CFunction
from .straight import straight_line

STRAIGHT_UP_TO = 7000  # nodes: beyond, the text leaves the instruction cache and compile time grows
# nodes: where there is a sweep in lanes, too; v_dot's text of so many has 32 KB with AVX2
STRAIGHT_BESIDE_LANES = 4100
# mostly zeros and copies: loops are as fast, and quick to compile
ALWAYS_IN_LOOPS = ("tail_point_jacobians",)
# columns of H times links, the work of a sweep in lanes: from here on segments are as fast
SEGMENTS_FROM = 128
LINKS_OF_AN_ARC = 4  # an arc is as much work as so many links
# what the manifest says of the choice
RULE = {
    "straight_up_to": STRAIGHT_UP_TO,
    "straight_beside_lanes_up_to": STRAIGHT_BESIDE_LANES,
    "segments_from": SEGMENTS_FROM,
    "links_of_an_arc": LINKS_OF_AN_ARC,
}
UNROLLED_ROWS = 12  # smaller matrices are factored without loops


@dataclass(frozen=True)
class PrintedFunction:
    """A function with its C body, and the form in which it was printed."""

    function: Function
    body: CFunction
    emission: str


def printed_function(scene: Scene, tail: Tail, function: Function) -> PrintedFunction:
    """Print one function in the form that the scene asks for."""
    fixed = baked_values(scene)
    form, program = (
        fastest(function, tail)
        if scene.emission == "auto"
        else in_form(scene.emission, function, tail)
    )
    if form == "loops" and has_directions(program):
        program = without_still(program)
    if form == "straight" and places_lanes(program):
        program = directions_in_turn(program)
    printer = straight_line if form == "straight" else in_loops
    return PrintedFunction(function, printer(program, scene.real, scene.name, fixed), form)


def fastest(function: Function, tail: Tail) -> tuple[str, Program]:
    """Return the form that runs fastest on a processor with vectors, and the program in that form.

    Straight lines are fastest until their text fills the instruction cache, if all of them are
    always run. Sweeps in lanes overtake them before that, and sweeps by segments overtake both.
    """
    # sweeps by segments, if the tail is long
    form, swept = in_form("segments" if long(tail) else "lanes", function, tail)
    if form == "segments" or function.name in ALWAYS_IN_LOOPS:
        return form, swept

    # straight lines, if they are short and all of them are always run
    program = assemble(function, tail)
    longest = STRAIGHT_BESIDE_LANES if form == "lanes" else STRAIGHT_UP_TO
    if applied(program) <= longest and not branches(program):
        return "straight", program
    return form, swept


def long(tail: Tail) -> bool:
    """Tell if a tail is so long that sweeps by segments are fast."""
    arcs = sum(run.stop - run.first for run in tail.runs("continuum"))
    work = tail.nt * (tail.pieces + (LINKS_OF_AN_ARC - 1) * arcs)
    return tail.segments > 1 and work >= SEGMENTS_FROM


def in_form(form: str, function: Function, tail: Tail) -> tuple[str, Program]:
    """Return the form and the program of a function when the scene asks for this form.

    A function without a form by segments gets lanes; a function without a form in lanes gets loops.
    """
    program = assemble(function, tail)
    if form in ("straight", "loops"):
        return form, program
    lanes = assemble(function, tail, "lanes")
    segments = assemble(function, tail, "segments") if form == "segments" else lanes
    if segments != lanes:
        return "segments", unrolled_ldl(segments, UNROLLED_ROWS)
    return "loops" if lanes == program else "lanes", unrolled_ldl(lanes, UNROLLED_ROWS)


def baked_values(scene: Scene) -> dict[str, list]:
    """Return the parameters to fold into the code."""
    return {p.name: values(scene, p.name) for p in struct_parameters(scene)} if scene.baked else {}


def values(scene: Scene, name: str) -> list[float]:
    """Return a parameter as a list of scalars."""
    value = scene.parameters[name]
    return list(value) if isinstance(value, tuple) else [value]
