"""FATROP, which CasADi brings, solves the stages of a program: both are called in C."""

import ctypes
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.checks import shown
from ..basics.errors import PlanningError
from .fatrop_settings import has_setting
from .interrupt import stop_reason
from .library import in_c, kernel
from .problem import OcpInC, OptimalProblem
from .samples import MeshSamples, nodes_of, packed, unpacked
from .solution import Solution
from .thread_pool import crew_of, helped

CALLED = {  # of FATROP's C interface, by the names of Library in native/fatrop.c
    "create": "fatrop_ocp_c_create",
    "solve": "fatrop_ocp_c_solve",
    "destroy": "fatrop_ocp_c_destroy",
    "set_double": "fatrop_ocp_c_set_option_double",
    "set_int": "fatrop_ocp_c_set_option_int",
    "set_bool": "fatrop_ocp_c_set_option_bool",
    "primal": "fatrop_ocp_c_get_primal",
    "dual": "fatrop_ocp_c_get_dual",
    "stats": "fatrop_ocp_c_get_stats",
}
# statuses of native/fatrop.c; FATROP's own message if it gives one
SOLVED, STOPPED = 0, 2
STATUSES = {
    2: "User_Requested_Stop",
    3: "No_Collocation_Of_Guess",
    4: "No_Derivatives",
    5: "Restoration_Failed",
    6: "No_Room_Between_Bounds",
}
NOT_STARTED = (3, 6)  # statuses
SAYINGS = (
    "Solve_Succeeded",
    "Maximum_Iterations_Exceeded",
    "Solved_To_Acceptable_Level",
    "Infeasible_Problem_Detected",
    "Line_Search_Failed",
    "Error_In_Step_Computation",
    "Unknown",
)
# of the objective, tried in turn: FATROP adds bounds to the Hessians of stages, and if their
# multipliers are large, the cost of torques may be lost in rounding
SCALES = (0.1, 1.0)
PREFIX = "fatrop."  # of its options
OPTIONS = {
    "print_level": 0,
    "max_iter": 300,
    # never: small steps in a row are no solution
    "acceptable_iter": 10_000,
    # its trial steps may leave the region where collocation has a solution
    "watchdog_shortened_iter_trigger": 0,
}
# A matrix counts as indefinite if a pivot is a smaller part of its diagonal entry. FATROP's own
# value, 1e-6, would add regularisation wherever a bound or the goal has a large weight, and steps
# would become short. FATROP has this setting, although it does not list it.
PIVOT, LEAST_PIVOT = "linsol_pivot_tol", 1e-14
# for guesses that are close to a solution
CLOSE_OPTIONS = {"mu_init": 1e-5, "bound_push": 1e-6, "bound_frac": 1e-6}
GUESS_OPTIONS: dict[str, dict[str, float]] = {"far": {}, "close": CLOSE_OPTIONS}
# What squares of the goal's rows cost, by guess: a soft goal is found from afar with fewer steps, a
# stiff one is met more exactly.
GIVES = {"far": 1e5, "close": 1e8}
QUICK = {"far": 150, "close": 60}  # iterations that show whether a guess leads anywhere
Stop = ctypes.CFUNCTYPE(ctypes.c_int)


class Library(ctypes.Structure):
    """What is called of FATROP."""

    _fields_ = tuple((name, ctypes.c_void_p) for name in CALLED)


class Option(ctypes.Structure):
    """A setting of FATROP's."""

    _fields_ = (("name", ctypes.c_char_p), ("kind", ctypes.c_int), ("value", ctypes.c_double))


class SolveResult(ctypes.Structure):
    """How a solve ended, and the elapsed times (s) of evaluations and in total."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("status", "iterations", "said")),
        *((name, ctypes.c_double) for name in ("objective", "functions_s", "total_s")),
    )


@cache
def library() -> ctypes.CDLL:
    """FATROP's library; PlanningError if this CasADi brings none."""
    import casadi as ca

    folder = Path(ca.__file__).parent
    for path in sorted([*folder.glob("libfatrop.*"), *folder.glob("fatrop.dll")]):
        try:
            return ctypes.CDLL(str(path))
        except OSError:
            continue
    raise PlanningError(
        f"solver: value 'fatrop': CasADi {ca.CasadiMeta.version()} comes without libfatrop: use "
        "solver='ipopt'"
    )


@cache
def called() -> Library:
    """Return the addresses of the functions of FATROP that are called."""
    found = library()
    return Library(
        **{
            name: ctypes.cast(getattr(found, symbol), ctypes.c_void_p).value
            for name, symbol in CALLED.items()
        }
    )


def options_of(asked: Mapping[str, Any], guess: str, most: int | None = None) -> Any:
    """Return the settings, an array of Option; most: iterations, if there are none asked for.

    PlanningError if one is unknown or not a number.
    """
    settings: dict[str, Any] = {}
    for name, value in asked.items():
        own = name.removeprefix(PREFIX)
        kind = library().fatrop_ocp_c_option_type(own.encode())
        if own == name or kind not in (0, 1, 2):
            meant = "'fatrop.max_iter' is one"
            if kind in (0, 1, 2):
                meant = f"did you mean '{PREFIX}{own}'?"
            raise PlanningError(f"options: {shown(name)}: FATROP has no such setting; {meant}")
        if not isinstance(value, bool | int | float) or not np.isfinite(value):
            raise PlanningError(f"options: {name}: value {shown(value)}: needs a number")
        settings[own] = value
    few = {} if most is None else {"max_iter": most}
    settings = OPTIONS | GUESS_OPTIONS[guess] | few | settings
    kinds = {name: library().fatrop_ocp_c_option_type(name.encode()) for name in settings}
    if has_setting(library(), PIVOT, tuple(CALLED.values())):
        kinds[PIVOT], settings[PIVOT] = 0, LEAST_PIVOT
    return (Option * len(settings))(
        *(Option(name.encode(), kinds[name], float(value)) for name, value in settings.items())
    )


@dataclass
class _Stopping:
    """Checks at every iteration whether to stop.

    Keeps an exception until the solver has returned.
    """

    raised: BaseException | None = None

    def __call__(self) -> int:
        try:
            return int(self.raised is not None or stop_reason() is not None)
        except BaseException as error:
            self.raised = error
            return 1


def solve(
    problem: OptimalProblem,
    begin: MeshSamples,
    guess: str,
    asked: Mapping[str, Any],
    most_threads: int | None = 1,
    quick: bool = False,
) -> Solution:
    """Solve from a motion that is "far" from a solution or "close" to one.

    asked: options by their names. quick: with few iterations and one scale.
    """
    options = options_of(asked, guess, QUICK[guess] if quick else None)
    variables = packed(problem, begin)
    states = nodes_of(problem, begin)
    begun, iterations = time.process_time(), 0
    crew = crew_of(problem, most_threads)
    for scale in SCALES[:1] if quick else SCALES:
        ocp = OcpInC(problem, GIVES[guess], scale)
        outcome, found, nodes, slopes = _run(ocp, variables, states, options, crew)
        iterations += outcome.iterations
        success = outcome.status == SOLVED and bool(np.isfinite(found).all())
        if success or outcome.status == STOPPED:
            break
    # a diverged solve may end where the collocation of stages has no solution, or never start
    ended = outcome.status not in NOT_STARTED and np.isfinite(found).all()
    ended = ended and np.isfinite(nodes).all()
    return Solution(
        samples=unpacked(problem, found, nodes) if ended else begin,
        value=outcome.objective / scale,
        success=success,
        status=STATUSES.get(outcome.status, SAYINGS[outcome.said]),
        iterations=iterations,
        cpu_s=time.process_time() - begun,
        solver="fatrop",
        slopes=-slopes / scale,
    )


def _run(
    ocp: OcpInC, variables: np.ndarray, states: np.ndarray, options: Any, crew: int
) -> tuple[SolveResult, np.ndarray, np.ndarray, np.ndarray]:
    """Run FATROP; what it ends with, its variables, states at the nodes, multipliers of constants.

    crew: number of threads that evaluate stages.
    """
    code, stopping, outcome = kernel(), _Stopping(), SolveResult()
    found, nodes = variables.copy(), states.copy()
    slopes = np.zeros(ocp.problem.free)
    with in_c(ocp) as program:
        code.program_guess(program, nodes.ctypes.data)
        with helped(code, program, crew - 1):
            code.fatrop_run(
                program,
                ctypes.byref(called()),
                options,
                len(options),
                Stop(stopping),
                found.ctypes.data,
                slopes.ctypes.data,
                ctypes.byref(outcome),
            )
        if outcome.status not in NOT_STARTED:
            code.program_nodes(program, nodes.ctypes.data)
    if stopping.raised is not None:
        raise stopping.raised
    return outcome, found, nodes, slopes
