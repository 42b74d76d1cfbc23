"""How a search for a plan is stopped early: by Ctrl-C, or by its time limit.

The search asks between its solutions, and the solver at every iteration, whether to stop.  Then
the best plan so far is returned instead of an exception.
"""

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

_ctrl_c = threading.Event()  # one for all threads: so is the signal
_search = threading.local()  # a search and its solver's iterations run in one thread


def stop_reason() -> str | None:
    """Return why the search of this thread should end: "interrupt", "time limit", or None."""
    if _ctrl_c.is_set():
        return "interrupt"
    return "time limit" if time.monotonic() >= getattr(_search, "deadline", math.inf) else None


@contextmanager
def stoppable(time_limit: float | None = None) -> Iterator[None]:
    """Let Ctrl-C stop the search, once, a second one acting as usual; and so a limit (s) from now.

    Only the main thread gets signals: in another one the time limit alone counts.
    """
    _ctrl_c.clear()
    _search.deadline = math.inf if time_limit is None else time.monotonic() + time_limit
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def note(_number, _frame) -> None:
        _ctrl_c.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
