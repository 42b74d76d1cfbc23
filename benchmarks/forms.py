"""Nanoseconds of every form of some functions: the results decide which form is emitted.

Each function of each tail is generated in every form that it has, and compiled for this processor
and for x86-64-v3, which has 16 vector registers of 4 numbers each; on an AVX-512 machine the first
has 32 of 8. All run in interleaved rounds. It takes 40 minutes, so `make bench` leaves it out.
"""

import platform
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import DFD, FD, HESSIAN, built, label, sizes, timed_function
from benchmarks.timing import States, random_states, time_rounds
from serpentail.basics.progress import Stage

FUNCTIONS = ("mass_matrix", "inverse_dynamics", FD, "inverse_dynamics_derivatives", DFD, HESSIAN)
SIZES = (
    *((1, n) for n in (1, 2, 3, 6, 12)),
    *((2, n) for n in (1, 2, 3, 6)),
    *((3, n) for n in (1, 2, 4, 8)),
    *((4, 1), (4, 2), (4, 4), (6, 1), (6, 2), (6, 6), (8, 4)),
)
FORMS = ("straight", "loops", "lanes", "segments")
MOST_TEXT = 1_000_000  # bytes of C: straight lines beyond would take minutes to compile
ROUNDS, CALLS = 60, 64


def measured(folder: Path) -> list[dict]:
    """Return a row for each function, tail and target; print each when it is ready."""
    targets: dict[str, tuple[str, ...]] = {"here": ()}
    if platform.machine() in ("x86_64", "AMD64"):
        targets["16 registers"] = ("-march=x86-64-v3",)
    rows, pairs = [], [(function, size) for function in FUNCTIONS for size in SIZES]
    with Stage("forms") as stage:
        for done, (function, size) in enumerate(pairs):
            stage.tell(done / len(pairs), f"{function} {size}")
            rows += of_function(folder, function, size, targets)
    return rows


def of_function(folder: Path, function: str, size: tuple[int, int], targets: dict) -> list[dict]:
    """Return the rows of one function of one tail."""
    chosen = built(*size, functions=[function]).manifest["functions"][function]
    forms: dict[str, st.Model] = {}
    for form in FORMS:
        model = built(*size, functions=[function], emission=form)
        text = model.folder / "src" / f"{model.name}.c"
        emitted = model.manifest["functions"][function]["emission"]
        if emitted == form and text.stat().st_size <= MOST_TEXT:
            forms[form] = model
    keys = [(target, form) for target in targets for form in forms]
    timed = [timed_function(forms[f], folder, function, flags=targets[t]) for t, f in keys]
    q, v, _ = random_states(size[0])
    width = max(sum(sizes(chosen["inputs"][2:])), 1)
    states = States(q, v, np.random.default_rng(0).uniform(-1, 1, (len(q), width)))
    times = dict(
        zip(keys, time_rounds([t.closure for t in timed], states, ROUNDS, CALLS), strict=True)
    )
    rows = []
    for target in targets:
        row = {"function": function, "model": label(*size), "target": target}
        row |= {"chosen": chosen["emission"]}
        rows.append(row | {f"{form}, ns": times[target, form] for form in forms})
        print(*rows[-1].values(), flush=True)
    return rows
