"""Progress of long work: stages report to a function of the user's, the log or the terminal."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TextIO

PATIENCE_S = 1.0  # s: longer stages are reported
NOTABLE_S = 0.5  # s: the log has shorter stages at level DEBUG
PERIOD_S = 10.0  # s between lines in a pipe or a file


@dataclass(frozen=True)
class Progress:
    """How far a stage of long work is; what ``progress`` passes to its function.

    Attributes
    ----------
    stage : str
        Name of the stage, such as "compile", "simulate" or "plan".
    what : str
        What it works on, such as a model's name.
    done : float or None
        Part that is done, from 0 to 1; None if unknown.
    seconds : float
        Time since the stage began (s).
    ended : bool
        Whether the stage is over.
    depth : int
        Number of stages that this one is part of.
    """

    stage: str
    what: str
    done: float | None
    seconds: float
    ended: bool = False
    depth: int = 0

    @property
    def left(self) -> float | None:
        """Estimated time until the end (s); None if unknown."""
        if self.ended:
            return 0.0
        return self.seconds * (1 - self.done) / self.done if self.done else None

    def __str__(self) -> str:
        text = f"{self.stage} {self.what}".rstrip()
        if self.ended:
            return f"{text}: {self.seconds:.1f} s"
        if self.done is None or self.left is None:
            return f"{text}: {self.seconds:.0f} s so far"
        return f"{text}: {self.done:.0%}, {self.seconds:.0f} s, {self.left:.0f} s left"


Hook = Callable[[Progress], object]
_hook: ContextVar[Hook | None] = ContextVar("serpentail.progress", default=None)
_depth: ContextVar[int] = ContextVar("serpentail.depth", default=0)


@contextmanager
def progress(hook: Hook | None = None) -> Iterator[None]:
    """Report the progress of all long work inside a ``with`` block.

    Parameters
    ----------
    hook : callable, optional
        Function of a ``Progress``. Each stage (derive, compile, simulate, plan and others) calls
        it repeatedly and at its end. An exception that it raises ends the work. Default: stages
        that take more than one second and are not part of another stage are shown on stderr, as
        one line that is updated on a terminal, else as separate lines.

    Notes
    -----
    Without this context manager nothing is shown. The logger "serpentail" receives the end of
    each stage in any case, at level INFO, or DEBUG if it took less than half a second.

    Examples
    --------
    >>> import serpentail as st
    >>> with st.progress():  # doctest: +SKIP
    ...     plan = st.plan(model, start=(q0, v0), duration=0.3)
    """
    token = _hook.set(hook or ProgressWriter(sys.stderr))
    try:
        yield
    finally:
        _hook.reset(token)


class Stage:
    """A stage of long work: ``with Stage("compile", name) as stage: ... stage.tell(0.5)``."""

    def __init__(self, name: str, what: str = ""):
        self.name, self.subject, self.what = name, what, what
        self.hook: Hook | None = _hook.get()
        self.done: float | None = None

    def __enter__(self) -> "Stage":
        self.begun, self.depth = time.perf_counter(), _depth.get()
        _depth.set(self.depth + 1)
        return self

    def tell(self, done: float | None = None, what: str | None = None) -> None:
        """Report which part of the stage is done, and what it works on now."""
        if self.hook is not None:
            self.done, self.what = done, self.what if what is None else what
            self.hook(self._now())

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        _depth.set(self.depth)
        now = self._now(ended=True)
        logging: Any = sys.modules.get("logging")  # without it, nobody receives log records
        if logging is not None:
            words = "%s" if kind is None else "%s, ended by " + kind.__name__
            level = logging.INFO if now.seconds >= NOTABLE_S else logging.DEBUG
            logging.getLogger("serpentail").log(level, words, now)
        if self.hook is not None:
            self.hook(now)

    def _now(self, ended: bool = False) -> Progress:
        """Return how far it is."""
        what = self.subject if ended else self.what
        seconds = time.perf_counter() - self.begun
        return Progress(self.name, what, self.done, seconds, ended, self.depth)


class ProgressWriter:
    """Writes progress to a stream: one line that is updated on a terminal, else separate lines."""

    def __init__(self, stream: TextIO):
        self.stream, self.over = stream, stream.isatty()
        self.last = 0.0  # s, when something was written
        self.shown = ""  # on the terminal's line

    def __call__(self, now: Progress) -> None:
        """Write a line if the stage has taken long enough."""
        if now.depth:
            return
        if now.seconds < PATIENCE_S or (self.over and now.ended):
            self._clear()
            return
        passed = time.perf_counter() - self.last
        if not now.ended and passed < (0.1 if self.over else PERIOD_S):
            return
        self.last = time.perf_counter()
        if self.over:
            self._clear()
            self.shown = str(now)[:79]
            self.stream.write(self.shown)
        else:
            self.stream.write(f"{now}\n")
        self.stream.flush()

    def _clear(self) -> None:
        """Clear the terminal's line."""
        if self.shown:
            self.stream.write("\r" + " " * len(self.shown) + "\r")
            self.stream.flush()
            self.shown = ""
