"""The processors that one machine can represent, each with an environment that limits it."""

import os
import platform
from pathlib import Path
from typing import NamedTuple

from tests.support.as_on import surroundings

LEVEL = "SERPENTAIL_BENCH_LEVEL"  # level of x86-64 that limits a process and its compilers
ABSENT = {"AVX-512": "AVX-512: this processor has none", "AVX2": "AVX2: this processor has none"}


class Processor(NamedTuple):
    """A processor by its widest vectors; level: of x86-64, which represents it here."""

    name: str
    level: str | None = None

    @property
    def environment(self) -> dict[str, str]:
        """Return the environment of a process whose models and peers are built for it."""
        return {**surroundings(self.level), LEVEL: self.level} if self.level else {**os.environ}


def processors(flags: str | None = None) -> list[Processor]:
    """Return the processors that this machine can represent, the widest first.

    flags: those of the processor, as Linux reports them; read by default.
    """
    found = (processor_line("flags") if flags is None else flags).split()
    if "avx512f" in found:
        return [Processor("AVX-512"), Processor("AVX2", "x86-64-v3")]
    return [Processor("AVX2" if "avx2" in found else platform.machine())]


def processor_line(name: str) -> str:
    """Return what Linux reports about the first core under a name; nothing elsewhere."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    found = (line.split(":", 1)[1].strip() for line in lines if line.split("\t")[0] == name)
    return next(found, "")


def left_out(there: list[Processor]) -> list[str]:
    """Return a sentence for each processor of the report that this machine cannot represent."""
    return [words for name, words in ABSENT.items() if name not in [p.name for p in there]]


def march() -> str:
    """Return the target of compilers in this process: a level of x86-64, or this processor."""
    return os.environ.get(LEVEL, "native")
