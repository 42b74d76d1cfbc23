"""Solving a nonlinear program by CasADi's ``nlpsol``, as a rule with IPOPT."""

import re
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.checks import did_you_mean, shown
from ...basics.errors import PlanningError
from ...basics.short_repr import brief
from .blas_threads import one_thread
from .bounds import Limits
from .cache import memoised
from .interrupt import stop_reason
from .multipliers import Multipliers
from .node import PARAMETERS
from .transcription import Transcription

if TYPE_CHECKING:
    import casadi as ca

IPOPT_OPTIONS: dict[str, Any] = {
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
# for guesses that come with multipliers
WARM_OPTIONS: dict[str, Any] = CLOSE_OPTIONS | {
    "ipopt.mu_init": 1e-7,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}
GUESS_OPTIONS = {"far": {}, "close": CLOSE_OPTIONS, "warm": WARM_OPTIONS}
SOLVERS = ("ipopt", "fatrop")
DERIVATIVES = ("grad_f", "jac_g", "hess_lag")  # which a transcription brings


@dataclass(frozen=True, eq=False)
class Solution:
    """What a solver found: unknowns and multipliers, whether it calls them solved, and the cost."""

    w: np.ndarray
    multipliers: Multipliers
    value: float
    success: bool
    status: str
    iterations: int
    cpu_s: float
    __repr__ = brief


def solver(
    nlp: Transcription,
    name: str = "ipopt",
    options: Mapping[str, Any] | None = None,
    guess: str = "far",
) -> "ca.Function":
    """Return CasADi's solver of a program, for a guess that is "far", "close" or "warm".

    Every thread has its own solvers, because two threads in one solver crash. PlanningError if
    there is no solver of that name, or an option is unknown.
    """
    import casadi as ca

    if not isinstance(name, str) or not ca.has_nlpsol(name):
        remedy = did_you_mean(name, SOLVERS) or "CasADi has no such solver here."
        others = "There are 'ipopt', 'fatrop' and other solvers of casadi.nlpsol"
        raise PlanningError(f"solver: value {shown(name)}: {remedy} {others}")
    settings: dict[str, Any] = {"print_time": False, "error_on_fail": False}
    if name == "ipopt":
        settings |= IPOPT_OPTIONS | GUESS_OPTIONS[guess]
    settings |= options or {}
    key = (nlp.indices, name, repr(sorted(settings.items())), threading.get_ident())
    try:
        return memoised(key, partial(_engine, nlp, name, settings))
    except RuntimeError as error:
        raise PlanningError(
            f"options: value {shown(options)}: {name} refuses them: {_reason(error, name)}"
        ) from error


def _engine(nlp: Transcription, name: str, options: dict[str, Any]) -> "ca.Function":
    import casadi as ca

    program = nlp.functions["nlp"]
    if name != "ipopt":
        return ca.nlpsol("plan", name, program, options)
    watch = _watch(nlp.indices.size, nlp.rows)
    exact = {key: nlp.functions[key] for key in DERIVATIVES}
    engine = ca.nlpsol("plan", name, program, exact | {"iteration_callback": watch} | options)
    vars(engine)["watch"] = watch  # CasADi keeps no callback alive
    return engine


def _watch(unknowns: int, rows: int) -> "ca.Callback":
    """A callback of every iteration, through which Ctrl-C or a time limit ends the search."""
    import casadi as ca

    class Watch(ca.Callback):
        def get_n_in(self):
            return ca.nlpsol_n_out()

        def get_name_in(self, k):
            return ca.nlpsol_out(k)

        def get_sparsity_in(self, k):
            sizes = {"f": 1, "x": unknowns, "g": rows, "p": PARAMETERS}
            return ca.Sparsity.dense(sizes[ca.nlpsol_out(k).removeprefix("lam_")], 1)

        def eval(self, _iterate):
            return [int(stop_reason() is not None)]

    watch = Watch()
    watch.construct("watch", {})
    return watch


def solve(
    engine: "ca.Function",
    limits: Limits,
    w: np.ndarray,
    p: np.ndarray,
    multipliers: Multipliers | None = None,
) -> Solution:
    """Run a solver from the unknowns w (and multipliers of a like problem); p: its parameters."""
    arguments = vars(limits) | {"x0": np.clip(w, limits.lbx, limits.ubx), "p": p}
    if multipliers is not None:
        arguments |= {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
    begun = time.process_time()
    with one_thread():
        results = engine(**arguments)
    spent, stats = time.process_time() - begun, engine.stats()
    x, lam_x, lam_g = (np.array(results[key]).ravel() for key in ("x", "lam_x", "lam_g"))
    return Solution(
        w=x,
        multipliers=(lam_x, lam_g),
        value=float(results["f"]),
        success=bool(stats.get("success", False)) and bool(np.isfinite(x).all()),
        status=str(stats.get("return_status", "unknown")),
        iterations=int(stats.get("iter_count", -1)),
        cpu_s=spent,
    )


def _reason(error: Exception, name: str) -> str:
    unknown = re.search(r"Unknown option: (\w+)", str(error))
    if unknown:
        own = f'did you mean "{name}.{unknown[1]}"?'
        return f'CasADi has no option "{unknown[1]}"; {own} A solver\'s own begin with its name'
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"
