"""Times all nodes of a mesh at once: CasADi functions of the dynamics, and FATROP's stages."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("meshes", __doc__)

import ctypes
import subprocess
import time
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import serpentail as st
from benchmarks.fixtures import built, label
from examples import righting
from serpentail.planning.staged import fatrop
from serpentail.planning.staged.thread_pool import helped
from serpentail_scene.signatures.table import AIRBORNE, EXACT_DERIVATIVES

NODES, ROUNDS = 64, 300
DYNAMICS = ((1, 3), (3, 4))
COMPILED = ((1, 3),)  # the compiler works for minutes on longer tails
STAGED, INTERVALS, EVALUATIONS = ((1, 3), (3, 2), (6, 2)), 40, 200
THREADS = (1, 2)
KINDS = ("value", "Jacobian", "Jacobian of the gradient")


def mesh_times(folder: Path) -> list[dict]:
    """Nanoseconds a node of forward dynamics at 64 nodes, in one thread: ``model.casadi.nodes``,
    ``external`` in a map, and the SX function in a map, whose C CasADi generated and gcc compiled.
    """
    return [row for size in DYNAMICS for row in dynamics_rows(size, folder)]


def dynamics_rows(size: tuple, folder: Path) -> list[dict]:
    """Return the rows of one tail."""
    exact = {n for name, orders in EXACT_DERIVATIVES.items() for n in (name, *chain(*orders))}
    model = built(*size, functions=sorted(exact))
    model.batch_library.threads = 1
    f = model.casadi.external("forward_dynamics", 2)
    nodes = model.casadi.nodes("forward_dynamics", NODES)
    ways = {"nodes": three(nodes), "external": [g.map(NODES) for g in three(f)]}
    if size in COMPILED:
        ways["SX compiled"] = [g.map(NODES) for g in compiled(model, folder)]
    calls = {way: [call_of(g, model) for g in functions] for way, functions in ways.items()}
    rows = []
    for k, kind in enumerate(KINDS):
        times = alternately({way: own[k] for way, own in calls.items()}, ROUNDS)
        row: dict = {"model": label(*size), "function": kind}
        rows.append(row | {f"{way}, ns": 1e9 * s / NODES for way, s in times.items()})
    return rows


def three(f: Any) -> list:
    """Return a function, its Jacobian, and the Jacobian of its gradient."""
    return [f, f.jacobian(), f.reverse(1).jacobian()]


def compiled(model: st.Model, folder: Path) -> list:
    """Return the same of SX operations in compiled C, with dense inputs."""
    import casadi as ca

    f = model.casadi.forward_dynamics
    inputs = [ca.SX.sym(key, f.size1_in(key)) for key in f.name_in()]
    x, mu = ca.veccat(*inputs), ca.SX.sym("mu", model.nv)
    y = f(*inputs)
    results = [y, ca.jacobian(y, x), ca.hessian(ca.dot(mu, y), x)[0]]
    found = []
    for k, result in enumerate(results):
        name, text = f"sx{k}", folder / f"sx{k}.c"
        generator = ca.CodeGenerator(text.name)
        generator.add(ca.Function(name, [*inputs, mu], [result]))
        generator.generate(f"{folder}/")
        flags = ("-O2", "-march=native", "-fPIC", "-shared")
        path = text.with_suffix(".so")
        subprocess.run(["gcc", *flags, str(text), "-o", str(path), "-lm"], check=True)
        found.append(ca.external(name, str(path)))
    return found


def call_of(f: Any, model: st.Model) -> Callable[[], Any]:
    """Return a call without conversions, of random states."""
    random = np.random.default_rng(0)
    buffer, call = f.buffer()
    held: list = [f, buffer]
    for k in range(f.n_in()):
        rows, columns = f.size_in(k)
        given = 0.1 * random.normal(size=(rows, columns))
        if f.name_in(k) == "q" or (k == 0 and rows == model.nq):
            given[3] += 1.0
        if "parameters" in f.name_in(k):
            given = np.tile(np.array(model.casadi.parameter_vector), columns)
        array = np.ascontiguousarray(given.T.ravel())
        held.append(array)
        buffer.set_arg(k, memoryview(array))
    for k in range(f.n_out()):
        array = np.zeros(max(1, f.nnz_out(k)))
        held.append(array)
        buffer.set_res(k, memoryview(array))

    def run(_held: list = held) -> None:
        call()

    return run


def alternately(calls: dict[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Return the least seconds of each call, taken in turns."""
    least = dict.fromkeys(calls, np.inf)
    for _ in range(rounds):
        for name, call in calls.items():
            begun = time.perf_counter()
            call()
            least[name] = min(least[name], time.perf_counter() - begun)
    return least


class _Captured(Exception):
    """Raised with the arguments of FATROP's first run."""


def stage_times(folder: Path) -> list[dict]:
    """Milliseconds in which all stages of 40 intervals give values, slopes and Hessians once, as
    FATROP asks for them in an iteration, from the kick, close to passive flight.
    """
    return [stage_row(size) for size in STAGED]


def stage_row(size: tuple) -> dict:
    """Return the row of one tail."""
    model = built(*size, functions=[*righting.FUNCTIONS.split(","), *AIRBORNE])
    task, w, states = captured(model, size)
    code, random = fatrop.kernel(), np.random.default_rng(1)
    pointer, zeros = ctypes.c_void_p, np.zeros(INTERVALS, np.intc)
    code.program_values.argtypes = code.program_slopes.argtypes = (pointer, pointer)
    code.program_curve.argtypes = (pointer, pointer, ctypes.c_double, *(pointer,) * 3)
    programs, weights = {}, random.normal(size=len(w))
    for count in THREADS:
        programs[count] = code.program_new(ctypes.byref(task.task))
        code.program_guess(programs[count], states.ctypes.data)
    row: dict = {"model": label(*size)}
    least = dict.fromkeys(THREADS, np.inf)
    one, two = (programs[count] for count in THREADS)
    with helped(code, one, THREADS[0] - 1), helped(code, two, THREADS[1] - 1):
        for _ in range(EVALUATIONS):
            near = w + 1e-3 * random.normal(size=len(w))
            for count, program in programs.items():
                begun = time.perf_counter()
                code.program_values(program, near.ctypes.data)
                code.program_slopes(program, near.ctypes.data)
                code.program_curve(
                    *(program, near.ctypes.data, 1.0, weights.ctypes.data),
                    *(zeros.ctypes.data, zeros.ctypes.data),
                )
                least[count] = min(least[count], time.perf_counter() - begun)
    for count, program in programs.items():
        code.program_free(program)
        row[f"{count} thread{'s' if count > 1 else ''}, ms"] = 1e3 * least[count]
    return row | {"ratio": least[THREADS[0]] / least[THREADS[1]]}


def captured(model: st.Model, size: tuple) -> tuple:
    """Return the task of the first program, its variables and the states at its nodes."""
    run = fatrop._run

    def note(task, variables, states, *_):
        raise _Captured(task, variables, np.ascontiguousarray(states))

    fatrop._run = note
    try:
        st.plan(
            model,
            start=righting.kicked(model),
            duration=(0.3, righting.FLIGHT),
            bounds=righting.bounds(model, np.pi if size[0] == 1 else 2 * np.pi),
            solver="fatrop",
            intervals=INTERVALS,
            tolerance=None,
            track=False,
        )
    except _Captured as found:
        return found.args
    finally:
        fatrop._run = run
    raise AssertionError("the plan was made without FATROP")
