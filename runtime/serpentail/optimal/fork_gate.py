"""Makes a fork wait until no search of another thread is inside CasADi or its solver.

A lock that such a thread holds at that moment would stay locked in the child for ever, because the
child does not have the thread. Searches let forks pass when they check whether to stop.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class _Gate:
    """Threads that are inside, and how many forks wait for them."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.inside: set[int] = set()
        self.waiting = 0

    def enter(self) -> None:
        with self.changed:
            while self.waiting:
                self.changed.wait()
            self.inside.add(threading.get_ident())

    def leave(self) -> None:
        with self.changed:
            self.inside.discard(threading.get_ident())
            self.changed.notify_all()

    def before_fork(self) -> None:
        """Wait for the others, then hold the gate."""
        self.changed.acquire()
        self.waiting += 1
        while self.inside - {threading.get_ident()}:
            self.changed.wait()

    def after_fork(self) -> None:
        self.waiting -= 1
        self.changed.notify_all()
        self.changed.release()

    def in_child(self) -> None:
        """Reset the gate for the only thread that is left."""
        self.changed, self.waiting = threading.Condition(), 0
        self.inside &= {threading.get_ident()}


_gate = _Gate()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_gate.before_fork,
        after_in_parent=_gate.after_fork,
        after_in_child=_gate.in_child,
    )


@contextmanager
def forks_wait() -> Iterator[None]:
    """Have forks of other threads wait for the end, or for `let_forks_pass`."""
    _gate.enter()
    try:
        yield
    finally:
        _gate.leave()


def let_forks_pass() -> None:
    """Let the forks pass that wait for this thread."""
    if _gate.waiting and threading.get_ident() in _gate.inside:
        _gate.leave()
        _gate.enter()
