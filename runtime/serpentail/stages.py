"""How far long work is: stages tell a function of the user's, the log, or a person who waits."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TextIO

PATIENCE_S = 1.0  # s of a stage after which it is worth a line
PERIOD_S = 10.0  # s between lines in a pipe or a file


@dataclass(frozen=True)
class Progress:
    """How far a stage is.

    stage: such as "compile"; what: of what, such as a model's name; done: part from 0 to 1, None
    where that is not known; seconds: since its begin; ended: whether it is over; depth: how many
    other stages it is a part of.
    """

    stage: str
    what: str
    done: float | None
    seconds: float
    ended: bool = False
    depth: int = 0

    @property
    def left(self) -> float | None:
        """Estimated seconds until the end; None where nothing tells."""
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
    """Let all long work inside ``with serpentail.progress():`` tell how far it is.

    hook: a function of a Progress, which each stage (derive, compile, simulate, plan and so on)
    calls as it goes on and at its end; what it raises ends the work.  None: stages that take more
    than a second and are part of no other are told on stderr, as one line that is written over on a
    terminal, else as lines.  Without it nothing is told; the log "serpentail" has the end of each
    stage either way.
    """
    token = _hook.set(hook or Told(sys.stderr))
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
        """Tell which part of the stage is done, and what it is about now."""
        if self.hook is not None:
            self.done, self.what = done, self.what if what is None else what
            self.hook(self._now())

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        _depth.set(self.depth)
        now = self._now(ended=True)
        logging: Any = sys.modules.get("logging")  # nobody listens who has not imported it
        if logging is not None:
            words = "%s" if kind is None else "%s, ended by " + kind.__name__
            logging.getLogger("serpentail").info(words, now)
        if self.hook is not None:
            self.hook(now)

    def _now(self, ended: bool = False) -> Progress:
        """Return how far it is."""
        what = self.subject if ended else self.what
        seconds = time.perf_counter() - self.begun
        return Progress(self.name, what, self.done, seconds, ended, self.depth)


class Told:
    """Writes what is worth it: over one line of a terminal, or line by line."""

    def __init__(self, stream: TextIO):
        self.stream, self.over = stream, stream.isatty()
        self.last = 0.0  # s, when something was written
        self.shown = ""  # on the terminal's line

    def __call__(self, now: Progress) -> None:
        """Write a line, where the stage has gone on for long enough."""
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
        """Leave the terminal's line empty."""
        if self.shown:
            self.stream.write("\r" + " " * len(self.shown) + "\r")
            self.stream.flush()
            self.shown = ""
