"""Nanoseconds of every form of some functions, on this processor and on one with 16 registers."""

import ctypes
import json
import math
import platform
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.derivatives import generated
from benchmarks.fixtures import ADAPTER, offsets, sizes
from benchmarks.peers.timing import Closure, States, random_states, time_rounds
from serpentail.basics.progress import Stage
from serpentail.compiling.compiler import compile_library
from serpentail.model.kernel import aligned

FUNCTIONS = (
    "mass_matrix",
    "inverse_dynamics",
    "forward_dynamics",
    "inverse_dynamics_derivatives",
    "forward_dynamics_derivatives",
    "inverse_dynamics_hessian",
)
SIZES = (
    *((1, n) for n in (1, 2, 3, 6, 12)),
    *((2, n) for n in (1, 2, 3, 6)),
    *((3, n) for n in (1, 2, 4, 8)),
    *((4, 1), (4, 2), (4, 4), (6, 1), (6, 2), (6, 6), (8, 4)),
)
FORMS = ("straight", "loops", "lanes", "segments")
# -march of each target, and its name in rows
TARGETS = {"here": (), "16 registers": ("-march=x86-64-v3",)}
MOST_TEXT = 1_000_000  # bytes of C: straight lines beyond would take minutes to compile
ROUNDS, CALLS = 60, 64


def measured(folder: Path, functions, grid) -> list[dict]:
    """Measure, print the rows as they come, and write them to ``forms.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    targets = TARGETS if platform.machine() in ("x86_64", "AMD64") else {"here": ()}
    rows, pairs = [], [(f, size) for f in functions for size in grid]
    with Stage("forms") as stage:
        for done, (function, size) in enumerate(pairs):
            stage.tell(done / len(pairs), f"{function} {size}")
            rows += of_function(folder, function, size, targets)
            (folder / "forms.json").write_text(json.dumps(rows, indent=1))
    return rows


def of_function(folder: Path, function: str, size: tuple[int, int], targets) -> list[dict]:
    """Time one function of one tail in all its forms, by target; print and return the rows."""
    chosen = st.load(model_in(folder, function, size, "auto")).manifest["functions"][function]
    forms = {}
    for form in FORMS:
        model = st.load(model_in(folder, function, size, form))
        text = model.folder / "src" / f"{model.name}.c"
        got = model.manifest["functions"][function]["emission"]
        if got == form and text.stat().st_size <= MOST_TEXT:
            forms[form] = model
    keys = [(target, form) for target in targets for form in forms]
    closures = [closure(forms[form], function, folder, targets[t]) for t, form in keys]
    times = time_rounds([c for c, _ in closures], states(size, chosen), ROUNDS, CALLS)
    rows = []
    for target in targets:
        ns = {form: least for (t, form), (least, _) in zip(keys, times, strict=True) if t == target}
        row = {"function": function, "size": size, "target": target}
        rows.append(row | {"chosen": chosen["emission"], "ns": ns})
        told = "  ".join(f"{form} {least:.0f}" for form, least in ns.items())
        print(f"{function:30} {size!s:8} {target:12} [{chosen['emission']}] {told}", flush=True)
    return rows


def model_in(folder: Path, function: str, size: tuple[int, int], form: str) -> Path:
    """Generate a tail with one function in one form."""
    (folder / form).mkdir(exist_ok=True)
    return generated(folder / form, size, (function,), form)


def states(size: tuple[int, int], function: dict) -> States:
    """Random states, and all other inputs of the function, one after the other."""
    q, v, _ = random_states(size[0])
    width = max(sum(sizes(function["inputs"][2:])), 1)
    return States(q, v, np.random.default_rng(0).uniform(-1, 1, (len(q), width)))


def closure(model: st.Model, function: str, scratch: Path, flags) -> tuple[Closure, np.ndarray]:
    """Compile an adapter of a function to the timer's call; return it and its workspace."""
    entry, work = model.manifest["functions"][function], model.manifest["work"][function]
    work = -(-(work + 1) // 8) * 8
    named = [a["name"] for a in entry["inputs"]]
    lengths = [math.prod(a["shape"]) for a in entry["inputs"]]
    torso = [name for name in named if name in ("q", "v")]
    outputs = sizes(entry["outputs"])
    given = [*torso, *offsets("rest", lengths[len(torso) :]), *offsets("out", outputs)]
    text = ADAPTER.format(
        prefix=model.name,
        function=function,
        work=work,
        out=sum(outputs),
        target="context->out",
        arguments=", ".join(given),
    )
    adapter = scratch / f"{model.name}_{function}.c"
    adapter.write_text(text)
    sources = [adapter, model.folder / "src" / f"{model.name}.c"]
    library = ctypes.CDLL(str(compile_library(sources, model.folder / "include", flags=flags)))
    context = aligned(work + len(model.parameter_vector) + sum(outputs), float)
    context[work : work + len(model.parameter_vector)] = model.parameter_vector
    measured = ctypes.cast(library.measured, ctypes.c_void_p).value
    return Closure(measured, context.ctypes.data), context
