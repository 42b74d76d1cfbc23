"""Threads that help to evaluate the stages of a program.

A forked child has none of them: it evaluates all stages alone.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from ..compiling.threads import after_fork, threads
from .problem import OptimalProblem

# intervals, each times the square of its unknowns, that are worth a thread: about 0.1 ms of work
WORTH_A_THREAD = 5000
_at_work: dict[int, ctypes.CDLL] = {}  # programs that have helpers, by their addresses


def crew_of(problem: OptimalProblem, most: int | None) -> int:
    """Return how many threads evaluate stages: at most `most`, and as many as are worth it."""
    if not problem.threads:
        return 1
    unknowns = len(problem.rule.nodes) * problem.node.states
    worth = problem.mesh.intervals * unknowns**2 // WORTH_A_THREAD
    return max(1, min(threads(most), worth, problem.stages))


@contextmanager
def helped(code: ctypes.CDLL, program: int, helpers: int) -> Iterator[None]:
    """Have so many threads help to evaluate a program; C runs in them without Python's lock."""
    crew: list[threading.Thread] = []
    _at_work[program] = code
    code.program_helpers(program, helpers)
    try:
        for _ in range(helpers):
            thread = threading.Thread(
                target=code.program_help, args=(program,), name="serpentail-stages", daemon=True
            )
            thread.start()
            crew.append(thread)
        yield
    finally:
        code.program_dismiss(program)
        for thread in crew:
            thread.join()
        del _at_work[program]


def _leave_alone() -> None:
    for program, code in _at_work.items():
        code.program_helpers(program, 0)


after_fork(_leave_alone)
