"""The records of native/nodes.h, in its order."""

import ctypes

MOST_ARRAYS = 10  # of a model's argument record
KINDS = ("values", "jacobian", "gradient", "hessian")
BATCHES = ("value", "first", "mass", "product", "second")
INPUTS = ("q", "v", "last", "weights")
PARTS = (
    *("dq", "dv", "dlast", "by_q"),
    *("turn_gradient", "v_gradient", "last_gradient", "gradient_q"),
    *("v_dot", "H", "mu", "qq", "qv", "vv", "aq", "tq", "half", "by_qq", "by_qv", "by_last"),
)
_size, _pointer = ctypes.c_size_t, ctypes.c_void_p


class Ports(ctypes.Structure):
    """One function's inputs and outputs for CasADi."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("inputs", "outputs")),
        *((name, _pointer) for name in ("names_in", "names_out")),
        *((name, _pointer) for name in ("patterns_in", "patterns_out")),
        *((name, _pointer) for name in ("differentiable_in", "differentiable_out")),
        ("sources", ctypes.c_int * len(INPUTS)),
        *((name, _pointer) for name in ("nonzeros", "offsets")),
        *((name, ctypes.c_int) for name in ("filled", "threads")),
    )


class Nodes(ctypes.Structure):
    """A model's dynamics at a number of nodes."""

    _fields_ = (
        ("inverse", ctypes.c_int),
        *((name, _size) for name in ("nq", "nv", "last", "parameters")),
        *((name, _size) for name in ("count", "lanes", "block", "work")),
        ("sizes", _size * len(INPUTS)),
        ("places", _size * len(PARTS)),
        ("batches", _pointer * len(BATCHES)),
        ("kinds", Ports * len(KINDS)),
    )
