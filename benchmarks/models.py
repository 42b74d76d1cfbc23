"""Builds the models that benchmarks measure, and wraps their C functions to be timed."""

import ctypes
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.peers.build import Compiler, build_library, compilers
from benchmarks.timing import Closure
from serpentail.compiling.compiler import compile_library
from serpentail.compiling.toolchain import PROFILES
from serpentail.model.memory import aligned

FD, DFD = "forward_dynamics", "forward_dynamics_derivatives"
HESSIAN = "inverse_dynamics_hessian"
ADAPTER = """
#include "{prefix}.h"
typedef {prefix}_real real;
struct context {{ real work[{work}]; {prefix}_parameters parameters; real out[{out}]; }};
int measured(void *c, const real *q, const real *v, const real *rest, real *seen);
int measured(void *c, const real *q, const real *v, const real *rest, real *seen)
{{
  struct context *context = c;
  real *out = {target};
  int status = {prefix}_{function}(&context->parameters, {arguments}, context->work);
  (void)q, (void)v, (void)rest;
  seen[0] = out[0];
  return status;
}}
"""


def built(segments: int, links: int | None = None, **options) -> st.Model:
    """Build and load a tail, a continuum if there are no links."""
    tail = {"tail": "articulated", "links": links} if links else {"tail": "continuum"}
    return st.build(segments=segments, **tail, **options)


def label(segments: int, links: int | None) -> str:
    """Return (m, n) as text; a continuum has no links."""
    return f"({segments}, {links})" if links else f"continuum, m = {segments}"


@dataclass(frozen=True)
class TimedFunction:
    """A model, and one of its C functions as the timer calls it; it keeps the memory alive."""

    model: st.Model
    closure: Closure
    context: np.ndarray


def timed_function(
    model: st.Model,
    scratch: Path,
    function: str = FD,
    compiler: Compiler | None = None,
    flags: tuple[str, ...] = (),
) -> TimedFunction:
    """Compile an adapter from one of a model's functions to the timer's call.

    The timer's third array holds all inputs but q and v, one after the other. Outputs other than an
    acceleration stay in the context, behind the workspace, which begins at a cache line. compiler:
    one of the peers'; by default that of users, with flags.
    """
    model.need(function)
    entry, work = model.manifest["functions"][function], model.manifest["work"][function]
    work = -(-(work + 1) // 8) * 8
    names = [argument["name"] for argument in entry["inputs"]]
    state = [name for name in names if name in ("q", "v")]
    outputs = sizes(entry["outputs"])
    direct = outputs == [model.nv]  # what the timer's own array holds
    arguments = [*state, *offsets("rest", sizes(entry["inputs"])[len(state) :])]
    text = ADAPTER.format(
        prefix=model.name,
        function=function,
        work=work,
        out=1 if direct else sum(outputs),
        target="seen" if direct else "context->out",
        arguments=", ".join([*arguments, *offsets("out", outputs)]),
    )
    adapter = scratch / f"{model.name}_{function}.c"
    adapter.write_text(text)
    library = ctypes.CDLL(str(compiled(model, adapter, compiler, flags)))
    context = aligned(work + len(model.parameter_vector) + sum(outputs), float)
    context[work : work + len(model.parameter_vector)] = model.parameter_vector
    address = ctypes.cast(library.measured, ctypes.c_void_p).value
    return TimedFunction(model, Closure(address, context.ctypes.data), context)


def compiled(model: st.Model, adapter: Path, compiler: Compiler | None, flags) -> Path:
    """Return the library of a model and an adapter of it."""
    source, include = model.folder / "src" / f"{model.name}.c", model.folder / "include"
    if compiler is None:
        return compile_library([adapter, source], include, flags=flags)
    both = adapter.with_name(f"{adapter.stem}_{compiler.name}.c")
    both.write_text(source.read_text() + adapter.read_text())
    profile = [flag for flag in PROFILES["fast"] if flag.startswith("-fno")]
    return build_library(both, compiler, ("-I", str(include), "-lm", *profile))


def by_clang(model: st.Model, scratch: Path, function: str) -> dict[str, TimedFunction]:
    """Return a function of a model compiled by the peers' clang, if that is installed."""
    found = (compiler for compiler in compilers() if compiler.name == "clang")
    return {each.name: timed_function(model, scratch, function, each) for each in found}


def sizes(arguments: list[dict]) -> list[int]:
    """Return the lengths of a function's arrays."""
    return [math.prod(argument["shape"]) for argument in arguments]


def offsets(name: str, lengths: list[int]) -> list[str]:
    """Return C expressions of arrays that are one after the other."""
    return [f"{name} + {sum(lengths[:k])}" for k in range(len(lengths))]
