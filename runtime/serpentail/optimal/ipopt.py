"""IPOPT on the same stages as FATROP: an oracle, and a second try where FATROP finds nothing."""

import ctypes
import re
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.checks import shown
from ..basics.errors import PlanningError
from .blas_threads import one_thread
from .interrupt import stop_reason
from .library import in_c, kernel
from .problem import OcpInC, OptimalProblem
from .samples import MeshSamples, nodes_of, packed, unpacked
from .solution import Solution
from .thread_pool import crew_of, helped

if TYPE_CHECKING:
    import casadi as ca

OPTIONS: dict[str, Any] = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.nlp_scaling_method": "none",
    # half the iterations
    "ipopt.mu_strategy": "adaptive",
    # a tenth of the usual: a quarter fewer iterations
    "ipopt.bound_push": 1e-3,
    "ipopt.bound_frac": 1e-3,
    # else multipliers may grow without bound, and steps shrink
    "ipopt.watchdog_shortened_iter_trigger": 0,
    # else pivots are delayed: up to 20 times slower
    "ipopt.mumps_pivtol": 1e-8,
    "ipopt.mumps_pivtolmax": 1e-6,
}
# for guesses that are close to a solution
CLOSE_OPTIONS: dict[str, Any] = {
    "ipopt.mu_strategy": "monotone",
    "ipopt.mu_init": 1e-5,
    "ipopt.bound_push": 1e-6,
    "ipopt.bound_frac": 1e-6,
}
GUESS_OPTIONS: dict[str, dict[str, Any]] = {"far": {}, "close": CLOSE_OPTIONS}
QUICK = {"far": 150, "close": 60}  # iterations that show whether a guess leads anywhere


class _Sparse:
    """A program of C with the patterns of its derivatives."""

    def __init__(self, program: int):
        self.code, self.program = kernel(), program
        self.size, self.rows = self.code.program_variables(program), self.code.program_rows(program)
        stages = self.code.sparse_stages(program)
        sizes = np.zeros((stages + 1, 4), np.intc)
        self.code.program_sizes(program, sizes.ctypes.data)
        controls, states, equalities, inequalities = sizes.T.astype(int)
        columns = controls + states
        ends = np.append(0, np.cumsum(columns))
        led = np.append(states[1:], 0)
        own = led + equalities + inequalities
        first = np.append(0, np.cumsum(own))
        rows, cols = [], []
        for k in range(stages + 1):
            i, j = np.meshgrid(
                first[k] + np.arange(own[k]), ends[k] + np.arange(columns[k]), indexing="ij"
            )
            rows.append(i.ravel())
            cols.append(j.ravel())
        self.blocks = sum(part.size for part in rows)
        # what a stage leads to, less the next one's states
        for k in range(stages):
            rows.append(first[k] + np.arange(led[k]))
            cols.append(ends[k + 1] + controls[k + 1] + np.arange(led[k]))
        self.jacobian = _Pattern(np.concatenate(rows), np.concatenate(cols), self.rows, self.size)
        squares = [
            np.meshgrid(*(ends[k] + np.arange(columns[k]),) * 2, indexing="ij")
            for k in range(stages + 1)
        ]
        i, j = (np.concatenate([part[axis].ravel() for part in squares]) for axis in range(2))
        self.upper, self.squares = np.flatnonzero(i <= j), i.size
        self.hessian = _Pattern(i[self.upper], j[self.upper], self.size, self.size)

    def values(self, w: np.ndarray) -> tuple[float, np.ndarray]:
        """Return objective and constraints."""
        f, g = ctypes.c_double(), np.zeros(self.rows)
        self.code.sparse_values(self.program, w.ctypes.data, ctypes.byref(f), g.ctypes.data)
        return f.value, g

    def slopes(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gradient and the entries of the Jacobian; nan where there are none."""
        gradient, entries = np.zeros(self.size), np.full(self.jacobian.size, -1.0)
        failed = self.code.sparse_slopes(
            self.program, w.ctypes.data, gradient.ctypes.data, entries.ctypes.data
        )
        if failed:
            entries[: self.blocks] = np.nan
        return gradient, entries

    def curve(self, w: np.ndarray, scale: float, lam: np.ndarray) -> np.ndarray:
        """Return the entries of the Hessian's upper triangle."""
        blocks = np.zeros(self.squares)
        failed = self.code.sparse_curve(
            self.program, w.ctypes.data, scale, lam.ctypes.data, blocks.ctypes.data
        )
        return blocks[self.upper] * np.nan if failed else blocks[self.upper]

    def limits(self, room: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return least and most of the constraints; room: of the goal's rows, at the end."""
        least, most = np.zeros((2, self.rows))
        self.code.sparse_limits(self.program, least.ctypes.data, most.ctypes.data)
        least[self.rows - len(room) :], most[self.rows - len(room) :] = -room, room
        return least, most


class _Pattern:
    """A sparse pattern: order (n,) of entries, column by column."""

    def __init__(self, rows: np.ndarray, columns: np.ndarray, height: int, width: int):
        import casadi as ca

        self.size = rows.size
        self.order = np.lexsort((rows, columns))
        ends = np.append(0, np.cumsum(np.bincount(columns, minlength=width)))
        self.sparsity = ca.Sparsity(height, width, ends.tolist(), rows[self.order].tolist())

    def matrix(self, entries: np.ndarray) -> "ca.DM":
        """Return the matrix of entries in their own order."""
        import casadi as ca

        return ca.DM(self.sparsity, entries[self.order])


def _callback(name: str, inputs: list[Any], outputs: list[Any], function: Any) -> "ca.Callback":
    """Return a function of CasADi: (name, sparsity) of inputs and outputs."""
    import casadi as ca

    class Called(ca.Callback):
        def get_n_in(self) -> int:
            return len(inputs)

        def get_n_out(self) -> int:
            return len(outputs)

        def get_name_in(self, k: int) -> str:
            return inputs[k][0]

        def get_name_out(self, k: int) -> str:
            return outputs[k][0]

        def get_sparsity_in(self, k: int) -> "ca.Sparsity":
            return inputs[k][1]

        def get_sparsity_out(self, k: int) -> "ca.Sparsity":
            return outputs[k][1]

        def eval(self, arguments: Any) -> Any:
            return function(*(np.array(part).ravel() for part in arguments))

    made = Called()
    made.construct(name, {})
    return made


def _functions(sparse: _Sparse) -> "dict[str, ca.Callback]":
    """Return the program and its derivatives by CasADi's names, and what is asked at iterations."""
    import casadi as ca

    dense = ca.Sparsity.dense
    x, f, g, none = dense(sparse.size, 1), dense(1, 1), dense(sparse.rows, 1), ca.Sparsity(0, 0)
    wp = [("x", x), ("p", none)]

    def values(w: np.ndarray, _p: np.ndarray) -> list[Any]:
        return list(sparse.values(w))

    def gradient(w: np.ndarray, _p: np.ndarray) -> list[Any]:
        return [sparse.values(w)[0], sparse.slopes(w)[0]]

    def jacobian(w: np.ndarray, _p: np.ndarray) -> list[Any]:
        return [sparse.values(w)[1], sparse.jacobian.matrix(sparse.slopes(w)[1])]

    def hessian(w: np.ndarray, _p: np.ndarray, scale: np.ndarray, lam: np.ndarray) -> list[Any]:
        return [sparse.hessian.matrix(sparse.curve(w, float(scale[0]), lam))]

    iterate = {"f": f, "x": x, "g": g, "p": none, "lam_x": x, "lam_g": g, "lam_p": none}
    own = [(ca.nlpsol_out(k), iterate[ca.nlpsol_out(k)]) for k in range(ca.nlpsol_n_out())]
    return {
        "nlp": _callback("nlp", wp, [("f", f), ("g", g)], values),
        "grad_f": _callback("nlp_grad_f", wp, [("f", f), ("grad:f:x", x)], gradient),
        "jac_g": _callback(
            "nlp_jac_g", wp, [("g", g), ("jac:g:x", sparse.jacobian.sparsity)], jacobian
        ),
        "hess_lag": _callback(
            "nlp_hess_l",
            [*wp, ("lam:f", f), ("lam:g", g)],
            [("triu:hess:gamma:x:x", sparse.hessian.sparsity)],
            hessian,
        ),
        "iteration_callback": _callback(
            "watch", own, [("ret", f)], lambda *_: [int(stop_reason() is not None)]
        ),
    }


def solve(
    problem: OptimalProblem,
    begin: MeshSamples,
    guess: str,
    asked: Mapping[str, Any],
    most_threads: int | None = 1,
    quick: bool = False,
) -> Solution:
    """Solve from a motion that is "far" from a solution or "close" to one.

    asked: options by CasADi's names; PlanningError if one is unknown. quick: with few iterations.
    """
    import casadi as ca

    settings: dict[str, Any] = dict.fromkeys(
        ("print_time", "error_on_fail", "show_eval_warnings"), False
    )
    few = {"ipopt.max_iter": QUICK[guess]} if quick else {}
    settings |= OPTIONS | GUESS_OPTIONS[guess] | few | dict(asked)
    # the multipliers and parameters' derivatives are not asked for again at the end
    settings |= dict.fromkeys(("calc_lam_p", "calc_lam_x", "calc_f", "calc_g"), False)
    settings |= {"no_nlp_grad": True}
    begun, w = time.process_time(), packed(problem, begin)
    nodes = nodes_of(problem, begin)
    crew = crew_of(problem, most_threads)
    with in_c(OcpInC(problem, 0.0, 1.0)) as program, helped(kernel(), program, crew - 1):
        kernel().program_guess(program, nodes.ctypes.data)
        sparse = _Sparse(program)
        functions = _functions(sparse)
        nlp = functions.pop("nlp")
        try:
            engine = ca.nlpsol("plan", "ipopt", nlp, functions | settings)
        except RuntimeError as error:
            raise PlanningError(
                f"options: value {shown(dict(asked))}: ipopt refuses them: {_reason(error)}"
            ) from error
        least, most = sparse.limits(problem.end_room)
        with one_thread():
            found = engine(x0=w, lbg=least, ubg=most, p=np.zeros((0, 0)))
        stats, w_found = engine.stats(), np.array(found["x"]).ravel()
        sparse.values(w_found)
        kernel().program_nodes(program, nodes.ctypes.data)
        lam, slopes = np.array(found["lam_g"]).ravel(), np.zeros(problem.free)
        kernel().sparse_multipliers(program, lam.ctypes.data, slopes.ctypes.data)
        value = kernel().sparse_cost(program)
    ended = np.isfinite(w_found).all() and np.isfinite(nodes).all()
    return Solution(
        samples=unpacked(problem, w_found, nodes) if ended else begin,
        value=value,
        success=bool(stats.get("success", False)) and bool(ended),
        status=str(stats.get("return_status", "unknown")),
        iterations=int(stats.get("iter_count", -1)),
        cpu_s=time.process_time() - begun,
        solver="ipopt",
        slopes=-slopes,
    )


def _reason(error: Exception) -> str:
    unknown = re.search(r"Unknown option: (\w+)", str(error))
    if unknown:
        own = f'did you mean "ipopt.{unknown[1]}"?'
        return f'CasADi has no option "{unknown[1]}"; {own} A solver\'s own begin with its name'
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"
