"""Terms of a node: rates, rows and cost as CasADi expressions, called from C with derivatives."""

import ctypes
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.errors import CompilerNotFound, PlanningError
from ..compiling.compiler import library_of_texts, opened

if TYPE_CHECKING:
    import casadi as ca

NAMES = ("values", "by_zeta", "twice")  # of Node in native/node.h
MOST_COMPILED = 20_000  # operations: longer ones take longer to compile than plans take
FLAGS = ("-O1", "-fno-math-errno")
_numbers = ctypes.POINTER(ctypes.c_double)
CasadiCall = ctypes.CFUNCTYPE(
    ctypes.c_int,
    ctypes.POINTER(_numbers),
    ctypes.POINTER(_numbers),
    ctypes.c_void_p,
    ctypes.c_void_p,
    ctypes.c_int,
)


@dataclass(frozen=True, eq=False)
class Terms:
    """C functions of e (native/node.h) by the names of NAMES; compiled: whether threads may call
    them at the same time. values: the function of values alone, for Python.
    """

    functions: dict[str, Any]
    compiled: bool
    values: "ca.Function"
    kept: object  # what the functions need to live


def terms_of(e: "ca.SX", given: "ca.SX", values: "ca.SX") -> Terms:
    """Return values (n,) of e and of given numbers, with first and second derivatives by e.

    e, given: SX symbols.
    """
    import casadi as ca

    mu = ca.SX.sym("mu", values.numel())
    J = ca.densify(ca.jacobian(values, e).T)  # by columns: J by rows
    H = ca.densify(ca.hessian(ca.dot(mu, values), e)[0])
    dense = ca.densify(values)
    options, whole = {"cse": True}, ca.vertcat(e, given)
    made = [
        ca.Function("values", [whole], [dense], options),
        ca.Function("by_zeta", [whole], [dense, J], options),
        ca.Function("twice", [whole, mu], [dense, J, H], options),
    ]
    if made[-1].n_instructions() > MOST_COMPILED:
        buffers = [_Buffer(function) for function in made]
        functions = {name: buffer.call for name, buffer in zip(NAMES, buffers, strict=True)}
        return Terms(functions, False, made[0], buffers)
    library = _compiled(made)
    functions = {name: getattr(library, name) for name in NAMES}
    return Terms(functions, True, made[0], library)


def _compiled(functions: "list[ca.Function]") -> ctypes.CDLL:
    """Return the library of functions; PlanningError if no compiler works."""
    import casadi as ca

    generator = ca.CodeGenerator("terms", {"with_header": False})
    for function in functions:
        generator.add(function)
    text = generator.dump().encode()
    try:
        return opened(lambda: library_of_texts({"terms.c": text}, flags=FLAGS))
    except CompilerNotFound as error:
        raise PlanningError(f"solver: {error}") from error


class _Buffer:
    """A function that CasADi evaluates, as one that C calls; one call at a time."""

    def __init__(self, function: "ca.Function"):
        self.buffer: Any
        self.buffer, self.evaluate = function.buffer()
        self.lock = threading.Lock()
        self.inputs = [np.zeros(function.size1_in(k)) for k in range(function.n_in())]
        self.outputs = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
        for k, array in enumerate(self.inputs):
            self.buffer.set_arg(k, array.data)
        for k, array in enumerate(self.outputs):
            self.buffer.set_res(k, array.data)
        self.call = CasadiCall(self._called)

    def _called(self, given: Any, found: Any, *_unused: Any) -> int:
        try:
            with self.lock:
                for k, array in enumerate(self.inputs):
                    ctypes.memmove(array.ctypes.data, given[k], array.nbytes)
                self.evaluate()
                for k, array in enumerate(self.outputs):
                    ctypes.memmove(found[k], array.ctypes.data, array.nbytes)
        except BaseException:  # C knows no exceptions: there are no values here
            return 1
        return 0
