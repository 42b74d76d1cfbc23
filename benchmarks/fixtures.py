"""Models to measure: a generated folder goes in, the model and a closure of its C forward dynamics come out."""

import ctypes
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from peers import Closure
from serpentail.compiler import compile_library

ADAPTER = """
#include "{prefix}.h"
struct context {{ {prefix}_parameters parameters; {prefix}_real work[{work}]; }};
int measured(void *c, const {prefix}_real *q, const {prefix}_real *v, const {prefix}_real *tau, {prefix}_real *v_dot);
int measured(void *c, const {prefix}_real *q, const {prefix}_real *v, const {prefix}_real *tau, {prefix}_real *v_dot)
{{
  struct context *context = c;
  return {prefix}_forward_dynamics(&context->parameters, q, v, tau, v_dot, context->work);
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
    "us": "us a call",
    "overhead_us": "of it outside C",
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
}


@dataclass(frozen=True)
class Fixture:
    """A loaded model and what calls its C forward dynamics for the timer."""

    model: st.Model
    closure: Closure
    context: np.ndarray

    @property
    def parameters(self) -> dict:
        """The model's parameters."""
        return dict(self.model.parameters)


def fixture(folder: Path, scratch: Path) -> Fixture:
    """Load a generated folder and compile an adapter to the timer's call."""
    model = st.load(folder)
    work = model.manifest["work"]["forward_dynamics"] + 1
    adapter = scratch / f"{model.name}_adapter.c"
    adapter.write_text(ADAPTER.format(prefix=model.name, work=work))
    library = ctypes.CDLL(str(compile_library([adapter, folder / "src" / f"{model.name}.c"], folder / "include")))
    context = np.concatenate([model.parameter_vector, np.zeros(work)])
    address = ctypes.cast(library.measured, ctypes.c_void_p).value
    return Fixture(model, Closure(address, context.ctypes.data), context)
