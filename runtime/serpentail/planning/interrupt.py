"""Interrupts: Ctrl-C while a plan is made goes in; that the plan should end with what it has comes out."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_asked = threading.Event()  # one for all: so is the signal


def asked() -> bool:
    """Tell whether Ctrl-C was pressed since the plan began."""
    return _asked.is_set()


@contextmanager
def heeded() -> Iterator[None]:
    """Take the first Ctrl-C as a wish to stop, a second one as usual; only the main thread gets signals."""
    _asked.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def ask(_number, _frame) -> None:
        _asked.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, ask)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
