"""FATROP, which CasADi brings, solves the stages of a program: both are called in C."""

import ctypes
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ...basics.checks import shown
from ...basics.errors import CompilerNotFound, PlanningError
from ...compiling.compiler import compile_library, opened
from ..nlp.interrupt import stop_reason
from ..nlp.solver import Solution
from .stages import Stages, packed, unpacked
from .task import StageTask, task_of
from .thread_pool import crew_of, helped

NATIVE = Path(__file__).parent / "native"
FLAGS = ("-O3", "-ftree-vectorize", "-pthread")  # loops along rows of matrices; threads
CALLED = {  # of FATROP's C interface, by the names of Library in native/fatrop.c
    "create": "create",
    "solve": "solve",
    "destroy": "destroy",
    "set_double": "set_option_double",
    "set_int": "set_option_int",
    "set_bool": "set_option_bool",
    "primal": "get_primal",
    "dual": "get_dual",
    "stats": "get_stats",
}
# statuses of native/fatrop.c; FATROP's own message if it gives one
SOLVED, SAID, STOPPED, MEMORY = 0, 1, 2, 6
STATUSES = {
    2: "User_Requested_Stop",
    3: "No_Collocation_Of_Guess",
    4: "No_Derivatives",
    5: "Restoration_Failed",
    7: "No_Room_Between_Bounds",
}
NOT_STARTED = (3, 7)  # statuses
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
PIVOT_SETTER = "_ZN6fatrop15AugSystemSolverINS_7OcpTypeEE13set_pivot_tolERKd"
# for guesses that are close to a solution
CLOSE_OPTIONS = {"mu_init": 1e-5, "bound_push": 1e-6, "bound_frac": 1e-6}
GUESS_OPTIONS: dict[str, dict[str, float]] = {"far": {}, "close": CLOSE_OPTIONS}
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
def kernel() -> ctypes.CDLL:
    """The stages in C, compiled once; PlanningError if no compiler works."""
    import casadi as ca

    headers = Path(ca.__file__).parent / "include"
    version = f"-DCASADI_{''.join(c if c.isalnum() else '_' for c in ca.CasadiMeta.version())}"
    sources, flags = sorted(NATIVE.glob("*.c")), (*FLAGS, version, "-I", str(headers))
    try:
        made = opened(lambda: compile_library(sources, NATIVE, flags=flags))
    except CompilerNotFound as error:
        raise PlanningError(f"solver: value 'fatrop': {error}") from error
    pointer = ctypes.c_void_p
    made.program_new.restype = pointer
    made.program_new.argtypes = (ctypes.POINTER(StageTask),)
    made.program_free.argtypes = made.program_variables.argtypes = (pointer,)
    made.program_rows.argtypes = made.program_help.argtypes = (pointer,)
    made.program_dismiss.argtypes = (pointer,)
    made.program_helpers.argtypes = (pointer, ctypes.c_int)
    made.program_guess.argtypes = (pointer, pointer)
    made.program_nodes.argtypes = (pointer, pointer, pointer)
    made.fatrop_run.argtypes = (
        *(pointer, ctypes.POINTER(Library), ctypes.POINTER(Option), ctypes.c_int, Stop),
        *(pointer, pointer, ctypes.POINTER(SolveResult)),
    )
    made.fatrop_run.restype = None
    return made


@cache
def called() -> Library:
    """Return the addresses of the functions of FATROP that are called."""
    found = library()
    return Library(
        **{
            name: ctypes.cast(getattr(found, f"fatrop_ocp_c_{symbol}"), ctypes.c_void_p).value
            for name, symbol in CALLED.items()
        }
    )


def options_of(asked: Mapping[str, Any], guess: str) -> Any:
    """Return the settings, an array of Option; PlanningError if one is unknown or not a number."""
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
    settings = OPTIONS | GUESS_OPTIONS[guess] | settings
    kinds = {name: library().fatrop_ocp_c_option_type(name.encode()) for name in settings}
    if _has_pivot():
        kinds[PIVOT], settings[PIVOT] = 0, LEAST_PIVOT
    return (Option * len(settings))(
        *(Option(name.encode(), kinds[name], float(value)) for name, value in settings.items())
    )


@cache
def _has_pivot() -> bool:
    """Tell if FATROP has the setting PIVOT; an unknown setting would end the process."""
    found = library()
    return hasattr(found, PIVOT_SETTER) and PIVOT.encode() in Path(found._name).read_bytes()


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


@dataclass(frozen=True, eq=False)
class Engine:
    """How to solve from a "far" or a "close" guess; settings: an array of Option."""

    guess: str
    settings: Any


def engine_of(asked: Mapping[str, Any], guess: str) -> Engine:
    """Return FATROP's engine; PlanningError if an option is unknown or not a number."""
    return Engine(guess, options_of(asked, guess))


def solve_stages(
    stages: Stages, start: dict[str, np.ndarray], w: np.ndarray, p: np.ndarray, engine: Engine
) -> Solution:
    """Solve from unknowns w; start: blocks in SI; p: the program's parameters (``nlp.node``)."""
    units = stages.variables.units
    first = np.concatenate([start[name] / units[name] for name, _ in stages.variables.states])
    variables, states = packed(stages, w)
    begun, iterations = time.process_time(), 0
    crew = crew_of(stages)
    for scale in SCALES:
        task = task_of(stages, first, p, scale, engine.guess)
        outcome, found, multipliers, nodes = _run(task, variables, states, engine.settings, crew)
        iterations += outcome.iterations
        success = outcome.status == SOLVED and bool(np.isfinite(found).all())
        if success or outcome.status == STOPPED:
            break
    # a diverged solve may end where the collocation of stages has no solution, or never start
    ended = outcome.status not in NOT_STARTED and all(
        np.isfinite(part).all() for part in (found, *nodes.values())
    )
    return Solution(
        w=unpacked(stages, found, nodes | {"start": first}) if ended else w,
        multipliers=(np.zeros(0), multipliers / scale),
        value=outcome.objective / scale,
        success=success,
        status=STATUSES.get(outcome.status, SAYINGS[outcome.said]),
        iterations=iterations,
        cpu_s=time.process_time() - begun,
    )


def _run(
    task: Any, variables: np.ndarray, states: np.ndarray, settings: Any, crew: int = 1
) -> tuple[SolveResult, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Run FATROP; what it ends with, its variables, multipliers, and states and turn at nodes.

    crew: number of threads that evaluate stages.
    """
    code, stopping, outcome = kernel(), _Stopping(), SolveResult()
    found, nodes = variables.copy(), np.ascontiguousarray(states)
    y = np.zeros((*states.shape[:2], states.shape[2] + 3))
    program = code.program_new(ctypes.byref(task.task))
    if program is None:
        raise MemoryError("stages of a plan")
    try:
        multipliers = np.zeros(code.program_rows(program))
        code.program_guess(program, nodes.ctypes.data)
        with helped(code, program, crew - 1):
            code.fatrop_run(
                program,
                ctypes.byref(called()),
                settings,
                len(settings),
                Stop(stopping),
                found.ctypes.data,
                multipliers.ctypes.data,
                ctypes.byref(outcome),
            )
        if outcome.status in (SOLVED, SAID, *STATUSES):
            code.program_nodes(program, nodes.ctypes.data, y.ctypes.data)
    finally:
        code.program_free(program)
    if stopping.raised is not None:
        raise stopping.raised
    if outcome.status == MEMORY:
        raise MemoryError("a plan's solver")
    return outcome, found, multipliers, {"states": nodes, "turn": y[..., -3:]}
