"""The C target: a scene's programs go in, the text of every C file comes out."""

import hashlib
import json
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from ..functions.function import Argument, Function, struct_parameters
from ..functions.function import program as assemble
from ..functions.tail import Tail
from ..ir.interpret import applied, branches
from ..ir.program import VECTOR, Program
from ..ir.tape import operation_count
from ..passes.unrolled_ldl import written_out
from ..scene import Scene
from ..templating import render
from .c_function import CFunction, Routine, dialect, in_loops, routine_arguments, routine_lines, straight_line
from .casadi_external import casadi_context
from .simulation import Has, layouts, simulation_context

STRAIGHT_UP_TO = 7000  # nodes: beyond, the text leaves the instruction cache and compile time grows
STRAIGHT_BESIDE_LANES = 3500  # nodes: where there is a sweep in lanes, too, that is faster beyond
SEGMENTS_FROM = 128  # columns of H times links, the work of a sweep in lanes: from here on segments are no slower
ELIMINATED = 12  # rows: smaller matrices are factored without loops
LARGE = 100  # operations: a step that is written out wherever it is called; larger ones as the compiler sees fit
COORDINATES = {
    "joint": "alpha_1, beta_1, ... of the joints",
    "bend": "a_1, b_1, ... of the segments' bend",
    "polar": "phi_1, theta_1, ... of the segments' bend",
}
PIECES = {"articulated": "links", "continuum": "samples"}


@dataclass(frozen=True)
class Emitted:
    """One emitted function: what it computes, its C body, and how it was emitted."""

    function: Function
    body: CFunction
    emission: str


def emit(scene: Scene, tail: Tail, function: Function) -> Emitted:
    """Print one function in the form that the scene asks for."""
    fixed = baked_values(scene)
    form, program = fastest(function, tail) if scene.emission == "auto" else in_form(scene.emission, function, tail)
    printer = straight_line if form == "straight" else in_loops
    return Emitted(function, printer(program, scene.real, scene.name, fixed), form)


def fastest(function: Function, tail: Tail) -> tuple[str, Program]:
    """Return the form that runs fastest on a processor with vectors, and the program in that form.

    Straight lines are fastest until their text crowds the instruction cache, if all of them are always run; sweeps in
    lanes overtake them before that, and sweeps by segments overtake both.
    """
    long = tail.segments > 1 and tail.nt * tail.total >= SEGMENTS_FROM
    form, swept = in_form("segments" if long else "lanes", function, tail)
    if form == "segments":
        return form, swept
    program = assemble(function, tail)
    if applied(program) <= (STRAIGHT_BESIDE_LANES if form == "lanes" else STRAIGHT_UP_TO) and not branches(program):
        return "straight", program
    return form, swept


def in_form(form: str, function: Function, tail: Tail) -> tuple[str, Program]:
    """Return the form that a function gets where this one is asked for, and its program.

    What nothing goes by segments in gets lanes, what has no use for lanes gets loops.
    """
    program = assemble(function, tail)
    if form in ("straight", "loops"):
        return form, program
    lanes = assemble(function, tail, "lanes")
    segments = assemble(function, tail, "segments") if form == "segments" else lanes
    if segments != lanes:
        return "segments", written_out(segments, ELIMINATED)
    return "loops" if lanes == program else "lanes", written_out(lanes, ELIMINATED)


def baked_values(scene: Scene) -> dict[str, list]:
    """Return the parameters to fold into the code."""
    return {p.name: values(scene, p.name) for p in struct_parameters(scene)} if scene.baked else {}


def values(scene: Scene, name: str) -> list[float]:
    """Return a parameter as a list of scalars."""
    value = scene.parameters[name]
    return list(value) if isinstance(value, tuple) else [value]


class ArgumentView:
    """An argument as the templates see it."""

    def __init__(self, argument: Argument, tail: Tail):
        self.name, self.meaning = argument.name, argument.meaning
        self.length = argument.length(tail)
        self.dims = "][".join(map(str, argument.shape(tail)))


class FunctionView:
    """A function as the templates see it: prototypes, call texts, lines."""

    def __init__(self, emitted: Emitted, tail: Tail, prefix: str):
        function, self.lines, self.work = emitted.function, emitted.body.lines, emitted.body.work
        self.name, self.doc = function.name, function.doc
        self.emission, self.operations = emitted.emission, emitted.body.operations
        views = [ArgumentView(a, tail) for a in (*function.inputs, *function.outputs)]
        self.inputs, self.outputs = views[: len(function.inputs)], views[len(function.inputs) :]
        real = f"{prefix}_real"
        arguments = [f"const {real} *{a.name}" for a in self.inputs] + [f"{real} *{a.name}" for a in self.outputs]
        head = f"const {prefix}_parameters *parameters"
        self.prototype = wrapped(f"int {prefix}_{self.name}(", [head, *arguments, f"{real} *work"])
        self.names = ", ".join(a.name for a in views)
        self.unused = unused(self.lines)


def wrapped(head: str, arguments: list[str]) -> str:
    """Print a prototype, its arguments on as many lines as 118 columns need."""
    lines, indent = [head + arguments[0]], " " * len(head)
    for argument in arguments[1:]:
        if len(lines[-1]) + len(argument) > 116:
            lines[-1] += ","
            lines.append(indent + argument)
        else:
            lines[-1] += f", {argument}"
    return "\n".join(lines) + ")"


def parameter_views(scene: Scene) -> list[dict]:
    """Return the fields of the parameter struct."""
    literal = dialect(scene.real).literal
    fields = struct_parameters(scene)
    return [
        {
            "name": p.name,
            "size": p.size,
            "unit": p.unit,
            "meaning": p.meaning,
            "literals": list(map(literal, values(scene, p.name))),
        }
        for p in fields
    ]


def step_views(emitted, real: str, prefix: str) -> list[dict]:
    """Return every step that some loop calls, once."""
    routines: dict[str, Routine] = {}
    bodies = [e.body for e in emitted] + [body for _, body in callees_of(emitted)]
    for routine in (r for body in bodies for r in body.routines):
        if routines.setdefault(routine.name, routine) != routine:
            raise ValueError(f"two steps are called {routine.name}")
    return [
        {
            "name": routine.name,
            "kind": "STEP" if operation_count(routine.step.nodes, routine.step.results) < LARGE else "static void",
            "doc": routine.step.doc,
            "lines": routine_lines(routine, real, prefix),
            "arguments": routine_arguments(routine),
        }
        for routine in routines.values()
    ]


def callees_of(emitted) -> list[tuple[Program, CFunction]]:
    """Return the programs that functions call, once, those first that others call."""
    found: dict[str, tuple[Program, CFunction]] = {}
    for program, body in (callee for e in emitted for callee in e.body.callees):
        for inner in (*body.callees, (program, body)):
            if found.setdefault(inner[0].name, inner) != inner:
                raise ValueError(f"two programs are called {inner[0].name}")
    return list(found.values())


def callee_view(program: Program, body: CFunction, prefix: str) -> dict:
    """Return a called program as a function of the C file."""
    arguments = [f"const {prefix}_parameters *parameters"]
    arguments += [f"const real *{a.name}" for a in program.of_role("input")]
    arguments += [f"real *{a.name}" for a in program.of_role("output")]
    head = f"static int {prefix}_{program.name}("
    return {
        "name": program.name,
        "doc": program.doc,
        "prototype": wrapped(head, [*arguments, "real *work"]),
        "lines": body.lines,
        "unused": unused(body.lines, [a.name for a in program.of_role("input")]),
    }


def unused(lines: Iterable[str], names: Iterable[str] = ()) -> list[str]:
    """Return which of these arguments, parameters and work a body does not read."""
    words = set(re.findall(r"\w+", " ".join(lines)))
    return [name for name in ("parameters", "work", *names) if name not in words]


def offered(tail: Tail, views: list["FunctionView"]) -> Has:
    """Return what the simulation of a scene with these functions can do."""
    outputs = {f.name: f.outputs for f in views}
    factors = outputs["implicit_factor"][0].length if "implicit_factor" in outputs else 0
    return Has("pfl" in outputs, factors, tail.points, tuple(tail.groups.items()), "feet" in tail.contacts)


def abi_hash(scene: Scene, tail: Tail, views: list[FunctionView]) -> str:
    """Digest of what a caller relies on: symbols, argument sizes, workspace, the parameter struct."""
    interface = [scene.name, scene.real, [[p.name, p.size] for p in struct_parameters(scene)]]
    interface += [[f.name, [[a.name, a.length] for a in (*f.inputs, *f.outputs)], f.work] for f in views]
    if "rollout" in scene.functions:
        interface += layouts(offered(tail, views)).items()
    return hashlib.sha256(json.dumps(interface).encode()).hexdigest()[:16]


def c_context(scene: Scene, tail: Tail, emitted: list[Emitted], version: str) -> dict:
    """Return everything that the C templates lay out."""
    views = [FunctionView(e, tail, scene.name) for e in emitted]
    literal = dialect(scene.real).literal
    numbers = {"zero": 0, "one": 1, "two": 2, "half": 0.5, "third": 1 / 3}
    numbers |= {"stiffness": 400, "damping": 40}  # of the example's tail
    numbers |= {"word": 2.0**-32, "quarter": math.pi / 2 * 2.0**-30}
    works = {f.name: f.work for f in views}
    rollout = {}
    if "rollout" in scene.functions:
        rollout = simulation_context(scene, tail, offered(tail, views), works)
    return joined(
        {name: literal(value) for name, value in numbers.items()},
        {
            "title": f"{scene.kind} tail, {tail.segments} segments x {tail.links} {PIECES[scene.kind]}",
            "pieces": PIECES[scene.kind],
            "prefix": scene.name,
            "vector": VECTOR,
            "widest": VECTOR,
            "upper": scene.name.upper(),
            "real": scene.real,
            "reproducible": scene.profile == "reproducible",
            "least": "FLT_MIN" if scene.real == "float" else "DBL_MIN",
            "most": "FLT_MAX" if scene.real == "float" else "DBL_MAX",
            "sqrt": dialect(scene.real).functions["sqrt"],
            "version": version,
            "coordinates": COORDINATES[scene.coordinates],
            "polar": tail.polar,
            "content_hash": "",
            "abi_hash": abi_hash(scene, tail, views),
            "tail": tail,
            "factors": next((a.length for f in views for a in f.outputs if a.name == "factors"), 0),
            "groups": ", ".join(f"{count} of the {name}" for name, count in tail.groups.items()),
            "baked": scene.baked,
            "parameters": parameter_views(scene),
            "parameter_count": sum(p.size for p in struct_parameters(scene)),
            "functions": views,
            "names": [f.name for f in views],
            "most_arrays": max(len(f.inputs) + len(f.outputs) for f in views),
            "works": [{"name": name, "work": work} for name, work in works.items()],
            "steps": step_views(emitted, scene.real, scene.name),
            "callees": [callee_view(*callee, scene.name) for callee in callees_of(emitted)],
            "helpers": sorted(set().union(*(e.body.helpers for e in emitted))),
        },
        rollout,
        casadi_context(scene, tail, works),
    )


def joined(*parts: dict) -> dict:
    """Return the parts of a context as one; no name means two things."""
    names = [name for part in parts for name in part]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"the templates' names {', '.join(twice)} mean two things")
    return {name: value for part in parts for name, value in part.items()}


def c_files(scene: Scene, context: dict) -> dict[str, str]:
    """Render the header, the model, its host entries and an example."""
    name = scene.name
    places = {"simulation.h.jinja": f"include/{name}_simulation.h", "simulation.c.jinja": f"src/{name}_simulation.c"}
    return {
        f"include/{name}.h": render("header.h.jinja", context),
        f"src/{name}.c": render("model.c.jinja", context),
        f"src/{name}_host.c": render("host.c.jinja", context),
        "example/main.c": render("example.c.jinja", context),
        **({path: render(template, context) for template, path in places.items()} if "has" in context else {}),
    }
