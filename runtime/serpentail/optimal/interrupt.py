"""How a search for a plan is stopped early: by Ctrl-C, or by its time limit.

The search asks between its solutions, and the solver at every iteration, whether to stop.  Then
the best plan so far is returned instead of an exception.
"""

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace

from ..compiling.threads import after_fork
from .fork_gate import let_forks_pass

# Ctrl-C for all threads: its count, the thread that receives it, and the handler before
_ctrl_c = SimpleNamespace(noted=0, listener=None, before=None)


class _Search(threading.local):
    """The search of one thread: its latest end (s), the count of interrupts at its beginning, the
    function that receives its progress, and the exception that this raised.
    """

    deadline = math.inf
    noted = 0
    tick: Callable[[], object] = staticmethod(lambda: None)
    raised: BaseException | None = None


_search = _Search()


def stop_reason() -> str | None:
    """Return why the search of this thread should end: "interrupt", "time limit", "progress" (the
    progress function raised an exception), or None.
    """
    let_forks_pass()
    _tick()
    if _search.raised is not None:
        return "progress"
    if _ctrl_c.noted > _search.noted:
        return "interrupt"
    return "time limit" if time.monotonic() >= _search.deadline else None


def time_left() -> float:
    """Return the time (s) until the latest end of the search of this thread; inf without one."""
    return _search.deadline - time.monotonic()


@contextmanager
def stoppable(
    time_limit: float | None = None, tick: Callable[[], object] = lambda: None
) -> Iterator[None]:
    """Let the first Ctrl-C stop the search, and a second one act as usual; limit: s from now.

    Only a search in the main thread receives Ctrl-C, for all threads; without one, only the time
    limit counts. tick: called at every iteration of the solver; an exception that it raises ends
    the search.
    """
    _search.noted, _search.tick, _search.raised = _ctrl_c.noted, tick, None
    _search.deadline = math.inf if time_limit is None else time.monotonic() + time_limit
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        _raise()
        return
    _ctrl_c.listener, _ctrl_c.before = threading.get_ident(), before
    signal.signal(signal.SIGINT, _note)
    try:
        yield
    finally:
        _hear_no_more()
    _raise()


def _tick() -> None:
    """Report progress; keep an exception, because CasADi would not pass it on."""
    try:
        _search.tick()
    except BaseException as error:
        _search.raised = error


def _raise() -> None:
    """Raise the exception that the progress function raised."""
    raised, _search.raised = _search.raised, None
    if raised is not None:
        raise raised


def _note(_number: int, _frame: object) -> None:
    _ctrl_c.noted += 1
    _hear_no_more()


def _hear_no_more() -> None:
    _ctrl_c.listener = None
    signal.signal(signal.SIGINT, _ctrl_c.before)


def _hear_as_before() -> None:
    """In a forked child without the thread that listened, let Ctrl-C act as usual."""
    if _ctrl_c.listener not in (None, threading.get_ident()):
        _hear_no_more()


after_fork(_hear_as_before)
