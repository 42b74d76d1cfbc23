"""A mutation: one small change of one source file."""

import hashlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """Bytes [start, end) of a file become `after`; `text` is the line where they start."""

    path: str  # from the root
    line: int
    start: int
    end: int
    after: str
    text: str
    change: str  # "a < b -> a <= b"
    nth: int = 0  # number among equal changes on equal lines of a file

    @property
    def key(self) -> str:
        """A name that does not change when other lines of the file change."""
        told = "\n".join((self.path, self.text, self.change, str(self.nth)))
        return hashlib.sha256(told.encode()).hexdigest()[:16]

    def of(self, source: bytes) -> bytes:
        """Return the mutated source."""
        return source[: self.start] + self.after.encode() + source[self.end :]

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.change}"
