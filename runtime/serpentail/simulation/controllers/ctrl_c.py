"""Ctrl-C in runs with a Python function as controller.

KeyboardInterrupt raised while C enters Python would be lost, and the run would continue. It is
therefore held back until the function is entered.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class CtrlC:
    """Whether a signal came, and whether it may be raised now in Python."""

    def __init__(self) -> None:
        self.noted = self.inside = False

    @contextmanager
    def waits(self, wanted: bool) -> Iterator[None]:
        """Hold signals back until the next `enter`, or the end, if wanted and in the main thread.

        Only the main thread receives signals.
        """
        main = wanted and threading.current_thread() is threading.main_thread()
        before = signal.getsignal(signal.SIGINT) if main else None
        if not callable(before):
            yield
            return

        def note(number: int, frame: FrameType | None) -> None:
            if self.inside:
                before(number, frame)
            else:
                self.noted = True

        signal.signal(signal.SIGINT, note)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
            self.inside = False
            self._raise_noted()

    def enter(self) -> None:
        """Let signals raise, those that came before, too."""
        self.inside = True
        self._raise_noted()

    def leave(self) -> None:
        """Let signals wait again."""
        self.inside = False

    def _raise_noted(self) -> None:
        if self.noted:
            self.noted = False
            signal.raise_signal(signal.SIGINT)
