"""Interrupts: Ctrl-C or a time limit while a plan is made goes in; why to end with what there is
comes out.
"""

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

_pressed = threading.Event()  # one for all: so is the signal
_own = threading.local()  # a plan and its solver's iterations run in one thread


def asked() -> str | None:
    """Return why the plan of this thread should end: "interrupt", "time limit", or None."""
    if _pressed.is_set():
        return "interrupt"
    return "time limit" if time.monotonic() >= getattr(_own, "deadline", math.inf) else None


@contextmanager
def heeded(time_limit: float | None = None) -> Iterator[None]:
    """Take the first Ctrl-C as a wish to stop, a second one as usual; only the main thread gets
    signals.

    time_limit: s from now, after which stopping is wished, too.
    """
    _pressed.clear()
    _own.deadline = math.inf if time_limit is None else time.monotonic() + time_limit
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def ask(_number, _frame) -> None:
        _pressed.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, ask)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
