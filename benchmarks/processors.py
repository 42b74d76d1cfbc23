"""The processors that one machine can stand for, each with the environment that keeps to it."""

import os
import platform
from pathlib import Path
from typing import NamedTuple

from tests.support.as_on import surroundings

LEVEL = "SERPENTAIL_BENCH_LEVEL"  # of x86-64, that a process and its compilers keep to
ABSENT = {"AVX-512": "AVX-512: this processor has none", "AVX2": "AVX2: this processor has none"}


class Processor(NamedTuple):
    """A processor by its widest vectors; level: of x86-64, that stands in for it here."""

    name: str
    level: str | None = None

    @property
    def environment(self) -> dict[str, str]:
        """The environment of a process whose models and peers are built for it."""
        return {**surroundings(self.level), LEVEL: self.level} if self.level else {**os.environ}


def processors(flags: str | None = None) -> list[Processor]:
    """Return what this machine can stand for, the widest first.

    flags: the processor's, as Linux tells them; asked by default.
    """
    found = (processor_line("flags") if flags is None else flags).split()
    if "avx512f" in found:
        return [Processor("AVX-512"), Processor("AVX2", "x86-64-v3")]
    return [Processor("AVX2" if "avx2" in found else platform.machine())]


def processor_line(name: str) -> str:
    """Return what Linux tells of the first core under a name; nothing elsewhere."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    found = (line.split(":", 1)[1].strip() for line in lines if line.split("\t")[0] == name)
    return next(found, "")


def left_out(there: list[Processor]) -> list[str]:
    """Return a sentence for each processor of the report that this machine cannot stand for."""
    return [words for name, words in ABSENT.items() if name not in [p.name for p in there]]


def march() -> str:
    """Return what compilers build for in this process: a level of x86-64, or what is there."""
    return os.environ.get(LEVEL, "native")
