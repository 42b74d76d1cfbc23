"""Nanoseconds a node of forward dynamics at 64 nodes, in one thread.

``model.casadi.nodes``, ``external`` in a map, and the SX function in a map, whose C CasADi
generated and gcc compiled.
"""

import subprocess
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import serpentail as st
from benchmarks.models import built, label
from benchmarks.timing import best_of
from serpentail_scene.signatures.table import EXACT_DERIVATIVES

PER_PROCESSOR = True
NODES, ROUNDS = 64, 300
SIZES = ((1, 3), (3, 4))
COMPILED = ((1, 3),)  # the compiler works for minutes on longer tails
KINDS = ("value", "Jacobian", "Jacobian of the gradient")


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail and derivative."""
    return [row for size in SIZES for row in rows_of(size, folder)]


def rows_of(size: tuple, folder: Path) -> list[dict]:
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
        times = best_of([own[k] for own in calls.values()], ROUNDS)
        row: dict = {"model": label(*size), "function": kind}
        rows.append(row | {f"{way}, ns": ns / NODES for way, ns in zip(calls, times, strict=True)})
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
