"""How much a motion violates the constraints of a program."""

import ctypes

import numpy as np

from .library import in_c, kernel
from .problem import OcpInC, OptimalProblem
from .samples import MeshSamples, nodes_of, packed


def violation(problem: OptimalProblem, samples: MeshSamples) -> float:
    """Return the largest violation of a constraint, in the program's units; inf if unknown."""
    if not samples.is_motion:
        return np.inf
    code, w = kernel(), packed(problem, samples)
    nodes = nodes_of(problem, samples)
    with in_c(OcpInC(problem, 1.0, 1.0)) as program:
        rows, f = code.program_rows(program), ctypes.c_double()
        g, least, most = np.zeros((3, rows))
        code.program_guess(program, nodes.ctypes.data)
        code.sparse_values(program, w.ctypes.data, ctypes.byref(f), g.ctypes.data)
        code.sparse_limits(program, least.ctypes.data, most.ctypes.data)
    return float(np.max(np.maximum(least - g, g - most), initial=0.0))
