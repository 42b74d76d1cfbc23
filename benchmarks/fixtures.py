"""Builds the models that benchmarks measure, and wraps their C to be timed."""

import ctypes
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.peers.build import CACHE, build_library
from benchmarks.peers.compilers import Compiler, compilers
from benchmarks.peers.timing import Closure
from serpentail.compiling.compiler import compile_library
from serpentail.compiling.toolchain import PROFILES
from serpentail.model.kernel import aligned

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
  seen[0] = out[0];
  return status;
}}
"""
COLUMNS = {
    "model": "(m, n)",
    "generate_s": "generate, s",
    "compile_s": "compile, s",
    "total_s": "in all, s",
    "c_bytes": "C text, bytes",
    "ns": "serpentail, ns",
    "median_ns": "median, ns",
    "v_dot_difference": "difference",
    "plain_ns": "Pinocchio, ns",
    "plain_ratio": "times slower",
    "tuned_ns": "its CRBA, tuned, ns",
    "tuned_ratio": "times slower",
    "own_ns": "own sums on its types, ns",
    "own_ratio": "times slower",
    "continuum_ns": "continuum, ns",
    "articulated_ns": "articulated (m, 3), ns",
    "c_us": "in C, us",
    "caller_us": "for the caller, us",
    "overhead_us": "of it outside C, us",
    "energy_drift": "energy drift",
    "momentum_drift": "momentum drift",
    "quaternion": "norm error",
    "seconds": "run time, s",
    "bend_H": "H, bend",
    "polar_H": "H, polar",
    "bend_v_dot": "v_dot, bend",
    "polar_v_dot": "v_dot, polar",
    "bend_ns": "bend, ns",
    "polar_ns": "polar, ns",
    "form_ratio": "ratio (of medians)",
    "bend_operations": "operations, bend",
    "polar_operations": "operations, polar",
    "revolutes_ns": "tuned, ns",
    "revolutes_ratio": "times slower",
    "mujoco_ns": "MuJoCo, ns",
    "mujoco_ratio": "times slower",
    "casadi_ns": "CasADi's C, ns",
    "casadi_ratio": "times slower",
    "hand_ns": "the same, turn by hand, ns",
    "hand_ratio": "times slower",
    "clang_ns": "ours by clang, ns",
    "clang_ratio": "times ours",
    "clang_by": "by",
    "sparse_ns": "CasADi's C, its nonzeros, ns",
    "sparse_ratio": "times slower",
    "plain_by": "by",
    "tuned_by": "by",
    "own_by": "by",
    "revolutes_by": "by",
    "mujoco_by": "by",
    "casadi_by": "by",
    "hand_by": "by",
    "sparse_by": "by",
    "scalar_gf": "peak of scalars, GF/s",
    "vector_gf": "peak of vectors, GF/s",
    "took_s": "took, s",
    "v_dot_ns": "v_dot, ns",
    "jacobians_ns": "its Jacobians, ns",
    "value": "after",
    "plain_difference": "difference: Pinocchio",
    "jacobian_difference": "others",
    "hessian_difference": "difference",
    "forward_dynamics_derivatives_operations": "operations: Jacobians of v_dot",
    "inverse_dynamics_derivatives_operations": "of H v_dot + C",
    "inverse_dynamics_hessian_operations": "its Hessian",
    "derivative_bytes": "C text, bytes",
    "generate_cpu": "generate, CPU s",
    "compile_cpu": "compile, CPU s",
    "ms": "for the caller, ms",
    "cpu_ms": "processor, ms",
    "real_time_factor": "times real time",
    "lsoda_ms": "SciPy's LSODA, ms",
    "lsoda_error": "its error",
    "lsoda_ratio": "times slower",
    "lsoda_ratio_at_our_error": "at our error",
    "mujoco_step_s": "MuJoCo's step, s",
    "points": "contact points",
    "dynamics_operations": "operations of v_dot",
    "implicit_operations": "of an implicit step's matrix",
    "dynamics_ns": "v_dot, ns",
    "implicit_ns": "implicit step's matrix, ns",
    "page_bytes": "page, bytes",
    "ready_s": "ready, s",
    "frames_per_s": "frames a second",
}


def built(segments: int, links: int | None = None, **options) -> st.Model:
    """Build and load a tail, a continuum if there are no links."""
    tail = {"tail": "articulated", "links": links} if links else {"tail": "continuum"}
    return st.build(segments=segments, **tail, **options)


def label(segments: int, links: int | None) -> str:
    """Return (m, n) as text; a continuum has no links."""
    return f"({segments}, {links})" if links else f"continuum, m = {segments}"


@dataclass(frozen=True)
class Fixture:
    """A loaded model, and an adapter that calls one of its C functions for the timer."""

    model: st.Model
    closure: Closure
    context: np.ndarray

    @property
    def parameters(self) -> dict:
        """The model's parameters."""
        return dict(self.model.parameters)


def fixture(
    model: st.Model,
    scratch: Path,
    function: str = "forward_dynamics",
    compiler: Compiler | None = None,
) -> Fixture:
    """Compile an adapter from one of a model's functions to the timer's call.

    The third array of the timer holds all inputs after q and v, one after the other. More than one
    output stays in the context, behind the workspace, which begins at a cache line. compiler: one
    of the peers'; by default the one that users of the model get.
    """
    work = -(-(model.manifest["work"][function] + 1) // 8) * 8
    inputs, outputs = (
        sizes(model.manifest["functions"][function][key]) for key in ("inputs", "outputs")
    )
    single = len(outputs) == 1
    arguments = ["q", "v", *offsets("rest", inputs[2:]), *offsets("out", outputs)]
    adapter = scratch / f"{model.name}_{function}.c"
    text = ADAPTER.format(
        prefix=model.name,
        function=function,
        work=work,
        out=1 if single else sum(outputs),
        target="seen" if single else "context->out",
        arguments=", ".join(arguments),
    )
    adapter.write_text(text)
    library = ctypes.CDLL(str(compiled(model, adapter, compiler)))
    context = aligned(work + len(model.parameter_vector) + sum(outputs), float)
    context[work : work + len(model.parameter_vector)] = model.parameter_vector
    return Fixture(
        model,
        Closure(ctypes.cast(library.measured, ctypes.c_void_p).value, context.ctypes.data),
        context,
    )


def compiled(model: st.Model, adapter: Path, compiler: Compiler | None) -> Path:
    """Return the library of a model and an adapter of it."""
    source, include = model.folder / "src" / f"{model.name}.c", model.folder / "include"
    if compiler is None:
        return compile_library([adapter, source], include)
    both = adapter.with_name(f"{adapter.stem}_{compiler.name}.c")
    both.write_text(source.read_text() + adapter.read_text())
    profile = [flag for flag in PROFILES["fast"] if flag.startswith("-fno")]
    return build_library(both, CACHE, compiler, ("-I", str(include), "-lm", *profile))


def by_clang(model: st.Model, scratch: Path, function: str) -> dict[str, Fixture]:
    """Return a fixture of a function compiled by clang, if that is installed."""
    found = (compiler for compiler in compilers() if compiler.name == "clang")
    return {each.name: fixture(model, scratch, function, each) for each in found}


def sizes(arguments: list[dict]) -> list[int]:
    """Return the lengths of a function's arrays."""
    return [math.prod(argument["shape"]) for argument in arguments]


def offsets(name: str, lengths: list[int]) -> list[str]:
    """Return C expressions of arrays that are one after the other."""
    return [f"{name} + {sum(lengths[:k])}" for k in range(len(lengths))]
