"""Solvers: a program, limits and a guess go in; the unknowns that CasADi's nlpsol finds come
out.
"""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...errors import PlanningError
from .blas_threads import one_thread
from .bounds import Limits
from .cache import memoised
from .interrupt import stop_reason
from .transcription import Transcription

IPOPT = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.nlp_scaling_method": "none",
}
IPOPT |= {"ipopt.mu_strategy": "adaptive"}  # half the iterations
IPOPT |= {
    "ipopt.bound_push": 1e-3,
    "ipopt.bound_frac": 1e-3,
}  # a tenth of the usual: a quarter fewer iterations
IPOPT |= {
    "ipopt.watchdog_shortened_iter_trigger": 0
}  # else multipliers may grow without bound, and steps shrink
IPOPT |= {
    "ipopt.mumps_pivtol": 1e-8,
    "ipopt.mumps_pivtolmax": 1e-6,
}  # else pivots are delayed: up to 20 times slower
CLOSE = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": 1e-5}  # to a solution
CLOSE |= {"ipopt.bound_push": 1e-6, "ipopt.bound_frac": 1e-6}
SAME = CLOSE | {"ipopt.mu_init": 1e-7, "ipopt.warm_start_init_point": "yes"}  # with its multipliers
SAME |= {
    f"ipopt.warm_start_{part}": 1e-8 for part in ("bound_push", "bound_frac", "mult_bound_push")
}
NEARNESS = {"far": {}, "close": CLOSE, "same": SAME}
EXACT = ("grad_f", "jac_g", "hess_lag")


@dataclass(frozen=True, eq=False)
class Solution:
    """What a solver found: unknowns and multipliers, whether it says that they solve the problem,
    and its cost.
    """

    w: np.ndarray
    multipliers: tuple[np.ndarray, np.ndarray]
    value: float
    success: bool
    status: str
    iterations: int
    cpu_s: float


def solver(
    program: Transcription, name: str = "ipopt", options: dict | None = None, near: str = "far"
):
    """Return CasADi's solver of a program; PlanningError where there is none of that name, or an
    option is unknown.
    """
    import casadi as ca

    if not ca.has_nlpsol(name):
        raise PlanningError(
            f"solver: value {name!r}: CasADi has no such solver here; 'ipopt' comes with it"
        )
    given = {"print_time": False, "error_on_fail": False}
    if name == "ipopt":
        given |= IPOPT | NEARNESS[near]
    given |= options or {}
    try:
        return memoised(
            (program.places, name, repr(sorted(given.items()))),
            partial(_engine, program, name, given),
        )
    except RuntimeError as error:
        raise PlanningError(
            f"options: value {options!r}: {name} refuses them: {_reason(error)}"
        ) from error


def _engine(program: Transcription, name: str, options: dict):
    import casadi as ca

    if name != "ipopt":
        return ca.nlpsol("plan", name, program.program["nlp"], options)
    exact, watch = (
        {key: program.program[key] for key in EXACT},
        _watch(program.places.size, program.rows),
    )
    engine = ca.nlpsol(
        "plan", name, program.program["nlp"], exact | {"iteration_callback": watch} | options
    )
    engine.watch = watch  # CasADi keeps no callback alive
    return engine


def _watch(unknowns: int, rows: int):
    """A callback of every iteration, through which Ctrl-C or a time limit ends the search."""
    import casadi as ca

    class Watch(ca.Callback):
        def get_n_in(self):
            return ca.nlpsol_n_out()

        def get_name_in(self, k):
            return ca.nlpsol_out(k)

        def get_sparsity_in(self, k):
            sizes = {"f": 1, "x": unknowns, "lam_x": unknowns, "g": rows, "lam_g": rows, "lam_p": 3}
            return ca.Sparsity.dense(sizes[ca.nlpsol_out(k)], 1)

        def eval(self, _found):
            return [int(stop_reason() is not None)]

    watch = Watch()
    watch.construct("watch", {})
    return watch


def solve(engine, limits: Limits, w: np.ndarray, h: np.ndarray, multipliers=None) -> Solution:
    """Run a solver from the unknowns w (and multipliers of a like problem); h: angular momentum."""
    more = {} if multipliers is None else {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
    begun = time.process_time()
    bounds = {"lbx": limits.lbx, "ubx": limits.ubx, "lbg": limits.lbg, "ubg": limits.ubg}
    with one_thread():
        found = engine(x0=np.clip(w, limits.lbx, limits.ubx), p=h, **bounds, **more)
    spent, stats = time.process_time() - begun, engine.stats()
    x, lam_x, lam_g = (np.array(found[key]).ravel() for key in ("x", "lam_x", "lam_g"))
    finite = bool(np.isfinite(x).all())
    status = str(stats.get("return_status", "unknown"))
    good = bool(stats.get("success", False)) and finite
    return Solution(
        x, (lam_x, lam_g), float(found["f"]), good, status, int(stats.get("iter_count", -1)), spent
    )


def _reason(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"
